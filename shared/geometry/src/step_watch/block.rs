//! Samples of some frames, and the resulting offsets of the cameras.

use nalgebra::{DMatrix, DVector, Matrix3, Vector2};

use super::{MIN_POINTS, MOST_MISS, Moving, Seen};
use crate::Camera;
use crate::rig_watch::median;

/// Minimum movement along the normals of epipolar lines, as root mean square per second, relative to the longer side of the rectangle
/// around the person. The value is not from a publication.
const MIN_MOVEMENT: f64 = 0.08;
/// Minimum number of samples of a pair of views.
const MIN_SAMPLES: f64 = 100.0;

/// Sums over the samples of every pair of views.
#[derive(Debug, Clone)]
pub(super) struct Block {
    n_views: usize,
    pairs: Vec<Pair>,
    n_frames: usize,
    /// For each view, the sum of its known skews, and their number.
    skews: Vec<(f64, usize)>,
}

#[derive(Debug, Clone)]
struct Pair {
    views: [usize; 2],
    /// Essential matrix; `None` for cameras in one place.
    essential: Option<Matrix3<f64>>,
    /// Sums over all samples, followed by the sums over the samples of each point.
    all: Sums,
    points: Vec<Sums>,
    /// Sum of the squares of the longer sides of the rectangles around people.
    sides: f64,
}

/// Sums over samples.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    n: f64,
    miss: f64,
    along: [f64; 2],
    /// Sum of `e^2`; the next two fields are the sums of `e (g_a + g_b) / 2` and of `g_a g_b`.
    squares: f64,
    both: f64,
    movement: f64,
}

impl Sums {
    fn add(&mut self, it: &Sample) {
        let [a, b] = it.along;
        self.n += 1.0;
        self.miss += it.miss;
        self.along = [self.along[0] + a, self.along[1] + b];
        self.squares += it.miss * it.miss;
        self.both += it.miss * 0.5 * (a + b);
        self.movement += a * b;
    }
}

/// The residual of a point, and its velocities along the normals of the epipolar lines in both pictures.
#[derive(Debug, Clone, Copy)]
struct Sample {
    point: usize,
    miss: f64,
    along: [f64; 2],
}

/// Offset of a camera from the samples of a block.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Estimate {
    /// Delay of the camera's pictures relative to the stated times, compared with the median of all cameras, in seconds.
    pub(super) offset_s: f64,
    /// Variance of the offset, according to the samples.
    pub(super) variance: f64,
}

impl Block {
    pub(super) fn new(cameras: &[Camera]) -> Self {
        let n_views = cameras.len();
        let pair = |a: usize, b: usize| Pair {
            views: [a, b],
            essential: essential(&cameras[a], &cameras[b]),
            all: Sums::default(),
            points: Vec::new(),
            sides: 0.0,
        };
        let pairs = (0..n_views).flat_map(|a| (a + 1..n_views).map(move |b| (a, b)));
        Self {
            n_views,
            pairs: pairs.map(|(a, b)| pair(a, b)).collect(),
            n_frames: 0,
            skews: vec![(0.0, 0); n_views],
        }
    }

    /// Returns the number of frames in which a pair had samples.
    pub(super) fn n_frames(&self) -> usize {
        self.n_frames
    }

    /// Adds a frame.
    ///
    /// * `views`: views in the order of the cameras.
    pub(super) fn add(&mut self, views: &[Option<Seen>]) {
        let mut is_used = false;
        for pair in &mut self.pairs {
            let [Some(a), Some(b)] =
                pair.views.map(|view| views.get(view).and_then(Option::as_ref))
            else {
                continue;
            };
            is_used |= pair.add([&a.points, &b.points], a.side.max(b.side));
        }
        if is_used {
            self.n_frames += 1;
            for (sum, view) in self.skews.iter_mut().zip(views) {
                if let Some(it) = view {
                    *sum = (sum.0 + it.skew_s, sum.1 + 1);
                }
            }
        }
    }

    /// Returns the offset of every camera; `None` for a camera without enough movement. Returns no list at all if no camera has enough
    /// movement, or if some cameras cannot be compared with the others.
    pub(super) fn estimates(&self) -> Option<Vec<Option<Estimate>>> {
        let slopes = self.pairs.iter().filter_map(|pair| Some((pair.views, pair.slope()?)));
        let slopes: Vec<([usize; 2], Slope)> = slopes.collect();
        let linked = linked(self.n_views, slopes.iter().map(|slope| slope.0))?;
        // Every pair gives the difference between the offsets of its two views. The offset of a view without a pair is fixed at 0.
        let all: f64 = slopes.iter().map(|slope| slope.1.weight).sum();
        let mut normal = DMatrix::identity(self.n_views, self.n_views) * (1e-9 * all);
        let mut right = DVector::zeros(self.n_views);
        for ([a, b], slope) in &slopes {
            for (one, other, sign) in [(*a, *b, -1.0), (*b, *a, 1.0)] {
                normal[(one, one)] += slope.weight;
                normal[(one, other)] -= slope.weight;
                right[one] += sign * slope.weight * slope.offset_s;
            }
        }
        let solved = normal.clone().cholesky()?.solve(&right);
        let known = |view: usize| {
            let (sum, n) = self.skews[view];
            sum / n.max(1) as f64
        };
        let unknown: Vec<Option<f64>> = (0..self.n_views)
            .map(|view| linked[view].then(|| solved[view] - known(view)))
            .collect();
        let middle = middle(unknown.iter().flatten().copied().collect())?;
        let of_view = |(view, it): (usize, Option<f64>)| {
            let offset_s = it? - middle;
            // This variance assumes that the offsets of all other views are exact.
            let variance = 1.0 / normal[(view, view)];
            let is_number = offset_s.is_finite() && variance.is_finite();
            is_number.then_some(Estimate { offset_s, variance })
        };
        Some(unknown.into_iter().enumerate().map(of_view).collect())
    }
}

