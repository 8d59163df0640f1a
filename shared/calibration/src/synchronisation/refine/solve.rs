//! Offsets and drifts with the lowest cost, and their standard errors.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{DMatrix, DVector};

/// Number of delays on each side for which costs are known and a parabola is fitted.
pub(super) const REACH: i64 = 4;
pub(super) const HALF: i64 = REACH + 3;
/// Length of the blocks of time whose errors are assumed independent, in seconds.
pub(super) const BLOCK_S: f64 = 0.5;
/// Factor by which variances are multiplied, because errors are correlated between joints and over more than one block.
const ALIKE: f64 = 2.0;
/// Minimum and maximum number of parts of the footage that are left out in turn to estimate an error.
const PARTS: [usize; 2] = [4, 12];
/// Factor by which the variance between parts is multiplied, because adjacent parts are correlated.
const ALIKE_PARTS: f64 = 1.5;
const MOST_STEPS: usize = 20;
/// Largest and smallest change of offsets in a step, in seconds.
const STEPS_S: [f64; 2] = [0.02, 1e-5];

/// Cost of a joint in two cameras, by delay of the second camera, in a block of time.
#[derive(Debug, Clone)]
pub(super) struct Piece {
    cameras: [usize; 2],
    joint: usize,
    block: i64,
    n: f64,
    costs: Vec<f64>,
    /// Sums of the times of both cameras relative to their centres.
    since: [f64; 2],
}

impl Piece {
    pub(super) fn new(cameras: [usize; 2], joint: usize, block: i64) -> Self {
        Self {
            cameras,
            joint,
            block,
            n: 0.0,
            costs: Vec::new(),
            since: [0.0; 2],
        }
    }

    pub(super) fn add(&mut self, costs: &[f64], since: [f64; 2]) {
        self.n += 1.0;
        self.costs.resize(costs.len(), 0.0);
        for (sum, it) in self.costs.iter_mut().zip(costs) {
            *sum += it;
        }
        for (sum, it) in self.since.iter_mut().zip(since) {
            *sum += it;
        }
    }

    /// Returns the slope and curvature of the parabola that fits the costs around a delay.
    ///
    /// * `delay`, `step_s`: the delay in steps, and the length of a step.
    fn parabola(&self, delay: f64, step_s: f64) -> [f64; 2] {
        let most = (HALF - REACH) as f64;
        let at = delay.clamp(-most, most);
        let below = at.floor().min(most - 1.0).max(-most);
        let share = at - below;
        let mut both = [0.0; 2];
        let m = REACH as f64;
        let n = 2.0 * m + 1.0;
        let squares = m * (m + 1.0) * n / 3.0;
        let fourths = squares * (3.0 * m * m + 3.0 * m - 1.0) / 5.0;
        let spread = fourths - squares * squares / n;
        for (place, weight) in [(below as i64, 1.0 - share), (below as i64 + 1, share)] {
            for by in -REACH..=REACH {
                let cost = self.costs.get((HALF + place + by) as usize);
                let cost = weight * cost.copied().unwrap_or(0.0);
                let by = by as f64;
                both[0] += cost * by / squares;
                both[1] += 2.0 * cost * (by * by - squares / n) / spread;
            }
        }
        [both[0] / step_s, both[1] / step_s.powi(2)]
    }
}

/// Sums of all costs. The unknowns of every camera are its offset, and its drift times half the length of the footage.
pub(super) struct Sums<'a> {
    pieces: &'a [Piece],
    /// True for unknowns that stay 0.
    fixed: Vec<bool>,
    scale_s: f64,
    /// Step between delays, in seconds.
    step_s: f64,
}

/// Gradients by joint and block of time.
type Blocks = BTreeMap<(usize, i64), DVector<f64>>;

impl<'a> Sums<'a> {
    pub(super) fn new(
        pieces: &'a [Piece],
        drifts: &[bool],
        reference: usize,
        scale_s: f64,
        reach_s: f64,
    ) -> Self {
        let is_known = |camera: usize| pieces.iter().any(|piece| piece.cameras.contains(&camera));
        let fixed = drifts.iter().enumerate().flat_map(|(camera, drifts)| {
            let fixed = camera == reference || !is_known(camera);
            [fixed, fixed || !drifts]
        });
        Self {
            pieces,
            fixed: fixed.collect(),
            scale_s,
            step_s: reach_s / REACH as f64,
        }
    }

    /// Returns the unknowns with the lowest cost over some blocks; zeros if there is no minimum.
    pub(super) fn solve(&self, uses: &dyn Fn(i64) -> bool) -> DVector<f64> {
        self.solve_from(DVector::zeros(self.fixed.len()), uses)
    }

