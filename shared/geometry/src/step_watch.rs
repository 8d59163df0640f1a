//! Detects cameras whose pictures were taken at other times than they say, from the points of a person who moves.

mod block;

use std::collections::VecDeque;

use nalgebra::{Point2, Vector2};

use crate::Camera;
use crate::extent::longer_side;
use block::{Block, Estimate};

/// Frames whose samples make one estimate, and estimates that are kept.
const N_BLOCK: usize = 60;
const N_KEPT: usize = 12;
/// The fewest estimates for a result.
const MIN_BLOCKS: usize = 5;
/// A camera is out of step if its offset is larger than this by this many standard errors.
pub const OUT_OF_STEP_MS: f64 = 5.0;
const N_ERRORS: f64 = 3.0;
/// No standard error is smaller, seconds.
const MIN_ERROR_S: f64 = 0.001;
/// The fewest points of a usable pair of views.
const MIN_POINTS: usize = 5;
/// Pictures before and after one that are further apart say nothing of the speed, seconds.
const LONGEST_GAP_S: f64 = 0.35;
/// A point that is faster is another one: longer sides of the person per second.
const MOST_SPEED: f64 = 9.0;
/// A point that misses the epipolar line by more is another one, share of the longer side of the person in the picture.
const MOST_MISS: f64 = 0.2;

/// Estimates by how much later every camera took its pictures than their times say.
///
/// Where camera B is late by `d`, a point that moves at `u` (pixels per second) is seen `u d` ahead, so that the epipolar
/// residual is `e = g d` with `g = n . u`, `n` the normal of the epipolar line. With the true motion, the velocities in both
/// pictures give the same `g`, but their errors are independent: `d = sum(e g) / sum(g_a g_b)` is not drawn to zero by them, and
/// tells nothing of a person who stands. The means over the points of a frame, and over the frames of a point, are subtracted: what a
/// camera that was moved adds is nearly the same for the whole person, and for some seconds for each point, while limbs move to and
/// fro. The offsets of all pairs of views give those of the views, against their median; the mean of the last such estimates, by
/// their certainty, is the result.
///
/// Not a synchronisation: beyond 40 ms, offsets come out too large (60 ms as 69), because limbs do not move evenly for so long.
#[derive(Debug, Clone)]
pub struct StepWatch {
    cameras: Vec<Camera>,
    /// The last three frames, the newest last.
    frames: VecDeque<Frame>,
    block: Block,
    /// By camera: the estimates of the last blocks.
    estimates: Vec<VecDeque<Estimate>>,
    /// By camera: whether it was ever out of step.
    reported: Vec<bool>,
}

/// The offset of a camera against the median of all.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// How much later its pictures were taken than their times say, milliseconds; negative for earlier.
    pub offset_ms: f64,
    /// Standard error of that, milliseconds.
    pub error_ms: f64,
}

impl Step {
    /// Returns true if the offset exceeds [`OUT_OF_STEP_MS`] beyond doubt.
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
    /// When, seconds; and how long after the instant of the frame.
    seconds: f64,
    skew_s: f64,
    /// Undistorted and normalised.
    points: Vec<Option<Point2<f64>>>,
    /// The longer side of the rectangle around the points.
    side: f64,
}

/// A point of a view, and its velocity per second.
type Moving = (Point2<f64>, Vector2<f64>);

/// A view whose pictures before and after are known.
#[derive(Debug, Clone)]
struct Seen {
    points: Vec<Option<Moving>>,
    /// The longer side of the person in the picture.
    side: f64,
    skew_s: f64,
}

impl StepWatch {
    /// Starts without observations.
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
    /// * `instant_s`: of the frame, seconds; frames in order.
    /// * `points_px`: one entry per camera, `None` without a detection; the same points of the world in the same order, pixels of
    ///   the recorded image.
    /// * `skews_s`: by camera, how long after the instant its picture was taken by its own time, seconds.
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

    /// Turns the samples of a block into one estimate for every camera.
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

    /// The offset of a camera; `None` while too little has moved, and of a single camera.
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
        // What the samples tell of themselves, or how the estimates scatter, whichever is more.
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

    /// Its points with their velocities, from the pictures before and after.
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
