//! One joint as seen by a view: a ray, and how far the joint may be from it.

use geometry::{Camera, Sightline};
use nalgebra::{Matrix3, Point2, Point3, Vector3};

use crate::{Detection, Keypoint, N};

/// Minimum standard deviation of a view's joints in space, even where the picture is sharp, in metres.
const FLOOR_M: f64 = 0.03;
/// Smallest sine of the angle between two rays (3 degrees) at which the distance of the joint can be computed from them.
const LEAST_SINE: f64 = 0.05;

/// A joint as seen by a view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Sight {
    pub(crate) origin: Point3<f64>,
    /// Direction of the ray, a unit vector.
    pub(crate) direction: Vector3<f64>,
    /// Standard deviation across the ray, in metres per metre of distance.
    pub(crate) spread: f64,
    /// Confidence of the detector, 0 to 1.
    pub(crate) heat: f64,
}

impl Sight {
    /// Creates the ray of a keypoint; `None` if the lens model has no ray there.
    pub(crate) fn new(camera: &Camera, keypoint: &Keypoint) -> Option<Self> {
        let usable = keypoint.sd_px.is_finite() && keypoint.sd_px > 0.0 && keypoint.heat > 0.0;
        let ray = camera.ray(&Point2::from(keypoint.at_px)).filter(|_| usable)?;
        let focal = (camera.intrinsics.fx * camera.intrinsics.fy).sqrt();
        Some(Self {
            origin: ray.origin,
            direction: ray.direction.into_inner(),
            spread: keypoint.sd_px / focal,
            heat: keypoint.heat.min(1.0),
        })
    }

    /// Returns the distance of a point from the ray, in metres; infinite behind the camera.
    pub(crate) fn distance(&self, point: &Point3<f64>) -> f64 {
        let offset = point - self.origin;
        let along = offset.dot(&self.direction);
        if along <= 0.0 {
            return f64::INFINITY;
        }
        (offset.norm_squared() - along * along).max(0.0).sqrt()
    }

    /// Returns the standard deviation of the ray at the distance of a point, as stated by the detector, in metres.
    pub(crate) fn stated(&self, point: &Point3<f64>) -> f64 {
        self.spread * (point - self.origin).norm()
    }

    /// Returns the standard deviation of the ray at the distance of a point, in metres. It is at least the minimum that applies even where
    /// the picture is sharp.
    pub(crate) fn sd(&self, point: &Point3<f64>) -> f64 {
        let stated = self.stated(point);
        #[expect(
            clippy::imprecise_flops,
            reason = "`hypot` is slow, and metres do not overflow"
        )]
        (FLOOR_M * FLOOR_M + stated * stated).sqrt()
    }

    /// Returns the distance of a point from the ray, in standard deviations.
    pub(crate) fn deviations(&self, point: &Point3<f64>) -> f64 {
        self.distance(point) / self.sd(point)
    }

    /// Returns the point of the ray that is nearest to a given point.
    pub(crate) fn nearest(&self, point: &Point3<f64>) -> Point3<f64> {
        let along = (point - self.origin).dot(&self.direction);
        self.origin + self.direction * along.max(0.0)
    }

    /// Returns the contribution of the ray to the normal equations of the joint: the inverse covariance across the ray.
    pub(crate) fn information(&self, point: &Point3<f64>) -> Matrix3<f64> {
        let across = Matrix3::identity() - self.direction * self.direction.transpose();
        across / self.sd(point).powi(2)
    }
}

/// The joints of a detection as seen by a view.
pub(crate) type Sights = [Option<Sight>; N];

/// Converts the joints of a detection to rays.
pub(crate) fn sights(camera: &Camera, detection: &Detection) -> Sights {
    core::array::from_fn(|joint| Sight::new(camera, detection.joints[joint].as_ref()?))
}

/// The closest approach of two rays.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Passing {
    /// Midpoint between the two rays.
    pub(crate) point: Point3<f64>,
    /// Distance between the rays, in metres.
    pub(crate) gap: f64,
}

