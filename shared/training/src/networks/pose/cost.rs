//! The cost of the difference between the network's output and the true output, and its gradients.

use serde::{Deserialize, Serialize};

use super::network::STRIDE;
use super::peak;

/// Range to which the logarithm of an expected error is clamped.
const LOGARITHMS: core::ops::RangeInclusive<f32> = -8.0..=2.0;
/// Additional weight of a cell with heat 1, relative to a cell with heat 0.
const HEAT: f32 = 9.0;
/// Approximate sum of the weights of all cells of a map in which no cell has heat.
const CELLS: f32 = 40.0;

/// The truth of a batch.
#[derive(Debug, Clone, Default)]
pub struct Truth {
    /// Columns and rows of the maps.
    pub cells: [usize; 2],
    /// True heat of every keypoint, 0 to 1: `[n, keypoints, rows, columns]`.
    pub maps: Vec<f32>,
    /// Weight of the map of every keypoint: `[n, keypoints]`.
    pub weights: Vec<f32>,
    /// Direction of the trunk; its length, 0 to 1, is the certainty: `[n, 2]`.
    pub fronts: Vec<f32>,
    /// Positions of the keypoints in cells of the maps, NaN if a position is not certain: `[n, keypoints, 2]`.
    pub places: Vec<f32>,
}

/// The parts of the cost of a step.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Cost {
    /// Cost of the maps.
    pub maps: f32,
    /// Cost of the direction, in nats per person with a known direction.
    pub front: f32,
    /// Cost of the expected errors.
    pub error: f32,
}

/// A part of the cost, and its gradient with respect to an output of the network.
pub(super) struct Part {
    pub(super) cost: f32,
    pub(super) gradient: Vec<f32>,
}

/// Returns log(1 + exp(x)), without overflow.
fn softplus(x: f32) -> f32 {
    x.max(0.0) + (-x.abs()).exp().ln_1p()
}

fn sigmoid(x: f32) -> f32 {
    1.0 / (1.0 + (-x).exp())
}

impl Truth {
    /// Number of columns and rows of the maps for an input of some width and height.
    pub(super) fn cells([width, height]: [usize; 2]) -> [usize; 2] {
        [width, height].map(|side| side / STRIDE)
    }

    /// Cross-entropy of the maps, in which cells of heat 1 have ten times the weight. It is a mean over joints, relative to `CELLS`.
    pub(super) fn of_maps(&self, maps: &[f32]) -> Part {
        let [columns, rows] = self.cells;
        let all = self.weights.iter().sum::<f32>().max(1.0) * CELLS;
        let mut sum = 0.0;
        let mut gradient = Vec::with_capacity(maps.len());
        let targets = self.maps.chunks_exact(columns * rows);
        let found = maps.chunks_exact(columns * rows).zip(targets);
        for ((found, target), weight) in found.zip(&self.weights) {
            let mut of_map = 0.0;
            for (found, target) in found.iter().zip(target) {
                let weight = (target * HEAT + 1.0) * weight / all;
                of_map += weight * (softplus(*found) - found * target);
                gradient.push(weight * (sigmoid(*found) - target));
            }
            sum += of_map;
        }
        Part {
            cost: sum,
            gradient,
        }
    }

    /// Negative log-likelihood of the direction, weighted by its certainty.
    pub(super) fn of_front(&self, evidence: &[f32]) -> Part {
        let directions = self.fronts.as_chunks::<2>().0;
        let lengths: Vec<f32> = directions.iter().map(|[x, y]| x.hypot(*y)).collect();
        let certain = lengths.iter().sum::<f32>().max(1.0);
        let mut cost = 0.0;
        let mut gradient = Vec::with_capacity(evidence.len());
        let evidence = evidence.as_chunks::<2>().0;
        for ((evidence, direction), length) in evidence.iter().zip(directions).zip(lengths) {
            let along = evidence[0] * direction[0] + evidence[1] * direction[1];
            let factor = 2.0 / (length + 1e-6);
            let weight = length / certain;
            cost += weight * softplus(-along * factor);
            let slope = -weight * factor * sigmoid(-along * factor);
            gradient.extend(direction.map(|axis| slope * axis));
        }
        Part { cost, gradient }
    }

