//! Percentiles of measured values.

use serde::{Deserialize, Serialize};
use statistics::Sorted;

/// Percentiles of measured values, in their unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Spread {
    /// Number of values.
    pub n: usize,
    /// The median.
    pub p50: f64,
    /// The 99th percentile.
    pub p99: f64,
    /// The 99.9th percentile; the maximum if there are fewer than 1000 values.
    pub p99_9: f64,
    /// The maximum.
    pub max: f64,
}

impl Spread {
    /// Returns the percentiles of values, by nearest rank; `None` if there are no values.
    pub(crate) fn of(values: Vec<f64>) -> Option<Self> {
        let sorted = Sorted::new(values);
        Some(Self {
            n: sorted.values().len(),
            p50: sorted.nearest_rank(0.5)?,
            p99: sorted.nearest_rank(0.99)?,
            p99_9: sorted.nearest_rank(0.999)?,
            max: sorted.nearest_rank(1.0)?,
        })
    }

    /// Returns the four percentiles as cells of a table; `-` if there are none.
    pub(crate) fn cells(spread: Option<Self>, digits: usize) -> [String; 4] {
        let Some(spread) = spread else {
            return ["-"; 4].map(str::to_owned);
        };
        [spread.p50, spread.p99, spread.p99_9, spread.max].map(|value| format!("{value:.digits$}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_values_that_were_measured() {
        let values = (1..=1000).rev().map(f64::from).collect();
        let expected = Spread {
            n: 1000,
            p50: 500.0,
            p99: 990.0,
            p99_9: 999.0,
            max: 1000.0,
        };
        assert_eq!(Spread::of(values), Some(expected));
    }

    #[test]
    fn the_high_percentiles_of_few_values_are_the_maximum() {
        let got = Spread::of(vec![3.0, 1.0, 2.0]).unwrap();
        assert_eq!([got.p50, got.p99, got.p99_9, got.max], [2.0, 3.0, 3.0, 3.0]);
        assert_eq!(Spread::of(vec![7.0]).unwrap().p50, 7.0);
    }

    #[test]
    fn without_values_there_are_no_percentiles() {
        assert_eq!(Spread::of(Vec::new()), None);
        assert_eq!(Spread::cells(None, 1), ["-"; 4]);
    }
}
