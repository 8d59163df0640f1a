//! Detects cameras that were moved after calibration, from the points of a person seen by several cameras.

mod swap;

#[cfg(test)]
mod tests;

use std::collections::VecDeque;

use nalgebra::{Point2, Point3};
use statistics::Sorted;

use crate::{Camera, Ray};

pub use swap::{Contradiction, Swap, SwapWatch};

/// Number of frames of the running median.
const WINDOW: usize = 60;
/// Minimum number of frames for a result.
const MIN_FRAMES: usize = 12;
/// Number of successive usable frames in which a camera must be suspected of having moved before it is reported.
const PERSISTENT: u32 = 8;
/// Minimum number of points of a usable frame.
const MIN_POINTS: usize = 5;
/// Minimum sine of the angle between two rays; below it, their intersection is too uncertain.
const MIN_SINE: f64 = 0.2;
/// A camera is suspected if the residual of the camera groups that contain it is at least this many times the residual of the groups
/// without it. The residual must also reach limits in degrees and pixels. Detections are on a grid of cells of four pixels, and may always
/// be off by half a cell in the same direction.
const FACTOR: f64 = 2.5;
const MIN_DEGREES: f64 = 0.5;
const MIN_PX: f64 = 4.0;
/// A camera can be suspected only if the residual of the other cameras is at most this.
const MAX_DEGREES: f64 = 1.5;

/// Tracks the residuals of the same points in all cameras, with and without each camera.
///
/// With four or more cameras, a point is triangulated from the rays of each pair of other cameras, and projected into the camera. The
/// offset of the camera's own observation from this projection is measured. Two medians are taken: over the points of a frame, in x and in
/// y; then over the last frames of each group of three cameras, as a vector. The residual of the group is the length of this vector: errors
/// of detections change direction and cancel out, but the offset of a moved camera does not. The residual of a camera is the median over
/// all groups that contain it. A single moved camera only affects the groups that contain it.
///
/// With three cameras, the epipolar distance to the ray of one other camera is used instead, without its direction, because the two
/// remaining cameras may agree by chance. This hardly detects a camera that is rotated along its epipolar lines. With two cameras, it is
/// impossible to decide which one is wrong.
///
/// This is not a calibration: it detects that a camera was moved, but does not determine the new pose.
#[derive(Debug, Clone)]
pub struct RigWatch {
    cameras: Vec<Camera>,
    groups: Vec<Group>,
    /// Number of successive usable frames in which each camera was suspected.
    streaks: Vec<u32>,
    /// True for each camera that was ever reported.
    reported: Vec<bool>,
}

/// A group of cameras, and their residuals on the same points.
#[derive(Debug, Clone)]
struct Group {
    /// The camera into which points are projected, then the two other cameras; if there is only one other, it is listed twice.
    views: [usize; 3],
    /// Median offset of the observed from the predicted points in each of the last frames, in pixels.
    offsets_px: VecDeque<[f64; 2]>,
}

/// A camera whose pose differs from the calibration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Suspect {
    /// Index of the camera.
    pub view: usize,
    /// Residual of the camera groups that contain this camera, in pixels.
    pub residual_px: f64,
    /// Residual of the camera groups that do not contain this camera, in pixels.
    pub without_px: f64,
}

impl RigWatch {
    /// Creates a watch without observations.
    pub fn new(cameras: Vec<Camera>) -> Self {
        let n = cameras.len();
        let counts = |[view, a, b]: &[usize; 3]| {
            let is_new = if n > 3 { a < b } else { n == 3 && a == b };
            is_new && view != a && view != b
        };
        let all = (0..n).flat_map(|view| (0..n * n).map(move |pair| [view, pair / n, pair % n]));
        let groups = all.filter(counts).map(|views| Group {
            views,
            offsets_px: VecDeque::new(),
        });
        Self {
            groups: groups.collect(),
            streaks: vec![0; n],
            reported: vec![false; n],
            cameras,
        }
    }

