//! Tests with rings of cameras, of which at most one was moved.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use super::*;
use crate::people::testing::{Flaws, N_JOINTS, ring, sides};

fn settings() -> Settings {
    Settings {
        n_joints: N_JOINTS,
        sides: sides(),
        offsets_s: Vec::new(),
        offset_sd_s: 0.005,
        pose_sd: [0.5, 0.02],
        focal: false,
        most_instants: 100,
    }
}

/// Returns a camera rotated about its own axes, in degrees.
fn turned(camera: &Camera, degrees: f64) -> Camera {
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.6, 0.8, 0.0) * degrees.to_radians());
    let by = Isometry3::from_parts(Translation3::identity(), turn);
    Camera {
        camera_from_world: by * camera.camera_from_world,
        ..camera.clone()
    }
}

#[test]
fn a_rotated_camera_is_corrected() {
    let truth = ring(4);
    let films = Flaws::usual(2).films(&truth);
    let mut given = truth.clone();
    given[2] = turned(&truth[2], 2.0);
    let recording = Recording {
        cameras: &given,
        films: &films,
    };
    let outcome = refine(&recording, &settings()).unwrap();
    assert_eq!(outcome.doubts, []);
    assert!(outcome.is_better, "{outcome:?}");
    let left = difference(&outcome.cameras[2], &truth[2]).turn.to_degrees();
    assert!(left < 0.2, "{left} degrees are left of 2");
    for camera in [0, 1, 3] {
        let by = difference(&outcome.cameras[camera], &truth[camera]);
        assert!(by.turn.to_degrees() < 0.2, "{camera}: {by:?}");
    }
}

#[test]
fn refining_a_correct_rig_does_not_improve_it() {
    let truth = ring(4);
    let films = Flaws::usual(4).films(&truth);
    let recording = Recording {
        cameras: &truth,
        films: &films,
    };
    let outcome = refine(&recording, &settings()).unwrap();
    assert_eq!(outcome.doubts, []);
    assert!(!outcome.is_better, "{outcome:?}");
}
