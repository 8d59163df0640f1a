//! Measures of predicted errors as classifiers of errors above a threshold.

/// Area under the ROC curve: the probability that a positive sample scores higher than a negative one; ties count half.
///
/// * Returns `None` if all samples are positive or all are negative.
pub fn area(scores: &[f32], positive: &[bool]) -> Option<f64> {
    let ranks = ranks(scores);
    let of_positive = ranks.iter().zip(positive).filter(|ranked| *ranked.1);
    let n_positive = positive.iter().filter(|is_positive| **is_positive).count() as f64;
    let n_other = positive.len() as f64 - n_positive;
    let sum: f64 = of_positive.map(|ranked| ranked.0).sum();
    let above = sum - n_positive * (n_positive + 1.0) / 2.0;
    (n_positive > 0.0 && n_other > 0.0).then(|| above / (n_positive * n_other))
}

/// Spearman's rank correlation; tied values share the mean of their ranks.
///
/// * Returns `None` if all values of one list are the same.
pub fn rank_correlation(a: &[f32], b: &[f32]) -> Option<f64> {
    let (a, b) = (ranks(a), ranks(b));
    let middle = f64::midpoint(a.len() as f64, 1.0);
    let product = |a: &[f64], b: &[f64]| -> f64 {
        let each = a.iter().zip(b);
        each.map(|(a, b)| (a - middle) * (b - middle)).sum()
    };
    let size = (product(&a, &a) * product(&b, &b)).sqrt();
    (size > 0.0).then(|| product(&a, &b) / size)
}

/// Ranks from 1; ties share their mean.
fn ranks(of: &[f32]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..of.len()).collect();
    order.sort_unstable_by(|a, b| of[*a].total_cmp(&of[*b]));
    let mut ranks = vec![0.0; of.len()];
    let same = order.chunk_by(|a, b| of[*a] == of[*b]);
    let mut before = 0;
    for group in same {
        let mean = before as f64 + f64::midpoint(group.len() as f64, 1.0);
        for &at in group {
            ranks[at] = mean;
        }
        before += group.len();
    }
    ranks
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn ranks_of_ties_are_shared() {
        assert_eq!(ranks(&[5.0, 1.0, 5.0, 0.0]), [3.5, 2.0, 3.5, 1.0]);
    }

    #[test]
    fn a_perfect_score_has_area_1_and_a_constant_score_has_area_one_half() {
        let positive = [false, true, false, true];
        assert_eq!(area(&[1.0, 3.0, 2.0, 4.0], &positive), Some(1.0));
        assert_eq!(area(&[1.0; 4], &positive), Some(0.5));
        assert_eq!(area(&[4.0, 2.0, 3.0, 1.0], &positive), Some(0.0));
        assert_eq!(area(&[1.0, 2.0], &[true, true]), None);
    }

    #[test]
    fn any_increasing_function_has_rank_correlation_1() {
        let a = [1.0, 5.0, 2.0, 9.0];
        let b = a.map(f32::exp);
        assert!((rank_correlation(&a, &b).unwrap() - 1.0).abs() < 1e-12);
        let falling = a.map(|value| -value);
        assert!((rank_correlation(&a, &falling).unwrap() + 1.0).abs() < 1e-12);
        assert_eq!(rank_correlation(&a, &[1.0; 4]), None);
    }

    proptest! {
        #[test]
        fn the_area_is_the_fraction_of_pairs_in_the_right_order(
            cases in proptest::collection::vec((0_u8..12, any::<bool>()), 2..40)
        ) {
            let scores: Vec<f32> = cases.iter().map(|case| f32::from(case.0)).collect();
            let positive: Vec<bool> = cases.iter().map(|case| case.1).collect();
            let (mut n, mut right) = (0.0, 0.0);
            for (a, _) in cases.iter().filter(|case| case.1) {
                for (b, _) in cases.iter().filter(|case| !case.1) {
                    n += 1.0;
                    right += 0.5 * (f64::from(u8::from(a > b)) + f64::from(u8::from(a >= b)));
                }
            }
            if let Some(area) = area(&scores, &positive) {
                prop_assert!((area - right / n).abs() < 1e-12);
            } else {
                prop_assert_eq!(n, 0.0);
            }
        }
    }
}
