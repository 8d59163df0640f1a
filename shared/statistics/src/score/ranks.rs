//! Rank statistics: area under the ROC, and rank correlation.

/// Returns the area under the receiver operating characteristic: the probability that a sample of the class scores above a sample that is
/// not of the class, where ties count half (Mann and Whitney).
///
/// * `samples`: score, and whether the sample is of the class.
/// * Returns `None` if all samples, or none, are of the class, or if a score is NaN.
pub fn area_under_roc(samples: &[(f64, bool)]) -> Option<f64> {
    let scores: Vec<f64> = samples.iter().map(|sample| sample.0).collect();
    let ranks = ranks(&scores)?;
    let positives = samples.iter().zip(&ranks).filter(|sample| sample.0.1);
    let (n, sum) = positives.fold((0.0, 0.0), |(n, sum), it| (n + 1.0, sum + it.1));
    let others = samples.len() as f64 - n;
    (n > 0.0 && others > 0.0).then(|| (sum - n * (n + 1.0) / 2.0) / (n * others))
}

/// Returns Spearman's rank correlation of two quantities; ties get the mean of their ranks.
///
/// * Returns `None` for fewer than two pairs, if either quantity is constant, or if a number is NaN.
pub fn rank_correlation(pairs: &[(f64, f64)]) -> Option<f64> {
    let [first, second] = [
        pairs.iter().map(|pair| pair.0).collect::<Vec<f64>>(),
        pairs.iter().map(|pair| pair.1).collect(),
    ];
    let [first, second] = [ranks(&first)?, ranks(&second)?];
    let mean = f64::midpoint(pairs.len() as f64, 1.0);
    let product = |a: &[f64], b: &[f64]| -> f64 {
        let both = a.iter().zip(b);
        both.map(|(a, b)| (a - mean) * (b - mean)).sum()
    };
    let scale = (product(&first, &first) * product(&second, &second)).sqrt();
    (scale > 0.0).then(|| product(&first, &second) / scale)
}

/// Ranks counted from 1; equal numbers get the mean of their ranks. `None` if one is NaN.
fn ranks(values: &[f64]) -> Option<Vec<f64>> {
    if values.iter().any(|value| value.is_nan()) {
        return None;
    }
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
    let mut ranks = vec![0.0; values.len()];
    let mut begin = 0;
    for equal in order.chunk_by(|&a, &b| values[a] == values[b]) {
        let rank = begin as f64 + f64::midpoint(equal.len() as f64, 1.0);
        for &it in equal {
            ranks[it] = rank;
        }
        begin += equal.len();
    }
    Some(ranks)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_separating_score_has_area_1_and_a_constant_score_has_area_one_half() {
        let separating = [(1.0, false), (2.0, false), (3.0, true), (4.0, true)];
        assert_eq!(area_under_roc(&separating), Some(1.0));
        let wrong = separating.map(|(score, is)| (score, !is));
        assert_eq!(area_under_roc(&wrong), Some(0.0));
        let constant = separating.map(|(_, is)| (7.0, is));
        assert_eq!(area_under_roc(&constant), Some(0.5));
    }

    #[test]
    fn without_positive_and_negative_samples_there_is_no_area() {
        assert_eq!(area_under_roc(&[(1.0, true), (2.0, true)]), None);
        assert_eq!(area_under_roc(&[(1.0, false)]), None);
        assert_eq!(area_under_roc(&[]), None);
        assert_eq!(area_under_roc(&[(f64::NAN, true), (2.0, false)]), None);
    }

    #[test]
    fn rank_correlation_depends_on_the_order_only() {
        let curved = [(1.0, 1.0), (2.0, 8.0), (3.0, 27.0), (4.0, 1000.0)];
        assert_eq!(rank_correlation(&curved), Some(1.0));
        let falling = curved.map(|(a, b)| (-a, b));
        assert_eq!(rank_correlation(&falling), Some(-1.0));
        // Ranks 1, 2.5, 2.5, 4 against 1, 3, 2, 4: 4.5 / sqrt(4.5 x 5).
        let tied = [(1.0, 1.0), (2.0, 3.0), (2.0, 2.0), (5.0, 9.0)];
        let got = rank_correlation(&tied).unwrap();
        assert!((got - 4.5 / 22.5_f64.sqrt()).abs() < 1e-12, "{got}");
    }

    #[test]
    fn a_constant_has_no_rank_correlation() {
        assert_eq!(rank_correlation(&[(1.0, 1.0), (1.0, 2.0)]), None);
        assert_eq!(rank_correlation(&[(1.0, 1.0)]), None);
        assert_eq!(rank_correlation(&[(f64::NAN, 1.0), (1.0, 2.0)]), None);
    }

    proptest! {
        #[test]
        fn the_area_is_the_fraction_of_pairs_in_the_right_order(
            samples in prop::collection::vec((0..6_i32, any::<bool>()), 0..40),
        ) {
            let samples: Vec<(f64, bool)> =
                samples.into_iter().map(|(score, is)| (f64::from(score), is)).collect();
            let (mut sum, mut n) = (0.0, 0.0);
            for of in samples.iter().filter(|sample| sample.1) {
                for not in samples.iter().filter(|sample| !sample.1) {
                    n += 1.0;
                    sum += if of.0 > not.0 { 1.0 } else if of.0 == not.0 { 0.5 } else { 0.0 };
                }
            }
            let expected = (n > 0.0).then(|| sum / n);
            let got = area_under_roc(&samples);
            prop_assert_eq!(got.is_some(), expected.is_some());
            let difference = got.unwrap_or_default() - expected.unwrap_or_default();
            prop_assert!(difference.abs() < 1e-12);
        }
    }
}
