//! Detects that the footage of two cameras was swapped, from the points of a person seen by the cameras.

use nalgebra::{Matrix3, Point2, Point3, UnitVector3, Vector3};

use super::median;
use crate::{Framing, Ray};

/// Maximum number of frames to examine; footage is swapped from the beginning, or not at all.
const MAX_FRAMES: usize = 60;
/// Minimum number of frames for a result.
const MIN_FRAMES: usize = 12;
/// Minimum number of points of a usable frame.
const MIN_POINTS: usize = 5;
/// Maximum number of cameras for which swapping left and right is tried. With more cameras, this would take too long.
const MAX_TO_MIRROR: usize = 8;
/// The footage of two cameras was swapped if the angular residual with the configured cameras is at least `MIN_DEGREES`. With the two
/// swapped back, the residual must be at most `MAX_DEGREES`, and smaller by the factor `FACTOR`. The pair is certain if swapping any other
/// pair gives a residual that is larger by the factor `LEAD`.
const MIN_DEGREES: f64 = 0.75;
const MAX_DEGREES: f64 = 1.5;
const FACTOR: f64 = 2.5;
const LEAD: f64 = 1.5;
/// Angular residual above which the cameras do not see one person at the position that the rig gives.
const CONTRADICTION_DEGREES: f64 = 2.5;
/// Angular residual that is reported even before [`MIN_FRAMES`] frames, because no correct detection of a person has such a large residual.
const IMPOSSIBLE_DEGREES: f64 = 5.0;

/// Computes, frame by frame, the angular residual of the rays with the footage of two cameras swapped.
///
/// For every point, the rays of all views are intersected in the least-squares sense. The residual is the angle between a ray and the
/// direction to that point; the residual of a frame is the median over views and points. Every pair of cameras is tried. Two cameras were
/// swapped if swapping them back lowers the residual from far above the usual detection error to the usual value. In addition, left and
/// right may be swapped in any view.
#[derive(Debug, Clone)]
pub struct SwapWatch {
    framings: Vec<Framing>,
    /// For each point, the corresponding point on the other side of the body.
    mirror: Option<Vec<usize>>,
    /// For each pair of views, the residuals of every frame in degrees: as configured, then with the two views swapped.
    tried: Vec<([usize; 2], Vec<[f64; 2]>)>,
    /// Residual of every frame as configured, in degrees.
    configured: Vec<f64>,
}

/// Evidence that the cameras do not see one person where the rig predicts, for any reason.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contradiction {
    /// Median angular residual of the rays to the same body part, in degrees.
    pub degrees: f64,
    /// Largest residual that is usual for a correct rig, in degrees.
    pub usual_degrees: f64,
    /// The two views that fit best when swapped, if they fit better than the configuration.
    pub likely: Option<[usize; 2]>,
}

/// Two cameras whose footage was swapped.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Swap {
    /// Indices of the two views.
    pub views: [usize; 2],
    /// Angular residual as configured, in degrees.
    pub degrees: f64,
    /// Angular residual with the two views swapped, in degrees.
    pub exchanged_degrees: f64,
    /// True if the pair is certain. With three cameras at equal angles around people, swapping any two fits almost equally well.
    pub is_sure: bool,
}

impl SwapWatch {
    /// Creates a watch without observations.
    ///
    /// * `framings`: framings of the views.
    /// * `mirror`: for each point, the corresponding point on the other side of the body.
    pub fn new(framings: Vec<Framing>, mirror: Option<Vec<usize>>) -> Self {
        let n = framings.len();
        let pairs = (0..n).flat_map(|a| (a + 1..n).map(move |b| [a, b]));
        Self {
            framings,
            mirror,
            tried: pairs.map(|pair| (pair, Vec::new())).collect(),
            configured: Vec::new(),
        }
    }

