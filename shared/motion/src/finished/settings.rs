//! Settings for smoothing a finished run.

/// Settings for smoothing a finished run.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// The smoothing method.
    pub method: Method,
    /// Cutoff frequency of [`Method::Butterworth`], in Hz.
    pub cutoff_hz: f64,
    /// Maximum time between two measurements, in seconds, for the gap to be filled.
    pub fill_s: f64,
    /// True if [`Method::Rts`] keeps the bone lengths of the limbs constant over the run.
    pub constant_bones: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            method: Method::Rts,
            cutoff_hz: 6.0,
            fill_s: crate::live::FILL_S,
            constant_bones: false,
        }
    }
}

/// Method for smoothing a finished run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Method {
    /// Uses all measurements before and after an instant, with their covariances.
    #[default]
    Rts,
    /// Uses a zero-phase low-pass filter.
    Butterworth,
    /// Uses Kalman filters, which only use earlier measurements, with their covariances.
    Kalman,
    /// Does not smooth.
    None,
}

impl Method {
    /// All methods.
    pub const ALL: [Self; 4] = [Self::Rts, Self::Butterworth, Self::Kalman, Self::None];

    /// Returns the name used on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rts => "rts",
            Self::Butterworth => "butterworth",
            Self::Kalman => "kalman",
            Self::None => "none",
        }
    }
}
