//! The cost of the difference between the network's output and the true output, and its gradients.

use serde::{Deserialize, Serialize};

use super::network::CHANNELS;

/// Range to which the logarithm of a distance to a side of the box is clamped.
const LOGARITHMS: core::ops::RangeInclusive<f32> = -3.0..=5.0;
/// Limit of the log-odds of a cell, beyond which they are clamped.
const MOST_LOG_ODDS: f32 = 15.0;

/// The true boxes of a batch, as heat and sides.
#[derive(Debug, Clone, Default)]
pub struct Truth {
    /// Heat of every cell, 0 to 1, exactly 1 at the middle of a box: `[n, rows, columns]`. Cells with a value below 0 do not count.
    pub heat: Vec<f32>,
    /// Distances from the centre of every cell to the sides of its box, in cells; 0 if the cell belongs to no box:
    /// `[n, 4, rows, columns]`.
    pub sides: Vec<f32>,
}

/// The parts of the cost of a step.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Cost {
    /// The cost of the heat, divided by the number of people.
    pub heat: f32,
    /// The cost of the boxes: the mean of -log(`IoU`), where `IoU` is the intersection over union with the true box.
    pub sides: f32,
}

impl Truth {
    /// Returns the cost, and its gradient with respect to the output of the network.
    ///
    /// The cost of the heat is the focal loss with lower penalties around the middle of a box (Law and Deng 2018, "`CornerNet`", equation
    /// 1). The cost of the boxes is the negative logarithm of the intersection over union (Yu et al. 2016, "`UnitBox`"), with cells
    /// weighted by their heat.
    ///
    /// * `cells`: columns times rows.
    /// * `weight`: weight of the boxes relative to the heat.
    pub fn cost(&self, found: &[f32], cells: usize, weight: f32) -> (Cost, Vec<f32>) {
        let mut cost = Cost::default();
        let mut gradient = vec![0.0; found.len()];
        let n_people = self.heat.iter().filter(|heat| **heat == 1.0).count();
        let n_people = n_people.max(1) as f32;
        let heat_of_boxes = self.heat_of_boxes(cells).max(1e-3);
        let samples = found.chunks_exact(CHANNELS * cells).enumerate();
        let gradients = gradient.chunks_exact_mut(CHANNELS * cells);
        for ((nth, found), gradient) in samples.zip(gradients) {
            let heat = &self.heat[nth * cells..][..cells];
            let sides = &self.sides[4 * nth * cells..][..4 * cells];
            for (at, heat) in heat.iter().enumerate().filter(|(_, heat)| **heat >= 0.0) {
                let [value, slope] = focal(found[at], *heat);
                cost.heat += value / n_people;
                gradient[at] = slope / n_people;
                if sides[at] <= 0.0 {
                    continue;
                }
                let share = heat / heat_of_boxes;
                let truth = [0, 1, 2, 3].map(|side| sides[side * cells + at]);
                let logarithms = [1, 2, 3, 4].map(|channel| found[channel * cells + at]);
                let (value, slopes) = union(logarithms, truth);
                cost.sides += share * value;
                for (side, slope) in slopes.into_iter().enumerate() {
                    gradient[(side + 1) * cells + at] = weight * share * slope;
                }
            }
        }
        (cost, gradient)
    }

    /// The sum of the heat over all cells that belong to a box.
    fn heat_of_boxes(&self, cells: usize) -> f32 {
        let heat = self.heat.chunks_exact(cells);
        let each = heat.zip(self.sides.chunks_exact(4 * cells));
        let boxed = each.flat_map(|(heat, sides)| heat.iter().zip(sides));
        let boxed = boxed.filter(|(heat, left)| **heat >= 0.0 && **left > 0.0);
        boxed.map(|(heat, _)| heat).sum()
    }
}

