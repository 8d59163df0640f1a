//! A checked header in front of a payload.

use crate::checksum::fnv1a;

/// Number of bytes in the header.
pub const HEADER_BYTES: usize = 28;

/// Header of one kind of file.
///
/// | bytes | content |
/// |---|---|
/// | 0..8 | the kind of file, eight letters |
/// | 8..12 | version, u32, little-endian |
/// | 12..20 | length of the payload, u64, little-endian |
/// | 20..28 | [`fnv1a`] of the payload, little-endian; it detects every change within one byte |
/// | 28.. | payload |
///
/// ```
/// let envelope = formats::checksum::Envelope { magic: *b"PLXTILES", version: 1 };
/// let file = envelope.seal(b"payload");
/// assert_eq!(envelope.open(&file), Ok(&b"payload"[..]));
/// assert!(envelope.open(&file[..file.len() - 1]).is_err());
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Envelope {
    /// First bytes of files of this kind.
    pub magic: [u8; 8],
    /// Version that is written, which is also the only one that can be read.
    pub version: u32,
}

/// Reason why bytes are not a file of the expected kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum EnvelopeError {
    /// The file is of a different kind.
    #[error("the file does not begin with `{}`", String::from_utf8_lossy(.expected))]
    Magic {
        /// Expected first bytes.
        expected: [u8; 8],
    },
    /// The file was written by a different version of Parallax.
    #[error("the file has version {got}, but this Parallax reads version {expected}")]
    Version {
        /// Version of the file.
        got: u32,
        /// Version that can be read.
        expected: u32,
    },
    /// The file is truncated, or something was appended.
    #[error("the file has {got} bytes, but its header says {expected}")]
    Length {
        /// Actual number of bytes.
        got: u64,
        /// Expected number of bytes.
        expected: u64,
    },
    /// The file is damaged.
    #[error("the file is damaged: its checksum is {got:016x}, but its header says {expected:016x}")]
    Checksum {
        /// Checksum of the payload.
        got: u64,
        /// Checksum in the header.
        expected: u64,
    },
}

impl Envelope {
    /// Returns the bytes of a file with this payload.
    pub fn seal(&self, payload: &[u8]) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(HEADER_BYTES + payload.len());
        bytes.extend(self.magic);
        bytes.extend(self.version.to_le_bytes());
        bytes.extend((payload.len() as u64).to_le_bytes());
        bytes.extend(fnv1a(payload).to_le_bytes());
        bytes.extend(payload);
        bytes
    }

    /// Returns the payload of a file.
    ///
    /// # Errors
    ///
    /// Fails with [`EnvelopeError`]. A truncated file, or one with a single changed byte, is always refused.
    pub fn open<'a>(&self, bytes: &'a [u8]) -> Result<&'a [u8], EnvelopeError> {
        let expected = self.magic;
        let rest = bytes.strip_prefix(&expected).ok_or(EnvelopeError::Magic { expected })?;
        let too_short = || EnvelopeError::Length {
            got: bytes.len() as u64,
            expected: HEADER_BYTES as u64,
        };
        let (&version, rest) = rest.split_first_chunk().ok_or_else(too_short)?;
        let (&length, rest) = rest.split_first_chunk().ok_or_else(too_short)?;
        let (&checksum, payload) = rest.split_first_chunk().ok_or_else(too_short)?;
        let (got, expected) = (u32::from_le_bytes(version), self.version);
        if got != expected {
            return Err(EnvelopeError::Version { got, expected });
        }
        let length = u64::from_le_bytes(length);
        if length != payload.len() as u64 {
            return Err(EnvelopeError::Length {
                got: bytes.len() as u64,
                expected: length.saturating_add(HEADER_BYTES as u64),
            });
        }
        let (got, expected) = (fnv1a(payload), u64::from_le_bytes(checksum));
        if got != expected {
            return Err(EnvelopeError::Checksum { got, expected });
        }
        Ok(payload)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const KIND: Envelope = Envelope {
        magic: *b"PLXTRIAL",
        version: 3,
    };

    #[test]
    fn the_format_is_frozen() {
        let mut golden = b"PLXTRIAL\x03\0\0\0\x06\0\0\0\0\0\0\0".to_vec();
        golden.extend(0x8594_4171_f739_67e8_u64.to_le_bytes());
        golden.extend(b"foobar");
        assert_eq!(KIND.seal(b"foobar"), golden);
    }

    #[test]
    fn another_kind_or_version_is_refused_with_the_expected_one() {
        let other = Envelope {
            magic: *b"PLXOTHER",
            ..KIND
        };
        let older = Envelope { version: 2, ..KIND };
        let refused = |envelope: Envelope| KIND.open(&envelope.seal(b"x")).unwrap_err().to_string();
        assert_eq!(refused(other), "the file does not begin with `PLXTRIAL`");
        assert_eq!(
            refused(older),
            "the file has version 2, but this Parallax reads version 3"
        );
    }

    proptest! {
        #[test]
        fn any_payload_survives_a_round_trip(payload: Vec<u8>) {
            let file = KIND.seal(&payload);
            prop_assert_eq!(KIND.open(&file), Ok(&payload[..]));
        }

        #[test]
        fn truncated_and_longer_files_are_refused(payload: Vec<u8>, part in 0.0..1.0) {
            let file = KIND.seal(&payload);
            let kept = (file.len() as f64 * part) as usize;
            prop_assert!(KIND.open(&file[..kept]).is_err());
            prop_assert!(KIND.open(&[&file[..], &[0]].concat()).is_err());
        }

        #[test]
        fn a_changed_byte_is_refused(payload: Vec<u8>, part in 0.0..1.0, change in 1_u8..) {
            let mut file = KIND.seal(&payload);
            let at = (file.len() as f64 * part) as usize;
            file[at] ^= change;
            prop_assert!(KIND.open(&file).is_err());
        }
    }
}
