//! Quality of the expected errors, which adaptive selection depends on.

use serde::{Deserialize, Serialize};
use skeleton::{N_PARTS, PART_NAMES};
use statistics::score::{area_under_roc, rank_correlation};

/// Expected and true errors of one view: one number per part, in pixels of the frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Predicted {
    /// Expected errors.
    pub sigma_px: Vec<f32>,
    /// Thresholds: parts with larger expected errors are switched off. Empty if there are no thresholds.
    pub tau_px: Vec<f32>,
    /// True errors of the single-view pose.
    pub error_px: Vec<f32>,
}

/// Quality of the predictions for a part, or for all parts.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Judgement {
    /// Name of the part; `mean` for the mean of the parts.
    pub part: String,
    /// Number of evaluated views.
    pub n: usize,
    /// Percentage of views in which the true error of the part is above the threshold.
    pub above: Option<f64>,
    /// Percentage of the views with a true error above the threshold in which the part is switched off (correctly).
    pub caught: Option<f64>,
    /// Percentage of the views with a true error below the threshold in which the part is switched off (wrongly).
    pub wasted: Option<f64>,
    /// Area under the ROC curve for "error above the threshold", predicted by the expected error divided by the threshold.
    pub auc: Option<f64>,
    /// Spearman's rank correlation between expected and true error, both divided by the threshold.
    pub rank_correlation: Option<f64>,
}

/// Evaluates predictions for every part, and their mean over the parts with a value.
///
/// Errors are divided by their threshold, since thresholds may depend on the person's size.
///
/// * Returns an empty list if no view has thresholds.
pub fn judge(views: &[&Predicted]) -> Vec<Judgement> {
    let parts: Vec<Judgement> = (0..N_PARTS)
        .map(|part| {
            of_part(
                PART_NAMES[part],
                views.iter().filter_map(|view| sample(view, part)),
            )
        })
        .collect();
    if parts.iter().all(|part| part.n == 0) {
        return Vec::new();
    }
    let mean = |of: fn(&Judgement) -> Option<f64>| {
        let known: Vec<f64> = parts.iter().filter_map(of).collect();
        (!known.is_empty()).then(|| known.iter().sum::<f64>() / known.len() as f64)
    };
    let all = Judgement {
        part: "mean".to_owned(),
        n: parts.iter().map(|part| part.n).sum::<usize>() / N_PARTS,
        above: mean(|part| part.above),
        caught: mean(|part| part.caught),
        wasted: mean(|part| part.wasted),
        auc: mean(|part| part.auc),
        rank_correlation: mean(|part| part.rank_correlation),
    };
    std::iter::once(all).chain(parts).collect()
}

/// Returns the expected and the true error of a part, divided by the threshold.
fn sample(view: &Predicted, part: usize) -> Option<(f64, f64)> {
    let at = |values: &[f32]| values.get(part).map(|value| f64::from(*value));
    let tau = at(&view.tau_px).filter(|value| *value > 0.0)?;
    let (sigma, error) = (at(&view.sigma_px)? / tau, at(&view.error_px)? / tau);
    (sigma.is_finite() && error.is_finite()).then_some((sigma, error))
}

fn of_part(name: &str, samples: impl Iterator<Item = (f64, f64)>) -> Judgement {
    let samples: Vec<(f64, f64)> = samples.collect();
    let classes: Vec<(f64, bool)> =
        samples.iter().map(|sample| (sample.0, sample.1 > 1.0)).collect();
    let share = |of: &dyn Fn(&(f64, bool)) -> bool, among: &dyn Fn(&(f64, bool)) -> bool| {
        let n = classes.iter().filter(|class| among(class)).count();
        let hits = classes.iter().filter(|class| among(class) && of(class)).count();
        (n > 0).then(|| 100.0 * hits as f64 / n as f64)
    };
    Judgement {
        part: name.to_owned(),
        n: samples.len(),
        above: share(&|class| class.1, &|_| true),
        caught: share(&|class| class.0 > 1.0, &|class| class.1),
        wasted: share(&|class| class.0 > 1.0, &|class| !class.1),
        auc: area_under_roc(&classes),
        rank_correlation: rank_correlation(&samples),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a view with the same values for all parts.
    fn view(sigma: f32, tau: f32, error: f32) -> Predicted {
        let all = |value: f32| vec![value; N_PARTS];
        Predicted {
            sigma_px: all(sigma),
            tau_px: all(tau),
            error_px: all(error),
        }
    }

    #[test]
    fn predictions_are_judged_by_the_threshold_of_their_own_view() {
        // The last person is twice as large as the others, and the threshold is twice as high.
        let views = [
            view(5.0, 10.0, 4.0),
            view(15.0, 10.0, 12.0),
            view(11.0, 10.0, 8.0),
            view(18.0, 20.0, 30.0),
        ];
        let judged = judge(&views.iter().collect::<Vec<_>>());
        assert_eq!(judged.len(), 1 + N_PARTS);
        let all = &judged[0];
        assert_eq!((all.part.as_str(), all.n), ("mean", 4));
        assert_eq!(
            (all.above, all.caught, all.wasted),
            (Some(50.0), Some(50.0), Some(50.0))
        );
        // Of four pairs of samples, only one is in the wrong order: the expected error is 0.9 where the true error is above the threshold,
        // but 1.1 where it is below.
        assert_eq!(all.auc, Some(0.75));
        assert_eq!(judged[7].part, PART_NAMES[6]);
        assert_eq!(judged[7].auc, Some(0.75));
    }

    #[test]
    fn the_true_errors_are_a_perfect_prediction() {
        let views: Vec<Predicted> = (1..9).map(|i| view(i as f32, 4.0, i as f32)).collect();
        let all = &judge(&views.iter().collect::<Vec<_>>())[0];
        assert_eq!((all.auc, all.rank_correlation), (Some(1.0), Some(1.0)));
        assert_eq!((all.caught, all.wasted), (Some(100.0), Some(0.0)));
    }

    #[test]
    fn a_constant_prediction_has_chance_level() {
        let views: Vec<Predicted> = (1..9).map(|i| view(3.0, 4.0, i as f32)).collect();
        let all = &judge(&views.iter().collect::<Vec<_>>())[0];
        assert_eq!((all.auc, all.rank_correlation), (Some(0.5), None));
    }

    #[test]
    fn without_thresholds_no_prediction_is_judged() {
        let mut alone = view(1.0, 1.0, 1.0);
        alone.tau_px.clear();
        assert_eq!(judge(&[&alone]), []);
        assert_eq!(judge(&[]), []);
    }
}
