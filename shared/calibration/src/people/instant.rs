//! One person at one instant: joints in space, and their positions in the cameras.

use geometry::{Camera, Observation, Settings, triangulate};
use nalgebra::{Point2, Point3, Vector2, Vector3};

use super::sightings::Sight;

/// Number of standard deviations beyond which residuals are down-weighted.
pub(super) const WIDTH: f64 = 2.0;
/// Minimum angle between rays, in radians; a smaller angle does not determine the depth.
const LEAST_ANGLE: f64 = 0.02;

/// A joint that a camera sees.
#[derive(Debug, Clone)]
pub(super) struct Seen {
    pub(super) camera: usize,
    /// Index of the point in the instant.
    pub(super) point: usize,
    pub(super) at: Point2<f64>,
    pub(super) speed: Vector2<f64>,
    pub(super) sigma_px: f64,
}

/// One person at one instant.
#[derive(Debug, Clone)]
pub(super) struct Instant {
    /// Index of the instant.
    pub(super) nth: usize,
    /// The joint of each point.
    pub(super) joints: Vec<usize>,
    pub(super) points: Vec<Point3<f64>>,
    /// Weight of each point. It is lower for a joint that stays in one place, because its error is then always the same.
    pub(super) shares: Vec<f64>,
    pub(super) seen: Vec<Seen>,
}

impl Instant {
    pub(super) fn place(&self, joint: usize) -> Option<usize> {
        self.joints.iter().position(|known| *known == joint)
    }

    /// Returns the extent of the person.
    pub(super) fn size(&self) -> f64 {
        let extent = |axis: usize| {
            let each = self.points.iter().map(|point| point[axis]);
            let [from, to] = each.fold([f64::INFINITY, f64::NEG_INFINITY], |[from, to], it| {
                [from.min(it), to.max(it)]
            });
            to - from
        };
        Vector3::new(extent(0), extent(1), extent(2)).norm()
    }

    pub(super) fn distance(&self, a: usize, b: usize) -> Option<f64> {
        let (a, b) = (self.place(a)?, self.place(b)?);
        Some((self.points[a] - self.points[b]).norm())
    }
}

/// Triangulates those joints of an instant that at least two cameras see.
pub(super) fn instant(
    cameras: &[Camera],
    seen: &[Vec<Option<Sight>>],
    sigmas: &[Vec<f64>],
) -> Instant {
    let mut all = Instant {
        nth: 0,
        joints: Vec::new(),
        points: Vec::new(),
        shares: Vec::new(),
        seen: Vec::new(),
    };
    let n_joints = seen.first().map_or(0, Vec::len);
    let joints: Vec<usize> = (0..n_joints).collect();
    for joint in joints {
        let each = seen.iter().enumerate();
        let each: Vec<(usize, Sight)> =
            each.filter_map(|(camera, it)| Some((camera, (*it.get(joint)?)?))).collect();
        let sigma = |camera: usize, weight: f64| sigmas[camera][joint] / weight.sqrt();
        let observations: Vec<Observation<'_>> = each
            .iter()
            .map(|(camera, it)| Observation {
                camera: &cameras[*camera],
                point_px: it.at,
                sigma_px: sigma(*camera, it.weight),
            })
            .collect();
        let Some(point) = place(&observations) else {
            continue;
        };
        let nth = all.points.len();
        all.joints.push(joint);
        all.points.push(point);
        all.shares.push(1.0);
        all.seen.extend(each.iter().map(|(camera, it)| Seen {
            camera: *camera,
            point: nth,
            at: it.at,
            speed: it.speed,
            sigma_px: sigma(*camera, it.weight),
        }));
    }
    all
}

/// Returns a point from robust triangulation.
pub(crate) fn place(observations: &[Observation<'_>]) -> Option<Point3<f64>> {
    let sigma = observations.first()?.sigma_px;
    let settings = Settings {
        loss_px: WIDTH * sigma,
        max_reprojection_px: None,
        min_views: 2,
        min_angle: LEAST_ANGLE,
    };
    Some(triangulate(observations, &settings).ok()?.in_world)
}
