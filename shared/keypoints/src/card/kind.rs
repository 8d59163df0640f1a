//! The kind of network that a card declares; it is read before the other keys.

use serde::Deserialize;

use super::CardError;

/// Format name of a card.
pub(crate) const FORMAT: &str = "parallax-keypoint-network";
/// Format name of the card of a detector.
pub(crate) const DETECTOR_FORMAT: &str = "parallax-detector";
/// Version of both formats that is read.
pub(crate) const VERSION: u32 = 1;

/// Kind of network that a card describes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CardKind {
    /// A network that finds keypoints: [`Card`](crate::Card).
    Keypoints,
    /// A detector of people: [`DetectorCard`](crate::DetectorCard).
    Detector,
}

impl CardKind {
    /// Returns the kind that a text declares; `None` if it does not declare a kind.
    pub fn of(text: &str) -> Option<Self> {
        let head: Head = toml::from_str(text).ok()?;
        match head.format.as_str() {
            FORMAT => Some(Self::Keypoints),
            DETECTOR_FORMAT => Some(Self::Detector),
            _ => None,
        }
    }
}

/// The keys with which any card begins.
#[derive(Debug, Deserialize)]
struct Head {
    format: String,
    version: u32,
}

/// Checks the format and version that a text declares, before its keys are checked.
pub(crate) fn check_head(text: &str, expected: &'static str) -> Result<(), CardError> {
    let head: Head = toml::from_str(text)?;
    if head.format == expected && head.version == VERSION {
        return Ok(());
    }
    Err(CardError::Version {
        format: head.format.chars().take(32).collect(),
        version: head.version,
        expected,
    })
}
