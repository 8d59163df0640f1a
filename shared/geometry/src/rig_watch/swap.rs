//! Whether the footage of two cameras was exchanged, from what the cameras see of a person.

use nalgebra::{Matrix3, Point2, Point3, UnitVector3, Vector3};

use super::median;
use crate::{Framing, Ray};

/// Frames that are looked at: footage is exchanged from the beginning, or not at all.
const MOST_FRAMES: usize = 60;
/// Frames without which nothing is said.
const LEAST_FRAMES: usize = 12;
/// Points of a frame without which it says nothing.
const LEAST_POINTS: usize = 5;
/// Where more cameras are, nobody tries whether a view has named left and right wrongly: it would take too long.
const MOST_TO_TURN: usize = 8;
/// Two cameras were exchanged if rays miss each other by at least so many degrees as it is, by at most so many if the
/// two are exchanged, and by so much less than as it is; which two is sure if it is by so much less than with others.
const LEAST_DEGREES: f64 = 0.75;
const MOST_DEGREES: f64 = 1.5;
const FACTOR: f64 = 2.5;
const AHEAD: f64 = 1.5;
/// Rays to the same part that miss each other by more: what the cameras see is not one person where the rig says.
const CONTRADICTION_DEGREES: f64 = 2.5;

/// Tries, frame by frame, what rays of the cameras say if the footage of two of them is exchanged.
///
/// Of every point the rays of all views are brought to the point in space that is nearest to them; the angle between
/// a ray and the way to that point counts, and of a frame the median over views and points. Every two cameras are
/// tried: those whose exchange takes that angle from far above what detections are off by to what is usual were
/// exchanged. Left and right may be named wrongly by any view.
#[derive(Debug, Clone)]
pub struct SwapWatch {
    framings: Vec<Framing>,
    /// The point on the other side of the body.
    mirror: Option<Vec<usize>>,
    /// By pair of views: of every frame the angle as it is, and with the two exchanged, degrees.
    tried: Vec<([usize; 2], Vec<[f64; 2]>)>,
    /// Of every frame the angle as it is, degrees.
    as_it_is: Vec<f64>,
}

/// Cameras that do not see one person where the rig says, whatever the reason.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contradiction {
    /// By how much rays to the same part miss each other, degrees: the median.
    pub degrees: f64,
    /// What is usual at most, degrees.
    pub usual_degrees: f64,
    /// The two views whose exchange fits best, if it fits better than what is.
    pub likely: Option<[usize; 2]>,
}

/// Two cameras whose footage was exchanged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Swap {
    /// The two views.
    pub views: [usize; 2],
    /// By how much rays miss each other as it is, degrees.
    pub degrees: f64,
    /// The same with the two exchanged.
    pub exchanged_degrees: f64,
    /// Whether it is these two. Of three cameras in equal distances around people, any two say almost the same.
    pub is_sure: bool,
}

impl SwapWatch {
    /// Begins to watch.
    ///
    /// * `framings`: of the views.
    /// * `mirror`: by point, the one on the other side of the body.
    pub fn new(framings: Vec<Framing>, mirror: Option<Vec<usize>>) -> Self {
        let n = framings.len();
        let pairs = (0..n).flat_map(|a| (a + 1..n).map(move |b| [a, b]));
        Self {
            framings,
            mirror,
            tried: pairs.map(|it| (it, Vec::new())).collect(),
            as_it_is: Vec::new(),
        }
    }

    /// Takes in what the views see of one frame.
    ///
    /// * `points_px`: one entry a view, `None` where it saw nothing; the same points of the world in the same order,
    ///   pixels of the frame.
    pub fn note(&mut self, points_px: &[Option<Vec<[f64; 2]>>]) {
        let here = points_px.iter().flatten().count();
        if self.as_it_is.len() >= MOST_FRAMES || here < 2 || points_px.len() != self.framings.len()
        {
            return;
        }
        let rays = self.rays(points_px);
        let as_it_is: Vec<usize> = (0..self.framings.len()).collect();
        let Some(now) = self.miss(&rays, &as_it_is) else {
            return;
        };
        self.as_it_is.push(now);
        for nth in 0..self.tried.len() {
            let [a, b] = self.tried[nth].0;
            if points_px[a].is_none() || points_px[b].is_none() {
                continue;
            }
            let mut exchanged = as_it_is.clone();
            exchanged.swap(a, b);
            if let Some(then) = self.miss(&rays, &exchanged) {
                self.tried[nth].1.push([now, then]);
            }
        }
    }

