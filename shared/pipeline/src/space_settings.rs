//! Settings of the step in space.

use multiview::{SidesSettings, SpaceSettings};
use posenetwork::MapSettings;
use skeleton::{JointSet, PARSE14};

use crate::network_step::NetworkSettings;
use crate::skeleton_settings::BodySettings;

/// Settings of the step.
#[derive(Debug, Clone, PartialEq)]
pub struct SpaceStepSettings {
    /// The energy in space, and its solution.
    pub space: SpaceSettings,
    /// How the maps became evidence.
    pub maps: MapSettings,
    /// Heat that half of a person's joints have in two views each, 0 to 1.
    pub least_heat: f64,
    /// Joints of the result.
    pub joints: &'static JointSet,
    /// Knowledge about bodies.
    pub body: BodySettings,
    /// How left and right of the whole body are decided, where those of the views follow the picture; `None` where the views name the
    /// sides of the body.
    pub sides: Option<SidesSettings>,
}

impl SpaceStepSettings {
    /// The settings for what views find.
    ///
    /// * `least_heat`: mean heat of the joints of a person who is seen in a view, 0 to 1. In space the views have to
    ///   agree: a person who is seen badly in one does not count there, and half of the joints need twice as much.
    /// * `as_seen`: left and right follow the picture, so that those of the whole body are to be decided.
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