    /// Adds the observations of one frame.
    ///
    /// * `points_px`: one entry per view, `None` without a detection. All views list the same points of the world in the same order, in
    ///   pixels of the frame.
    pub fn note(&mut self, points_px: &[Option<Vec<[f64; 2]>>]) {
        let n_views = points_px.iter().flatten().count();
        if self.configured.len() >= MAX_FRAMES
            || n_views < 2
            || points_px.len() != self.framings.len()
        {
            return;
        }
        let rays = self.rays(points_px);
        let configured: Vec<usize> = (0..self.framings.len()).collect();
        let Some(before) = self.residual_degrees(&rays, &configured) else {
            return;
        };
        self.configured.push(before);
        for index in 0..self.tried.len() {
            let [a, b] = self.tried[index].0;
            if points_px[a].is_none() || points_px[b].is_none() {
                continue;
            }
            let mut exchanged = configured.clone();
            exchanged.swap(a, b);
            if let Some(after) = self.residual_degrees(&rays, &exchanged) {
                self.tried[index].1.push([before, after]);
            }
        }
    }

    /// Returns the two cameras that were swapped, if any.
    pub fn swap(&self) -> Option<Swap> {
        let all = self.best(MIN_FRAMES);
        let best = *all.first()?;
        let is_worse = |other: &Swap| other.exchanged_degrees > LEAD * best.exchanged_degrees;
        let is_sure = all.get(1).is_none_or(is_worse);
        let is_swap = best.degrees >= MIN_DEGREES
            && best.exchanged_degrees <= MAX_DEGREES
            && best.degrees >= FACTOR * best.exchanged_degrees;
        is_swap.then_some(Swap { is_sure, ..best })
    }

    /// Returns evidence that the observations contradict the rig: swapped footage, a rig that belongs to other footage, unsynchronised
    /// views, or wrong detections in every view. An impossible residual is reported from the first frame on. Swapped footage that is not
    /// clear enough for [`Self::swap`] is also reported. It can be unclear because a frame that is rotated upright for the wrong camera
    /// shows a tilted person, and the detections in it fit no camera.
    pub fn contradiction(&self) -> Option<Contradiction> {
        let least = if self.configured.len() >= MIN_FRAMES {
            CONTRADICTION_DEGREES
        } else {
            IMPOSSIBLE_DEGREES
        };
        let degrees = median(self.configured.clone()).filter(|degrees| *degrees > least)?;
        let best = self.best(1).into_iter().next();
        let likely = best.filter(|swap| swap.exchanged_degrees < swap.degrees);
        Some(Contradiction {
            degrees,
            usual_degrees: CONTRADICTION_DEGREES,
            likely: likely.map(|swap| swap.views),
        })
    }

    /// Returns all pairs with at least `n_frames` frames. The pair that fits best when swapped comes first.
    pub(super) fn best(&self, n_frames: usize) -> Vec<Swap> {
        let usable = self.tried.iter().filter(|(_, frames)| frames.len() >= n_frames);
        let mut all: Vec<Swap> = usable
            .filter_map(|(views, frames)| {
                let column = |index: usize| median(frames.iter().map(|row| row[index]).collect());
                Some(Swap {
                    views: *views,
                    degrees: column(0)?,
                    exchanged_degrees: column(1)?,
                    is_sure: false,
                })
            })
            .collect();
        all.sort_by(|a, b| a.exchanged_degrees.total_cmp(&b.exchanged_degrees));
        all
    }

    /// Returns `[view][camera][point]`: the ray of a view's observation, on the assumption that its footage was recorded by the given
    /// camera.
    fn rays(&self, points_px: &[Option<Vec<[f64; 2]>>]) -> Vec<Vec<Vec<Option<Ray>>>> {
        let of_view = |(view, points): (usize, &Option<Vec<[f64; 2]>>)| {
            let points = points.as_deref().unwrap_or_default();
            let as_seen_by = |camera: &Framing| {
                let ray = |at: &[f64; 2]| camera.camera().ray(&self.seen_by(view, camera, *at)?);
                points.iter().map(ray).collect()
            };
            self.framings.iter().map(as_seen_by).collect()
        };
        points_px.iter().enumerate().map(of_view).collect()
    }

