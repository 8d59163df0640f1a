//! Tests of the adjustment with rings of known cameras and points.

use nalgebra::{
    Isometry3, Matrix3, Point2, Point3, Rotation3, Translation3, UnitQuaternion, Vector2, Vector3,
};

use super::*;
use crate::{Camera, Intrinsics, Lens, LensModel};

const BROWN: LensModel = LensModel::BrownConrady {
    k: [-0.1, 0.05, -0.01, 0.02, -0.003, 0.001],
    p: [0.001, -0.002],
};
const FISHEYE: LensModel = LensModel::KannalaBrandt {
    k: [-0.02, 0.01, -0.004, 0.0007],
};
const ALL: Free = Free {
    pose: true,
    focal: true,
    aspect: true,
    centre: true,
    lens: [true; 8],
};

/// Returns a camera 4 m from the origin, at an angle of the ring.
fn camera(nth: usize, of: usize, lens: LensModel) -> Camera {
    let angle = (0.2 + nth as f64) / of as f64 * core::f64::consts::TAU;
    let centre = Vector3::new(4.0 * angle.cos(), 4.0 * angle.sin(), 1.5 + 0.2 * nth as f64);
    let forward = (Vector3::new(0.0, 0.0, 1.0) - centre) / (Vector3::z() - centre).norm();
    let right = forward.cross(&Vector3::z());
    let right = right / right.norm();
    let down = forward.cross(&right);
    let matrix = Matrix3::from_rows(&[right.transpose(), down.transpose(), forward.transpose()]);
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix));
    Camera {
        name: format!("cam{nth}"),
        intrinsics: Intrinsics {
            fx: 800.0,
            fy: 820.0,
            cx: 500.0,
            cy: 480.0,
            size: [1000, 1000],
            lens: Lens::new(lens),
        },
        camera_from_world: Isometry3::from_parts(Translation3::from(rotation * -centre), rotation),
    }
}

/// Points that cameras see. The first camera and the distance between the first two are known.
#[derive(Clone)]
struct Cloud {
    cameras: Cameras,
    points: Vec<Point3<f64>>,
    seen: Vec<Vec<Option<Point2<f64>>>>,
    loss: Loss,
    baseline: Option<f64>,
}

impl Cloud {
    fn new(n_cameras: usize, n_points: usize, lens: LensModel, free: Free) -> Self {
        let cameras: Vec<Camera> = (0..n_cameras).map(|i| camera(i, n_cameras, lens)).collect();
        let mut random = fastrand_like(7);
        let mut point = || Point3::new(2.0 * random() - 1.0, 2.0 * random() - 1.0, 2.0 * random());
        let points: Vec<Point3<f64>> = (0..n_points).map(|_| point()).collect();
        let of = |point: &Point3<f64>| cameras.iter().map(|camera| camera.project(point)).collect();
        let seen = points.iter().map(of).collect();
        let mut each = vec![free; n_cameras];
        each[0].pose = false;
        Self {
            cameras: Cameras::new(cameras, &each),
            points,
            seen,
            loss: Loss::Square,
            baseline: Some(1.0),
        }
    }

    /// Returns the problem with all free values disturbed.
    fn disturbed(&self) -> Self {
        let mut random = fastrand_like(3);
        let mut by = |size: f64| size * (random() - 0.5);
        let shared = (0..self.n_shared())
            .map(|i| {
                let name = self.name(i);
                let size = if name.contains("focal") || name.contains("principal") {
                    20.0
                } else if name.contains("lens") {
                    0.002
                } else {
                    0.1
                };
                by(size)
            })
            .collect();
        let locals = self.points.iter().map(|_| (0..3).map(|_| by(0.2)).collect());
        self.moved(&Step {
            shared,
            locals: locals.collect(),
        })
    }
}

/// Returns a generator of numbers from 0 to 1.
fn fastrand_like(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    }
}

impl Problem for Cloud {
    fn n_shared(&self) -> usize {
        self.cameras.n_parameters()
    }

    fn name(&self, parameter: usize) -> String {
        self.cameras.name(parameter)
    }

    fn locals(&self) -> Vec<usize> {
        vec![3; self.points.len()]
    }

    fn terms_of(&self, local: usize, take: &mut dyn FnMut(&Term)) {
        let mut term = Term::default();
        for (camera, seen) in self.seen[local].iter().enumerate() {
            let Some(seen) = *seen else { continue };
            let point = &self.points[local];
            let observed = self.cameras.observe(camera, point, (seen, 0.5), self.loss, &mut term);
            for axis in 0..3 {
                term.by_local(axis, observed.by_point.column(axis).as_slice());
            }
            take(&term);
        }
    }

