//! Offsets and drifts to fractions of a frame, with standard errors.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use crate::pair::{Epipolar, cost};
use crate::track::{LEAST_JOINTS, Place, Track};

/// Most times at which a pair is looked at, each way.
const MOST_TIMES: usize = 300;
/// Length of the blocks of time whose errors are taken as independent, seconds.
const BLOCK_S: f64 = 0.5;
/// Errors are alike over joints and longer than a block: how much larger the variance is.
const ALIKE: f64 = 3.0;
/// The costs are compared at offsets this far to both sides, seconds: far where people move slowly, near where they move fast.
const REACHES_S: [f64; 3] = [0.08, 0.04, 0.02];
/// The most that offsets change in a step, seconds.
const LONGEST_STEP_S: f64 = 0.05;
const MOST_STEPS: usize = 30;
/// Steps shorter than this, seconds, are the last.
const CLOSE_S: f64 = 2e-5;

/// The clock of a camera: `t + offset + drift (t - centre)` on the common clock.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Clock {
    pub(crate) offset_s: f64,
    pub(crate) drift: f64,
    pub(crate) centre_s: f64,
}

impl Clock {
    pub(crate) fn common(&self, own_s: f64) -> f64 {
        own_s + self.offset_s + self.drift * (own_s - self.centre_s)
    }

    pub(crate) fn own(&self, common_s: f64) -> f64 {
        let at_centre = common_s - self.offset_s - self.centre_s;
        self.centre_s + at_centre / (1.0 + self.drift)
    }

    /// The offset at the beginning of the camera's own clock, seconds.
    pub(crate) fn at_zero_s(&self) -> f64 {
        self.offset_s - self.drift * self.centre_s
    }
}

/// What is refined.
pub(crate) struct Problem<'a> {
    /// Of every camera.
    pub(crate) tracks: &'a [Vec<Track>],
    /// Every pair that has an epipolar constraint, both ways.
    pub(crate) pairs: Vec<([usize; 2], Epipolar)>,
    /// The camera whose clock is the common one.
    pub(crate) reference: usize,
    /// Of each joint the one on the other side, where sides may be exchanged.
    pub(crate) mirror: Option<&'a [usize]>,
    pub(crate) n_joints: usize,
}

/// What came out.
#[derive(Debug, Clone)]
pub(crate) struct Fit {
    pub(crate) clocks: Vec<Clock>,
    /// Standard errors of offset (at the centre) and drift.
    pub(crate) errors: Vec<[f64; 2]>,
    /// Residuals of every camera: how many, and their median in expected errors and in pixels.
    pub(crate) residuals: Vec<Residuals>,
}

/// The residuals of a camera.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Residuals {
    pub(crate) n: usize,
    pub(crate) median: f64,
    pub(crate) median_px: f64,
}

/// Gradients by joint and block of time.
type Blocks = BTreeMap<(usize, i64), DVector<f64>>;

/// One joint in two cameras.
struct Row {
    cameras: [usize; 2],
    block: (usize, i64),
    residual: f64,
    px: f64,
    weight: f64,
    /// Slope and curvature of the cost over the own time of the second camera, from the costs at both sides.
    slope: f64,
    curvature: f64,
    /// Times of the first and the second camera from their centres.
    since: [f64; 2],
}

