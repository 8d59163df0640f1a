//! Jerk density of a joint, and a scale that shows whether the covariances of its measurements are right.

/// Noise parameters of a track.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Spectral density of the jerk, in m²/s⁵: a measure of how abruptly the joint moves.
    pub jerk: f64,
    /// Factor by which the covariances must be multiplied: 1 if they are right, above 1 if they are too small.
    pub scale: f64,
}

/// Expected jerk density of a joint before any measurement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prior {
    /// Mean of the common logarithm of the density in m²/s⁵.
    pub log10_jerk: f64,
    /// Standard deviation of that logarithm.
    pub sd: f64,
}
