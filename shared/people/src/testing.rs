//! People and cameras for tests.

use fastrand::Rng;
use geometry::{Camera, Intrinsics, Lens, LensModel};
use nalgebra::{Isometry3, Point3, Rotation3, Vector3};

use crate::{Detection, Keypoint, N, View};

/// A standing person, in fractions of the stature: right, forward, up.
const STANDING: [[f64; 3]; N] = [
    [0.06, 0.0, 0.04],
    [0.055, 0.01, 0.285],
    [0.05, 0.0, 0.53],
    [-0.05, 0.0, 0.53],
    [-0.055, 0.01, 0.285],
    [-0.06, 0.0, 0.04],
    [0.16, 0.08, 0.52],
    [0.14, -0.02, 0.64],
    [0.106, 0.0, 0.82],
    [-0.106, 0.0, 0.82],
    [-0.14, -0.02, 0.64],
    [-0.16, 0.08, 0.52],
    [0.0, 0.0, 0.83],
    [0.0, 0.03, 1.0],
];

/// A person at a position, rotated about the vertical.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Actor {
    pub(crate) at: [f64; 2],
    pub(crate) turn: f64,
    pub(crate) stature: f64,
}

impl Actor {
    pub(crate) fn joints(&self) -> [Point3<f64>; N] {
        let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), self.turn);
        let place = Vector3::new(self.at[0], self.at[1], 0.0);
        STANDING.map(|share| Point3::from(turn * Vector3::from(share) * self.stature + place))
    }
}

/// Cameras on a ring of radius 4 m at a height of 2 m that look at the centre.
pub(crate) fn ring(n: usize) -> Vec<Camera> {
    let camera = |nth: usize| {
        let angle = 0.3 + std::f64::consts::TAU * nth as f64 / n as f64;
        let eye = Point3::new(4.0 * angle.cos(), 4.0 * angle.sin(), 2.0);
        // The camera's y points down.
        let camera_from_world =
            Isometry3::look_at_rh(&eye, &Point3::new(0.0, 0.0, 1.0), &Vector3::z());
        let flip = Isometry3::rotation(Vector3::x() * std::f64::consts::PI);
        Camera {
            name: format!("cam{nth}"),
            intrinsics: Intrinsics {
                fx: 600.0,
                fy: 600.0,
                cx: 479.5,
                cy: 359.5,
                size: [960, 720],
                lens: Lens::new(LensModel::Pinhole),
            },
            camera_from_world: flip * camera_from_world,
        }
    };
    (0..n).map(camera).collect()
}

/// Renders people into the cameras' views: some joints are missing, and all have noise.
///
/// * `noise_px`: standard deviation of the noise, in pixels.
pub(crate) fn seen(
    cameras: &[Camera],
    people: &[Actor],
    noise_px: f64,
    random: &mut Rng,
) -> Vec<View> {
    let mut views = Vec::new();
    for camera in cameras {
        let mut detections = Vec::new();
        for actor in people {
            let mut normal = || (0..12).map(|_| random.f64()).sum::<f64>() - 6.0;
            let joints = actor.joints().map(|joint| {
                let at = camera.project(&joint)?;
                let at_px = [at.x + noise_px * normal(), at.y + noise_px * normal()];
                let is_missed = normal() > 1.5;
                (!is_missed).then_some(Keypoint {
                    at_px,
                    sd_px: noise_px.max(0.5),
                    heat: 0.8,
                })
            });
            detections.push(Detection {
                joints,
                colour: None,
            });
        }
        views.push(View {
            detections,
            loose: Vec::new(),
        });
    }
    views
}
