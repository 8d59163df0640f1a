//! Percentiles of a sample.

/// The value below which a share of the sample lies, interpolated linearly between neighbours.
///
/// * `values`: in any order; NaN is not allowed.
/// * `share`: 0.5 is the median, 0.9 the 90th percentile.
/// * Returns `None` for an empty sample.
pub fn percentile(values: &[f64], share: f64) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len().checked_sub(1)?;
    let at = share.clamp(0.0, 1.0) * last as f64;
    let (lo, hi) = (at.floor() as usize, at.ceil() as usize);
    Some(sorted[lo] + (sorted[hi] - sorted[lo]) * (at - lo as f64))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_of_an_even_sample_lies_between_its_middles() {
        assert_eq!(percentile(&[4.0, 1.0, 3.0, 2.0], 0.5), Some(2.5));
    }

    #[test]
    fn the_ends_are_the_extremes() {
        let values = [5.0, -1.0, 2.0];
        assert_eq!(percentile(&values, 0.0), Some(-1.0));
        assert_eq!(percentile(&values, 1.0), Some(5.0));
    }

    #[test]
    fn an_empty_sample_has_none() {
        assert_eq!(percentile(&[], 0.5), None);
    }
}
