//! Image of a viewing ray in another, distorted view.

use nalgebra::{Point2, Vector2, Vector3};

use crate::Camera;

/// Number of samples of the scan for the visible part.
const SCAN: usize = 512;

/// Returns the curve in the recorded image of B that contains the point seen at a pixel of A.
///
/// The curve follows the viewing ray of A from its camera to infinity, as distorted by the lens of B and clipped to the image of B. It is
/// meant for drawing; distances are better measured on ideal pixels ([`super::epipolar_line`]).
///
/// * `point_in_a`: pixel of the recorded image of A.
/// * Returns `n` pixels in order along the ray. The list is empty if no part of the ray is in the image of B, or if `n` < 2.
pub fn epipolar_curve(
    a: &Camera,
    b: &Camera,
    point_in_a: &Point2<f64>,
    n: usize,
) -> Vec<Point2<f64>> {
    let Some((near, far)) = visible_line(a, b, point_in_a) else {
        return Vec::new();
    };
    if n < 2 {
        return Vec::new();
    }
    let at = |s: f64| {
        b.intrinsics
            .lens
            .distort(&(near + (far - near) * s))
            .map(|p| b.intrinsics.pixel(&p))
    };
    let seen = |s: f64| at(s).is_some_and(|pixel| inside(b, &pixel));
    let grid = |i: usize| i as f64 / (SCAN - 1) as f64;
    let Some((first, last)) = longest_run(|i| seen(grid(i))) else {
        return Vec::new();
    };
    let start = if first == 0 {
        0.0
    } else {
        border(seen, grid(first), grid(first - 1))
    };
    let end = if last + 1 == SCAN {
        1.0
    } else {
        border(seen, grid(last), grid(last + 1))
    };
    (0..n)
        .filter_map(|i| at(start + (end - start) * i as f64 / (n - 1) as f64))
        .collect()
}

/// Returns the part of the ray that the lens of B can show, as a segment of B's normalised plane.
fn visible_line(a: &Camera, b: &Camera, point: &Point2<f64>) -> Option<(Point2<f64>, Point2<f64>)> {
    let ray = a.ray(point)?;
    let origin = (b.camera_from_world * ray.origin).coords;
    if origin.norm() < super::SAME_PLACE {
        return None;
    }
    let direction = b.camera_from_world.rotation * ray.direction.into_inner();
    // A point of the ray is `origin + d direction`, d in [0, ∞). As s goes from 0 to 1, the homogeneous point (1 - s) origin + s direction
    // covers all of its images.
    let at = |s: f64| origin * (1.0 - s) + direction * s;
    let (z0, z1) = (origin.z, direction.z);
    let crossing = z0 / (z0 - z1);
    let (low, high) = match (z0 > 0.0, z1 > 0.0) {
        (true, true) => (0.0, 1.0),
        (true, false) => (0.0, crossing * (1.0 - 1e-9)),
        (false, true) => (crossing + (1.0 - crossing) * 1e-9, 1.0),
        (false, false) => return None,
    };
    clip_to_disc(
        normalised(&at(low))?,
        normalised(&at(high))?,
        image_radius(b),
    )
}

fn normalised(v: &Vector3<f64>) -> Option<Vector2<f64>> {
    Point2::from_homogeneous(*v)
        .map(|p| p.coords)
        .filter(|p| p.iter().all(|c| c.is_finite()))
}

/// Returns the radius of a circle in the normalised plane that contains every ray of the image.
fn image_radius(camera: &Camera) -> f64 {
    let [width, height] = camera.intrinsics.size.map(f64::from);
    let limit = camera.intrinsics.lens.max_radius();
    let corners = [(0.0, 0.0), (width, 0.0), (0.0, height), (width, height)];
    corners.iter().fold(0.0, |radius: f64, &(u, v)| {
        let corner = camera.undistort(&Point2::new(u, v));
        radius.max(corner.map_or(limit, |p| (p.coords.norm() * 1.2).min(limit)))
    })
}

fn clip_to_disc(
    from: Vector2<f64>,
    to: Vector2<f64>,
    radius: f64,
) -> Option<(Point2<f64>, Point2<f64>)> {
    let along = (to - from).try_normalize(1e-12)?;
    let length = (to - from).norm();
    let middle = -from.dot(&along);
    let half_squared = radius * radius - (from + along * middle).norm_squared();
    if half_squared <= 0.0 {
        return None;
    }
    let half = half_squared.sqrt();
    let (start, end) = ((middle - half).max(0.0), (middle + half).min(length));
    let at = |t: f64| Point2::from(from + along * t);
    (start < end).then(|| (at(start), at(end)))
}

fn inside(camera: &Camera, pixel: &Point2<f64>) -> bool {
    let [width, height] = camera.intrinsics.size.map(f64::from);
    (-0.5..=width - 0.5).contains(&pixel.x) && (-0.5..=height - 0.5).contains(&pixel.y)
}

/// Returns the first and last index of the longest run of the scan for which `holds` is true.
fn longest_run(holds: impl Fn(usize) -> bool) -> Option<(usize, usize)> {
    let mut best: Option<(usize, usize)> = None;
    let mut begin = None;
    for i in 0..=SCAN {
        if i < SCAN && holds(i) {
            begin.get_or_insert(i);
        } else if let Some(first) = begin.take() {
            let longer = best.is_none_or(|(f, l)| i - 1 - first > l - f);
            best = if longer { Some((first, i - 1)) } else { best };
        }
    }
    best
}

/// Returns the last parameter, from `inside` towards `outside`, for which the point is seen.
fn border(seen: impl Fn(f64) -> bool, mut inside: f64, mut outside: f64) -> f64 {
    for _ in 0..40 {
        let middle = 0.5 * (inside + outside);
        if seen(middle) {
            inside = middle;
        } else {
            outside = middle;
        }
    }
    inside
}
