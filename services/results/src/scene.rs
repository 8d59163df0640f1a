//! Meaning of the numbers in messages: names of views and joints, models, and pixels of the footage.

use std::sync::Arc;

use deployment::person::Follow;
use fmp::{Layout, Model};
use geometry::Framing;
use nalgebra::{Matrix3, UnitVector3};
use skeleton::JointSet;

/// One view of the deployment.
#[derive(Debug, Clone)]
pub struct View {
    /// The camera's name in the rig.
    pub name: String,
    /// From the footage to the frames that messages speak of.
    pub framing: Framing,
    /// The pyramid of those frames.
    pub layout: Arc<Layout>,
}

/// Everything a reader of messages has to know.
#[derive(Debug, Clone)]
pub struct Scene {
    /// The model.
    pub model: Arc<Model>,
    /// The views, as they are numbered in messages.
    pub views: Vec<View>,
    /// True if the candidates of a view are the people that a network sees: fusion decides which of them is the person.
    pub has_maps: bool,
    /// Least heat of half of the joints of a person who serves to check the places of the cameras, 0 to 1.
    pub least_heat: f64,
    /// The joints of the result.
    pub joints: &'static JointSet,
    /// Names of the extra keypoints of the result.
    pub extra_keypoints: Vec<String>,
    /// Frames of the footage per second, where known.
    pub frame_rate_hz: Option<f64>,
    /// Distance between the frames used.
    pub frame_step: u64,
    /// Which of several people is followed.
    pub follow: Follow,
    /// Against gravity, where the rig knows.
    pub up_in_world: Option<UnitVector3<f64>>,
}

impl Scene {
    /// When a frame was taken, seconds after frame 0 of the footage, where known.
    pub fn time_s(&self, frame: u64) -> Option<f64> {
        self.frame_rate_hz.map(|rate| frame as f64 / rate)
    }

    /// Names of the views whose bits are set.
    pub fn names(&self, mask: u32) -> Vec<&str> {
        self.views
            .iter()
            .enumerate()
            .filter(|(view, _)| *view < 32 && mask >> view & 1 == 1)
            .map(|(_, view)| view.name.as_str())
            .collect()
    }

    /// The axes of `OpenSim` from those of the world: y up.
    ///
    /// With the world's z up `(X, Y, Z) = (y, z, x)`; another up is turned to z first, the short way
    /// round. Without one the world's axes stay.
    pub fn opensim_from_world(&self) -> Matrix3<f64> {
        self.up_in_world.map_or_else(Matrix3::identity, |up| {
            geometry::y_up_from_world(&up).into_inner()
        })
    }
}

impl View {
    /// A point of the frame in pixels of the footage.
    pub fn in_source(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        self.framing.source_from_output().map(|row| row[0] * x + row[1] * y + row[2])
    }

    /// Pixels of the footage per pixel of the frame.
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
    fn z_up_becomes_y_up_by_exchanging_axes() {
        assert_eq!(opensim([0.0, 0.0, 1.0], [1.0, 2.0, 3.0]), [2.0, 3.0, 1.0]);
    }

    #[test]
    fn any_up_becomes_y() {
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
