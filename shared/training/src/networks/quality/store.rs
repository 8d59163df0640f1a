//! Conversion of samples to bytes and back.

use serde::{Deserialize, Serialize};
use skeleton::N_PARTS;
use viewquality::{EVIDENCE_VERSION, TileShape, n_evidence};

use super::sample::{Sample, picture_size};
use crate::networks::checkpoint::{StoreError, unwrap, wrap};

/// Kind of a file with samples.
const SAMPLES: [u8; 8] = *b"PLXTILES";

/// Reason why samples cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum SamplesError {
    /// The bytes are not samples, or are damaged.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// A sample's sizes do not match the header, or its numbers are invalid.
    #[error(
        "sample {sample} ({file_says}) does not have the sizes in the header, or has values that are not finite"
    )]
    Sample {
        /// Number of the sample, from 1.
        sample: usize,
        /// Origin of the sample.
        file_says: String,
    },
    /// The evidence has an unknown layout.
    #[error("its evidence has layout {got}, but this Parallax supports layout {EVIDENCE_VERSION}")]
    Evidence {
        /// Version of the layout.
        got: u32,
    },
}

/// Samples with tiles of one shape.
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
    /// Makes the bytes of a file; [`Self::from_bytes`] returns the same samples.
    ///
    /// # Errors
    ///
    /// Fails with [`StoreError::Encode`] if there are more than 16 GiB.
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
    /// Fails with [`SamplesError`]. All returned samples have the expected sizes and finite numbers.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, SamplesError> {
        let Payload {
            tile,
            evidence,
            all,
        } = unwrap(SAMPLES, bytes)?;
        if evidence != EVIDENCE_VERSION {
            return Err(SamplesError::Evidence { got: evidence });
        }
        let [height, width] = tile.map(|side| side.min(4096));
        let [rows, cols] = picture_size(TileShape { height, width });
        for (at, sample) in all.iter().enumerate() {
            let sound = sample.picture.len() == 3 * rows * cols
                && sample.evidence.len() == n_evidence(N_PARTS)
                && sample.errors_px.len() == N_PARTS
                && sample.evidence.iter().chain(&sample.errors_px).all(|value| value.is_finite())
                && sample.height_px.is_finite()
                && sample.height_px > 0.0;
            if !sound {
                return Err(SamplesError::Sample {
                    sample: at + 1,
                    file_says: sample.source.clone(),
                });
            }
        }
        Ok(Self { tile, all })
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
            picture: (0..3 * rows * cols).map(|at| at as u8).collect(),
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
            matches!(
                refused,
                Err(SamplesError::Store(StoreError::Left { left: 1 }))
            ),
            "{refused:?}"
        );
    }

    #[test]
    fn samples_with_wrong_sizes_or_invalid_numbers_are_refused() {
        let change: [fn(&mut Sample); 4] = [
            |sample| sample.picture.truncate(10),
            |sample| sample.evidence[7] = f32::NAN,
            |sample| sample.errors_px.truncate(25),
            |sample| sample.height_px = 0.0,
        ];
        for change in change {
            let mut samples = samples();
            change(&mut samples.all[1]);
            let error = Samples::from_bytes(&samples.to_bytes().unwrap()).unwrap_err();
            assert!(
                matches!(error, SamplesError::Sample { sample: 2, .. }),
                "{error}"
            );
        }
    }
}