impl Problem<'_> {
    /// Refines clocks.
    ///
    /// * `span`: the part of the common time that is used, seconds.
    /// * `with_drift`: whether drifts are refined as well.
    pub(crate) fn refine(&self, start: &[Clock], span: [f64; 2], with_drift: bool) -> Fit {
        let mut best: Option<(f64, Fit)> = None;
        let mut from = start.to_vec();
        for reach_s in REACHES_S {
            let fit = self.refine_at(&from, span, (with_drift, reach_s));
            let known = fit
                .errors
                .iter()
                .map(|it| it[0])
                .filter(|it| it.is_finite());
            let error = known.fold(0.0, f64::max);
            from.clone_from(&fit.clocks);
            if best.as_ref().is_none_or(|it| error < it.0) {
                best = Some((error, fit));
            }
        }
        let (_, fit) =
            best.unwrap_or_else(|| (0.0, self.refine_at(start, span, (with_drift, REACHES_S[0]))));
        fit
    }

    fn refine_at(
        &self,
        start: &[Clock],
        span: [f64; 2],
        (with_drift, reach_s): (bool, f64),
    ) -> Fit {
        let mut clocks = start.to_vec();
        let per_camera = if with_drift { 2 } else { 1 };
        let scale_s = (span[1] - span[0]).max(0.1) / 2.0;
        for it in &mut clocks {
            let centre_s = it.own(f64::midpoint(span[0], span[1]));
            *it = Clock {
                offset_s: it.common(centre_s) - centre_s,
                drift: it.drift,
                centre_s,
            };
        }
        let mut rows = self.rows(&clocks, span, reach_s);
        for _ in 0..MOST_STEPS {
            let (normal, gradient, _) = self.equations(&rows, [per_camera, clocks.len()], scale_s);
            let Some(step) = normal.cholesky().map(|it| it.solve(&-gradient)) else {
                break;
            };
            let longest = step.amax();
            let share = (LONGEST_STEP_S / longest.max(LONGEST_STEP_S)).min(1.0);
            for (camera, clock) in clocks.iter_mut().enumerate() {
                clock.offset_s += share * step[per_camera * camera];
                if with_drift {
                    clock.drift += share * step[per_camera * camera + 1] / scale_s;
                }
            }
            rows = self.rows(&clocks, span, reach_s);
            if longest < CLOSE_S {
                break;
            }
        }
        let errors = self.errors(&rows, [per_camera, clocks.len()], scale_s);
        Fit {
            residuals: (0..clocks.len()).map(|it| residuals(&rows, it)).collect(),
            clocks,
            errors,
        }
    }

    /// The residuals of all cameras with the clocks as they are.
    pub(crate) fn residuals(&self, clocks: &[Clock], span: [f64; 2]) -> Vec<Residuals> {
        let rows = self.rows(clocks, span, REACHES_S[0]);
        (0..clocks.len()).map(|it| residuals(&rows, it)).collect()
    }

    /// All joints in all pairs, at the times that the clocks tell.
    fn rows(&self, clocks: &[Clock], span: [f64; 2], reach_s: f64) -> Vec<Row> {
        let mut rows = Vec::new();
        let step_s = ((span[1] - span[0]) / MOST_TIMES as f64).max(0.01);
        for (cameras, epipolar) in &self.pairs {
            let [a, b] = *cameras;
            let n = ((span[1] - span[0]) / step_s).floor() as usize;
            for nth in 0..=n {
                let common_s = span[0] + nth as f64 * step_s;
                let times = [clocks[a].own(common_s), clocks[b].own(common_s)];
                for track in alive(&self.tracks[a], times[0]) {
                    let found = self.nearest(epipolar, (track, &self.tracks[b]), times, reach_s);
                    for (joint, mut row) in found {
                        row.cameras = *cameras;
                        let block = (common_s / BLOCK_S).floor() as i64;
                        row.block = (joint, block);
                        row.since = [times[0] - clocks[a].centre_s, times[1] - clocks[b].centre_s];
                        rows.push(row);
                    }
                }
            }
        }
        rows
    }

    /// The joints of the person in the second camera who costs least.
    fn nearest(
        &self,
        epipolar: &Epipolar,
        (track, others): (&Track, &[Track]),
        times: [f64; 2],
        reach_s: f64,
    ) -> Vec<(usize, Row)> {
        let places = |of: &Track, at: f64| -> Vec<Option<Place>> {
            (0..self.n_joints).map(|it| of.place(it, at)).collect()
        };
        let in_a = places(track, times[0]);
        let mut best: Option<(f64, &Track, bool)> = None;
        for other in alive(others, times[1]) {
            let in_b = places(other, times[1]);
            for is_exchanged in [false, true] {
                let Some(other_of) = self.sides(is_exchanged) else {
                    continue;
                };
                let both = [&in_a[..], &in_b[..]];
                let cost = mean_cost(epipolar, both, [track.size, other.size], other_of);
                if let Some(cost) = cost.filter(|it| best.is_none_or(|best| *it < best.0)) {
                    best = Some((cost, other, is_exchanged));
                }
            }
        }
        let Some((_, other, is_exchanged)) = best else {
            return Vec::new();
        };
        let Some(other_of) = self.sides(is_exchanged) else {
            return Vec::new();
        };
        let sizes = [track.size, other.size];
        let row = |(joint, a): (usize, &Option<Place>)| {
            let a = (*a)?;
            let at = |by: f64| {
                let b = other.place(other_of(joint), times[1] + by)?;
                Some((epipolar.residual(a.at, b.at, sizes)?, b.weight))
            };
            let (before, (now, weight), after) = (at(-reach_s)?, at(0.0)?, at(reach_s)?);
            let costs = [before.0, now, after.0].map(|it| cost(it.value));
            let row = Row {
                cameras: [0; 2],
                block: (0, 0),
                residual: now.value,
                px: now.px,
                weight: a.weight * weight,
                slope: (costs[2] - costs[0]) / (2.0 * reach_s),
                curvature: (costs[2] + costs[0] - 2.0 * costs[1]) / reach_s.powi(2),
                since: [0.0; 2],
            };
            Some((joint, row))
        };
        in_a.iter().enumerate().filter_map(row).collect()
    }

    /// Which joint of the second camera is which of the first; none where sides cannot be exchanged.
    fn sides(&self, is_exchanged: bool) -> Option<impl Fn(usize) -> usize + Copy> {
        let mirror = self.mirror.filter(|_| is_exchanged);
        (mirror.is_some() || !is_exchanged)
            .then_some(move |joint: usize| mirror.map_or(joint, |it| it[joint]))
    }

    /// Normal matrix, gradient, and the gradients of the blocks; without unknowns of the reference.
    ///
    /// * `[per_camera, n]`: unknowns of a camera, and cameras.
    fn equations(
        &self,
        rows: &[Row],
        [per_camera, n]: [usize; 2],
        scale_s: f64,
    ) -> (DMatrix<f64>, DVector<f64>, Blocks) {
        let size = per_camera * n;
        let mut normal = DMatrix::zeros(size, size);
        let mut gradient = DVector::zeros(size);
        let mut blocks = Blocks::new();
        for row in rows {
            let block = blocks
                .entry(row.block)
                .or_insert_with(|| DVector::zeros(size));
            let mut entries = [(0, 0.0); 4];
            for (side, sign) in [1.0, -1.0].into_iter().enumerate() {
                let unknown = per_camera * row.cameras[side];
                entries[2 * side] = (unknown, sign);
                if per_camera == 2 {
                    entries[2 * side + 1] = (unknown + 1, sign * row.since[side] / scale_s);
                }
            }
            for &(i, of_i) in &entries {
                let by = row.weight * of_i * row.slope;
                gradient[i] += by;
                block[i] += by;
                for &(j, of_j) in &entries {
                    normal[(i, j)] += row.weight * of_i * of_j * row.curvature;
                }
            }
        }
        for fixed in per_camera * self.reference..per_camera * (self.reference + 1) {
            normal.row_mut(fixed).fill(0.0);
            normal.column_mut(fixed).fill(0.0);
            normal[(fixed, fixed)] = 1.0;
            gradient[fixed] = 0.0;
            for it in blocks.values_mut() {
                it[fixed] = 0.0;
            }
        }
        // Cameras that nothing is known of stay where they are.
        for nth in 0..size {
            if normal[(nth, nth)] <= 0.0 {
                normal[(nth, nth)] = 1.0;
            }
        }
        (normal, gradient, blocks)
    }

    /// Standard errors: from the curvature, and from how much the blocks of time disagree.
    fn errors(&self, rows: &[Row], sizes: [usize; 2], scale_s: f64) -> Vec<[f64; 2]> {
        let [per_camera, n] = sizes;
        let (normal, _, blocks) = self.equations(rows, sizes, scale_s);
        let tells = |it: &Row| it.curvature != 0.0;
        let is_known = |camera: usize| {
            rows.iter()
                .any(|it| it.cameras.contains(&camera) && tells(it))
        };
        let Some(inverse) = normal.cholesky().map(|it| it.inverse()) else {
            return vec![[f64::INFINITY; 2]; n];
        };
        let n_unknown = (per_camera * n) as f64;
        let spread = |each: &mut dyn Iterator<Item = &DVector<f64>>| {
            let (mut sum, mut count) = (DMatrix::zeros(per_camera * n, per_camera * n), 0.0);
            for it in each {
                sum += it * it.transpose();
                count += 1.0;
            }
            &inverse * sum * &inverse * (count / (count - n_unknown).max(1.0))
        };
        let mut variance = spread(&mut blocks.values()) * ALIKE;
        // Errors that all joints have in common, where there are enough blocks to see them.
        let mut by_time = BTreeMap::<i64, DVector<f64>>::new();
        for ((_, time), it) in &blocks {
            *by_time
                .entry(*time)
                .or_insert_with(|| DVector::zeros(it.len())) += it;
        }
        if by_time.len() as f64 > 2.0 * n_unknown {
            variance = variance.sup(&(spread(&mut by_time.values()) * ALIKE));
        }
        let of_camera = |camera: usize| {
            if !is_known(camera) {
                return [f64::INFINITY; 2];
            }
            let at = |nth: usize| variance[(per_camera * camera + nth, per_camera * camera + nth)];
            let drift = if per_camera == 2 {
                at(1).sqrt() / scale_s
            } else {
                f64::INFINITY
            };
            [at(0).sqrt(), drift]
        };
        (0..n).map(of_camera).collect()
    }
}

