//! The paper's histogram of improvements and deteriorations between two results.

/// Histogram of differences of errors, `before - after`; positive differences are improvements.
#[derive(Debug, Clone, PartialEq)]
pub struct Changes {
    width: f64,
    /// Number of differences in each bin `[edge, edge + width)`; the first and the last bin also count everything beyond them.
    bins: Vec<usize>,
    improved: usize,
    deteriorated: usize,
    total: usize,
    same: f64,
}

impl Changes {
    /// Creates an empty histogram.
    ///
    /// * `reach`: the histogram ranges from `-reach` to `reach`, in the unit of the errors.
    /// * `n_bins`: number of bins, at least 2.
    /// * `same`: maximum difference that counts as no change.
    pub fn new(reach: f64, n_bins: usize, same: f64) -> Self {
        let n_bins = n_bins.max(2);
        Self {
            width: 2.0 * reach / n_bins as f64,
            bins: vec![0; n_bins],
            improved: 0,
            deteriorated: 0,
            total: 0,
            same,
        }
    }

    /// Counts an error before and after; ignored if either is not finite.
    pub fn add(&mut self, before: f64, after: f64) {
        let gain = before - after;
        if !gain.is_finite() {
            return;
        }
        self.total += 1;
        self.improved += usize::from(gain > self.same);
        self.deteriorated += usize::from(gain < -self.same);
        let last = self.bins.len() - 1;
        let bin = (gain / self.width + self.bins.len() as f64 / 2.0).floor();
        self.bins[bin.clamp(0.0, last as f64) as usize] += 1;
    }

    /// Returns the bins from the worst to the best, each as lower edge and count.
    pub fn bins(&self) -> impl Iterator<Item = (f64, usize)> + '_ {
        let middle = self.bins.len() as f64 / 2.0;
        let edge = move |value: usize| (value as f64 - middle) * self.width;
        let counts = self.bins.iter().enumerate();
        counts.map(move |(bin, &count)| (edge(bin), count))
    }

    /// Returns the number of improvements.
    pub fn improved(&self) -> usize {
        self.improved
    }

    /// Returns the number of deteriorations.
    pub fn deteriorated(&self) -> usize {
        self.deteriorated
    }

    /// Returns the number of all counted differences.
    pub fn total(&self) -> usize {
        self.total
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn improvements_are_positive_and_the_outermost_bins_are_open() {
        let mut changes = Changes::new(20.0, 4, 0.5);
        for (before, after) in [
            (100.0, 1.0),
            (5.0, 4.0),
            (4.0, 4.25),
            (4.0, 15.0),
            (0.0, 99.0),
        ] {
            changes.add(before, after);
        }
        changes.add(f64::INFINITY, 3.0);
        let bins: Vec<_> = changes.bins().collect();
        assert_eq!(bins, [(-20.0, 2), (-10.0, 1), (0.0, 1), (10.0, 1)]);
        assert_eq!((changes.improved(), changes.deteriorated()), (2, 2));
        assert_eq!(changes.total(), 5);
    }

    proptest! {
        #[test]
        fn every_change_is_in_one_bin_and_swapping_before_and_after_mirrors_the_bins(
            pairs in prop::collection::vec((0_u8..200, 0_u8..200), 0..50),
        ) {
            // The halves keep every change off the edges, which belong to one of two bins.
            let pairs = pairs.into_iter().map(|(before, after)| (f64::from(before), f64::from(after) + 0.5));
            let pairs: Vec<(f64, f64)> = pairs.collect();
            let count = |swap: bool| {
                let mut changes = Changes::new(50.0, 10, 1.0);
                for &(a, b) in &pairs {
                    let (before, after) = if swap { (b, a) } else { (a, b) };
                    changes.add(before, after);
                }
                changes
            };
            let (there, back) = (count(false), count(true));
            prop_assert_eq!(there.bins().map(|bin| bin.1).sum::<usize>(), pairs.len());
            let mut mirrored: Vec<usize> = back.bins().map(|bin| bin.1).collect();
            mirrored.reverse();
            prop_assert!(there.bins().map(|bin| bin.1).eq(mirrored));
            prop_assert_eq!(there.improved(), back.deteriorated());
            prop_assert_eq!(there.deteriorated(), back.improved());
        }
    }
}