    /// Adds the observations of one frame.
    ///
    /// * `points_px`: one entry per camera, `None` without a detection. All cameras list the same points of the world in the same order, in
    ///   pixels of the recorded image.
    pub fn note(&mut self, points_px: &[Option<Vec<[f64; 2]>>]) {
        let views = self.cameras.iter().zip(points_px);
        let observe =
            |(camera, points): (&Camera, &Option<Vec<[f64; 2]>>)| -> Vec<Option<ObservedPoint>> {
                let points = points.iter().flatten();
                points.map(|px| ObservedPoint::new(camera, *px)).collect()
            };
        let observed: Vec<Vec<Option<ObservedPoint>>> = views.map(observe).collect();
        let mut is_usable = false;
        for group in &mut self.groups {
            let [Some(own), Some(a), Some(b)] = group.views.map(|view| observed.get(view)) else {
                continue;
            };
            let camera = &self.cameras[group.views[0]];
            let is_one = group.views[1] == group.views[2];
            let points = own.iter().zip(a).zip(b);
            let offsets_px = points.filter_map(|((own, a), b)| {
                let (own, a, b) = (own.as_ref()?, a.as_ref()?, b.as_ref()?);
                if is_one {
                    let offset = own.offset_from_ray(camera, &a.ray)?;
                    Some([offset[0].hypot(offset[1]), 0.0])
                } else {
                    own.offset_from_meeting_point(camera, &a.ray, &b.ray)
                }
            });
            let offsets_px: Vec<[f64; 2]> = offsets_px.collect();
            is_usable |= group.note(&offsets_px);
        }
        if is_usable {
            self.update_streaks();
        }
    }

    /// Updates the number of frames in which each camera was suspected, and reports cameras.
    fn update_streaks(&mut self) {
        let suspects = self.suspects();
        for (view, streak) in self.streaks.iter_mut().enumerate() {
            let is_suspect = suspects.iter().any(|suspect| suspect.view == view);
            *streak = if is_suspect { *streak + 1 } else { 0 };
            self.reported[view] |= *streak >= PERSISTENT;
        }
    }

    /// Returns true if a camera was ever suspected for several successive usable frames.
    pub fn is_reported(&self, view: usize) -> bool {
        self.reported.get(view).copied().unwrap_or(false)
    }

    /// Returns the residual of the camera groups that contain a camera, in pixels; `None` while there are too few observations.
    pub fn residual_px(&self, view: usize) -> Option<f64> {
        self.median_residual(|group| group.views.contains(&view))
    }

    /// Returns the residual of the camera groups that do not contain a camera, in pixels.
    pub fn without_px(&self, view: usize) -> Option<f64> {
        self.median_residual(|group| !group.views.contains(&view))
    }

    /// Returns the median over some groups.
    fn median_residual(&self, counts: impl Fn(&Group) -> bool) -> Option<f64> {
        let groups = self.groups.iter().filter(|group| counts(group));
        median(groups.filter_map(Group::residual).collect())
    }

    /// Returns the cameras whose poses differ from the calibration.
    ///
    /// Cameras are found one at a time: the first is the one without which the others agree best. A moved camera affects the residuals of
    /// the others, so a second one is searched for only among the remaining cameras. At least four cameras must remain.
    pub fn suspects(&self) -> Vec<Suspect> {
        let mut left_out = Vec::new();
        let mut found = Vec::new();
        while let Some(suspect) = self.worst(&left_out) {
            left_out.push(suspect.view);
            found.push(suspect);
            if self.cameras.len() < 4 + left_out.len() {
                break;
            }
        }
        found
    }

    /// Returns the camera without which the others agree best, if it has moved. Cameras in `left_out` are ignored.
    fn worst(&self, left_out: &[usize]) -> Option<Suspect> {
        let views = (0..self.cameras.len()).filter(|view| !left_out.contains(view));
        let suspects = views.filter_map(|view| self.suspect(view, left_out));
        let gain = |suspect: &Suspect| suspect.residual_px / suspect.without_px.max(1e-9);
        suspects.max_by(|a, b| gain(a).total_cmp(&gain(b)))
    }

