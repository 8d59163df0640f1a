//! Reads a file of known length sequentially. Every length in the file is checked against that length.

use std::io::{self, BufReader, Read, Seek, SeekFrom};

/// Reason why reading has to stop.
#[derive(Debug)]
pub(crate) enum Stop {
    /// The file is truncated.
    Cut,
    /// The content is invalid.
    Damaged(&'static str),
    /// The file cannot be read.
    Io(io::Error),
}

/// A position in a file.
pub(crate) struct Cursor<'a, R: Read + Seek> {
    input: BufReader<&'a mut R>,
    at: u64,
    end: u64,
}

impl<'a, R: Read + Seek> Cursor<'a, R> {
    /// Creates a cursor at the start of a file.
    pub(crate) fn new(input: &'a mut R) -> io::Result<Self> {
        let end = input.seek(SeekFrom::End(0))?;
        input.seek(SeekFrom::Start(0))?;
        Ok(Self {
            input: BufReader::new(input),
            at: 0,
            end,
        })
    }

    /// Returns the position, in bytes from the start of the file.
    pub(crate) fn at(&self) -> u64 {
        self.at
    }

    /// Returns the length of the file, in bytes.
    pub(crate) fn end(&self) -> u64 {
        self.end
    }

    fn advance(&mut self, n: u64) -> Result<(), Stop> {
        match self.at.checked_add(n) {
            Some(at) if at <= self.end => {
                self.at = at;
                Ok(())
            }
            _ => Err(Stop::Cut),
        }
    }

    pub(crate) fn array<const N: usize>(&mut self) -> Result<[u8; N], Stop> {
        self.advance(N as u64)?;
        let mut bytes = [0; N];
        self.input.read_exact(&mut bytes).map_err(short)?;
        Ok(bytes)
    }

    pub(crate) fn bytes(&mut self, n: u64) -> Result<Vec<u8>, Stop> {
        self.advance(n)?;
        let mut bytes = vec![0; n as usize];
        self.input.read_exact(&mut bytes).map_err(short)?;
        Ok(bytes)
    }

    pub(crate) fn skip(&mut self, n: u64) -> Result<(), Stop> {
        self.advance(n)?;
        let n = i64::try_from(n).ok().ok_or(Stop::Cut)?;
        self.input.seek_relative(n).map_err(Stop::Io)
    }

    /// Reads the kind and length of a record.
    pub(crate) fn record_head(&mut self) -> Result<(u8, u64), Stop> {
        let [op] = self.array()?;
        Ok((op, u64::from_le_bytes(self.array()?)))
    }

    /// Moves to a position.
    pub(crate) fn go(&mut self, at: u64) -> io::Result<()> {
        self.at = at;
        self.input.seek(SeekFrom::Start(at)).map(drop)
    }

    /// Returns the checksum of the next `n` bytes. The position does not change.
    pub(crate) fn checksum(&mut self, mut n: u64) -> Result<u32, Stop> {
        let begin = self.at;
        let mut hasher = crc32fast::Hasher::new();
        while n > 0 {
            let some = n.min(1 << 16);
            hasher.update(&self.bytes(some)?);
            n -= some;
        }
        self.go(begin).map_err(Stop::Io)?;
        Ok(hasher.finalize())
    }

    /// Moves to the end. Returns true if the file ends with these bytes.
    pub(crate) fn ends_with(&mut self, bytes: &[u8]) -> Result<bool, Stop> {
        if self.end - self.at < bytes.len() as u64 {
            return Ok(false);
        }
        self.skip(self.end - self.at - bytes.len() as u64)?;
        let got = self.bytes(bytes.len() as u64)?;
        Ok(got == bytes)
    }
}

/// Converts an error. A file that becomes shorter while it is read counts as truncated.
fn short(error: io::Error) -> Stop {
    if error.kind() == io::ErrorKind::UnexpectedEof {
        Stop::Cut
    } else {
        Stop::Io(error)
    }
}