    fn priors(&self, take: &mut dyn FnMut(&Term)) {
        let Some(wanted) = self.baseline else { return };
        let [a, b] = [0, 1].map(|i| self.cameras.cameras()[i].centre_in_world());
        let way = b - a;
        let mut term = Term::default();
        let truth = (camera(1, self.cameras.cameras().len(), BROWN).centre_in_world()
            - camera(0, self.cameras.cameras().len(), BROWN).centre_in_world())
        .norm();
        term.begin(&[1e3 * (way.norm() - wanted * truth)], Loss::Square);
        if let Some(pose) = self.cameras.pose_parameters(1) {
            for axis in 0..3 {
                term.by_shared(pose[3 + axis], &[1e3 * way[axis] / way.norm()]);
            }
        }
        take(&term);
    }

    fn moved(&self, step: &Step) -> Self {
        let mut moved = self.clone();
        moved.cameras = self.cameras.moved(&step.shared);
        for (point, by) in moved.points.iter_mut().zip(&step.locals) {
            *point += Vector3::from_column_slice(by);
        }
        moved
    }
}

#[test]
fn derivatives_equal_finite_differences() {
    for lens in [LensModel::Pinhole, BROWN, FISHEYE] {
        let cloud = Cloud::new(3, 4, lens, ALL).disturbed();
        let error = derivative_error(&cloud, 1e-6);
        assert!(error < 1e-5, "{lens:?}: {error:e}");
    }
}

#[test]
fn cameras_and_points_are_recovered() {
    for lens in [LensModel::Pinhole, FISHEYE] {
        let truth = Cloud::new(4, 60, lens, Free::POSE);
        let (found, report) = solve(truth.disturbed(), &Settings::default());
        assert!(report.is_converged(), "{report:?}");
        assert!(report.cost_after < 1e-10, "{report:?}");
        for (a, b) in truth.cameras.cameras().iter().zip(found.cameras.cameras()) {
            let away = (a.centre_in_world() - b.centre_in_world()).norm();
            assert!(away < 1e-6, "{} is {away} m away", a.name);
        }
    }
}

#[test]
fn focal_lengths_and_lenses_are_estimated_together_with_the_poses() {
    let free = Free {
        lens: [true, true, false, false, false, false, true, true],
        ..ALL
    };
    let truth = Cloud::new(4, 200, BROWN, free);
    let (found, report) = solve(truth.disturbed(), &Settings::default());
    assert!(report.cost_after < 1e-8, "{report:?}");
    let [a, b] = [&truth, &found].map(|cloud| cloud.cameras.cameras()[2].intrinsics);
    assert!((a.fx - b.fx).abs() < 1e-3, "{} {}", a.fx, b.fx);
    assert!((a.cy - b.cy).abs() < 1e-3, "{} {}", a.cy, b.cy);
}

#[test]
fn outliers_hardly_change_a_robust_solution() {
    let mut cloud = Cloud::new(4, 60, LensModel::Pinhole, Free::POSE);
    let truth = cloud.clone();
    for nth in 0..6 {
        if let Some(it) = &mut cloud.seen[10 * nth][nth % 4] {
            *it += Vector2::new(60.0, -40.0);
        }
    }
    let worst = |cloud: &Cloud| {
        let each = cloud.cameras.cameras().iter().zip(truth.cameras.cameras());
        each.map(|(a, b)| (a.centre_in_world() - b.centre_in_world()).norm())
            .fold(0.0, f64::max)
    };
    let plain = worst(&solve(cloud.clone(), &Settings::default()).0);
    cloud.loss = Loss::Cauchy(2.0);
    let robust = worst(&solve(cloud, &Settings::default()).0);
    assert!(plain > 0.02, "{plain}");
    assert!(robust < 0.001, "{robust}");
}

#[test]
fn the_covariance_matches_the_spread_of_solutions() {
    let truth = Cloud::new(3, 40, LensModel::Pinhole, Free::POSE);
    let covariance = covariance(&truth).unwrap();
    let place = truth.cameras.pose_parameters(2).unwrap()[4];
    let mut random = fastrand_like(11);
    let mut normal = || (0..12).map(|_| random()).sum::<f64>() - 6.0;
    let mut spread = 0.0;
    let n = 60;
    for _ in 0..n {
        let mut noisy = truth.clone();
        for it in noisy.seen.iter_mut().flatten().flatten() {
            *it += 0.5 * Vector2::new(normal(), normal());
        }
        let (found, _) = solve(noisy, &Settings::default());
        let [a, b] = [&truth, &found].map(|cloud| cloud.cameras.cameras()[2].centre_in_world());
        spread += (a.y - b.y).powi(2) / f64::from(n);
    }
    // A variance from 60 samples is known to 18 %; three times this deviation is accepted.
    let ratio = spread / covariance.sd(place).powi(2);
    assert!((0.5..1.7).contains(&ratio), "{ratio}");
}

