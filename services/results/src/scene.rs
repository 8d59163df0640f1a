//! The meaning of the numbers in messages: names of views and joints, models, and pixels of the footage.

use std::sync::Arc;

use deployment::person::Follow;
use fmp::{Layout, Model};
use geometry::Framing;
use nalgebra::{Matrix3, UnitVector3};
use skeleton::JointSet;

/// One view of the deployment.
#[derive(Debug, Clone)]
pub struct View {
    /// Name of the camera in the rig.
    pub name: String,
    /// Mapping from the footage to the frames of the messages.
    pub framing: Framing,
    /// Pyramid of the frames of the messages.
    pub layout: Arc<Layout>,
}

/// Everything that is needed to interpret messages.
#[derive(Debug, Clone)]
pub struct Scene {
    /// The model.
    pub model: Arc<Model>,
    /// The views, in the order of their numbers in messages.
    pub views: Vec<View>,
    /// True if the candidates of a view are people that a network sees. Fusion then decides which candidate is the followed person.
    pub has_maps: bool,
    /// Heat, from 0 to 1, that half of a person's joints must reach for the person to be used in the check of the cameras.
    pub least_heat: f64,
    /// The joints of the result.
    pub joints: &'static JointSet,
    /// Names of the extra keypoints of the result.
    pub extra_keypoints: Vec<String>,
    /// Frames of the footage per second, if known.
    pub frame_rate_hz: Option<f64>,
    /// Interval between used frames, in frames of the footage.
    pub frame_step: u64,
    /// Choice of the followed person.
    pub follow: Follow,
    /// Upward direction, if the rig gives it.
    pub up_in_world: Option<UnitVector3<f64>>,
}

impl Scene {
    /// Returns the time of a frame in seconds after frame 0 of the footage, if known.
    pub fn time_s(&self, frame: u64) -> Option<f64> {
        self.frame_rate_hz.map(|rate| frame as f64 / rate)
    }

    /// Returns the joints of a pose; `None` if the parts of the model do not fit the joint set.
    pub(crate) fn joints_of(&self, parts: &[[f64; 2]]) -> Option<Vec<[f64; 2]>> {
        let n_parts = self.joints.joints.iter().flat_map(|joint| joint.parts).max()? + 1;
        (parts.len() >= n_parts).then(|| self.joints.from_parts(parts))
    }

    /// Returns the names of the views whose bits are set.
    pub fn names(&self, mask: u32) -> Vec<&str> {
        self.views
            .iter()
            .enumerate()
            .filter(|(view, _)| *view < 32 && mask >> view & 1 == 1)
            .map(|(_, view)| view.name.as_str())
            .collect()
    }

    /// Returns the rotation from the axes of the world to the axes of `OpenSim`, which has y up.
    ///
    /// If z is up in the world, `(X, Y, Z) = (y, z, x)`. Another upward direction is first rotated to z, along the shortest path.
    /// If the upward direction is unknown, the world's axes are kept.
    pub fn opensim_from_world(&self) -> Matrix3<f64> {
        self.up_in_world.map_or_else(Matrix3::identity, |up| {
            geometry::y_up_from_world(&up).into_inner()
        })
    }
}

impl View {
    /// Converts a point of the frame to pixels of the footage.
    pub fn in_source(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        self.framing.source_from_output().map(|row| row[0] * x + row[1] * y + row[2])
    }

    /// Returns the number of pixels of the footage per pixel of the frame.
    pub fn source_scale(&self) -> f64 {
        let [[a, b, _], [c, d, _]] = self.framing.source_from_output();
        (a * d - b * c).abs().sqrt()
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::testing::scene;

    fn opensim(up: [f64; 3], point: [f64; 3]) -> [f64; 3] {
        let mut scene = scene();
        scene.up_in_world = Some(UnitVector3::new_normalize(Vector3::from(up)));
        (scene.opensim_from_world() * Vector3::from(point)).into()
    }

    #[test]
    fn z_up_is_converted_to_y_up_by_a_swap_of_axes() {
        assert_eq!(opensim([0.0, 0.0, 1.0], [1.0, 2.0, 3.0]), [2.0, 3.0, 1.0]);
    }

    #[test]
    fn any_up_direction_is_converted_to_y_up() {
        for up in [[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [0.6, 0.0, 0.8]] {
            let got = opensim(up, up);
            let off = (got[0].powi(2) + (got[1] - 1.0).powi(2) + got[2].powi(2)).sqrt();
            assert!(off < 1e-12, "{up:?} became {got:?}");
        }
    }

    #[test]
    fn a_mask_names_its_views() {
        assert_eq!(scene().names(0b10), ["right"]);
        assert_eq!(scene().names(0b11), ["left", "right"]);
    }
}
