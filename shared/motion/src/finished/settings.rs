//! How a finished run is smoothed.

/// How a finished run is smoothed.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// The method.
    pub method: Method,
    /// Cutoff of [`Method::Butterworth`], Hz.
    pub cutoff_hz: f64,
    /// The longest time between two measurements of a joint that is filled, seconds.
    pub fill_s: f64,
    /// True if [`Method::Rts`] keeps the lengths of the limbs' bones constant over the run.
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

/// How a finished run is smoothed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Method {
    /// With everything before and after, on the measured covariances.
    #[default]
    Rts,
    /// By a zero-phase low-pass filter.
    Butterworth,
    /// By causal filters on the measured covariances.
    Kalman,
    /// Not at all.
    None,
}

impl Method {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Rts, Self::Butterworth, Self::Kalman, Self::None];

    /// Its word on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rts => "rts",
            Self::Butterworth => "butterworth",
            Self::Kalman => "kalman",
            Self::None => "none",
        }
    }
}
