//! Detects cameras whose pictures were taken at different times than stated, from the points of a moving person.

mod block;

use std::collections::VecDeque;

use nalgebra::{Point2, Vector2};

use crate::Camera;
use crate::extent::longer_side;
use block::{Block, Estimate};

/// Number of frames from which one estimate is computed, and number of estimates to store.
const N_BLOCK: usize = 60;
const N_KEPT: usize = 12;
/// Minimum number of estimates for a result.
const MIN_BLOCKS: usize = 5;
/// Offset above which a camera is out of step. The offset must exceed this limit by a number of standard errors.
pub const OUT_OF_STEP_MS: f64 = 5.0;
const N_ERRORS: f64 = 3.0;
/// Minimum standard error, in seconds.
const MIN_ERROR_S: f64 = 0.001;
/// Minimum number of points of a usable pair of views.
const MIN_POINTS: usize = 5;
/// Maximum time between the previous and the next picture that give a speed, in seconds.
const LONGEST_GAP_S: f64 = 0.35;
/// Maximum speed of a point, per second, relative to the longer side of the rectangle around the person; a faster point is taken for a
/// different one.
const MOST_SPEED: f64 = 9.0;
/// Maximum distance of a point from the epipolar line, relative to the longer side of the rectangle around the person. A point further away
/// is taken for a different one.
const MOST_MISS: f64 = 0.2;

/// Estimates how much later each camera took its pictures than their times state.
///
/// If camera B is late by `d`, a point that moves at `u` (pixels per second) is seen `u d` ahead. The epipolar residual is then `e = g d`
/// with `g = n . u`, where `n` is the normal of the epipolar line. The true velocities in both pictures would give the same `g`, and the
/// errors of the measured velocities are independent. The estimate `d = sum(e g) / sum(g_a g_b)` is therefore not biased towards zero. A
/// person who stands still does not affect it.
///
/// The means over the points of a frame, and over the frames of a point, are subtracted. This removes the residuals caused by a moved
/// camera: they are nearly the same for all points of a person, and for each point over some seconds, while limbs move back and forth. The
/// offsets of the single views, relative to their median, are computed from the offsets of all pairs of views. The result is the mean of
/// the last estimates, weighted by their certainty.
///
/// This is not a synchronisation. Offsets beyond 40 ms come out too large (60 ms as 69), because limbs do not move evenly for that long.
#[derive(Debug, Clone)]
pub struct StepWatch {
    cameras: Vec<Camera>,
    /// The last three frames, the newest last.
    frames: VecDeque<Frame>,
    block: Block,
    /// Estimates of the last blocks, by camera.
    estimates: Vec<VecDeque<Estimate>>,
    /// True for each camera that was ever out of step.
    reported: Vec<bool>,
}

/// Time offset of a camera relative to the median of all cameras.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Time by which the camera's pictures were taken later than stated, in milliseconds; negative if they were taken earlier.
    pub offset_ms: f64,
    /// Standard error of the offset, in milliseconds.
    pub error_ms: f64,
}

impl Step {
    /// Returns true if the offset exceeds [`OUT_OF_STEP_MS`] by several standard errors.
    pub fn is_out(&self) -> bool {
        self.offset_ms.abs() - N_ERRORS * self.error_ms > OUT_OF_STEP_MS
    }
}

/// Observations of all views in a frame.
#[derive(Debug, Clone)]
struct Frame {
    views: Vec<Option<View>>,
}

/// Observation of a view in a frame.
#[derive(Debug, Clone)]
struct View {
    /// Time of the picture in seconds. The next field is the delay of the picture after the instant of the frame.
    seconds: f64,
    skew_s: f64,
    /// Points, undistorted and normalised.
    points: Vec<Option<Point2<f64>>>,
    /// Longer side of the rectangle around the points.
    side: f64,
}

/// A point of a view, and its velocity per second.
type Moving = (Point2<f64>, Vector2<f64>);

/// A view whose previous and next pictures are known.
#[derive(Debug, Clone)]
struct Seen {
    points: Vec<Option<Moving>>,
    /// Longer side of the rectangle around the person in the picture.
    side: f64,
    skew_s: f64,
}

impl StepWatch {
    /// Creates a watch without observations.
    pub fn new(cameras: Vec<Camera>) -> Self {
        let n = cameras.len();
        Self {
            block: Block::new(&cameras),
            cameras,
            frames: VecDeque::new(),
            estimates: vec![VecDeque::new(); n],
            reported: vec![false; n],
        }
    }