/// The focal loss of a cell, and its derivative with respect to the log-odds.
fn focal(log_odds: f32, heat: f32) -> [f32; 2] {
    let x = log_odds.clamp(-MOST_LOG_ODDS, MOST_LOG_ODDS);
    let p = 1.0 / (1.0 + (-x).exp());
    // Logarithms of p and of 1 - p, without cancellation.
    let of_p = -(-x).exp().ln_1p();
    let of_other = -x.exp().ln_1p();
    let q = 1.0 - p;
    if heat == 1.0 {
        return [-q * q * of_p, 2.0 * p * q * q * of_p - q.powi(3)];
    }
    let weight = (1.0 - heat).powi(4);
    [
        -weight * p * p * of_other,
        weight * (p.powi(3) - 2.0 * p * p * q * of_other),
    ]
}

/// The negative logarithm of the intersection over union of two boxes around a point, and its derivatives with respect to the logarithms of
/// the distances to the sides.
fn union(logarithms: [f32; 4], truth: [f32; 4]) -> (f32, [f32; 4]) {
    let sides = logarithms.map(|side| side.clamp(*LOGARITHMS.start(), *LOGARITHMS.end()).exp());
    let area = |[left, top, right, bottom]: [f32; 4]| (left + right) * (top + bottom);
    let both: [f32; 4] = core::array::from_fn(|side| sides[side].min(truth[side]));
    let shared = area(both);
    let all = area(sides) + area(truth) - shared;
    let slopes = core::array::from_fn(|side| {
        if !LOGARITHMS.contains(&logarithms[side]) {
            return 0.0;
        }
        let [across, of_both] =
            [sides, both].map(|box_| box_[(side + 1) % 4] + box_[(side + 3) % 4]);
        let of_shared = if sides[side] < truth[side] {
            of_both
        } else {
            0.0
        };
        let of_all = across - of_shared;
        sides[side] * (of_all / all - of_shared / shared)
    });
    ((all / shared).ln(), slopes)
}

#[cfg(test)]
mod tests {
    use fastrand::Rng;

    use super::*;

    #[test]
    fn gradients_of_the_cost_equal_finite_differences() {
        let cells = 6;
        let mut rng = Rng::with_seed(3);
        let mut truth = Truth {
            heat: (0..2 * cells).map(|_| rng.f32()).collect(),
            sides: (0..8 * cells).map(|_| 0.5 + 3.0 * rng.f32()).collect(),
        };
        (truth.heat[3], truth.heat[8], truth.heat[5]) = (1.0, 1.0, -1.0);
        truth.sides[2] = 0.0;
        let mut found: Vec<f32> =
            (0..2 * CHANNELS * cells).map(|_| 3.0 * rng.f32() - 1.5).collect();
        // The cost is not differentiable where a side equals the true side.
        for (nth, side) in truth.sides.iter().enumerate() {
            let [sample, within] = [nth / (4 * cells), nth % (4 * cells)];
            let found = &mut found[sample * CHANNELS * cells + cells + within];
            if (*found - side.ln()).abs() < 0.05 {
                *found += 0.1;
            }
        }
        let whole = |found: &[f32]| {
            let (cost, gradient) = truth.cost(found, cells, 0.7);
            (cost.heat + 0.7 * cost.sides, gradient)
        };
        let gradient = whole(&found).1;
        for (at, gradient) in gradient.iter().enumerate() {
            let moved = |by: f32| {
                let mut moved = found.clone();
                moved[at] += by;
                whole(&moved).0
            };
            let change = (moved(1e-2) - moved(-1e-2)) / 2e-2;
            assert!(
                (change - gradient).abs() < 1e-2 * gradient.abs().max(0.05),
                "{at}: {change}, {gradient}"
            );
        }
    }

    #[test]
    fn a_box_that_is_found_exactly_costs_nothing() {
        let sides = [1.0_f32, 2.0, 3.0, 4.0];
        let (cost, _) = union(sides.map(f32::ln), sides);
        assert!(cost.abs() < 1e-6, "{cost}");
    }
}
