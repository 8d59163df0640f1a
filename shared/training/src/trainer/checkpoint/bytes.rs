//! Checkpoints as bytes: a checked header and the state behind it.
//!
//! | bytes | what |
//! |---|---|
//! | 0..8 | `PLXTRAIN` |
//! | 8..12 | version, u32, little-endian: 1 |
//! | 12..20 | length of the payload, u64, little-endian |
//! | 20..28 | FNV-1a (64 bit) of the payload, little-endian; it tells every change within one byte |
//! | 28.. | payload: the stamp and the checkpoint, bincode 2, standard configuration |

use bincode::config::{self, Configuration, Limit, LittleEndian, Varint};

use super::{Checkpoint, fnv1a};

const MAGIC: [u8; 8] = *b"PLXTRAIN";
const VERSION: u32 = 1;
const HEADER_BYTES: usize = 28;

/// Most bytes of a payload: ten million examples are far from it.
const MAX_BYTES: usize = 4 << 30;

/// Why bytes are no checkpoint, or none could be made.
#[derive(Debug, thiserror::Error)]
pub enum CheckpointBytesError {
    /// Another kind of file.
    #[error("it does not begin with `PLXTRAIN`")]
    Magic,
    /// Another Parallax made it.
    #[error("it has version {got}, this Parallax reads version {VERSION}")]
    Version {
        /// Its version.
        got: u32,
    },
    /// Truncated, or something was appended.
    #[error("it has {got} bytes, its header says {expected}")]
    Length {
        /// Bytes there are.
        got: u64,
        /// Bytes that there should be.
        expected: u64,
    },
    /// Damaged.
    #[error("it is damaged: its checksum is {got:016x}, its header says {expected:016x}")]
    Checksum {
        /// Checksum of what is there.
        got: u64,
        /// Checksum that the header holds.
        expected: u64,
    },
    /// The checksum is right, but what it is of is no checkpoint.
    #[error("the payload is no checkpoint")]
    Payload(#[source] Box<bincode::error::DecodeError>),
    /// Something follows the checkpoint in the payload.
    #[error("the checkpoint ends {left} bytes before its payload")]
    Left {
        /// Bytes that follow.
        left: usize,
    },
    /// Too large for the format.
    #[error("the checkpoint cannot be written")]
    Encode(#[source] Box<bincode::error::EncodeError>),
}

const fn configuration() -> Configuration<LittleEndian, Varint, Limit<MAX_BYTES>> {
    config::standard().with_limit::<MAX_BYTES>()
}

impl Checkpoint {
    /// Makes the bytes of a file; [`Self::from_bytes`] gives the same checkpoint and stamp.
    ///
    /// * `stamp`: whatever the caller knows of the training that the checkpoint does not, a hash of the
    ///   images say.
    ///
    /// # Errors
    ///
    /// [`CheckpointBytesError::Encode`], beyond 4 GiB.
    pub fn to_bytes(&self, stamp: u64) -> Result<Vec<u8>, CheckpointBytesError> {
        let payload = bincode::serde::encode_to_vec((stamp, self), configuration());
        let payload = payload.map_err(|it| CheckpointBytesError::Encode(Box::new(it)))?;
        let mut bytes = Vec::with_capacity(HEADER_BYTES + payload.len());
        bytes.extend(MAGIC);
        bytes.extend(VERSION.to_le_bytes());
        bytes.extend((payload.len() as u64).to_le_bytes());
        bytes.extend(fnv1a(payload.iter().copied()).to_le_bytes());
        bytes.extend(payload);
        Ok(bytes)
    }

    /// Reads the bytes of a file: the checkpoint and the stamp. Whether they fit a training is judged
    /// when it goes on, see [`Trainer::resume`](crate::Trainer::resume).
    ///
    /// # Errors
    ///
    /// [`CheckpointBytesError`]; truncated bytes and bytes with a changed one are always refused.
    pub fn from_bytes(bytes: &[u8]) -> Result<(Self, u64), CheckpointBytesError> {
        let rest = bytes
            .strip_prefix(&MAGIC)
            .ok_or(CheckpointBytesError::Magic)?;
        let too_short = || CheckpointBytesError::Length {
            got: bytes.len() as u64,
            expected: HEADER_BYTES as u64,
        };
        let (&version, rest) = rest.split_first_chunk().ok_or_else(too_short)?;
        let (&length, rest) = rest.split_first_chunk().ok_or_else(too_short)?;
        let (&checksum, payload) = rest.split_first_chunk().ok_or_else(too_short)?;
        let version = u32::from_le_bytes(version);
        if version != VERSION {
            return Err(CheckpointBytesError::Version { got: version });
        }
        let length = u64::from_le_bytes(length);
        if length != payload.len() as u64 {
            return Err(CheckpointBytesError::Length {
                got: bytes.len() as u64,
                expected: length.saturating_add(HEADER_BYTES as u64),
            });
        }
        let expected = u64::from_le_bytes(checksum);
        let got = fnv1a(payload.iter().copied());
        if got != expected {
            return Err(CheckpointBytesError::Checksum { got, expected });
        }
        let decoded = bincode::serde::decode_from_slice(payload, configuration());
        let ((stamp, checkpoint), n_read): ((u64, Self), usize) =
            decoded.map_err(|it| CheckpointBytesError::Payload(Box::new(it)))?;
        match payload.len() - n_read {
            0 => Ok((checkpoint, stamp)),
            left => Err(CheckpointBytesError::Left { left }),
        }
    }
}
