//! Confidence intervals by resampling frames (bootstrap).

use crate::Sorted;

/// The contribution of one frame to a mean: the sum and the number of its values.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Share {
    /// Sum of the values.
    pub sum: f64,
    /// Number of values.
    pub n: f64,
}

impl Share {
    /// Creates the contribution of a frame from its values.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Self {
        let add = |share: Self, value: f64| Self {
            sum: share.sum + value,
            n: share.n + 1.0,
        };
        values.into_iter().fold(Self::default(), add)
    }

    /// Returns the mean over all frames, each weighted by its number of values; `None` if there are no values.
    pub fn mean(frames: &[Self]) -> Option<f64> {
        let sum: f64 = frames.iter().map(|frame| frame.sum).sum();
        let n: f64 = frames.iter().map(|frame| frame.n).sum();
        (n > 0.0).then(|| sum / n)
    }
}

/// Settings for resampling frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bootstrap {
    /// Number of resamples.
    pub n_resamples: usize,
    /// Seed of the random numbers; the same seed gives the same interval.
    pub seed: u64,
    /// Fraction of the resamples inside the interval, from 0 to 1.
    pub confidence: f64,
    /// Number of consecutive frames that are drawn together. Neighbouring frames are correlated, so drawing them one by
    /// one gives intervals that are too narrow.
    pub block: usize,
}

impl Default for Bootstrap {
    fn default() -> Self {
        Self {
            n_resamples: 1000,
            seed: 1,
            confidence: 0.95,
            block: 1,
        }
    }
}

impl Bootstrap {
    /// Returns the percentile interval of the mean over frames (Efron 1979), in circular blocks
    /// (Politis & Romano 1992) if `block` is more than 1.
    ///
    /// * Returns the lower and the upper end; `None` if there are no values.
    pub fn interval(&self, frames: &[Share]) -> Option<[f64; 2]> {
        Share::mean(frames)?;
        let mut random = fastrand::Rng::with_seed(self.seed);
        let block = self.block.clamp(1, frames.len());
        let mut means = Vec::with_capacity(self.n_resamples);
        while means.len() < self.n_resamples.max(1) {
            let mut drawn = Share::default();
            let mut left = frames.len();
            while left > 0 {
                let first = random.usize(0..frames.len());
                for nth in 0..block.min(left) {
                    let it = frames[(first + nth) % frames.len()];
                    drawn.sum += it.sum;
                    drawn.n += it.n;
                }
                left -= block.min(left);
            }
            // A resample may consist of frames without a value; it is skipped.
            if drawn.n > 0.0 {
                means.push(drawn.sum / drawn.n);
            }
        }
        self.percentiles(means)
    }

    /// Returns the percentile interval of any number that is computed from the values of all frames. Frames are always drawn one by one,
    /// regardless of `block`.
    ///
    /// * `of`: computes the number; if it returns `None`, the resample is skipped.
    /// * Returns the lower and the upper end; `None` if no resample gives a number.
    pub fn interval_of<T: Copy>(
        &self,
        frames: &[Vec<T>],
        of: impl Fn(&[T]) -> Option<f64>,
    ) -> Option<[f64; 2]> {
        let mut random = fastrand::Rng::with_seed(self.seed);
        let mut drawn = Vec::new();
        let mut numbers = Vec::with_capacity(self.n_resamples);
        for _ in 0..self.n_resamples.max(1) {
            drawn.clear();
            for _ in 0..frames.len() {
                drawn.extend_from_slice(&frames[random.usize(0..frames.len())]);
            }
            numbers.extend(of(&drawn));
        }
        self.percentiles(numbers)
    }

    fn percentiles(&self, numbers: Vec<f64>) -> Option<[f64; 2]> {
        let outside = (1.0 - self.confidence.clamp(0.0, 1.0)) / 2.0;
        let numbers = Sorted::new(numbers);
        let low = numbers.interpolated(outside)?;
        let high = numbers.interpolated(1.0 - outside)?;
        Some([low, high])
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn frames(values: &[f64]) -> Vec<Share> {
        values.iter().map(|&value| Share::of([value])).collect()
    }

    #[test]
    fn the_mean_weights_frames_by_their_number_of_values() {
        let frames = [Share::of([1.0, 1.0, 1.0]), Share::of([5.0]), Share::of([])];
        assert_eq!(Share::mean(&frames), Some(2.0));
        assert_eq!(Share::mean(&[Share::of([])]), None);
    }

    #[test]
    fn a_constant_has_an_interval_of_no_width() {
        let got = Bootstrap::default().interval(&frames(&[0.75; 40]));
        assert_eq!(got, Some([0.75; 2]));
    }

    #[test]
    fn the_interval_of_a_coin_toss_has_the_theoretical_width() {
        let coin: Vec<f64> = (0..400).map(|i| f64::from(i % 2)).collect();
        let settings = Bootstrap {
            n_resamples: 4000,
            ..Bootstrap::default()
        };
        let [low, high] = settings.interval(&frames(&coin)).unwrap();
        let expected = 2.0 * 1.96 * (0.25_f64 / 400.0).sqrt();
        assert!(((high - low) / expected - 1.0).abs() < 0.1, "{low} {high}");
    }

    #[test]
    fn the_general_bootstrap_interval_equals_the_interval_of_the_mean() {
        let coin: Vec<Vec<f64>> = (0..400).map(|i| vec![f64::from(i % 2)]).collect();
        let mean = |values: &[f64]| {
            let n = values.len() as f64;
            (n > 0.0).then(|| values.iter().sum::<f64>() / n)
        };
        let settings = Bootstrap {
            n_resamples: 4000,
            ..Bootstrap::default()
        };
        let [low, high] = settings.interval_of(&coin, mean).unwrap();
        let expected = 2.0 * 1.96 * (0.25_f64 / 400.0).sqrt();
        assert!(((high - low) / expected - 1.0).abs() < 0.1, "{low} {high}");
        assert_eq!(settings.interval_of(&coin, |_| None), None);
        assert_eq!(settings.interval_of(&[], mean), None);
    }

    #[test]
    fn blocks_widen_the_interval_of_correlated_frames() {
        let slow: Vec<f64> = (0..400).map(|i| f64::from(i / 50 % 2)).collect();
        let width = |block: usize| {
            let settings = Bootstrap {
                block,
                ..Bootstrap::default()
            };
            let [low, high] = settings.interval(&frames(&slow)).unwrap();
            high - low
        };
        assert!(width(50) > 2.0 * width(1));
    }

    proptest! {
        #[test]
        fn the_same_seed_gives_the_same_interval_around_the_mean(
            values in prop::collection::vec(0.0..1.0_f64, 1..60),
            seed in any::<u64>(),
            block in 1..70_usize,
        ) {
            let settings = Bootstrap { n_resamples: 200, seed, block, ..Bootstrap::default() };
            let frames = frames(&values);
            let got = settings.interval(&frames).unwrap();
            prop_assert_eq!(Some(got), settings.interval(&frames));
            let least = values.iter().copied().fold(f64::INFINITY, f64::min);
            let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            prop_assert!(least - 1e-12 <= got[0] && got[0] <= got[1] && got[1] <= most + 1e-12);
        }
    }
}
