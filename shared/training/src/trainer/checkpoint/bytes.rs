//! Checkpoints as bytes: a header with a checksum, then the state.
//!
//! | bytes | content |
//! |---|---|
//! | 0..8 | `PLXTRAIN` |
//! | 8..12 | version, u32, little-endian: 1 |
//! | 12..20 | length of the payload, u64, little-endian |
//! | 20..28 | FNV-1a (64 bit) of the payload, little-endian; it detects every change within one byte |
//! | 28.. | payload: the stamp and the checkpoint, bincode 2, standard configuration |

use bincode::config::{self, Configuration, Limit, LittleEndian, Varint};
use formats::checksum::{Envelope, EnvelopeError};

use super::Checkpoint;

const ENVELOPE: Envelope = Envelope {
    magic: *b"PLXTRAIN",
    version: 1,
};

/// Largest size of a payload, in bytes: far more than ten million examples need.
const MAX_BYTES: usize = 4 << 30;

/// Reason why bytes are not a checkpoint or could not be written.
#[derive(Debug, thiserror::Error)]
pub enum CheckpointBytesError {
    /// The file has a different kind or version, or is damaged.
    #[error(transparent)]
    Envelope(#[from] EnvelopeError),
    /// The checksum is right, but the payload is not a checkpoint.
    #[error("the payload is not a checkpoint")]
    Payload(#[source] Box<bincode::error::DecodeError>),
    /// The payload has bytes after the checkpoint.
    #[error("the payload has {left} bytes after the end of the checkpoint")]
    Left {
        /// Number of additional bytes.
        left: usize,
    },
    /// The checkpoint is too large for the format.
    #[error("the checkpoint cannot be written")]
    Encode(#[source] Box<bincode::error::EncodeError>),
}

const fn configuration() -> Configuration<LittleEndian, Varint, Limit<MAX_BYTES>> {
    config::standard().with_limit::<MAX_BYTES>()
}

impl Checkpoint {
    /// Makes the bytes of a file; [`Self::from_bytes`] returns the same checkpoint and stamp.
    ///
    /// * `stamp`: the caller's fingerprint of data outside the checkpoint, for example a hash of the images.
    ///
    /// # Errors
    ///
    /// Fails with [`CheckpointBytesError::Encode`] if there are more than 4 GiB.
    pub fn to_bytes(&self, stamp: u64) -> Result<Vec<u8>, CheckpointBytesError> {
        let payload = bincode::serde::encode_to_vec((stamp, self), configuration());
        let payload = payload.map_err(|error| CheckpointBytesError::Encode(Box::new(error)))?;
        Ok(ENVELOPE.seal(&payload))
    }

    /// Reads the checkpoint and the stamp from the bytes of a file. [`Trainer::resume`](crate::Trainer::resume) later checks whether
    /// they match a training run.
    ///
    /// # Errors
    ///
    /// Fails with [`CheckpointBytesError`]; truncated bytes, and bytes with one change, are always refused.
    pub fn from_bytes(bytes: &[u8]) -> Result<(Self, u64), CheckpointBytesError> {
        let payload = ENVELOPE.open(bytes)?;
        let decoded = bincode::serde::decode_from_slice(payload, configuration());
        let ((stamp, checkpoint), n_read): ((u64, Self), usize) =
            decoded.map_err(|error| CheckpointBytesError::Payload(Box::new(error)))?;
        match payload.len() - n_read {
            0 => Ok((checkpoint, stamp)),
            left => Err(CheckpointBytesError::Left { left }),
        }
    }
}