    /// The two cameras that were exchanged.
    pub fn swap(&self) -> Option<Swap> {
        let all = self.best();
        let best = *all.first()?;
        let is_ahead = |it: &Swap| it.exchanged_degrees > AHEAD * best.exchanged_degrees;
        let is_sure = all.get(1).is_none_or(is_ahead);
        let is_swap = best.degrees >= LEAST_DEGREES
            && best.exchanged_degrees <= MOST_DEGREES
            && best.degrees >= FACTOR * best.exchanged_degrees;
        is_swap.then_some(Swap { is_sure, ..best })
    }

    /// What the cameras say together, if it cannot be: exchanged footage, the rig of other footage, other moments, or
    /// single views that all find something else.
    ///
    /// Where an exchange is not clear enough for [`Self::swap`], this still holds: frames that were turned upright for
    /// another camera show people askew, and what is found in them fits no camera.
    pub fn contradiction(&self) -> Option<Contradiction> {
        let degrees = median(self.as_it_is.clone())
            .filter(|it| self.as_it_is.len() >= LEAST_FRAMES && *it > CONTRADICTION_DEGREES)?;
        let best = self.best().into_iter().next();
        let likely = best.filter(|it| it.exchanged_degrees < it.degrees);
        Some(Contradiction {
            degrees,
            usual_degrees: CONTRADICTION_DEGREES,
            likely: likely.map(|it| it.views),
        })
    }

    /// What every two cameras would say, those first that fit best if they are exchanged.
    pub(super) fn best(&self) -> Vec<Swap> {
        let told = self.tried.iter().filter(|it| it.1.len() >= LEAST_FRAMES);
        let mut all: Vec<Swap> = told
            .filter_map(|(views, frames)| {
                let of = |nth: usize| median(frames.iter().map(|it| it[nth]).collect());
                Some(Swap {
                    views: *views,
                    degrees: of(0)?,
                    exchanged_degrees: of(1)?,
                    is_sure: false,
                })
            })
            .collect();
        all.sort_by(|a, b| a.exchanged_degrees.total_cmp(&b.exchanged_degrees));
        all
    }

    /// `[view][camera][point]`: the ray of what a view saw, if its footage is that of a camera.
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

    /// Where a point of a view's frame lies in the frame that another camera would have made of the same footage.
    fn seen_by(&self, view: usize, camera: &Framing, [x, y]: [f64; 2]) -> Option<Point2<f64>> {
        let in_source = self.framings[view].source_from_output();
        let source = in_source.map(|row| row[0] * x + row[1] * y + row[2]);
        let [[a, b, e], [c, d, f]] = camera.source_from_output();
        let determinant = a * d - b * c;
        let [x, y] = [source[0] - e, source[1] - f];
        let at = Point2::new(d * x - b * y, a * y - c * x) / determinant;
        at.iter().all(|it| it.is_finite()).then_some(at)
    }

    /// By how much rays miss each other, degrees, if every view's footage is that of the camera it is given; with left
    /// and right as they fit best.
    fn miss(&self, rays: &[Vec<Vec<Option<Ray>>>], camera_of: &[usize]) -> Option<f64> {
        let mut is_turned = vec![false; rays.len()];
        let mut best = self.miss_turned(rays, camera_of, &is_turned)?;
        if self.mirror.is_none() || rays.len() > MOST_TO_TURN {
            return Some(best);
        }
        // Nothing is changed by turning all, so that the first stays.
        for view in 1..rays.len() {
            is_turned[view] = true;
            let turned = self.miss_turned(rays, camera_of, &is_turned);
            match turned.filter(|it| *it < best) {
                Some(less) => best = less,
                None => is_turned[view] = false,
            }
        }
        Some(best)
    }

    fn miss_turned(
        &self,
        rays: &[Vec<Vec<Option<Ray>>>],
        camera_of: &[usize],
        is_turned: &[bool],
    ) -> Option<f64> {
        let n_points = rays.iter().flatten().map(Vec::len).max()?;
        let mut angles = Vec::new();
        let mut n_told = 0;
        for point in 0..n_points {
            let other = self.mirror.as_ref().and_then(|it| it.get(point));
            let of_view = |view: usize| {
                let other = other.copied().filter(|_| is_turned[view]);
                let it = rays[view][camera_of[view]].get(other.unwrap_or(point))?;
                it.as_ref()
            };
            let seen: Vec<&Ray> = (0..rays.len()).filter_map(of_view).collect();
            let Some(at) = nearest(&seen) else { continue };
            n_told += 1;
            let off = seen.iter().map(|it| off_degrees(it, &at));
            angles.extend(off.filter(|it| it.is_finite()));
        }
        median(angles).filter(|_| n_told >= LEAST_POINTS)
    }
}

/// The point nearest to rays, least squares; `None` of fewer than two, and of parallel ones.
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

/// The angle between a ray and the way to a point, degrees.
fn off_degrees(ray: &Ray, at: &Point3<f64>) -> f64 {
    ray.direction.angle(&(at - ray.origin)).to_degrees()
}
