//! The bytes of a file, and the decoding of numbers in the format of the processor that wrote them.

use crate::c3d::C3dError;

/// Number of bytes in a block; positions in the file are given in blocks, from 1.
pub(crate) const BLOCK: usize = 512;

/// The number format of a processor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Processor {
    Intel,
    Dec,
    Mips,
}

/// The bytes of a file, read with bounds checks.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bytes<'a> {
    bytes: &'a [u8],
    processor: Processor,
}

impl<'a> Bytes<'a> {
    /// Reads the format mark and the processor; also returns the position at which the parameters begin.
    pub(crate) fn of_file(bytes: &'a [u8]) -> Result<(Self, usize), C3dError> {
        let mut file = Self {
            bytes,
            processor: Processor::Intel,
        };
        let [block, mark] = file.array(0, "the mark")?;
        if mark != 0x50 {
            return Err(C3dError::NotC3d { got: mark });
        }
        file.slice(0, BLOCK, "the header")?;
        let section = usize::from(block.max(1) - 1) * BLOCK;
        let [_, _, _, code] = file.array(section, "the header of the parameters")?;
        file.processor = match code {
            84 => Processor::Intel,
            85 => Processor::Dec,
            86 => Processor::Mips,
            _ => return Err(C3dError::Processor { code }),
        };
        Ok((file, section))
    }

    pub(crate) fn slice(
        &self,
        at: usize,
        n: usize,
        what: &'static str,
    ) -> Result<&'a [u8], C3dError> {
        let end = at.checked_add(n);
        end.and_then(|end| self.bytes.get(at..end)).ok_or(C3dError::Short {
            what,
            needed: (at as u64).saturating_add(n as u64),
            got: self.bytes.len() as u64,
        })
    }

    fn array<const N: usize>(&self, at: usize, what: &'static str) -> Result<[u8; N], C3dError> {
        let mut array = [0; N];
        array.copy_from_slice(self.slice(at, N, what)?);
        Ok(array)
    }

    pub(crate) fn u8(&self, at: usize, what: &'static str) -> Result<u8, C3dError> {
        self.array(at, what).map(|[byte]| byte)
    }

    pub(crate) fn u16(&self, at: usize, what: &'static str) -> Result<u16, C3dError> {
        self.array(at, what).map(|bytes| self.u16_of(bytes))
    }

    pub(crate) fn f32(&self, at: usize, what: &'static str) -> Result<f32, C3dError> {
        self.array(at, what).map(|bytes| self.f32_of(bytes))
    }

    pub(crate) fn u16_of(&self, bytes: [u8; 2]) -> u16 {
        match self.processor {
            Processor::Intel | Processor::Dec => u16::from_le_bytes(bytes),
            Processor::Mips => u16::from_be_bytes(bytes),
        }
    }

    /// Decodes a real. In DEC's F format, the two words are swapped, and the exponent is larger by 2.
    pub(crate) fn f32_of(&self, bytes: [u8; 4]) -> f32 {
        match self.processor {
            Processor::Intel => f32::from_le_bytes(bytes),
            Processor::Mips => f32::from_be_bytes(bytes),
            Processor::Dec => {
                let [a, b, c, d] = bytes;
                f32::from_le_bytes([c, d, a, b]) / 4.0
            }
        }
    }
}