    fn suspect(&self, view: usize, left_out: &[usize]) -> Option<Suspect> {
        let counts = |group: &Group| !left_out.iter().any(|out| group.views.contains(out));
        let residual_px =
            self.median_residual(|group| counts(group) && group.views.contains(&view))?;
        let without_px =
            self.median_residual(|group| counts(group) && !group.views.contains(&view))?;
        let intrinsics = &self.cameras[view].intrinsics;
        let focal = intrinsics.fx.min(intrinsics.fy).abs();
        let px = |degrees: f64| focal * degrees.to_radians().tan();
        let min_px = px(MIN_DEGREES).max(MIN_PX);
        let is_wrong =
            residual_px > min_px.max(FACTOR * without_px) && without_px < px(MAX_DEGREES);
        is_wrong.then_some(Suspect {
            view,
            residual_px,
            without_px,
        })
    }
}

impl Group {
    /// Adds the offsets of one frame. Returns true if there were enough of them.
    fn note(&mut self, offsets_px: &[[f64; 2]]) -> bool {
        if offsets_px.len() < MIN_POINTS {
            return false;
        }
        self.offsets_px.extend(median_offset(offsets_px));
        if self.offsets_px.len() > WINDOW {
            self.offsets_px.pop_front();
        }
        true
    }

    fn residual(&self) -> Option<f64> {
        let frames: Vec<_> = self.offsets_px.iter().copied().collect();
        let offset = median_offset(&frames).filter(|_| frames.len() >= MIN_FRAMES)?;
        Some(offset[0].hypot(offset[1]))
    }
}

/// A point observed by a camera.
#[derive(Debug, Clone, Copy)]
struct ObservedPoint {
    at_px: Point2<f64>,
    ray: Ray,
}

impl ObservedPoint {
    fn new(camera: &Camera, at: [f64; 2]) -> Option<Self> {
        let at_px = Point2::from(at);
        let ray = camera.ray(&at_px)?;
        Some(Self { at_px, ray })
    }

    /// Returns the offset of the observation from the projection of the intersection of two rays, in pixels.
    fn offset_from_meeting_point(&self, camera: &Camera, a: &Ray, b: &Ray) -> Option<[f64; 2]> {
        let [on_a, on_b] = closest(a, b)?;
        self.offset_from_point(camera, &nalgebra::center(&on_a, &on_b))
    }

    /// Returns the offset of the observation from the projection of the closest point on another ray, in pixels.
    fn offset_from_ray(&self, camera: &Camera, ray: &Ray) -> Option<[f64; 2]> {
        let [on_ray, _] = closest(ray, &self.ray)?;
        self.offset_from_point(camera, &on_ray)
    }

    fn offset_from_point(&self, camera: &Camera, in_world: &Point3<f64>) -> Option<[f64; 2]> {
        let offset = self.at_px - camera.project(in_world)?;
        let is_finite = offset.iter().all(|value| value.is_finite());
        is_finite.then_some([offset.x, offset.y])
    }
}

/// Returns the closest points of two rays, one on each; `None` if the rays are almost parallel, or if a point is behind its camera.
fn closest(a: &Ray, b: &Ray) -> Option<[Point3<f64>; 2]> {
    let across = a.direction.cross(&b.direction);
    let squared_sine = across.norm_squared();
    if squared_sine.is_nan() || squared_sine < MIN_SINE.powi(2) {
        return None;
    }
    let between = b.origin - a.origin;
    let along = |other: &Ray| between.cross(&other.direction).dot(&across) / squared_sine;
    let (along_a, along_b) = (along(b), along(a));
    let is_ahead = along_a > 0.0 && along_b > 0.0;
    is_ahead.then(|| {
        [
            a.origin + along_a * *a.direction,
            b.origin + along_b * *b.direction,
        ]
    })
}

/// Returns the medians in x and in y; `None` for an empty list.
fn median_offset(all: &[[f64; 2]]) -> Option<[f64; 2]> {
    let along = |axis: usize| median(all.iter().map(|offset| offset[axis]).collect());
    Some([along(0)?, along(1)?])
}

/// Returns the lower median; `None` for an empty list.
pub(crate) fn median(all: Vec<f64>) -> Option<f64> {
    Sorted::new(all).lower_median()
}
