//! Settings of the tracker.

/// Settings of the tracker.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Maximum number of people tracked at the same time.
    pub max: usize,
    /// Minimum number of views that must see a person, 2 or more.
    pub min_views: usize,
    /// True if the detector labels left and right as they appear in the picture, so that two views may disagree.
    pub as_seen: bool,
    /// Minimum heat for a new person, 0 to 1: half of the joints must reach it in two views that agree on them.
    pub least_heat: f64,
}

impl Settings {
    /// Returns true if detections may be false, because some networks report a person in every box.
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