    /// Negative log-likelihood of the distances between the maxima of the maps and the true positions. These errors are assumed to be
    /// exponentially distributed, with the expected error as mean.
    pub(super) fn of_error(&self, logarithms: &[f32], maps: &[f32]) -> Part {
        let off = self.off(maps);
        let n_known = off.iter().flatten().count().max(1) as f32;
        let mut cost = 0.0;
        let gradient = logarithms.iter().zip(off).map(|(logarithm, off)| {
            let off = off?;
            let is_free = LOGARITHMS.contains(logarithm);
            let logarithm = logarithm.clamp(*LOGARITHMS.start(), *LOGARITHMS.end());
            let heights = off * (-logarithm).exp();
            cost += (heights + logarithm) / n_known;
            is_free.then_some((1.0 - heights) / n_known)
        });
        let gradient = gradient.map(Option::unwrap_or_default).collect();
        Part { cost, gradient }
    }

    /// Errors of the maxima of the maps, in heights of the input; `None` if the joint's position is not certain.
    fn off(&self, maps: &[f32]) -> Vec<Option<f32>> {
        let [columns, rows] = self.cells;
        let known = self.places.as_chunks::<2>().0;
        let off = maps.chunks_exact(columns * rows).zip(known);
        let off = off.map(|(map, place)| {
            let [x, y] = peak(map, columns);
            let off = (x - place[0]).hypot(y - place[1]) / rows as f32;
            off.is_finite().then_some(off)
        });
        off.collect()
    }
}

#[cfg(test)]
mod tests {
    use fastrand::Rng;

    use super::super::network::N_KEYPOINTS;
    use super::*;

    /// Checks that the gradient of a part of the cost matches the change of the cost with every output.
    fn check(outputs: &[f32], part: &dyn Fn(&[f32]) -> Part) {
        let step = 1e-2;
        let gradient = part(outputs).gradient;
        assert_eq!(gradient.len(), outputs.len());
        for (at, gradient) in gradient.iter().enumerate() {
            let moved = |by: f32| {
                let mut moved = outputs.to_vec();
                moved[at] += by;
                part(&moved).cost
            };
            let change = (moved(step) - moved(-step)) / (2.0 * step);
            assert!(
                (change - gradient).abs() < 2e-3 * gradient.abs().max(0.05),
                "{at}: {change}, {gradient}"
            );
        }
    }

    #[test]
    fn gradients_of_the_cost_equal_finite_differences() {
        let (n, cells) = (2, [4, 3]);
        let mut rng = Rng::with_seed(3);
        let mut numbers = |n: usize| -> Vec<f32> { (0..n).map(|_| rng.f32()).collect() };
        let mut truth = Truth {
            cells,
            maps: numbers(n * N_KEYPOINTS * 12),
            weights: numbers(n * N_KEYPOINTS),
            fronts: numbers(n * 2),
            places: numbers(n * N_KEYPOINTS * 2),
        };
        truth.places[4] = f32::NAN;
        let maps: Vec<f32> = numbers(truth.maps.len()).iter().map(|x| 8.0 * x - 4.0).collect();
        check(&maps, &|maps| truth.of_maps(maps));
        check(&numbers(n * 2), &|front| truth.of_front(front));
        let logarithms: Vec<f32> = numbers(n * N_KEYPOINTS).iter().map(|x| x - 2.0).collect();
        check(&logarithms, &|logarithms| truth.of_error(logarithms, &maps));
    }

    #[test]
    fn an_expected_error_out_of_bounds_has_no_gradient() {
        let truth = Truth {
            cells: [1, 1],
            places: vec![5.0, 5.0, 0.0, 0.0],
            ..Truth::default()
        };
        let part = truth.of_error(&[-9.0, 3.0], &[0.0, 0.0]);
        assert_eq!(part.gradient, [0.0, 0.0]);
        assert!(part.cost.is_finite());
    }
}
