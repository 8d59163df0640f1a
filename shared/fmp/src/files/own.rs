//! Parallax's own model file: a checked header and the model behind it, bit for bit.
//!
//! | bytes | what |
//! |---|---|
//! | 0..8 | `PLXMODEL` |
//! | 8..12 | version, u32, little-endian: 1 |
//! | 12..20 | length of the payload, u64, little-endian |
//! | 20..28 | FNV-1a (64 bit) of the payload, little-endian; it tells every change within one byte |
//! | 28.. | payload: bincode 2, standard configuration (little-endian, variable-length integers) |

use super::payload;
use crate::{Model, ModelSpec};

/// How Parallax's own model file begins.
pub const MAGIC: [u8; 8] = *b"PLXMODEL";

const VERSION: u32 = 1;
const HEADER_BYTES: usize = 28;

/// Why bytes are not a model file of Parallax, or none could be made.
#[derive(Debug, thiserror::Error)]
pub enum OwnError {
    /// Another kind of file.
    #[error("the file does not begin with `PLXMODEL`")]
    Magic,
    /// The file was made by another Parallax.
    #[error("the file has version {got}, this Parallax reads version {VERSION}")]
    Version {
        /// The file's version.
        got: u32,
    },
    /// The file is truncated, or something was appended.
    #[error("the file has {got} bytes, its header says {expected}")]
    Length {
        /// Bytes there are.
        got: u64,
        /// Bytes that there should be.
        expected: u64,
    },
    /// The file is damaged.
    #[error("the file is damaged: its checksum is {got:016x}, its header says {expected:016x}")]
    Checksum {
        /// Checksum of what is there.
        got: u64,
        /// Checksum that the header holds.
        expected: u64,
    },
    /// The payload is no model, though its checksum is right.
    #[error("the payload is not a model")]
    Payload(#[source] Box<bincode::error::DecodeError>),
    /// Something follows the model in the payload.
    #[error("the model ends {left} bytes before its payload")]
    Left {
        /// Bytes that follow.
        left: usize,
    },
    /// The model is too large for the format.
    #[error("the model cannot be written")]
    Encode(#[source] Box<bincode::error::EncodeError>),
}

/// Makes the bytes of a model file; [`decode`] gives the same model, every number bit for bit.
///
/// # Errors
///
/// [`OwnError::Encode`], for a model beyond the format's limit of 192 MiB.
pub fn encode(model: &Model) -> Result<Vec<u8>, OwnError> {
    let payload = payload::write(model.spec()).map_err(|it| OwnError::Encode(Box::new(it)))?;
    let mut bytes = Vec::with_capacity(HEADER_BYTES + payload.len());
    bytes.extend(MAGIC);
    bytes.extend(VERSION.to_le_bytes());
    bytes.extend((payload.len() as u64).to_le_bytes());
    bytes.extend(fnv1a(&payload).to_le_bytes());
    bytes.extend(payload);
    Ok(bytes)
}

/// Reads the bytes of a model file. What the model says is judged by [`Model::new`].
///
/// # Errors
///
/// [`OwnError`]; truncated bytes and bytes with a changed one are always refused.
pub fn decode(bytes: &[u8]) -> Result<ModelSpec, OwnError> {
    let rest = bytes.strip_prefix(&MAGIC).ok_or(OwnError::Magic)?;
    let too_short = || OwnError::Length {
        got: bytes.len() as u64,
        expected: HEADER_BYTES as u64,
    };
    let (&version, rest) = rest.split_first_chunk().ok_or_else(too_short)?;
    let (&length, rest) = rest.split_first_chunk().ok_or_else(too_short)?;
    let (&checksum, payload) = rest.split_first_chunk().ok_or_else(too_short)?;
    let version = u32::from_le_bytes(version);
    if version != VERSION {
        return Err(OwnError::Version { got: version });
    }
    let length = u64::from_le_bytes(length);
    if length != payload.len() as u64 {
        return Err(OwnError::Length {
            got: bytes.len() as u64,
            expected: length.saturating_add(HEADER_BYTES as u64),
        });
    }
    let expected = u64::from_le_bytes(checksum);
    let got = fnv1a(payload);
    if got != expected {
        return Err(OwnError::Checksum { got, expected });
    }
    let (spec, n_read) = payload::read(payload).map_err(|it| OwnError::Payload(Box::new(it)))?;
    match payload.len() - n_read {
        0 => Ok(spec),
        left => Err(OwnError::Left { left }),
    }
}

/// Fowler, Noll and Vo's hash 1a, 64 bit.
///
/// Every step is a bijection of the state, so two inputs that differ in one byte only never agree.
fn fnv1a(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, &byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}

#[cfg(test)]
mod tests {
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
    fn what_was_written_is_read_bit_for_bit() {
        let mut named = planted::three_parts();
        named.mirror = Some(vec![0, 2, 1]);
        named.filters[0].weights[0] = f64::MIN_POSITIVE;
        named.filters[0].weights[1] = -0.0;
        for spec in [named, planted::per_pair()] {
            let model = Model::new(spec.clone()).unwrap();
            let read = decode(&encode(&model).unwrap()).unwrap();
            assert_eq!(read, spec);
            let bits = |it: &ModelSpec| -> Vec<u64> {
                it.filters[0]
                    .weights
                    .iter()
                    .map(|it| it.to_bits())
                    .collect()
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
    fn the_hash_is_the_published_one() {
        assert_eq!(fnv1a(b""), 0xcbf2_9ce4_8422_2325);
        assert_eq!(fnv1a(b"foobar"), 0x8594_4171_f739_67e8);
    }

    #[test]
    fn says_what_is_wrong_with_the_header() {
        let mut bytes = bytes();
        let n = bytes.len();
        assert_eq!(
            said_of(b"PLXMODE"),
            "the file does not begin with `PLXMODEL`"
        );
        assert_eq!(
            said_of(&bytes[..27]),
            "the file has 27 bytes, its header says 28"
        );
        let expected = format!("the file has {} bytes, its header says {n}", n - 1);
        assert_eq!(said_of(&bytes[..n - 1]), expected);
        let longer = [&bytes[..], &[0]].concat();
        let expected = format!("the file has {} bytes, its header says {n}", n + 1);
        assert_eq!(said_of(&longer), expected);
        bytes[n - 1] ^= 1;
        assert!(said_of(&bytes).starts_with("the file is damaged: its checksum is "));
        bytes[8] = 2;
        let expected = "the file has version 2, this Parallax reads version 1";
        assert_eq!(said_of(&bytes), expected);
    }

    /// Puts a right header before any payload.
    fn sealed(payload: &[u8]) -> Vec<u8> {
        let mut bytes = MAGIC.to_vec();
        bytes.extend(VERSION.to_le_bytes());
        bytes.extend((payload.len() as u64).to_le_bytes());
        bytes.extend(fnv1a(payload).to_le_bytes());
        bytes.extend(payload);
        bytes
    }

    #[test]
    fn refuses_what_follows_the_model() {
        let mut payload = bytes()[HEADER_BYTES..].to_vec();
        payload.push(0);
        let expected = "the model ends 1 bytes before its payload";
        assert_eq!(said_of(&sealed(&payload)), expected);
    }

    #[test]
    fn a_count_that_the_payload_cannot_hold_is_refused() {
        // An empty name, then 2^62 parts.
        let mut payload = vec![0, 253];
        payload.extend((1_u64 << 62).to_le_bytes());
        assert_eq!(said_of(&sealed(&payload)), "the payload is not a model");
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
            if let Ok(spec) = decode(&sealed(&payload)) {
                let _model = Model::new(spec);
            }
        }
    }
}
