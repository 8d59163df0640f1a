//! Samples and checkpoints as bytes: a checked header and what it is about behind it.
//!
//! | bytes | what |
//! |---|---|
//! | 0..8 | which of the two: `PLXTILES`, `PLXQUALI` |
//! | 8..12 | version, u32, little-endian: 1 |
//! | 12..20 | length of the payload, u64, little-endian |
//! | 20..28 | FNV-1a (64 bit) of the payload, little-endian |
//! | 28.. | payload: bincode 2, standard configuration |

use bincode::config::{self, Configuration, Limit, LittleEndian, Varint};
use checksum::{Envelope, EnvelopeError};
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use viewquality::{EVIDENCE_VERSION, TileShape, n_evidence};

use crate::sample::{Sample, picture_size};
use skeleton::N_PARTS;

const SAMPLES: [u8; 8] = *b"PLXTILES";
/// Most bytes of a payload.
const MAX_BYTES: usize = 16 << 30;

/// Why bytes cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// Another kind or version of file, or a damaged one.
    #[error(transparent)]
    Envelope(#[from] EnvelopeError),
    /// The checksum is right, but what it is of is not what the header says.
    #[error("the payload is not what it should be")]
    Payload(#[source] Box<bincode::error::DecodeError>),
    /// Too large for the format.
    #[error("it cannot be written")]
    Encode(#[source] Box<bincode::error::EncodeError>),
    /// Something follows the content in the payload.
    #[error("its content ends {left} bytes before its payload")]
    Left {
        /// Bytes that follow.
        left: usize,
    },
    /// A sample has other sizes than its header, or invalid numbers.
    #[error("sample {sample} ({file_says}) has other sizes, or numbers that are none")]
    Sample {
        /// Which, from 1.
        sample: usize,
        /// Its source.
        file_says: String,
    },
    /// The evidence is of another layout.
    #[error("its evidence has layout {got}, this Parallax knows {EVIDENCE_VERSION}")]
    Evidence {
        /// The layout.
        got: u32,
    },
}

/// Samples of one shape of tile.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Samples {
    /// Height and width of the tile without its margin.
    pub tile: [usize; 2],
    /// The samples.
    pub all: Vec<Sample>,
}

#[derive(Serialize, Deserialize)]
struct Payload {
    tile: [usize; 2],
    evidence: u32,
    all: Vec<Sample>,
}

impl Samples {
    /// Makes the bytes of a file; [`Self::from_bytes`] gives the same samples.
    ///
    /// # Errors
    ///
    /// [`StoreError::Encode`], beyond 16 GiB.
    pub fn to_bytes(&self) -> Result<Vec<u8>, StoreError> {
        let payload = Payload {
            tile: self.tile,
            evidence: EVIDENCE_VERSION,
            all: self.all.clone(),
        };
        wrap(SAMPLES, &payload)
    }

    /// Reads the bytes of a file.
    ///
    /// # Errors
    ///
    /// [`StoreError`]; every sample that is returned has the sizes that it should have, and finite numbers.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, StoreError> {
        let Payload {
            tile,
            evidence,
            all,
        } = unwrap(SAMPLES, bytes)?;
        if evidence != EVIDENCE_VERSION {
            return Err(StoreError::Evidence { got: evidence });
        }
        let [height, width] = tile.map(|it| it.min(4096));
        let [rows, cols] = picture_size(TileShape { height, width });
        for (at, it) in all.iter().enumerate() {
            let sound = it.picture.len() == 3 * rows * cols
                && it.evidence.len() == n_evidence(N_PARTS)
                && it.errors_px.len() == N_PARTS
                && it
                    .evidence
                    .iter()
                    .chain(&it.errors_px)
                    .all(|it| it.is_finite())
                && it.height_px.is_finite()
                && it.height_px > 0.0;
            if !sound {
                return Err(StoreError::Sample {
                    sample: at + 1,
                    file_says: it.source.clone(),
                });
            }
        }
        Ok(Self { tile, all })
    }
}

const fn configuration() -> Configuration<LittleEndian, Varint, Limit<MAX_BYTES>> {
    config::standard().with_limit::<MAX_BYTES>()
}

const fn envelope(magic: [u8; 8]) -> Envelope {
    Envelope { magic, version: 1 }
}

/// A payload with its header.
pub(crate) fn wrap<T: Serialize>(magic: [u8; 8], payload: &T) -> Result<Vec<u8>, StoreError> {
    let payload = bincode::serde::encode_to_vec(payload, configuration());
    let payload = payload.map_err(|it| StoreError::Encode(Box::new(it)))?;
    Ok(envelope(magic).seal(&payload))
}

/// The payload behind a header that fits it.
pub(crate) fn unwrap<T: DeserializeOwned>(magic: [u8; 8], bytes: &[u8]) -> Result<T, StoreError> {
    let payload = envelope(magic).open(bytes)?;
    let decoded = bincode::serde::decode_from_slice(payload, configuration());
    let (decoded, n_read): (T, usize) = decoded.map_err(|it| StoreError::Payload(Box::new(it)))?;
    match payload.len() - n_read {
        0 => Ok(decoded),
        left => Err(StoreError::Left { left }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn samples() -> Samples {
        let tile = [4, 2];
        let [rows, cols] = picture_size(TileShape {
            height: 4,
            width: 2,
        });
        let sample = |group: &str| Sample {
            group: group.to_owned(),
            source: "a picture".to_owned(),
            picture: (0..3 * rows * cols).map(|it| it as u8).collect(),
            evidence: vec![0.5; n_evidence(N_PARTS)],
            height_px: 200.0,
            errors_px: vec![3.0; N_PARTS],
        };
        Samples {
            tile,
            all: vec![sample("s1"), sample("s2")],
        }
    }

    #[test]
    fn samples_survive_a_round_trip() {
        let samples = samples();
        let bytes = samples.to_bytes().unwrap();
        assert_eq!(Samples::from_bytes(&bytes).unwrap(), samples);
    }

    #[test]
    fn damaged_and_truncated_bytes_are_refused() {
        let bytes = samples().to_bytes().unwrap();
        for at in [0, 9, 14, 22, 40, bytes.len() - 1] {
            let mut damaged = bytes.clone();
            damaged[at] ^= 1;
            assert!(Samples::from_bytes(&damaged).is_err(), "byte {at}");
        }
        for n in [0, 7, 8, 27, 28, bytes.len() - 1] {
            assert!(Samples::from_bytes(&bytes[..n]).is_err(), "{n} bytes");
        }
    }

    #[test]
    fn trailing_data_in_the_payload_is_refused() {
        let longer = wrap(
            SAMPLES,
            &(
                Payload {
                    tile: samples().tile,
                    evidence: EVIDENCE_VERSION,
                    all: samples().all,
                },
                7_u8,
            ),
        );
        let refused = Samples::from_bytes(&longer.unwrap());
        assert!(
            matches!(refused, Err(StoreError::Left { left: 1 })),
            "{refused:?}"
        );
    }

    #[test]
    fn samples_with_wrong_sizes_or_invalid_numbers_are_refused() {
        let change: [fn(&mut Sample); 4] = [
            |it| it.picture.truncate(10),
            |it| it.evidence[7] = f32::NAN,
            |it| it.errors_px.truncate(25),
            |it| it.height_px = 0.0,
        ];
        for change in change {
            let mut samples = samples();
            change(&mut samples.all[1]);
            let error = Samples::from_bytes(&samples.to_bytes().unwrap()).unwrap_err();
            assert!(
                matches!(error, StoreError::Sample { sample: 2, .. }),
                "{error}"
            );
        }
    }
}