    fn solve_from(&self, mut found: DVector<f64>, uses: &dyn Fn(i64) -> bool) -> DVector<f64> {
        for _ in 0..MOST_STEPS {
            let (normal, gradient, _) = self.equations(&found, uses);
            let Some(step) = normal.cholesky().map(|cholesky| cholesky.solve(&-gradient)) else {
                break;
            };
            let longest = step.amax();
            found += step * (STEPS_S[0] / longest.max(STEPS_S[0]));
            if longest < STEPS_S[1] {
                break;
            }
        }
        found
    }

    fn equations(
        &self,
        at: &DVector<f64>,
        uses: &dyn Fn(i64) -> bool,
    ) -> (DMatrix<f64>, DVector<f64>, Blocks) {
        let size = self.fixed.len();
        let mut normal = DMatrix::zeros(size, size);
        let mut gradient = DVector::zeros(size);
        let mut blocks = Blocks::new();
        for piece in self.pieces.iter().filter(|piece| uses(piece.block)) {
            let mut entries = [(0, 0.0); 4];
            for (side, sign) in [1.0, -1.0].into_iter().enumerate() {
                let unknown = 2 * piece.cameras[side];
                let since = piece.since[side] / piece.n / self.scale_s;
                entries[2 * side] = (unknown, sign);
                entries[2 * side + 1] = (unknown + 1, sign * since);
            }
            let delay_s: f64 = entries.iter().map(|(nth, by)| by * at[*nth]).sum();
            let [slope, curvature] = piece.parabola(delay_s / self.step_s, self.step_s);
            let block =
                blocks.entry((piece.joint, piece.block)).or_insert_with(|| DVector::zeros(size));
            for &(i, of_i) in entries.iter().filter(|entry| !self.fixed[entry.0]) {
                gradient[i] += of_i * slope;
                block[i] += of_i * slope;
                for &(j, of_j) in entries.iter().filter(|entry| !self.fixed[entry.0]) {
                    normal[(i, j)] += of_i * of_j * curvature;
                }
            }
        }
        for (nth, _) in self.fixed.iter().enumerate().filter(|parameter| *parameter.1) {
            normal[(nth, nth)] = 1.0;
        }
        (normal, gradient, blocks)
    }

    /// Returns the standard errors of offset and drift of every camera; infinite if nothing determines them.
    pub(super) fn errors(&self, found: &DVector<f64>) -> Vec<[f64; 2]> {
        let size = self.fixed.len();
        let (normal, _, blocks) = self.equations(found, &|_| true);
        let is_flat =
            |parameter: usize| !self.fixed[parameter] && normal[(parameter, parameter)] <= 0.0;
        let Some(inverse) = normal.clone().cholesky().map(|cholesky| cholesky.inverse()) else {
            return vec![[f64::INFINITY; 2]; size / 2];
        };
        let mut squares = DMatrix::zeros(size, size);
        for it in blocks.values() {
            squares += it * it.transpose();
        }
        let variance = &inverse * squares * &inverse * ALIKE;
        let by_parts = self.parts(found);
        let error = |nth: usize| {
            let of_part = by_parts.as_ref().map_or(0.0, |part| part[nth]);
            variance[(nth, nth)].max(of_part * ALIKE_PARTS).sqrt()
        };
        let of_camera = |camera: usize| {
            let [offset, drift] = [2 * camera, 2 * camera + 1];
            if !self.knows(camera) || is_flat(offset) {
                return [f64::INFINITY; 2];
            }
            // The other cameras are measured relative to the reference.
            let has_drift = self.fixed[offset] || !self.fixed[drift];
            let of_drift = if has_drift {
                error(drift) / self.scale_s
            } else {
                f64::INFINITY
            };
            [error(offset), of_drift]
        };
        (0..size / 2).map(of_camera).collect()
    }

    fn knows(&self, camera: usize) -> bool {
        self.pieces.iter().any(|piece| piece.cameras.contains(&camera))
    }

    /// Returns the variances of the results when parts of the footage are left out in turn (jackknife); `None` if the footage is too short.
    fn parts(&self, found: &DVector<f64>) -> Option<DVector<f64>> {
        let blocks: BTreeSet<i64> = self.pieces.iter().map(|piece| piece.block).collect();
        let blocks: Vec<i64> = blocks.into_iter().collect();
        let n = blocks.len().min(PARTS[1]);
        if n < PARTS[0] {
            return None;
        }
        let without = |part: usize| {
            let [from, to] = [part, part + 1].map(|value| value * blocks.len() / n);
            let left_out = blocks[from]..=blocks[to - 1];
            self.solve_from(found.clone(), &|block| !left_out.contains(&block))
        };
        let each: Vec<DVector<f64>> = (0..n).map(without).collect();
        let n = n as f64;
        let mean = each.iter().fold(DVector::zeros(found.len()), |sum, it| sum + it) / n;
        let squares = each.iter().map(|solution| (solution - &mean).map(|value| value * value));
        let sum = squares.fold(DVector::zeros(found.len()), |sum, it| sum + it);
        // The factor corrects for the poor estimate of a variance from so few parts.
        Some(sum * ((n - 1.0) / n * (1.0 + 2.0 / n)))
    }
}
