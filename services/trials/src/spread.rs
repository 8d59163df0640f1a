//! How a quantity spreads: percentiles.

use serde::{Deserialize, Serialize};
use statistics::Sorted;

/// Percentiles of measured values, in their unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Spread {
    /// How many were measured.
    pub n: usize,
    /// Half are at most this.
    pub p50: f64,
    /// 99 of 100 are.
    pub p99: f64,
    /// 999 of 1000 are; the largest where fewer were measured.
    pub p99_9: f64,
    /// All are.
    pub max: f64,
}

impl Spread {
    /// Of some values, by nearest rank; none of nothing.
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

    /// Its four numbers for a table.
    pub(crate) fn cells(spread: Option<Self>, digits: usize) -> [String; 4] {
        let Some(it) = spread else {
            return ["-"; 4].map(str::to_owned);
        };
        [it.p50, it.p99, it.p99_9, it.max].map(|it| format!("{it:.digits$}"))
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
    fn of_few_values_the_high_percentiles_are_the_largest() {
        let got = Spread::of(vec![3.0, 1.0, 2.0]).unwrap();
        assert_eq!([got.p50, got.p99, got.p99_9, got.max], [2.0, 3.0, 3.0, 3.0]);
        assert_eq!(Spread::of(vec![7.0]).unwrap().p50, 7.0);
    }

    #[test]
    fn of_nothing_there_is_none() {
        assert_eq!(Spread::of(Vec::new()), None);
        assert_eq!(Spread::cells(None, 1), ["-"; 4]);
    }
}
