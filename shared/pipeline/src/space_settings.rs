//! Settings of the step that solves for people in 3D.

use multiview::{SidesSettings, SpaceSettings};
use posenetwork::MapSettings;
use skeleton::{JointSet, PARSE14};

use crate::network_step::NetworkSettings;
use crate::skeleton_settings::BodySettings;

/// Settings of the step.
#[derive(Debug, Clone, PartialEq)]
pub struct SpaceStepSettings {
    /// Settings of the energy in 3D and of its optimisation.
    pub space: SpaceSettings,
    /// Settings with which the network's maps were turned into evidence.
    pub maps: MapSettings,
    /// Minimum heat that half of a person's joints must have in two views, 0 to 1.
    pub least_heat: f64,
    /// The joints of the result.
    pub joints: &'static JointSet,
    /// How knowledge about human bodies is used.
    pub body: BodySettings,
    /// Settings for deciding left and right of the whole body, if views name them as they appear in the picture; `None` if the views name
    /// the person's own left and right.
    pub sides: Option<SidesSettings>,
}

impl SpaceStepSettings {
    /// Returns the 3D settings that match the settings of the views.
    ///
    /// * `least_heat`: minimum mean heat of the joints of a person who is seen in a view, 0 to 1. In 3D, views must agree: a view that sees
    ///   the person poorly is ignored, and half of the joints need twice this heat.
    /// * `as_seen`: true if views name left and right as they appear in the picture, so that left and right of the whole body must be
    ///   decided.
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

/// Heat that a joint of a person found by another program must have at the solution, as a fraction of the heat for a network's own maps. The
/// programs' scores are lower, and they report no people in empty rooms. With the default settings, it is a tenth: a keypoint with score 0.3
/// (the least that mmpose and `Pose2Sim` use) at 1.5 standard deviations from the solution.
const OF_KEYPOINTS: f64 = 0.25;

impl SpaceStepSettings {
    /// Returns the settings for views whose people were all found by other programs.
    #[must_use]
    pub fn by_keypoints(self) -> Self {
        Self {
            least_heat: OF_KEYPOINTS * self.least_heat,
            ..self
        }
    }
}

impl Default for SpaceStepSettings {
    fn default() -> Self {
        Self::for_views(NetworkSettings::default().least_heat, false)
    }
}
