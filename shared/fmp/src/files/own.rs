//! Parallax's own model file: a header with a checksum, followed by the model, bit for bit.
//!
//! | bytes | content |
//! |---|---|
//! | 0..8 | `PLXMODEL` |
//! | 8..12 | version, u32, little-endian: 1 |
//! | 12..20 | length of the payload, u64, little-endian |
//! | 20..28 | FNV-1a checksum (64 bit) of the payload, little-endian; it detects every change that affects a single byte |
//! | 28.. | payload: bincode 2, standard configuration (little-endian, variable-length integers) |

use formats::checksum::{Envelope, EnvelopeError};

use super::payload;
use crate::{Model, ModelSpec};

/// The first bytes of Parallax's own model file.
pub const MAGIC: [u8; 8] = *b"PLXMODEL";

const ENVELOPE: Envelope = Envelope {
    magic: MAGIC,
    version: 1,
};

/// Reason why bytes are not a Parallax model file, or a file could not be encoded.
#[derive(Debug, thiserror::Error)]
pub enum OwnError {
    /// The file is of another kind or version, or is damaged.
    #[error(transparent)]
    Envelope(#[from] EnvelopeError),
    /// The payload is not a model, although its checksum is right.
    #[error("the payload is not a model")]
    Payload(#[source] Box<bincode::error::DecodeError>),
    /// The payload contains bytes after the model.
    #[error("the payload has {left} bytes after the end of the model")]
    Left {
        /// Number of bytes after the model.
        left: usize,
    },
    /// The model is too large for the format.
    #[error("the model cannot be written")]
    Encode(#[source] Box<bincode::error::EncodeError>),
}

/// Encodes a model file; [`decode`] returns the same model, bit for bit.
///
/// # Errors
///
/// [`OwnError::Encode`] for a model beyond the format's limit of 192 MiB.
pub fn encode(model: &Model) -> Result<Vec<u8>, OwnError> {
    let payload =
        payload::write(model.spec()).map_err(|error| OwnError::Encode(Box::new(error)))?;
    Ok(ENVELOPE.seal(&payload))
}

/// Decodes a model file. The content of the model is checked by [`Model::new`].
///
/// # Errors
///
/// [`OwnError`]; truncated files and files with a changed byte are always rejected.
pub fn decode(bytes: &[u8]) -> Result<ModelSpec, OwnError> {
    let payload = ENVELOPE.open(bytes)?;
    let (spec, n_read) =
        payload::read(payload).map_err(|error| OwnError::Payload(Box::new(error)))?;
    match payload.len() - n_read {
        0 => Ok(spec),
        left => Err(OwnError::Left { left }),
    }
}

#[cfg(test)]
mod tests {
    use formats::checksum::HEADER_BYTES;
    use proptest::prelude::*;

    use super::*;
    use crate::files::planted;

    fn bytes() -> Vec<u8> {
        encode(&Model::new(planted::three_parts()).unwrap()).unwrap()
    }

    fn said_of(bytes: &[u8]) -> String {
        match decode(bytes) {
            Ok(_) => "fine".to_owned(),
            Err(error) => error.to_string(),
        }
    }

    #[test]
    fn a_written_model_is_read_back_bit_for_bit() {
        let mut named = planted::three_parts();
        named.mirror = Some(vec![0, 2, 1]);
        named.filters[0].weights[0] = f64::MIN_POSITIVE;
        named.filters[0].weights[1] = -0.0;
        for spec in [named, planted::per_pair()] {
            let model = Model::new(spec.clone()).unwrap();
            let read = decode(&encode(&model).unwrap()).unwrap();
            assert_eq!(read, spec);
            let bits = |model_spec: &ModelSpec| -> Vec<u64> {
                model_spec.filters[0].weights.iter().map(|weight| weight.to_bits()).collect()
            };
            assert_eq!(bits(&read), bits(&spec));
        }
    }

    #[test]
    fn the_format_is_frozen() {
        let mut spec = planted::three_parts();
        spec.parts.truncate(1);
        spec.parts[0].filter_of_type.truncate(1);
        spec.filters.truncate(1);
        let filter = &mut spec.filters[0];
        [filter.rows, filter.cols] = [1, 1];
        filter.weights = vec![1.0; 32];
        let bytes = encode(&Model::new(spec).unwrap()).unwrap();
        let mut golden = b"PLXMODEL\x01\0\0\0".to_vec();
        golden.extend(298_u64.to_le_bytes());
        golden.extend(0x5209_16e4_5f0c_3841_u64.to_le_bytes());
        golden.extend(b"\x07unnamed");
        golden.extend(b"\x01\x06part 1\x01\x00\x00");
        golden.extend(b"\x01\x01\x01\x20");
        golden.extend([0, 0, 0, 0, 0, 0, 0xf0, 0x3f].repeat(32));
        golden.extend((-0.125_f64).to_le_bytes());
        golden.extend([10, 4]);
        golden.extend(0.1_f64.to_le_bytes());
        golden.push(0);
        assert_eq!(bytes, golden);
    }

    #[test]
    fn errors_of_the_header_name_the_problem() {
        let mut bytes = bytes();
        let n = bytes.len();
        assert_eq!(
            said_of(b"PLXMODE"),
            "the file does not begin with `PLXMODEL`"
        );
        assert_eq!(
            said_of(&bytes[..27]),
            "the file has 27 bytes, but its header says 28"
        );
        let expected = format!("the file has {} bytes, but its header says {n}", n - 1);
        assert_eq!(said_of(&bytes[..n - 1]), expected);
        let longer = [&bytes[..], &[0]].concat();
        let expected = format!("the file has {} bytes, but its header says {n}", n + 1);
        assert_eq!(said_of(&longer), expected);
        bytes[n - 1] ^= 1;
        assert!(said_of(&bytes).starts_with("the file is damaged: its checksum is "));
        bytes[8] = 2;
        let expected = "the file has version 2, but this Parallax reads version 1";
        assert_eq!(said_of(&bytes), expected);
    }

    #[test]
    fn refuses_what_follows_the_model() {
        let mut payload = bytes()[HEADER_BYTES..].to_vec();
        payload.push(0);
        let expected = "the payload has 1 bytes after the end of the model";
        assert_eq!(said_of(&ENVELOPE.seal(&payload)), expected);
    }

    #[test]
    fn a_count_that_the_payload_cannot_hold_is_refused() {
        // An empty name, followed by a list of 2^62 parts.
        let mut payload = vec![0, 253];
        payload.extend((1_u64 << 62).to_le_bytes());
        assert_eq!(
            said_of(&ENVELOPE.seal(&payload)),
            "the payload is not a model"
        );
    }

    proptest! {
        #[test]
        fn truncated_bytes_are_refused(part in 0.0..1.0) {
            let bytes = bytes();
            let kept = (bytes.len() as f64 * part) as usize;
            prop_assert!(decode(&bytes[..kept]).is_err());
        }

        #[test]
        fn a_flipped_bit_is_refused(part in 0.0..1.0, bit in 0..8) {
            let mut bytes = bytes();
            let at = (bytes.len() as f64 * part) as usize;
            bytes[at] ^= 1_u8 << bit;
            prop_assert!(decode(&bytes).is_err());
        }

        #[test]
        fn a_damaged_payload_with_a_right_checksum_never_panics(part in 0.0..1.0, byte: u8) {
            let mut payload = bytes()[HEADER_BYTES..].to_vec();
            let at = (payload.len() as f64 * part) as usize;
            payload[at] = byte;
            if let Ok(spec) = decode(&ENVELOPE.seal(&payload)) {
                let _model = Model::new(spec);
            }
        }
    }
}
