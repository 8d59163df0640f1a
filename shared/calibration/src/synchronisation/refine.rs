//! Refinement of offsets and drifts to fractions of a frame, with standard errors.

mod solve;

use std::collections::BTreeMap;

use solve::{BLOCK_S, HALF, Piece, REACH, Sums};

use crate::synchronisation::pair::{Epipolar, cost};
use crate::synchronisation::track::{LEAST_JOINTS, Place, Track};

/// Maximum number of times at which a pair is compared, in each direction.
const MOST_TIMES: usize = 300;
/// Half-widths of the parabolas that are fitted to the costs, in seconds: wide for slow movement, narrow for fast movement. The half-width
/// with the smallest standard errors is used.
const REACHES_S: [f64; 4] = [0.16, 0.08, 0.04, 0.02];
/// Largest half-width, as a fraction of the footage. It is limited because joints must be visible over the whole width.
const MOST_REACH: f64 = 0.05;
/// Change of offsets above which costs are computed again, in seconds.
const MOVED_S: f64 = 0.005;
/// Maximum number of passes.
const MOST_PASSES: usize = 4;
/// Time over which the bias of a joint in a pair of cameras is assumed constant, in seconds. The joint detector shifts joints depending on
/// the direction from which it sees a person.
const BIAS_S: f64 = 20.0;
/// Time after which errors of a joint are independent, in seconds.
const INDEPENDENT_S: f64 = 0.25;
/// Standard deviation of a normal distribution divided by the median of its absolute values.
const NORMAL: f64 = 1.4826;

/// Clock of a camera. Its time `t` is `t + offset + drift (t - centre)` on the common clock.
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

    /// Returns the offset at time 0 of the camera's own clock, in seconds.
    pub(crate) fn at_zero_s(&self) -> f64 {
        self.offset_s - self.drift * self.centre_s
    }
}

/// Input of the refinement.
pub(crate) struct Problem<'a> {
    /// Tracks of every camera.
    pub(crate) tracks: &'a [Vec<Track>],
    /// Every pair that has an epipolar constraint, in both directions.
    pub(crate) pairs: Vec<([usize; 2], Epipolar)>,
    /// Index of the camera whose clock is the common one.
    pub(crate) reference: usize,
    /// For each joint, the index of the corresponding joint on the other side of the body; `None` if left and right are never swapped.
    pub(crate) mirror: Option<&'a [usize]>,
    pub(crate) n_joints: usize,
}

/// Result of the refinement.
#[derive(Debug, Clone)]
pub(crate) struct Fit {
    pub(crate) clocks: Vec<Clock>,
    /// Standard errors of the offset (at the centre) and the drift.
    pub(crate) errors: Vec<[f64; 2]>,
    /// Residuals of every camera: their number, and their median in expected errors and in pixels.
    pub(crate) residuals: Vec<Residuals>,
}

/// The residuals of a camera.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Residuals {
    pub(crate) n: usize,
    pub(crate) median: f64,
    pub(crate) median_px: f64,
}

/// One joint in two cameras.
struct Row {
    residual: f64,
    px: f64,
    weight: f64,
    /// Residual for each delay of the second camera.
    over_delay: Vec<f64>,
}

/// A row with its block of time, and with the times of both cameras since the centres of their clocks.
struct Timed {
    row: Row,
    since: [f64; 2],
    block: i64,
}

/// Costs of all pairs of cameras for offsets near those of the given clocks.
struct Table {
    pieces: Vec<Piece>,
    /// Cameras, residual in expected errors, and pixels per expected error.
    residuals: Vec<([usize; 2], f64, f64)>,
}