    /// Adds the observations of one frame.
    ///
    /// * `instant_s`: instant of the frame, in seconds; frames must be in order.
    /// * `points_px`: one entry per camera, `None` without a detection. All cameras list the same points of the world in the same order, in
    ///   pixels of the recorded image.
    /// * `skews_s`: for each camera, the stated time from the instant of the frame to the camera's picture, in seconds.
    pub fn note(&mut self, instant_s: f64, points_px: &[Option<Vec<[f64; 2]>>], skews_s: &[f64]) {
        let views = self.cameras.iter().enumerate().map(|(nth, camera)| {
            let points = points_px.get(nth)?.as_ref()?;
            View::new(camera, points, instant_s, skews_s.get(nth).copied()?)
        });
        let views = views.collect();
        self.frames.push_back(Frame { views });
        if self.frames.len() > 3 {
            self.frames.pop_front();
        }
        let moving: Vec<Option<Seen>> = {
            let [before, now, after] = match self.frames.make_contiguous() {
                [before, now, after] => [&*before, &*now, &*after],
                _ => return,
            };
            let each = now.views.iter().enumerate().map(|(nth, view)| {
                let view = view.as_ref()?;
                let ends = [before, after].map(|end| end.views.get(nth)?.as_ref());
                let points = view.moving([ends[0]?, ends[1]?])?;
                Some(Seen {
                    points,
                    side: view.side,
                    skew_s: view.skew_s,
                })
            });
            each.collect()
        };
        self.block.add(&moving);
        if self.block.n_frames() >= N_BLOCK {
            self.close_block();
        }
    }

    /// Computes one estimate for every camera from the samples of a block.
    fn close_block(&mut self) {
        let estimates = self.block.estimates();
        self.block = Block::new(&self.cameras);
        let Some(estimates) = estimates else { return };
        for (kept, estimate) in self.estimates.iter_mut().zip(estimates) {
            kept.extend(estimate);
            if kept.len() > N_KEPT {
                kept.pop_front();
            }
        }
        for view in 0..self.cameras.len() {
            self.reported[view] |= self.step(view).is_some_and(|step| step.is_out());
        }
    }

    /// Returns the offset of a camera; `None` if there was too little movement, or if there is only one camera.
    pub fn step(&self, view: usize) -> Option<Step> {
        let kept = self.estimates.get(view)?;
        if kept.len() < MIN_BLOCKS {
            return None;
        }
        let n = kept.len() as f64;
        let weight = |estimate: &Estimate| 1.0 / estimate.variance.max(MIN_ERROR_S * MIN_ERROR_S);
        let all: f64 = kept.iter().map(weight).sum();
        let sum: f64 = kept.iter().map(|estimate| weight(estimate) * estimate.offset_s).sum();
        let offset = sum / all;
        // There are two values for the error, one from the samples and one from the scatter of the estimates. The larger is used.
        let off = |estimate: &Estimate| (weight(estimate) * (estimate.offset_s - offset)).powi(2);
        let scatter = kept.iter().map(off).sum::<f64>() * n / (n - 1.0) / (all * all);
        let error = scatter.max(1.0 / all).sqrt().max(MIN_ERROR_S);
        Some(Step {
            offset_ms: 1e3 * offset,
            error_ms: 1e3 * error,
        })
    }

    /// Returns true if a camera was ever out of step ([`Step::is_out`]).
    pub fn is_reported(&self, view: usize) -> bool {
        self.reported.get(view).copied().unwrap_or(false)
    }
}

impl View {
    fn new(camera: &Camera, points_px: &[[f64; 2]], instant_s: f64, skew_s: f64) -> Option<Self> {
        let points: Vec<Option<Point2<f64>>> =
            points_px.iter().map(|px| camera.undistort(&Point2::from(*px))).collect();
        let side = longer_side(points.iter().flatten().map(|point| [point.x, point.y]))?;
        let seconds = instant_s + skew_s;
        seconds.is_finite().then_some(Self {
            seconds,
            skew_s,
            points,
            side,
        })
    }

    /// Returns the points with their velocities, from the previous and next pictures.
    fn moving(&self, [before, after]: [&Self; 2]) -> Option<Vec<Option<Moving>>> {
        let gap = after.seconds - before.seconds;
        let is_between = before.seconds < self.seconds && self.seconds < after.seconds;
        if !is_between || gap > LONGEST_GAP_S {
            return None;
        }
        let each = self.points.iter().enumerate().map(|(nth, at)| {
            let ends = [before, after].map(|end| end.points.get(nth).copied().flatten());
            let velocity = (ends[1]? - ends[0]?) / gap;
            let is_person = velocity.norm() <= MOST_SPEED * self.side;
            Some(((*at)?, velocity)).filter(|_| is_person)
        });
        Some(each.collect())
    }
}