    /// Returns the position of a point of a view's frame in the frame that another camera would have produced from the same footage.
    fn seen_by(&self, view: usize, camera: &Framing, [x, y]: [f64; 2]) -> Option<Point2<f64>> {
        let in_source = self.framings[view].source_from_output();
        let source = in_source.map(|row| row[0] * x + row[1] * y + row[2]);
        let [[a, b, e], [c, d, f]] = camera.source_from_output();
        let determinant = a * d - b * c;
        let [x, y] = [source[0] - e, source[1] - f];
        let at = Point2::new(d * x - b * y, a * y - c * x) / determinant;
        at.iter().all(|value| value.is_finite()).then_some(at)
    }

    /// Returns the angular residual in degrees on the assumption that camera `camera_of[i]` recorded the footage of view `i`, with left and
    /// right swapped where that fits better.
    fn residual_degrees(&self, rays: &[Vec<Vec<Option<Ray>>>], camera_of: &[usize]) -> Option<f64> {
        let mut is_mirrored = vec![false; rays.len()];
        let mut best = self.residual_mirrored(rays, camera_of, &is_mirrored)?;
        if self.mirror.is_none() || rays.len() > MAX_TO_MIRROR {
            return Some(best);
        }
        // Mirroring all views changes nothing, so the first one stays.
        for view in 1..rays.len() {
            is_mirrored[view] = true;
            let mirrored = self.residual_mirrored(rays, camera_of, &is_mirrored);
            match mirrored.filter(|degrees| *degrees < best) {
                Some(smaller) => best = smaller,
                None => is_mirrored[view] = false,
            }
        }
        Some(best)
    }

    fn residual_mirrored(
        &self,
        rays: &[Vec<Vec<Option<Ray>>>],
        camera_of: &[usize],
        is_mirrored: &[bool],
    ) -> Option<f64> {
        let n_points = rays.iter().flatten().map(Vec::len).max()?;
        let mut angles = Vec::new();
        let mut n_located = 0;
        for point in 0..n_points {
            let other = self.mirror.as_ref().and_then(|mirror| mirror.get(point));
            let of_view = |view: usize| {
                let other = other.copied().filter(|_| is_mirrored[view]);
                let ray = rays[view][camera_of[view]].get(other.unwrap_or(point))?;
                ray.as_ref()
            };
            let rays_to_point: Vec<&Ray> = (0..rays.len()).filter_map(of_view).collect();
            let Some(at) = nearest(&rays_to_point) else {
                continue;
            };
            n_located += 1;
            let residuals = rays_to_point.iter().map(|ray| angle_degrees(ray, &at));
            angles.extend(residuals.filter(|degrees| degrees.is_finite()));
        }
        median(angles).filter(|_| n_located >= MIN_POINTS)
    }
}

/// Returns the point nearest to the rays (least squares); `None` for fewer than two rays, or for parallel rays.
fn nearest(rays: &[&Ray]) -> Option<Point3<f64>> {
    let first = rays.first()?.origin;
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for ray in rays {
        let across = across(&ray.direction);
        normal += across;
        right += across * (ray.origin - first);
    }
    if rays.len() < 2 || normal.determinant().abs() < 1e-4 {
        return None;
    }
    Some(first + normal.try_inverse()? * right)
}

fn across(direction: &UnitVector3<f64>) -> Matrix3<f64> {
    Matrix3::identity() - direction.into_inner() * direction.transpose()
}

/// Returns the angle between a ray and the direction from its origin to a point, in degrees.
fn angle_degrees(ray: &Ray, at: &Point3<f64>) -> f64 {
    ray.direction.angle(&(at - ray.origin)).to_degrees()
}
