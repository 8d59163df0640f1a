//! Whom to track.

/// Whom to track.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// The most people at once.
    pub max: usize,
    /// The least number of views that see a person, 2 or more.
    pub min_views: usize,
    /// Set if left and right follow the picture, so that two views may have them exchanged.
    pub as_seen: bool,
    /// Half of the joints of a new person have this heat in two views that agree on them, 0 to 1.
    pub least_heat: f64,
}

impl Settings {
    /// Returns true if detections may be of nobody: a network sees a person in every box.
    pub(crate) fn is_doubtful(&self) -> bool {
        self.least_heat > 0.0
    }
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            max: 4,
            min_views: 2,
            as_seen: false,
            least_heat: 0.0,
        }
    }
}