#[test]
fn clustered_covariances_match_the_spread_if_errors_are_correlated() {
    const N_CLUSTERS: usize = 10;
    let mut truth = Cloud::new(3, 60, LensModel::Pinhole, Free::POSE);
    truth.loss = Loss::Square;
    let cluster_of: Vec<usize> = (0..60).map(|i| i * N_CLUSTERS / 60).collect();
    let place = truth.cameras.pose_parameters(2).unwrap()[4];
    let mut random = fastrand_like(11);
    let mut normal = || (0..12).map(|_| random()).sum::<f64>() - 6.0;
    let (mut spread, mut by_clusters, mut by_residuals) = (0.0, 0.0, 0.0);
    let n = 60;
    for _ in 0..n {
        let mut noisy = truth.clone();
        let common = [0; 3 * N_CLUSTERS].map(|_| 0.8 * Vector2::new(normal(), normal()));
        for (nth, seen) in noisy.seen.iter_mut().enumerate() {
            for (camera, it) in seen.iter_mut().enumerate() {
                let own = 0.8 * Vector2::new(normal(), normal());
                let common = common[3 * cluster_of[nth] + camera];
                *it = it.map(|value| value + own + common);
            }
        }
        let (found, _) = solve(noisy, &Settings::default());
        let [a, b] = [&truth, &found].map(|cloud| cloud.cameras.cameras()[2].centre_in_world());
        spread += (a.y - b.y).powi(2);
        let known = clustered(&found, &cluster_of).unwrap().unwrap();
        by_clusters += known.sd(place).powi(2);
        by_residuals += covariance(&found).unwrap().sd(place).powi(2);
    }
    assert!(spread > 2.5 * by_residuals, "{spread} {by_residuals}");
    // A variance from 60 samples is known to 18 %; three times this deviation is accepted.
    let ratio = spread / by_clusters;
    assert!((0.5..1.7).contains(&ratio), "{ratio}");
    assert_eq!(clustered(&truth, &[0; 60]), Ok(None));
}

#[test]
fn undetermined_parameters_are_named() {
    let mut cloud = Cloud::new(3, 40, LensModel::Pinhole, Free::POSE);
    cloud.baseline = None;
    let error = covariance(&cloud).unwrap_err().to_string();
    assert!(
        error.contains("cam1: place") && error.contains("cam2: place"),
        "{error}"
    );
    assert!(!error.contains("rotation"), "{error}");

    let mut cloud = Cloud::new(3, 40, LensModel::Pinhole, Free::POSE);
    for it in &mut cloud.seen {
        it[2] = None;
    }
    let error = covariance(&cloud).unwrap_err().to_string();
    assert!(error.contains("cam2: rotation x"), "{error}");
    assert!(!error.contains("cam1"), "{error}");
}

#[test]
fn a_point_seen_by_one_camera_has_no_effect() {
    let truth = Cloud::new(3, 40, LensModel::Pinhole, Free::POSE);
    let mut lonely = truth.clone();
    lonely.seen[3] = vec![None, lonely.seen[3][1], None];
    let [all, less] = [&truth, &lonely].map(|cloud| covariance(cloud).unwrap().sd(3));
    assert!(less >= all && less < 1.2 * all, "{less} {all}");
    let (_, report) = solve(lonely.disturbed(), &Settings::default());
    assert!(report.cost_after < 1e-8, "{report:?}");
}

#[test]
fn losses_have_the_stated_derivatives() {
    for loss in [Loss::Square, Loss::Huber(1.5), Loss::Cauchy(2.0)] {
        for s in [0.1, 1.0, 5.0, 100.0] {
            let numeric = (loss.of(s + 1e-5).0 - loss.of(s - 1e-5).0) / 2e-5;
            assert!((numeric - loss.of(s).1).abs() < 1e-6, "{loss:?} at {s}");
            // The curvature along one residual is the derivative of half the derivative of the cost.
            let slope = |at: f64| at * loss.of(at * at).1;
            let numeric = (slope(s.sqrt() + 1e-5) - slope(s.sqrt() - 1e-5)) / 2e-5;
            let found = loss.curvature(s, 1);
            assert!((numeric - found).abs() < 1e-5, "{loss:?} at {s}: {found}");
        }
    }
}
