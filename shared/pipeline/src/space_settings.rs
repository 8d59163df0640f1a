//! Settings of the step in space.

use multiview::{SidesSettings, SpaceSettings};
use posenetwork::MapSettings;
use skeleton::{JointSet, PARSE14};

use crate::network_step::NetworkSettings;
use crate::skeleton_settings::BodySettings;

/// Settings of the step.
#[derive(Debug, Clone, PartialEq)]
pub struct SpaceStepSettings {
    /// Settings of the energy in space and of its solution.
    pub space: SpaceSettings,
    /// Settings by which the maps were turned into evidence.
    pub maps: MapSettings,
    /// Minimum heat that half of a person's joints must have in two views, 0 to 1.
    pub least_heat: f64,
    /// The joints of the result.
    pub joints: &'static JointSet,
    /// How knowledge about human bodies is used.
    pub body: BodySettings,
    /// How left and right of the whole body are decided if views label sides as they appear in the picture; `None` if the views
    /// label the sides of the body.
    pub sides: Option<SidesSettings>,
}

impl SpaceStepSettings {
    /// Returns the settings in space that match the settings of the views.
    ///
    /// * `least_heat`: minimum mean heat of the joints of a person who is seen in a view, 0 to 1. In space, the views must
    ///   agree. A view that sees the person badly does not count, and half of the joints need twice this heat.
    /// * `as_seen`: true if views label sides as they appear in the picture, so that the sides of the whole body must be decided.
    pub fn for_views(least_heat: f64, as_seen: bool) -> Self {
        let maps = MapSettings::default();
        Self {
            space: SpaceSettings {
                as_seen,
                ..SpaceSettings::default()
            },
            maps,
            least_heat: 2.0 * least_heat,
            joints: &PARSE14,
            body: BodySettings::default(),
            sides: as_seen.then(SidesSettings::default),
        }
    }
}

impl Default for SpaceStepSettings {
    fn default() -> Self {
        Self::for_views(NetworkSettings::default().least_heat, false)
    }
}
