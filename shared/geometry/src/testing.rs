//! Generators of cameras and points for the tests of this crate.

use nalgebra::{Isometry3, Point2, Point3, UnitVector3, Vector3};
use proptest::prelude::*;

use crate::{Camera, Intrinsics, Lens, LensModel, Rig};

/// Generates lens models: pinhole, mild and strong barrel, pincushion, tangential, rational and fisheye.
pub(crate) fn lens_model() -> impl Strategy<Value = LensModel> {
    let brown = |k: [f64; 6], p: [f64; 2]| LensModel::BrownConrady { k, p };
    prop_oneof![
        Just(LensModel::Pinhole),
        (
            -0.5..0.3,
            -0.2..0.2,
            -0.1..0.1,
            -0.003..0.003,
            -0.003..0.003
        )
            .prop_map(move |(k1, k2, k3, p1, p2)| brown([k1, k2, k3, 0.0, 0.0, 0.0], [p1, p2])),
        Just(brown(
            [-0.289415, 0.105962, 0.0, 0.0, 0.0, 0.0],
            [-0.001358, 0.00113]
        )),
        Just(brown([-0.383, 0.159, 0.0, 0.0, 0.0, 0.0], [0.0, 0.0])),
        (0.0..2.0, 0.0..0.5, 0.0..2.0, 0.0..0.5)
            .prop_map(move |(k1, k2, k4, k5)| brown([k1, k2, 0.0, k4, k5, 0.0], [0.0; 2])),
        (-0.05..0.1, -0.02..0.02, -0.01..0.01, -0.002..0.002).prop_map(|(k1, k2, k3, k4)| {
            LensModel::KannalaBrandt {
                k: [k1, k2, k3, k4],
            }
        }),
    ]
}

pub(crate) fn lens() -> impl Strategy<Value = Lens> {
    lens_model().prop_map(Lens::new)
}

/// Generates cameras of 640x480, 4 to 6 m from the origin in any direction, looking at the origin, with some roll.
pub(crate) fn camera() -> impl Strategy<Value = Camera> {
    let inside = (500.0..900.0, 0.9..1.1, 300.0..340.0, 220.0..260.0, lens());
    let place = (0.0..std::f64::consts::TAU, 4.0..6.0, -0.5..1.5, -0.6..0.6);
    (inside, place).prop_map(
        |((fx, aspect, cx, cy, lens), (bearing, distance, height, roll))| Camera {
            name: "a".to_owned(),
            intrinsics: Intrinsics {
                fx,
                fy: fx * aspect,
                cx,
                cy,
                size: [640, 480],
                lens,
            },
            camera_from_world: looking_at_origin(bearing, distance, height, roll),
        },
    )
}

/// Returns the pose of a camera on a circle about the world's z axis, which points up.
pub(crate) fn looking_at_origin(
    bearing: f64,
    distance: f64,
    height: f64,
    roll: f64,
) -> Isometry3<f64> {
    let eye = Point3::new(distance * bearing.cos(), distance * bearing.sin(), height);
    let upright = Isometry3::look_at_rh(&eye, &Point3::origin(), &Vector3::z());
    // `look_at_rh` has x right, y up and z backward; a rotation by 180 degrees about x converts it to the convention of `OpenCV`.
    let opencv = Isometry3::rotation(Vector3::x() * std::f64::consts::PI);
    Isometry3::rotation(Vector3::z() * roll) * opencv * upright
}

/// Returns `n` cameras spread over the circle, all with the same lens.
pub(crate) fn ring(n: usize, model: LensModel) -> Vec<Camera> {
    (0..n)
        .map(|i| Camera {
            name: format!("cam{i}"),
            intrinsics: Intrinsics {
                fx: 700.0,
                fy: 705.0,
                cx: 320.0,
                cy: 241.0,
                size: [640, 480],
                lens: Lens::new(model),
            },
            camera_from_world: looking_at_origin(0.3 + 1.1 * i as f64, 5.0, 1.0, 0.1 * i as f64),
        })
        .collect()
}

/// Returns a rig of [`ring`] with z up.
pub(crate) fn ring_rig(n: usize, model: LensModel) -> Rig {
    Rig::new(ring(n, model), Some(z_up()), "planted").expect("a rig")
}

pub(crate) fn z_up() -> UnitVector3<f64> {
    Vector3::z_axis()
}

/// Generates points where a person may be.
pub(crate) fn point() -> impl Strategy<Value = Point3<f64>> {
    (-0.8..0.8, -0.8..0.8, -0.8..0.8).prop_map(|(x, y, z)| Point3::new(x, y, z))
}

/// Returns the Euclidean distance.
pub(crate) fn distance(a: &Point2<f64>, b: &Point2<f64>) -> f64 {
    (a - b).norm()
}