/// Delay of the second view of a pair relative to the first, and the reciprocal of its variance.
#[derive(Debug, Clone, Copy)]
struct Slope {
    offset_s: f64,
    weight: f64,
}

/// For each view, returns true if it is in a pair. Returns `None` if pairs do not connect all these views.
fn linked(n_views: usize, pairs: impl Iterator<Item = [usize; 2]> + Clone) -> Option<Vec<bool>> {
    let mut reached = vec![false; n_views];
    reached[pairs.clone().next()?[0]] = true;
    for _ in 0..n_views {
        for [a, b] in pairs.clone() {
            let either = reached[a] || reached[b];
            (reached[a], reached[b]) = (either, either);
        }
    }
    let mut all = pairs;
    all.all(|[a, _]| reached[a]).then_some(reached)
}

/// Returns the median. For an even number of values, it is the mean of the middle two, so that neither of two cameras counts as correct.
fn middle(all: Vec<f64>) -> Option<f64> {
    let turned = all.iter().map(|value| -value).collect();
    Some(0.5 * (median(all)? - median(turned)?))
}

impl Pair {
    /// Adds the points of a frame. Returns true if there were enough of them.
    fn add(&mut self, points: [&[Option<Moving>]; 2], side: f64) -> bool {
        let Some(essential) = self.essential else {
            return false;
        };
        let both = points[0].iter().zip(points[1]);
        let both = both.enumerate();
        let samples = both.filter_map(|(nth, (a, b))| sample(nth, &essential, (*a)?, (*b)?));
        let mut samples: Vec<Sample> = samples.collect();
        samples.retain(|sample| sample.miss.abs() <= MOST_MISS * side);
        if samples.len() < MIN_POINTS {
            return false;
        }
        let n = samples.len() as f64;
        let mean = |of: &dyn Fn(&Sample) -> f64| samples.iter().map(of).sum::<f64>() / n;
        let miss = mean(&|sample| sample.miss);
        let along = [0, 1].map(|side| mean(&|sample| sample.along[side]));
        for it in &samples {
            let it = Sample {
                miss: it.miss - miss,
                along: [it.along[0] - along[0], it.along[1] - along[1]],
                ..*it
            };
            self.all.add(&it);
            if self.points.len() <= it.point {
                self.points.resize(it.point + 1, Sums::default());
            }
            self.points[it.point].add(&it);
            self.sides += side * side;
        }
        true
    }

    /// Returns the slope of the residuals against the velocities, without the part that is constant for a point over all frames. Returns
    /// `None` without enough movement.
    fn slope(&self) -> Option<Slope> {
        let mut rest = self.all;
        let mut n_points = 0.0;
        for it in self.points.iter().filter(|point| point.n > 0.0) {
            let [a, b] = it.along;
            rest.squares -= it.miss * it.miss / it.n;
            rest.both -= it.miss * 0.5 * (a + b) / it.n;
            rest.movement -= a * b / it.n;
            n_points += 1.0;
        }
        let is_enough =
            rest.n >= MIN_SAMPLES && rest.movement > MIN_MOVEMENT * MIN_MOVEMENT * self.sides;
        let offset_s = rest.both / rest.movement;
        let left = (rest.squares - offset_s * rest.both).max(0.0) / (rest.n - n_points).max(1.0);
        let weight = rest.movement / left.max(1e-12);
        (is_enough && weight.is_finite()).then_some(Slope { offset_s, weight })
    }
}

/// Returns the residual of a point in two views, and the velocities along the epipolar normals.
fn sample(point: usize, essential: &Matrix3<f64>, a: Moving, b: Moving) -> Option<Sample> {
    let (in_a, in_b) = (a.0.to_homogeneous(), b.0.to_homogeneous());
    let (line_in_b, line_in_a) = (essential * in_a, essential.transpose() * in_b);
    let (normal_in_b, normal_in_a) = (line_in_b.xy(), line_in_a.xy());
    let length = (normal_in_a.norm_squared() + normal_in_b.norm_squared()).sqrt();
    let is_good = length > 1e-9 && length.is_finite();
    let along = |normal: &Vector2<f64>, velocity: &Vector2<f64>| normal.dot(velocity) / length;
    is_good.then(|| Sample {
        point,
        miss: in_b.dot(&line_in_b) / length,
        along: [-along(&normal_in_a, &a.1), along(&normal_in_b, &b.1)],
    })
}

/// Returns the essential matrix, which takes normalised points of A to lines of B.
fn essential(a: &Camera, b: &Camera) -> Option<Matrix3<f64>> {
    let b_from_a = b.camera_from_world * a.camera_from_world.inverse();
    let rotation = b_from_a.rotation.to_rotation_matrix();
    let matrix = b_from_a.translation.vector.cross_matrix() * rotation.matrix();
    matrix.try_normalize(1e-9)
}
