//! Files of a training run: a header with a checksum, then the content.
//!
//! | bytes | content |
//! |---|---|
//! | 0..8 | kind of file: `PLXTILES` (samples), `PLXTRAIN` (checkpoint) |
//! | 8..12 | version, u32, little-endian: 1 |
//! | 12..20 | length of the payload, u64, little-endian |
//! | 20..28 | FNV-1a (64 bit) of the payload, little-endian |
//! | 28.. | payload: bincode 2, standard configuration |

use bincode::config::{self, Configuration, Limit, LittleEndian, Varint};
use formats::checksum::{Envelope, EnvelopeError};
use serde::{Serialize, de::DeserializeOwned};

/// Kind of a file with the state of a training run.
pub(crate) const CHECKPOINT: [u8; 8] = *b"PLXTRAIN";
/// Largest size of a payload, in bytes.
const MAX_BYTES: usize = 16 << 30;

/// Reason why bytes cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The file has a different kind or version, or is damaged.
    #[error(transparent)]
    Envelope(#[from] EnvelopeError),
    /// The checksum is right, but the payload does not have the form that the header states.
    #[error("the payload does not have the expected form")]
    Payload(#[source] Box<bincode::error::DecodeError>),
    /// The content is too large for the format.
    #[error("it cannot be written")]
    Encode(#[source] Box<bincode::error::EncodeError>),
    /// The payload has bytes after its content.
    #[error("its payload has {left} bytes after the end of its content")]
    Left {
        /// Number of additional bytes.
        left: usize,
    },
}

const fn configuration() -> Configuration<LittleEndian, Varint, Limit<MAX_BYTES>> {
    config::standard().with_limit::<MAX_BYTES>()
}

const fn envelope(magic: [u8; 8]) -> Envelope {
    Envelope { magic, version: 1 }
}

/// Returns a payload with its header.
pub(crate) fn wrap<T: Serialize>(magic: [u8; 8], payload: &T) -> Result<Vec<u8>, StoreError> {
    let payload = bincode::serde::encode_to_vec(payload, configuration());
    let payload = payload.map_err(|error| StoreError::Encode(Box::new(error)))?;
    Ok(envelope(magic).seal(&payload))
}

/// Reads the payload, after checking the header.
pub(crate) fn unwrap<T: DeserializeOwned>(magic: [u8; 8], bytes: &[u8]) -> Result<T, StoreError> {
    let payload = envelope(magic).open(bytes)?;
    let decoded = bincode::serde::decode_from_slice(payload, configuration());
    let (decoded, n_read): (T, usize) =
        decoded.map_err(|error| StoreError::Payload(Box::new(error)))?;
    match payload.len() - n_read {
        0 => Ok(decoded),
        left => Err(StoreError::Left { left }),
    }
}