impl Problem<'_> {
    /// Refines clocks.
    ///
    /// * `span`: part of the common time to use, in seconds.
    /// * `drifts`: true for each camera whose drift is refined as well.
    pub(crate) fn refine(&self, start: &[Clock], span: [f64; 2], drifts: &[bool]) -> Fit {
        let mut from = start.to_vec();
        let mut best: Option<(f64, Fit)> = None;
        let most_s = (MOST_REACH * (span[1] - span[0])).max(REACHES_S[2]);
        for reach_s in REACHES_S.into_iter().filter(|reaches_s| *reaches_s <= most_s) {
            let fit = self.refine_at(&from, span, drifts, reach_s);
            let known = fit.errors.iter().map(|error| error[0]);
            let error = known.filter(|value| value.is_finite()).fold(0.0, f64::max);
            from.clone_from(&fit.clocks);
            if error > 0.0 && best.as_ref().is_none_or(|best| error < best.0) {
                best = Some((error, fit));
            }
        }
        best.map_or_else(
            || self.refine_at(start, span, drifts, REACHES_S[2]),
            |best| best.1,
        )
    }

    fn refine_at(&self, start: &[Clock], span: [f64; 2], drifts: &[bool], reach_s: f64) -> Fit {
        let mut clocks = start.to_vec();
        let scale_s = (span[1] - span[0]).max(0.1) / 2.0;
        for it in &mut clocks {
            let centre_s = it.own(f64::midpoint(span[0], span[1]));
            *it = Clock {
                offset_s: it.common(centre_s) - centre_s,
                drift: it.drift,
                centre_s,
            };
        }
        let mut pass = 0;
        loop {
            pass += 1;
            let table = self.table(&clocks, span, reach_s);
            let sums = Sums::new(&table.pieces, drifts, self.reference, scale_s, reach_s);
            let step = sums.solve(&|_| true);
            let mut moved_s: f64 = 0.0;
            for (camera, clock) in clocks.iter_mut().enumerate() {
                let [by_offset, by_drift] = [0, 1].map(|i| step[2 * camera + i]);
                clock.offset_s += by_offset;
                clock.drift += by_drift / scale_s;
                moved_s = moved_s.max(by_offset.abs() + by_drift.abs());
            }
            if moved_s < MOVED_S || pass == MOST_PASSES {
                return Fit {
                    residuals: (0..clocks.len()).map(|i| residuals(&table.residuals, i)).collect(),
                    errors: sums.errors(&step),
                    clocks,
                };
            }
        }
    }

    /// Returns the residuals of all cameras with the given clocks.
    pub(crate) fn residuals(&self, clocks: &[Clock], span: [f64; 2]) -> Vec<Residuals> {
        let table = self.table(clocks, span, REACHES_S[3]);
        let each = 0..clocks.len();
        each.map(|camera| residuals(&table.residuals, camera)).collect()
    }

    /// Returns the costs of all joints in all pairs, at times according to the given clocks.
    fn table(&self, clocks: &[Clock], span: [f64; 2], reach_s: f64) -> Table {
        let mut all = Vec::new();
        let mut biased = BTreeMap::<(usize, usize, i64), Vec<Timed>>::new();
        let step_s = ((span[1] - span[0]) / MOST_TIMES as f64).max(0.01);
        let n = ((span[1] - span[0]) / step_s).floor() as usize;
        for (pair, (cameras, epipolar)) in self.pairs.iter().enumerate() {
            let [a, b] = *cameras;
            for nth in 0..=n {
                let common_s = span[0] + nth as f64 * step_s;
                let times = [clocks[a].own(common_s), clocks[b].own(common_s)];
                let since = [times[0] - clocks[a].centre_s, times[1] - clocks[b].centre_s];
                let block = (common_s / BLOCK_S).floor() as i64;
                let part = ((common_s - span[0]) / BIAS_S).floor() as i64;
                for track in alive(&self.tracks[a], times[0]) {
                    let others = &self.tracks[b];
                    for (joint, row) in self.nearest(epipolar, (track, others), times, reach_s) {
                        all.push((*cameras, row.residual, row.px));
                        let rows = biased.entry((pair, joint, part)).or_default();
                        rows.push(Timed { row, since, block });
                    }
                }
            }
        }
        let spreads = spreads(self.pairs.len(), &biased);
        let mut pieces = BTreeMap::<(usize, usize, i64), Piece>::new();
        for ((pair, joint, _), rows) in &biased {
            let biases = biases(rows, spreads[*pair]);
            for Timed { row, since, block } in rows {
                let piece = pieces.entry((*pair, *joint, *block));
                let piece =
                    piece.or_insert_with(|| Piece::new(self.pairs[*pair].0, *joint, *block));
                let residuals = row.over_delay.iter().zip(&biases);
                let costs: Vec<f64> =
                    residuals.map(|(residual, bias)| row.weight * cost(residual - bias)).collect();
                piece.add(&costs, *since);
            }
        }
        Table {
            pieces: pieces.into_values().collect(),
            residuals: all,
        }
    }

    /// Returns the joints of the person in the second camera with the lowest cost. The cost is taken over a range of delays, so that no
    /// delay is preferred.
    fn nearest(
        &self,
        epipolar: &Epipolar,
        (track, others): (&Track, &[Track]),
        times: [f64; 2],
        reach_s: f64,
    ) -> Vec<(usize, Row)> {
        let places = |of: &Track, at: f64| -> Vec<Option<Place>> {
            (0..self.n_joints).map(|i| of.place(i, at)).collect()
        };
        let in_a = places(track, times[0]);
        let mut best: Option<(f64, &Track, bool)> = None;
        for other in alive(others, times[1]) {
            let in_b = [-reach_s, 0.0, reach_s].map(|value| places(other, times[1] + value));
            for is_exchanged in [false, true] {
                let Some(other_of) = self.sides(is_exchanged) else {
                    continue;
                };
                let cost = |in_b: &Vec<Option<Place>>| {
                    mean_cost(epipolar, [&in_a, in_b], [track.size, other.size], other_of)
                };
                let costs: Option<Vec<f64>> = in_b.iter().map(cost).collect();
                let cost = costs.map(|cost| cost.iter().sum::<f64>());
                if let Some(cost) = cost.filter(|cost| best.is_none_or(|best| *cost < best.0)) {
                    best = Some((cost, other, is_exchanged));
                }
            }
        }
        let found = best.and_then(|best| Some((best.1, self.sides(best.2)?)));
        let Some((other, other_of)) = found else {
            return Vec::new();
        };
        let row = |(joint, a): (usize, &Option<Place>)| {
            let a = (*a)?;
            let at = |nth: i64| {
                let b = other.place(
                    other_of(joint),
                    times[1] + nth as f64 * reach_s / REACH as f64,
                )?;
                let residual = epipolar.residual(a.at, b.at, [track.size, other.size])?;
                Some((residual, a.weight * b.weight))
            };
            let (now, weight) = at(0)?;
            let residuals = (-HALF..=HALF).map(|delay| Some(at(delay)?.0.value));
            let row = Row {
                residual: now.value,
                px: now.px,
                weight,
                over_delay: filled(&residuals.collect::<Vec<_>>())?,
            };
            Some((joint, row))
        };
        in_a.iter().enumerate().filter_map(row).collect()
    }

    /// Returns the map from joints of the first camera to those of the second; `None` if left and right should be swapped but are never
    /// swapped in these films.
    fn sides(&self, is_exchanged: bool) -> Option<impl Fn(usize) -> usize + Copy> {
        let mirror = self.mirror.filter(|_| is_exchanged);
        (mirror.is_some() || !is_exchanged)
            .then_some(move |joint: usize| mirror.map_or(joint, |mirror| mirror[joint]))
    }
}

