//! Tests of the refinement.

use super::*;
use crate::body::testing::{self, NO_COVARIANCES, POSTURES};

/// Returns the covariances of the noise: a standard deviation of 5 cm along x and 1 cm perpendicular to it.
fn depth_noise() -> Covariances {
    [Some(Matrix3::from_diagonal(&Vector3::new(25e-4, 1e-4, 1e-4))); N_JOINTS]
}

/// Returns the mean error of joints before and after refinement, in metres, over noisy frames of a person in all postures.
fn errors(body: impl Fn(&Joints) -> Joints, tall: f64, lengths: Option<&Lengths>) -> [f64; 2] {
    let mut random = fastrand::Rng::with_seed(11);
    let mut sum = [0.0; 2];
    for posture in POSTURES {
        let truth = body(&posture(tall));
        for _ in 0..60 {
            let seen = testing::noisy(&truth, 0.05, 0.01, &mut random);
            let refined = refine(&seen, &depth_noise(), lengths);
            sum[0] += testing::error(&seen, &truth);
            sum[1] += testing::error(&refined.joints, &truth);
        }
    }
    sum.map(|sum| sum / (60.0 * POSTURES.len() as f64))
}

/// Returns a body whose legs are longer and whose arms are shorter than the mean, by two standard deviations among people.
fn unusual(joints: &Joints) -> Joints {
    let mut it = *joints;
    let stretch = |stretched: &mut Joints, from: usize, to: &[usize], by: f64| {
        let add = (joints[to[0]].unwrap() - joints[from].unwrap()) * by;
        for &joint in to {
            stretched[joint] = stretched[joint].map(|point| point + add);
        }
    };
    for [hip, knee, ankle, shoulder, elbow, wrist] in [[2, 1, 0, 8, 7, 6], [3, 4, 5, 9, 10, 11]] {
        stretch(&mut it, hip, &[knee, ankle], 0.09);
        stretch(&mut it, knee, &[ankle], 0.08);
        stretch(&mut it, shoulder, &[elbow, wrist], -0.065);
        stretch(&mut it, elbow, &[wrist], -0.09);
    }
    it
}

#[test]
fn noise_along_the_viewing_direction_is_reduced() {
    for tall in [1.62, 1.76] {
        let [before, after] = errors(|joints| *joints, tall, None);
        assert!(after < 0.88 * before, "{tall}: {before} {after}");
    }
}

#[test]
fn learned_lengths_reduce_the_error_further() {
    let mut lengths = Lengths::default();
    testing::learn(&mut lengths, &unusual(&testing::walking(1.7)));
    let [before, after] = errors(unusual, 1.7, Some(&lengths));
    assert!(after < 0.8 * before, "{before} {after}");
}

#[test]
fn unusual_bodies_are_not_made_worse() {
    for tall in [0.95, 1.2, 1.5, 1.7] {
        let [before, after] = errors(unusual, tall, None);
        assert!(after < before, "{tall}: {before} {after}");
    }
}

#[test]
fn a_child_with_adult_proportions_is_not_made_worse() {
    let [before, after] = errors(
        |joints| joints.map(|joint| joint.map(|joint| joint * 0.5)),
        2.0,
        None,
    );
    assert!(after < before, "{before} {after}");
}

#[test]
fn a_perfect_body_is_unchanged() {
    for posture in POSTURES {
        let person = posture(1.7);
        let found = refine(&person, &NO_COVARIANCES, None);
        assert!(testing::error(&found.joints, &person) < 1e-3);
    }
}

#[test]
fn covariances_shrink_and_stay_positive_definite() {
    let person = testing::noisy(
        &testing::walking(1.7),
        0.05,
        0.01,
        &mut fastrand::Rng::with_seed(1),
    );
    let found = refine(&person, &depth_noise(), None);
    for (joint, covariance) in found.covariances.iter().enumerate() {
        let covariance = covariance.unwrap();
        let least = covariance.symmetric_eigenvalues().min();
        let gained =
            depth_noise()[joint].unwrap() + Matrix3::identity() * LEAST_VARIANCE - covariance;
        assert!(least > 0.0, "{joint} {covariance}");
        assert!(
            gained.symmetric_eigenvalues().min() > -1e-9,
            "{joint} {covariance}"
        );
    }
}

