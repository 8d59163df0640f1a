//! Percentiles and medians; each definition has a name of its own.

use core::cmp::Ordering;

/// Numbers that can be sorted: `f32` and `f64`.
pub trait Number: Copy + sealed::Sealed {
    /// Compares by the total order of IEEE 754.
    fn order(&self, other: &Self) -> Ordering;

    /// Returns the midpoint between two numbers.
    #[must_use]
    fn middle(self, other: Self) -> Self;
}

mod sealed {
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}

impl Number for f32 {
    fn order(&self, other: &Self) -> Ordering {
        self.total_cmp(other)
    }

    fn middle(self, other: Self) -> Self {
        self.midpoint(other)
    }
}

impl Number for f64 {
    fn order(&self, other: &Self) -> Ordering {
        self.total_cmp(other)
    }

    fn middle(self, other: Self) -> Self {
        self.midpoint(other)
    }
}

/// A sample in ascending order that provides percentiles and medians.
///
/// All of them are `None` for an empty sample. The definitions differ if a percentile lies between two values. Results that are stored or
/// compared must all use the same definition.
///
/// ```
/// let sample = statistics::Sorted::new([4.0, 1.0, 3.0, 2.0]);
/// assert_eq!(sample.median(), Some(2.5));
/// assert_eq!(sample.lower_median(), Some(2.0));
/// assert_eq!(sample.upper_median(), Some(3.0));
/// assert_eq!(sample.nearest_rank(0.9), Some(4.0));
/// assert_eq!(sample.interpolated(0.9), Some(3.7));
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Sorted<T = f64> {
    values: Vec<T>,
}

impl<T: Number> Sorted<T> {
    /// Sorts a sample.
    ///
    /// * `values`: the values, in any order. NaN is sorted after all numbers, or before all numbers if its sign bit is set.
    pub fn new(values: impl Into<Vec<T>>) -> Self {
        let mut values = values.into();
        values.sort_by(T::order);
        Self { values }
    }

    /// Returns the values, in ascending order.
    pub fn values(&self) -> &[T] {
        &self.values
    }

    /// Returns the middle value; for an even number of values, the mean of the two middle values.
    pub fn median(&self) -> Option<T> {
        Some(self.lower_median()?.middle(self.upper_median()?))
    }

    /// Returns the middle value; for an even number of values, the lower of the two middle values.
    pub fn lower_median(&self) -> Option<T> {
        let last = self.values.len().checked_sub(1)?;
        self.values.get(last / 2).copied()
    }

    /// Returns the middle value; for an even number of values, the upper of the two middle values.
    pub fn upper_median(&self) -> Option<T> {
        self.values.get(self.values.len() / 2).copied()
    }

    /// Returns the percentile as the smallest value such that at least a given fraction of the sample is not larger (nearest rank). It is
    /// always a value of the sample.
    ///
    /// * `share`: fraction from 0 to 1; 0.9 is the 90th percentile.
    pub fn nearest_rank(&self, share: f64) -> Option<T> {
        let n = self.values.len();
        let rank = (share * n as f64).ceil() as usize;
        self.values.get(rank.clamp(1, n.max(1)) - 1).copied()
    }
}

impl Sorted<f64> {
    /// Returns the percentile, interpolated linearly between neighbours (definition 7 of Hyndman and Fan 1996).
    ///
    /// * `share`: fraction from 0 to 1; 0.9 is the 90th percentile.
    pub fn interpolated(&self, share: f64) -> Option<f64> {
        let last = self.values.len().checked_sub(1)?;
        let at = share.clamp(0.0, 1.0) * last as f64;
        let (low, high) = (
            *self.values.get(at.floor() as usize)?,
            *self.values.get(at.ceil() as usize)?,
        );
        Some(low + (high - low) * at.fract())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn the_interpolated_median_of_an_even_sample_lies_between_its_two_middle_values() {
        let sample = Sorted::new([4.0, 1.0, 3.0, 2.0]);
        assert_eq!(sample.interpolated(0.5), Some(2.5));
    }

    #[test]
    fn the_ends_are_the_extremes() {
        let sample = Sorted::new([5.0, -1.0, 2.0]);
        assert_eq!(sample.interpolated(0.0), Some(-1.0));
        assert_eq!(sample.interpolated(1.0), Some(5.0));
        assert_eq!(sample.nearest_rank(0.0), Some(-1.0));
        assert_eq!(sample.nearest_rank(1.0), Some(5.0));
    }

    #[test]
    fn an_empty_sample_has_no_percentile() {
        let sample = Sorted::<f64>::new([]);
        assert_eq!(sample.interpolated(0.5), None);
        assert_eq!(sample.nearest_rank(0.5), None);
        assert_eq!(sample.median(), None);
        assert_eq!(sample.lower_median(), None);
        assert_eq!(sample.upper_median(), None);
    }

    #[test]
    fn all_kinds_of_median_of_an_odd_sample_are_its_middle_value() {
        let sample = Sorted::new([3.0_f32, 1.0, 2.0]);
        let medians = [
            sample.median(),
            sample.lower_median(),
            sample.upper_median(),
        ];
        assert_eq!(medians, [Some(2.0); 3]);
    }

    proptest! {
        #[test]
        fn the_nearest_rank_is_the_least_value_with_enough_of_the_sample_at_or_below_it(
            values in prop::collection::vec(-9_i32..9, 1..40),
            share_of_64 in 1_usize..=64,
        ) {
            let values: Vec<f64> = values.into_iter().map(f64::from).collect();
            let share = share_of_64 as f64 / 64.0;
            let found = Sorted::new(&values[..]).nearest_rank(share).unwrap();
            let at_most = |limit: f64| values.iter().filter(|value| **value <= limit).count();
            let is_enough = |n: usize| 64 * n >= share_of_64 * values.len();
            prop_assert!(is_enough(at_most(found)));
            let less = values.iter().copied().filter(|value| *value < found).max_by(f64::total_cmp);
            prop_assert!(less.is_none_or(|less| !is_enough(at_most(less))));
        }

        #[test]
        fn interpolation_stays_between_the_extremes_and_is_monotonic(
            values in prop::collection::vec(-1e3..1e3_f64, 1..40), share in 0.0..1.0,
        ) {
            let sample = Sorted::new(values);
            let at = |share| sample.interpolated(share).unwrap();
            prop_assert!(at(0.0) <= at(share) && at(share) <= at(1.0));
            prop_assert!(at(share) <= at(share + (1.0 - share) / 2.0) + 1e-9);
        }
    }
}