fn alive(tracks: &[Track], time_s: f64) -> impl Iterator<Item = &Track> {
    let is_there = move |track: &&Track| track.span[0] <= time_s && time_s <= track.span[1];
    tracks.iter().filter(is_there)
}

/// Returns the mean cost of the joints that two people have in common; `None` if there are too few.
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

/// Returns for every pair the variance of the biases of its joints: the excess variance of their medians over the variance expected without
/// bias.
fn spreads(n_pairs: usize, biased: &BTreeMap<(usize, usize, i64), Vec<Timed>>) -> Vec<f64> {
    let mut found: Vec<Vec<[f64; 2]>> = vec![Vec::new(); n_pairs];
    for ((pair, ..), rows) in biased {
        found[*pair].push([
            median_at(rows, HALF as usize).abs(),
            variance_of_median(rows),
        ]);
    }
    let spread = |of_pair: &Vec<[f64; 2]>| {
        let median = |axis: usize| median(of_pair.iter().map(|numbers| numbers[axis]).collect());
        ((NORMAL * median(0)).powi(2) - median(1)).max(0.0)
    };
    found.iter().map(spread).collect()
}

/// Returns the variance of the median of residuals that are correlated in time.
fn variance_of_median(rows: &[Timed]) -> f64 {
    let middle = median_at(rows, HALF as usize);
    let off = rows.iter().map(|row| (row.row.residual - middle).abs());
    let sigma = NORMAL * median(off.collect());
    let mut blocks: Vec<i64> = rows.iter().map(|row| row.block).collect();
    blocks.dedup();
    let n = blocks.len() as f64 * BLOCK_S / INDEPENDENT_S;
    sigma * sigma / n.max(1.0)
}