fn alive(tracks: &[Track], time_s: f64) -> impl Iterator<Item = &Track> {
    let is_there = move |it: &&Track| it.span[0] <= time_s && time_s <= it.span[1];
    tracks.iter().filter(is_there)
}

/// The mean cost of the joints that two people have both; none where these are too few.
fn mean_cost(
    epipolar: &Epipolar,
    [in_a, in_b]: [&[Option<Place>]; 2],
    sizes: [f64; 2],
    other: impl Fn(usize) -> usize,
) -> Option<f64> {
    let (mut sum, mut weights, mut n) = (0.0, 0.0, 0);
    for (joint, a) in in_a.iter().enumerate() {
        let Some((a, b)) = a.zip(in_b[other(joint)]) else {
            continue;
        };
        if let Some(residual) = epipolar.residual(a.at, b.at, sizes) {
            let weight = a.weight * b.weight;
            sum += weight * cost(residual.value);
            weights += weight;
            n += 1;
        }
    }
    (n >= LEAST_JOINTS).then(|| sum / weights)
}

fn residuals(rows: &[Row], camera: usize) -> Residuals {
    let of_camera = rows.iter().filter(|it| it.cameras.contains(&camera));
    let median = |of: fn(&Row) -> f64| {
        let mut each: Vec<f64> = of_camera.clone().map(of).collect();
        each.sort_by(f64::total_cmp);
        each.get(each.len() / 2).copied().unwrap_or(f64::NAN)
    };
    Residuals {
        n: of_camera.clone().count(),
        median: median(|it| it.residual.abs()),
        median_px: median(|it| it.residual.abs() * it.px),
    }
}