/// Returns the closest approach of two rays; `None` if they are parallel or meet behind a camera.
pub(crate) fn passing(a: &Sight, b: &Sight) -> Option<Passing> {
    let between = b.origin - a.origin;
    let cosine = a.direction.dot(&b.direction);
    let sine_squared = 1.0 - cosine * cosine;
    if sine_squared < LEAST_SINE * LEAST_SINE {
        return None;
    }
    let (on_a, on_b) = (between.dot(&a.direction), between.dot(&b.direction));
    let along_a = (on_a - cosine * on_b) / sine_squared;
    let along_b = (cosine * on_a - on_b) / sine_squared;
    if along_a <= 0.0 || along_b <= 0.0 {
        return None;
    }
    let ends = [
        a.origin + a.direction * along_a,
        b.origin + b.direction * along_b,
    ];
    Some(Passing {
        point: nalgebra::center(&ends[0], &ends[1]),
        gap: (ends[0] - ends[1]).norm(),
    })
}

/// A joint triangulated from rays.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Met {
    pub(crate) point: Point3<f64>,
    pub(crate) covariance: Matrix3<f64>,
    /// Number of rays that agree.
    pub(crate) n: usize,
}

/// Rays farther from the joint than this many standard deviations are ignored.
const OUTLYING: f64 = 3.0;
/// Maximum number of rays whose pairs propose a position. Each position is compared with all rays, so without this limit, the time would
/// grow with the cube of the number of views.
pub(crate) const MOST_PROPOSING: usize = 6;

/// Triangulates the joint on which most of the rays agree, each weighted by its deviation and heat.
///
/// Each pair of rays proposes a position; of many rays, only the pairs of those that cross at the widest angles. The position with the most
/// support from all rays is chosen, and then moved to minimise the squared distances to the rays that agree with it.
///
/// * `sights`: one for each view.
/// * Returns `None` if no two rays agree.
pub(crate) fn meet(sights: &[Sight]) -> Option<Met> {
    let mut best: Option<(f64, Point3<f64>)> = None;
    let lines = sights.iter().map(|sight| Sightline {
        direction: sight.direction,
        weight: sight.heat,
    });
    let lines: Vec<Sightline> = lines.collect();
    let proposing = geometry::widest_apart(&lines, MOST_PROPOSING);
    for (nth, a) in proposing.iter().enumerate() {
        for b in &proposing[nth + 1..] {
            let Some(it) = passing(&sights[*a], &sights[*b]) else {
                continue;
            };
            let support = |sight: &Sight| sight.heat * agreement(sight.deviations(&it.point));
            let score: f64 = sights.iter().map(support).sum();
            if best.is_none_or(|best| score > best.0) {
                best = Some((score, it.point));
            }
        }
    }
    let start = best?.1;
    let near: Vec<Sight> = sights
        .iter()
        .filter(|sight| sight.deviations(&start) < OUTLYING)
        .copied()
        .collect();
    if near.len() < 2 {
        return None;
    }
    let met = settle(&near, &start, None)?;
    Some(Met {
        n: near.len(),
        ..met
    })
}

/// A ray farther away than this many standard deviations gives no support; its Gaussian is below a hundred-thousandth.
const NO_AGREEMENT: f64 = 5.0;

/// Returns the support, from 0 to 1, that a ray gives to a position at a distance of this many standard deviations.
pub(crate) fn agreement(deviations: f64) -> f64 {
    if deviations > NO_AGREEMENT {
        return 0.0;
    }
    (-0.5 * deviations * deviations).exp()
}

/// The expected position of a joint before the current frame is evaluated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Prior {
    pub(crate) point: Point3<f64>,
    /// Standard deviation of the position, in metres.
    pub(crate) sd: f64,
}

/// Returns the position that minimises the squared distances to the rays, weighted by their heats, and to the prior.
pub(crate) fn settle(sights: &[Sight], start: &Point3<f64>, prior: Option<Prior>) -> Option<Met> {
    let (mut normal, mut target) = (Matrix3::zeros(), Vector3::zeros());
    for sight in sights {
        let information = sight.information(start) * sight.heat;
        normal += information;
        target += information * (sight.origin - start);
    }
    if let Some(prior) = prior {
        let information = 1.0 / (prior.sd * prior.sd);
        normal += Matrix3::from_diagonal_element(information);
        target += (prior.point - start) * information;
    }
    let factor = normal.cholesky()?;
    let point = start + factor.solve(&target);
    let covariance = factor.inverse();
    let is_finite = point.iter().chain(covariance.iter()).all(|entry| entry.is_finite());
    is_finite.then_some(Met {
        point,
        covariance,
        n: sights.len(),
    })
}