/// Returns the bias to subtract from the residuals of a joint of a pair, by delay of the second camera, in expected errors.
///
/// The median residual contains both errors and the bias. It is multiplied by a factor that follows from the ratio of their variances.
///
/// * `spread`: variance of the biases of the pair.
fn biases(rows: &[Timed], spread: f64) -> Vec<f64> {
    let of_errors = variance_of_median(rows).max(1e-9);
    let share = 1.0 - (of_errors / (of_errors + spread)).sqrt();
    let n_delays = rows.first().map_or(0, |row| row.row.over_delay.len());
    (0..n_delays).map(|delay| share * median_at(rows, delay)).collect()
}

fn median_at(rows: &[Timed], delay: usize) -> f64 {
    median(rows.iter().filter_map(|row| row.row.over_delay.get(delay).copied()).collect())
}

fn median(mut all: Vec<f64>) -> f64 {
    all.sort_by(f64::total_cmp);
    all.get(all.len() / 2).copied().unwrap_or(0.0)
}

/// Returns the residuals with missing values interpolated; `None` if more than a third is missing, or if a value at an end is missing.
fn filled(costs: &[Option<f64>]) -> Option<Vec<f64>> {
    let known: Vec<(usize, f64)> =
        costs.iter().enumerate().filter_map(|(nth, it)| Some((nth, (*it)?))).collect();
    if 3 * known.len() < 2 * costs.len() {
        return None;
    }
    let between = |nth: usize| {
        let after = known.partition_point(|entry| entry.0 < nth);
        let (to, at_end) = *known.get(after)?;
        if to == nth {
            return Some(at_end);
        }
        let (from, at_begin) = *known.get(after.checked_sub(1)?)?;
        let share = (nth - from) as f64 / (to - from) as f64;
        Some(at_begin + share * (at_end - at_begin))
    };
    (0..costs.len()).map(between).collect()
}

fn residuals(all: &[([usize; 2], f64, f64)], camera: usize) -> Residuals {
    let of_camera = all.iter().filter(|residual| residual.0.contains(&camera));
    let median = |of: fn(&([usize; 2], f64, f64)) -> f64| {
        let mut each: Vec<f64> = of_camera.clone().map(of).collect();
        each.sort_by(f64::total_cmp);
        each.get(each.len() / 2).copied().unwrap_or(f64::NAN)
    };
    Residuals {
        n: of_camera.clone().count(),
        median: median(|residual| residual.1.abs()),
        median_px: median(|residual| (residual.1 * residual.2).abs()),
    }
}