#[test]
fn covariances_are_the_inverse_of_the_normal_matrix() {
    let person = testing::noisy(
        &testing::sitting(1.7),
        0.05,
        0.02,
        &mut fastrand::Rng::with_seed(2),
    );
    let problem = Problem::new(&person, &depth_noise(), None);
    let found = problem.result(&problem.measured, 0).unwrap();
    let mut normal = SMatrix::<f64, 43, 43>::zeros();
    for joint in 0..N_JOINTS {
        let weight = problem.weights[joint];
        normal.view_mut((3 * joint, 3 * joint), (3, 3)).copy_from(&weight);
    }
    normal[(42, 42)] = 1.0 / STATURE_VARIANCE;
    for (row, loss) in problem.rows.iter().flatten().zip(problem.losses) {
        let linear = row.linear(&problem.measured);
        let mut by = SVector::<f64, 43>::zeros();
        for joint in 0..N_JOINTS {
            by.rows_mut(3 * joint, 3).copy_from(&linear.by_joint[joint]);
        }
        by[42] = linear.by_stature;
        let weight = (1.0 + linear.residual.powi(2) / loss).powi(-2) / row.variance;
        normal += weight * by * by.transpose();
    }
    let inverse = normal.try_inverse().unwrap();
    for joint in 0..N_JOINTS {
        let expected: Matrix3<f64> = inverse.fixed_view::<3, 3>(3 * joint, 3 * joint).into();
        let covariance = found.covariances[joint].unwrap();
        assert!((expected - covariance).norm() < 1e-9, "{joint}");
    }
}

#[test]
fn the_result_is_a_minimum() {
    let person = testing::noisy(
        &testing::bent(1.7),
        0.05,
        0.01,
        &mut fastrand::Rng::with_seed(3),
    );
    let problem = Problem::new(&person, &depth_noise(), None);
    let found = refine(&person, &depth_noise(), None);
    assert!(
        (1..MAX_ITERATIONS).contains(&found.iterations),
        "{}",
        found.iterations
    );
    let mut state = problem.measured;
    state.joints = found.joints.map(|joint| joint.unwrap().coords);
    // The result does not contain the stature; the best stature for these joints is used.
    let cost = |state: &State| {
        let of = |mm: i32| State {
            stature: 1.2 + f64::from(mm) / 1000.0,
            ..*state
        };
        (0..1000).map(|mm| problem.cost(&of(mm))).fold(f64::INFINITY, f64::min)
    };
    let least = cost(&state);
    for joint in 0..N_JOINTS {
        for step in [Vector3::x(), Vector3::y(), Vector3::z()] {
            for sign in [-0.005, 0.005] {
                let mut other = state;
                other.joints[joint] += sign * step;
                assert!(cost(&other) > least, "{joint} {step}");
            }
        }
    }
}

#[test]
fn an_impossible_limb_does_not_displace_its_neighbours() {
    let person = testing::walking(1.7);
    let mut wrong = person;
    wrong[6] = wrong[6].map(|wrong| wrong + Vector3::new(0.2, -1.0, 0.5));
    let covariances = [Some(Matrix3::identity() * 4e-4); N_JOINTS];
    let found = refine(&wrong, &covariances, None);
    for joint in (0..N_JOINTS).filter(|joint| *joint != 6) {
        let moved = (found.joints[joint].unwrap() - person[joint].unwrap()).norm();
        assert!(moved < 0.015, "{joint} {moved}");
    }
}

#[test]
fn missing_joints_stay_missing_and_the_mirror_image_is_mirrored() {
    let mut random = fastrand::Rng::with_seed(4);
    let mut person = testing::noisy(&testing::walking(1.7), 0.05, 0.01, &mut random);
    person[7] = None;
    let found = refine(&person, &depth_noise(), None);
    assert_eq!((found.joints[7], found.covariances[7]), (None, None));
    let mirrored = refine(&testing::mirrored(&person), &depth_noise(), None);
    assert!(testing::error(&testing::mirrored(&mirrored.joints), &found.joints) < 1e-6);
    let nothing = refine(&[None; N_JOINTS], &NO_COVARIANCES, None);
    assert_eq!(
        (nothing.joints, nothing.covariances),
        ([None; N_JOINTS], NO_COVARIANCES)
    );
}
