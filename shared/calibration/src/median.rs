//! The median.

/// The upper median; none of nothing. Sorts its argument.
pub(crate) fn median(all: &mut [f64]) -> Option<f64> {
    all.sort_by(f64::total_cmp);
    all.get(all.len() / 2).copied()
}
