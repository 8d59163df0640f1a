//! Evaluates predicted errors by comparing them with the true errors, part by part.

use skeleton::N_PARTS;
use statistics::Sorted;
use statistics::score::{area_under_roc, rank_correlation};

use super::sample::Sample;

/// Measures of the quality of predictions, for each part.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Judgement {
    /// Number of samples.
    pub n: usize,
    /// Area under the ROC curve of the classification "the error is larger than tau"; `None` if all samples are in the same class.
    pub area: Vec<Option<f64>>,
    /// Rank correlation of predicted and true error.
    pub rank_correlation: Vec<Option<f64>>,
    /// Mean absolute difference of predicted and true error, as a share of the height that the tile shows.
    pub inaccuracy: Vec<f64>,
    /// For each part, the share of the samples whose error is larger than tau.
    pub beyond: Vec<f64>,
}

/// The median error of every part, used as its tau. Errors are shares of the height that the tiles show.
pub fn tau(samples: &[&Sample]) -> Vec<f32> {
    let of_part = |part: usize| -> Vec<f32> {
        let share = |sample: &&Sample| sample.errors_px[part] / sample.height_px;
        samples.iter().map(share).collect()
    };
    (0..N_PARTS)
        .map(|part| Sorted::new(of_part(part)).median().unwrap_or(0.0))
        .collect()
}

impl Judgement {
    /// Evaluates predictions.
    ///
    /// * `predicted`: `[sample][part]`, as shares of the height that the tile shows.
    /// * `truth`: the samples.
    /// * `tau`: the thresholds, also as shares of this height.
    ///
    /// # Panics
    ///
    /// Panics if there are fewer predictions than samples.
    pub fn new(predicted: &[Vec<f32>], truth: &[&Sample], tau: &[f32]) -> Self {
        let n = truth.len();
        let mut judgement = Self {
            n,
            area: Vec::new(),
            rank_correlation: Vec::new(),
            inaccuracy: Vec::new(),
            beyond: Vec::new(),
        };
        for (part, tau) in tau.iter().enumerate() {
            let expected: Vec<f32> = predicted[..n].iter().map(|values| values[part]).collect();
            let actual: Vec<f32> =
                truth.iter().map(|sample| sample.errors_px[part] / sample.height_px).collect();
            let both = || expected.iter().zip(&actual);
            let off = both().map(|(a, b)| f64::from((a - b).abs()));
            let n_beyond = actual.iter().filter(|error| *error > tau).count();
            let classed = both().map(|(a, b)| (f64::from(*a), b > tau));
            let pairs = both().map(|(a, b)| (f64::from(*a), f64::from(*b)));
            judgement.area.push(area_under_roc(&classed.collect::<Vec<_>>()));
            judgement.rank_correlation.push(rank_correlation(&pairs.collect::<Vec<_>>()));
            judgement.inaccuracy.push(off.sum::<f64>() / n as f64);
            judgement.beyond.push(n_beyond as f64 / n as f64);
        }
        judgement
    }

    /// Mean of the area under the ROC curve, over the parts for which it is known.
    pub fn mean_area(&self) -> f64 {
        mean(&self.area)
    }

    /// Mean rank correlation, over the parts for which it is known.
    pub fn mean_rank_correlation(&self) -> f64 {
        mean(&self.rank_correlation)
    }
}

fn mean(of: &[Option<f64>]) -> f64 {
    let known: Vec<f64> = of.iter().flatten().copied().collect();
    known.iter().sum::<f64>() / known.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(error_px: f32) -> Sample {
        Sample {
            group: String::new(),
            source: String::new(),
            picture: Vec::new(),
            evidence: Vec::new(),
            height_px: 100.0,
            errors_px: vec![error_px; N_PARTS],
        }
    }

    #[test]
    fn the_true_errors_are_the_best_prediction_and_a_constant_has_chance_level() {
        let samples = [sample(1.0), sample(5.0), sample(3.0), sample(9.0)];
        let all: Vec<&Sample> = samples.iter().collect();
        let tau = tau(&all);
        assert_eq!(tau, [0.04; N_PARTS]);
        let truth: Vec<Vec<f32>> = samples
            .iter()
            .map(|sample| sample.errors_px.iter().map(|px| px / 100.0).collect())
            .collect();
        let judgement = Judgement::new(&truth, &all, &tau);
        assert_eq!(judgement.mean_area(), 1.0);
        assert!((judgement.mean_rank_correlation() - 1.0).abs() < 1e-12);
        assert_eq!(judgement.inaccuracy, [0.0; N_PARTS]);
        assert_eq!(judgement.beyond, [0.5; N_PARTS]);
        let constant = vec![vec![0.04; N_PARTS]; 4];
        let judgement = Judgement::new(&constant, &all, &tau);
        assert_eq!(judgement.mean_area(), 0.5);
        assert_eq!(judgement.rank_correlation, [None; N_PARTS]);
    }
}
