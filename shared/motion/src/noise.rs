//! How restless a joint is, and how far the covariances of its measurements can be believed.

/// The two numbers of a track.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Spectral density of the jerk, m²/s⁵: the restlessness of the joint.
    pub jerk: f64,
    /// Factor of the covariances: 1 where they are right, above where they are too small.
    pub scale: f64,
}

/// Expected jerk density of a joint before anything is measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prior {
    /// Mean of the common logarithm of the density in m²/s⁵.
    pub log10_jerk: f64,
    /// Standard deviation of that logarithm.
    pub sd: f64,
}
