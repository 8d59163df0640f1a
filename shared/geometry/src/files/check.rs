//! Plausibility checks of a rig that was read without error.

mod agreement;
mod finding;

use nalgebra::{Point2, Point3};

use crate::{Camera, Rig, upright_roll};

pub use agreement::{CameraError, EpipolarReport, PairError, epipolar_check};
pub use finding::{Finding, Severity};

/// Cameras count as being in the same place if all distances between them are below this, in metres.
const ONE_PLACE: f64 = 0.01;
/// Distance from the origin beyond which a camera is reported as far away, in metres.
const FAR_AWAY: f64 = 10_000.0;

/// Looks for implausible values in a rig. An empty list means that nothing was found, not that the rig is correct.
pub fn check(rig: &Rig) -> Vec<Finding> {
    let mut findings = Vec::new();
    let cameras = rig.cameras();
    for (i, a) in cameras.iter().enumerate() {
        check_intrinsics(a, &mut findings);
        findings.extend(far_away(a));
        for b in &cameras[i + 1..] {
            findings.extend(pair_distance(a, b));
        }
    }
    findings.extend(one_place(cameras).or_else(|| nothing_shared(cameras)));
    findings.extend(rig.left_out().iter().map(|left_out| Finding::LeftOut {
        camera: left_out.camera.clone(),
        why: left_out.why,
    }));
    if rig.up_in_world().is_none() {
        findings.push(Finding::UpUnknown);
    }
    for camera in cameras {
        let degrees = upright_roll(camera, rig).map(f64::to_degrees).filter(|d| d.abs() > 100.0);
        findings.extend(degrees.map(|degrees| Finding::UpsideDown {
            camera: camera.name.clone(),
            degrees,
        }));
        if rig.focus().is_some_and(|focus| !sees(camera, &focus)) {
            findings.push(Finding::LooksElsewhere {
                camera: camera.name.clone(),
            });
        }
    }
    findings
}

fn check_intrinsics(camera: &Camera, findings: &mut Vec<Finding>) {
    let intrinsics = &camera.intrinsics;
    let name = || camera.name.clone();
    let [width, height] = intrinsics.size.map(f64::from);
    let fraction = [intrinsics.cx / width, intrinsics.cy / height];
    if fraction.iter().any(|part| !(0.3..=0.7).contains(part)) {
        findings.push(Finding::PrincipalPoint {
            camera: name(),
            fraction,
        });
    }
    let ratio = intrinsics.fy / intrinsics.fx;
    if !(0.9..=1.1).contains(&ratio) {
        findings.push(Finding::Aspect {
            camera: name(),
            ratio,
        });
    }
    let angle = |extent: f64, focal: f64| 2.0 * (0.5 * extent / focal).atan().to_degrees();
    let degrees = angle(width, intrinsics.fx).max(angle(height, intrinsics.fy));
    if !(3.0..=150.0).contains(&degrees) {
        findings.push(Finding::FieldOfView {
            camera: name(),
            degrees,
        });
    }
    findings.extend(lens_range(camera).or_else(|| lens_strength(camera)));
}

/// Finds pixels to which no ray belongs, on a grid and in the corners.
fn lens_range(camera: &Camera) -> Option<Finding> {
    const STEPS: usize = 16;
    let [width, height] = camera.intrinsics.size.map(f64::from);
    let has_ray = |x: f64, y: f64| {
        let at = Point2::new(x * (width - 1.0), y * (height - 1.0));
        camera.undistort(&at).is_some()
    };
    let middle = |index: usize| (index as f64 + 0.5) / STEPS as f64;
    let grid = (0..STEPS * STEPS).map(|cell| [middle(cell % STEPS), middle(cell / STEPS)]);
    let n_without = grid.filter(|[x, y]| !has_ray(*x, *y)).count();
    let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]];
    let is_whole = n_without == 0 && corners.iter().all(|[x, y]| has_ray(*x, *y));
    (!is_whole).then(|| Finding::LensRange {
        camera: camera.name.clone(),
        share: n_without as f64 / (STEPS * STEPS) as f64,
    })
}

