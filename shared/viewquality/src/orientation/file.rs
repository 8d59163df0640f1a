//! The file of a network.
//!
//! | values | content |
//! |---|---|
//! | 1, u32 | number of features |
//! | 1, u32 | number of hidden units |
//! | features, f32 | means |
//! | features, f32 | one over the standard deviations |
//! | units x features, f32 | weights of the hidden units |
//! | units, f32 | biases of the hidden units |
//! | 2 x units, f32 | weights of the outputs |
//! | 2, f32 | biases of the outputs |
//!
//! All values are little-endian. They follow the header with a checksum, [`formats::checksum::Envelope`].

use formats::checksum::{Envelope, EnvelopeError};

use crate::orientation::features::n_features;
use crate::orientation::network::{N_OUTPUTS, Network};

const ENVELOPE: Envelope = Envelope {
    magic: *b"PLXFRONT",
    version: 1,
};

/// Maximum number of hidden units accepted in a file.
const MAX_HIDDEN: usize = 4096;

/// Reason why bytes are not the file of a network.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum FileError {
    /// The file has a different kind or version, or is damaged.
    #[error(transparent)]
    Envelope(#[from] EnvelopeError),
    /// The network was trained with different features.
    #[error("the network takes {got} features, but this Parallax computes {expected}")]
    Features {
        /// Number of features in the file.
        got: usize,
        /// Number of features that this version computes.
        expected: usize,
    },
    /// The network has no hidden units, or too many.
    #[error("the network has {got} hidden units, expected 1 to {MAX_HIDDEN}")]
    Hidden {
        /// Number of hidden units in the file.
        got: usize,
    },
    /// The length of the file does not match its sizes.
    #[error("the file has {got} bytes of values, but the sizes in the header need {expected}")]
    Length {
        /// Number of bytes found.
        got: usize,
        /// Number of bytes expected.
        expected: usize,
    },
    /// A value is infinite or NaN.
    #[error("value {index} is {value}")]
    NotFinite {
        /// Index of the value, from 0.
        index: usize,
        /// The invalid value.
        value: f32,
    },
}

impl Network {
    /// The bytes of the network's file.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut payload = Vec::new();
        for size in [self.n_features(), self.n_hidden()] {
            payload.extend((size as u32).to_le_bytes());
        }
        for values in [
            &self.mean,
            &self.inverse,
            &self.hidden,
            &self.hidden_bias,
            &self.output,
        ] {
            payload.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        }
        payload.extend(self.output_bias.iter().flat_map(|output_bias| output_bias.to_le_bytes()));
        ENVELOPE.seal(&payload)
    }

    /// Reads a file.
    ///
    /// # Errors
    ///
    /// Fails with [`FileError`].
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, FileError> {
        let payload = ENVELOPE.open(bytes)?;
        let (words, rest) = payload.as_chunks::<4>();
        let length = |expected: usize| FileError::Length {
            got: payload.len(),
            expected,
        };
        let [features, hidden, numbers @ ..] = words else {
            return Err(length(8));
        };
        let [features, hidden] =
            [features, hidden].map(|bytes| u32::from_le_bytes(*bytes) as usize);
        if features != n_features() {
            return Err(FileError::Features {
                got: features,
                expected: n_features(),
            });
        }
        if !(1..=MAX_HIDDEN).contains(&hidden) {
            return Err(FileError::Hidden { got: hidden });
        }
        let n = features * (2 + hidden) + hidden * (1 + N_OUTPUTS) + N_OUTPUTS;
        if numbers.len() != n || !rest.is_empty() {
            return Err(length(4 * (2 + n)));
        }
        let numbers: Vec<f32> = numbers.iter().map(|number| f32::from_le_bytes(*number)).collect();
        if let Some(index) = numbers.iter().position(|number| !number.is_finite()) {
            let value = numbers[index];
            return Err(FileError::NotFinite { index, value });
        }
        let mut left = numbers.as_slice();
        let mut take = |n: usize| {
            let (taken, rest) = left.split_at(n);
            left = rest;
            taken.to_vec()
        };
        Ok(Self {
            mean: take(features),
            inverse: take(features),
            hidden: take(hidden * features),
            hidden_bias: take(hidden),
            output: take(N_OUTPUTS * hidden),
            output_bias: [0, 1].map(|_| take(1)[0]),
        })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn network(hidden: usize) -> Network {
        let n = n_features();
        let values = |n: usize, step: f32| (0..n).map(|i| i as f32 * step).collect();
        Network {
            mean: values(n, 0.5),
            inverse: values(n, 0.25),
            hidden: values(n * hidden, -1e-3),
            hidden_bias: values(hidden, 1.0),
            output: values(N_OUTPUTS * hidden, 2.0),
            output_bias: [3.0, -4.0],
        }
    }

    #[test]
    fn written_weights_are_read_back() {
        let network = network(3);
        assert_eq!(Network::from_bytes(&network.to_bytes()), Ok(network));
    }

    #[test]
    fn wrong_sizes_are_reported() {
        let payload = |sizes: [u32; 2], n: usize| {
            let mut bytes: Vec<u8> = sizes.iter().flat_map(|size| size.to_le_bytes()).collect();
            bytes.resize(8 + n, 0);
            ENVELOPE.seal(&bytes)
        };
        let n = n_features() as u32;
        let read = |bytes: Vec<u8>| Network::from_bytes(&bytes).unwrap_err().to_string();
        assert!(read(payload([n + 1, 3], 0)).contains("features"));
        assert!(read(payload([n, 0], 0)).contains("0 hidden units"));
        assert!(read(payload([n, 5000], 0)).contains("5000 hidden units"));
        assert!(read(payload([n, 3], 40)).contains("48 bytes of values"));
        assert!(read(ENVELOPE.seal(&[1, 2, 3])).contains("3 bytes"));
    }

    #[test]
    fn numbers_that_are_not_finite_are_reported() {
        let mut network = network(2);
        network.mean[7] = f32::NAN;
        let error = Network::from_bytes(&network.to_bytes()).unwrap_err();
        assert_eq!(error.to_string(), "value 7 is NaN");
    }

    proptest! {
        #[test]
        fn any_bytes_are_parsed_as_weights_or_refused(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
            prop_assert!(Network::from_bytes(&bytes).is_err());
            prop_assert!(Network::from_bytes(&ENVELOPE.seal(&bytes)).is_err());
        }

        #[test]
        fn a_changed_byte_in_the_weights_is_detected(at in 0.0..1.0_f64, bit in 0..8_u8) {
            let mut bytes = network(1).to_bytes();
            let at = (at * bytes.len() as f64) as usize;
            bytes[at] ^= 1 << bit;
            prop_assert!(Network::from_bytes(&bytes).is_err());
        }
    }
}
