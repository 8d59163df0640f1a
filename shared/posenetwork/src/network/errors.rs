//! Why a network cannot be used, or says nothing.

use inference::RunError;
use keypoints::OutputError;

/// Why a network does not fit its card.
#[derive(Debug, thiserror::Error)]
pub enum FitError {
    /// Names on the card are not those of the network.
    #[error("the card names the {what} `{wanted}`, but the network has {has}")]
    Name {
        /// `input` or `output`.
        what: &'static str,
        /// The name on the card.
        wanted: String,
        /// The names in the file.
        has: String,
    },
    /// There are several, and the card does not say which one is meant.
    #[error("the network has the {what}s {has}: the card must name one (`{key}`)")]
    Several {
        /// `input` or `output`.
        what: &'static str,
        /// The names in the file.
        has: String,
        /// The key of the card.
        key: &'static str,
    },
    /// The input has other sides.
    #[error("the input `{name}` of the network is {got}, but the card says {expected}")]
    InputShape {
        /// Its name.
        name: String,
        /// Its sides in the file.
        got: String,
        /// Its sides by the card.
        expected: String,
    },
    /// It cannot be shown mirror images.
    #[error("it cannot process mirror images too: {0}")]
    Mirror(String),
    /// It could not be tried.
    #[error(transparent)]
    Look(#[from] LookError),
}

/// Why a network says nothing about a picture.
#[derive(Debug, thiserror::Error)]
pub enum LookError {
    /// The library could not run it.
    #[error(transparent)]
    Run(#[from] RunError),
    /// An output is not what the card says.
    #[error("output `{name}`: {error}")]
    Output {
        /// Its name.
        name: String,
        /// Error of the output.
        error: OutputError,
    },
    /// An output does not consist of numbers in single precision.
    #[error("output `{name}` is not of type f32")]
    Type {
        /// Its name.
        name: String,
    },
}