/// Finds a distortion that changes the angle of a corner to the axis by more than a factor of two.
fn lens_strength(camera: &Camera) -> Option<Finding> {
    let [width, height] = camera.intrinsics.size.map(f64::from);
    let ratio = |[bent, straight]: [f64; 2]| bent / straight;
    let corners = [
        (0.0, 0.0),
        (width - 1.0, 0.0),
        (0.0, height - 1.0),
        (width - 1.0, height - 1.0),
    ];
    let angles = corners.iter().filter_map(|&(x, y)| {
        let at = Point2::new(x, y);
        let straight = camera.intrinsics.normalised(&at).coords.norm();
        let bent = camera.undistort(&at)?.coords.norm();
        Some([bent, straight].map(|tangent| tangent.atan().to_degrees()))
    });
    let is_implausible =
        |angles: &[f64; 2]| angles[1] > 0.1 && !(0.5..=2.0).contains(&ratio(*angles));
    let worst = angles.filter(is_implausible).min_by(|a, b| ratio(*a).total_cmp(&ratio(*b)));
    worst.map(|[bent_degrees, straight_degrees]| Finding::LensStrength {
        camera: camera.name.clone(),
        straight_degrees,
        bent_degrees,
    })
}

fn far_away(camera: &Camera) -> Option<Finding> {
    let metres = camera.centre_in_world().coords.norm();
    let camera = camera.name.clone();
    (metres > FAR_AWAY).then_some(Finding::FarAway { camera, metres })
}

fn pair_distance(a: &Camera, b: &Camera) -> Option<Finding> {
    let cameras = [a.name.clone(), b.name.clone()];
    let metres = (a.centre_in_world() - b.centre_in_world()).norm();
    let angle = a.camera_from_world.rotation.angle_to(&b.camera_from_world.rotation);
    if metres < 1e-6 && angle < 1e-6 {
        return Some(Finding::SamePose { cameras });
    }
    (!(0.1..=100.0).contains(&metres)).then_some(Finding::Distance { cameras, metres })
}

fn one_place(cameras: &[Camera]) -> Option<Finding> {
    let places: Vec<Point3<f64>> = cameras.iter().map(Camera::centre_in_world).collect();
    let others = |(nth, a): (usize, &Point3<f64>)| {
        let distances = places[nth + 1..].iter().map(|b| (a - b).norm());
        distances.fold(0.0, f64::max)
    };
    let metres = places.iter().enumerate().map(others).fold(0.0, f64::max);
    (cameras.len() > 1 && metres < ONE_PLACE).then_some(Finding::OnePlace {
        n_cameras: cameras.len(),
        metres,
    })
}

/// Finds a rig in which no two cameras see a common region within twenty times the size of the rig.
fn nothing_shared(cameras: &[Camera]) -> Option<Finding> {
    const STEPS: usize = 8;
    const DEPTHS: usize = 40;
    let first = cameras.first()?.centre_in_world();
    let far = cameras.iter().map(|camera| (camera.centre_in_world() - first).norm());
    let size = far.fold(0.0, f64::max);
    let depth = |nth: usize| 0.02 * size * 1000_f64.powf(nth as f64 / DEPTHS as f64);
    let is_shared = |camera: &Camera, pixel: &Point2<f64>| {
        let Some(ray) = camera.ray(pixel) else {
            return false;
        };
        (0..DEPTHS).any(|nth| {
            let point = ray.origin + depth(nth) * *ray.direction;
            let mut others = cameras.iter().filter(|other| other.name != camera.name);
            others.any(|other| sees(other, &point))
        })
    };
    let shares = |camera: &Camera| {
        let [width, height] = camera.intrinsics.size.map(f64::from);
        let at = |nth: usize| (nth as f64 + 0.5) / STEPS as f64;
        let mut pixels = (0..STEPS * STEPS)
            .map(|cell| Point2::new(at(cell % STEPS) * width, at(cell / STEPS) * height));
        pixels.any(|pixel| is_shared(camera, &pixel))
    };
    let is_none = cameras.len() > 1 && !cameras.iter().any(shares);
    is_none.then_some(Finding::NothingShared {
        n_cameras: cameras.len(),
    })
}

fn sees(camera: &Camera, point: &Point3<f64>) -> bool {
    let [width, height] = camera.intrinsics.size.map(f64::from);
    let pixel = camera.project(point);
    pixel.is_some_and(|p| (-0.5..width).contains(&p.x) && (-0.5..height).contains(&p.y))
}
