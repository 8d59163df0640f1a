//! Chooses the weights by cross-validation on held-out people.

use serde::Serialize;

use crate::learned::Weights;

/// The grid of weights to try.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// Weights of the geometric term.
    pub alphas: Vec<f64>,
    /// Caps on the distances of the geometric term, in cells; `None` means no cap.
    pub caps: Vec<Option<f64>>,
    /// Weights of the appearance term with the paper's joint probabilities.
    pub joint_betas: Vec<f64>,
    /// Weights of the appearance term with the lift.
    pub lift_betas: Vec<f64>,
}

impl Default for Grid {
    fn default() -> Self {
        Self {
            alphas: vec![0.0005, 0.001, 0.002, 0.004, 0.008, 0.016],
            caps: vec![None, Some(8.0), Some(4.0)],
            joint_betas: vec![0.03, 0.1, 0.3, 1.0],
            lift_betas: vec![0.01, 0.03, 0.1, 0.2],
        }
    }
}

/// The result of one choice of weights.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Point {
    /// The weights that gave this result.
    pub weights: Weights,
    /// The criterion to maximise: area under the curve of PCP3D over its threshold from 0 to 1, in percent.
    pub area: f64,
    /// PCP3D at 0.5, in percent.
    pub pcp3d: f64,
    /// Mean number of single-view solutions until a pair converged.
    pub iterations: f64,
}

/// Accumulates the results of one choice of weights over frames.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Tally {
    n: u64,
    area: f64,
    right: u64,
    n_pairs: u64,
    iterations: u64,
}

impl Tally {
    /// Counts one frame.
    ///
    /// * `segments`: errors of the segments as fractions of their length; `None` for a segment that was not found.
    /// * `iterations`: number of iterations of every pair.
    pub fn add(&mut self, segments: &[Option<f64>], iterations: &[u32]) {
        for error in segments {
            self.n += 1;
            // The area under a step from 0 to 1 at `error`, over thresholds from 0 to 1.
            self.area += error.map_or(0.0, |error| (1.0 - error).max(0.0));
            self.right += u64::from(error.is_some_and(|error| error <= 0.5));
        }
        self.n_pairs += iterations.len() as u64;
        self.iterations += iterations.iter().map(|iteration| u64::from(*iteration)).sum::<u64>();
    }

    /// Returns the result over all frames.
    pub fn point(&self, weights: Weights) -> Point {
        let n = self.n.max(1) as f64;
        Point {
            weights,
            area: 100.0 * self.area / n,
            pcp3d: 100.0 * self.right as f64 / n,
            iterations: self.iterations as f64 / self.n_pairs.max(1) as f64,
        }
    }
}

/// Returns the best of the points; the first one in a tie.
pub fn best(points: &[Point]) -> Option<&Point> {
    points.iter().reduce(|best, it| if it.area > best.area { it } else { best })
}

impl Grid {
    /// Returns the first search: the geometric term alone.
    pub fn geometry(&self) -> Vec<Weights> {
        let of_cap = |cap: &Option<f64>| {
            let alphas = self.alphas.iter();
            let cap = *cap;
            alphas.map(move |&alpha| without_appearance(alpha, cap))
        };
        self.caps.iter().flat_map(of_cap).collect()
    }

    /// Returns the second search: the appearance term with the best geometric weights and their neighbours.
    pub fn appearance(&self, best: &Weights) -> Vec<Weights> {
        let at = self.alphas.iter().position(|alpha| *alpha == best.alpha);
        let at = at.unwrap_or_default();
        let alphas = &self.alphas[at.saturating_sub(1)..(at + 2).min(self.alphas.len())];
        let forms = [
            (crate::learned::Appearance::Joint, &self.joint_betas),
            (crate::learned::Appearance::Lift, &self.lift_betas),
        ];
        let mut all = Vec::new();
        for (appearance, betas) in forms {
            for &alpha in alphas {
                all.extend(betas.iter().map(|&beta| Weights {
                    alpha,
                    beta,
                    appearance,
                    ..*best
                }));
            }
        }
        all
    }
}

fn without_appearance(alpha: f64, max_distance_cells: Option<f64>) -> Weights {
    Weights {
        alpha,
        beta: 0.0,
        max_distance_cells,
        appearance: crate::learned::Appearance::Lift,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_area_is_the_area_under_the_curve() {
        let errors = [Some(0.2), Some(0.5), Some(0.9), Some(3.0), None];
        let mut tally = Tally::default();
        tally.add(&errors, &[4, 6]);
        let point = tally.point(without_appearance(1.0, None));
        let right =
            |gamma: f64| errors.iter().flatten().filter(|error| **error <= gamma).count() as f64;
        let n = 10_000;
        let curve = (0..n).map(|i| right((f64::from(i) + 0.5) / f64::from(n)));
        let area = curve.sum::<f64>() / f64::from(n) / 5.0 * 100.0;
        assert!((point.area - area).abs() < 0.05, "{} {area}", point.area);
        assert_eq!((point.pcp3d, point.iterations), (40.0, 5.0));
    }

    #[test]
    fn appearance_is_searched_around_the_best_geometry() {
        let grid = Grid::default();
        let tried = grid.appearance(&without_appearance(0.004, Some(4.0)));
        assert_eq!(tried.len(), 3 * 8);
        let alphas = [0.002, 0.004, 0.008];
        assert!(tried.iter().all(|settings| alphas.contains(&settings.alpha)));
        assert!(tried.iter().all(|settings| settings.max_distance_cells == Some(4.0)));
        let at_the_edge = grid.appearance(&without_appearance(0.0005, None));
        assert_eq!(at_the_edge.len(), 2 * 8);
    }

    #[test]
    fn ties_go_to_the_first() {
        let point = |alpha, area| Point {
            weights: without_appearance(alpha, None),
            area,
            pcp3d: 0.0,
            iterations: 0.0,
        };
        let points = [point(1.0, 50.0), point(2.0, 60.0), point(3.0, 60.0)];
        assert_eq!(best(&points).unwrap().weights.alpha, 2.0);
    }
}
