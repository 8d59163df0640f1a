//! Reasons why a network cannot be used or gives no result.

use inference::RunError;
use keypoints::OutputError;

/// Reason why a network does not match its card.
#[derive(Debug, thiserror::Error)]
pub enum FitError {
    /// The card names an input or output that the network does not have.
    #[error("the card names the {what} `{wanted}`, but the network has only {has}")]
    Name {
        /// `input` or `output`.
        what: &'static str,
        /// The name on the card.
        wanted: String,
        /// The names in the file.
        has: String,
    },
    /// There are several inputs or outputs, and the card does not select one.
    #[error("the network has the {what}s {has}: the card must name one of them (`{key}`)")]
    Several {
        /// `input` or `output`.
        what: &'static str,
        /// The names in the file.
        has: String,
        /// The key of the card that selects one.
        key: &'static str,
    },
    /// The input's dimensions differ from those on the card.
    #[error("the input `{name}` of the network is {got}, but the card states {expected}")]
    InputShape {
        /// Name of the input.
        name: String,
        /// Dimensions of the input in the file.
        got: String,
        /// Dimensions of the input on the card.
        expected: String,
    },
    /// The network cannot process mirror images.
    #[error("the network cannot process mirror images: {0}")]
    Mirror(String),
    /// The test run of the network failed.
    #[error(transparent)]
    Look(#[from] LookError),
}

/// Reason why a network gives no result for a picture.
#[derive(Debug, thiserror::Error)]
pub enum LookError {
    /// The library could not run the network.
    #[error(transparent)]
    Run(#[from] RunError),
    /// An output does not match the card.
    #[error("output `{name}`: {error}")]
    Output {
        /// Name of the output.
        name: String,
        /// Mismatch of the output.
        error: OutputError,
    },
    /// An output does not consist of single-precision numbers.
    #[error("the output `{name}` is not of type f32")]
    Type {
        /// Name of the output.
        name: String,
    },
}
