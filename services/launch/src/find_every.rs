//! Intervals at which the detector searches for people.

use deployment::network::Config;

/// Largest time between two frames over which a box can follow a person, in seconds. If frames are further apart, the detector searches
/// every frame.
pub const FOLLOWED_S: f64 = 0.4;

/// Intervals in frames: the detector searches every n-th frame of a view for people. If the deployment does not set the interval, it
/// depends on the frame rate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct FindEvery {
    /// Interval while one person is seen.
    pub(crate) alone: u64,
    /// Interval while several people are seen. It is short, so that a person who is hidden for a moment is soon found again.
    pub(crate) several: u64,
}

impl FindEvery {
    /// Chooses the intervals.
    ///
    /// * `rate_hz`: rate of the frames that are searched. It is not known for pictures in a folder, which may have been taken at any time.
    ///   In such pictures, people are not followed from frame to frame.
    pub(crate) fn new(config: &Config, rate_hz: Option<f64>) -> Self {
        /// Interval while one person is seen, in seconds. It is a time rather than a number of frames, because people come and go at the
        /// same speed at any frame rate.
        const SECONDS: f64 = 0.5;
        /// Interval while several people are seen, in seconds.
        const SECONDS_OF_SEVERAL: f64 = 0.125;
        /// Minimum interval in frames. Shorter intervals are not needed, because the network follows the people that it sees.
        const OFTEN: f64 = 10.0;
        let each = match (config.find_every, rate_hz) {
            (Some(every), _) => [every; 2],
            (None, Some(rate_hz)) if rate_hz * FOLLOWED_S >= 1.0 => {
                let alone = (SECONDS * rate_hz).round().clamp(OFTEN, 1e6);
                let several = (SECONDS_OF_SEVERAL * rate_hz).round().clamp(1.0, alone);
                [alone as u64, several as u64]
            }
            (None, _) => [1; 2],
        };
        let [alone, several] = each;
        Self { alone, several }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn by(config: &Config, rate_hz: Option<f64>) -> [u64; 2] {
        let FindEvery { alone, several } = FindEvery::new(config, rate_hz);
        [alone, several]
    }

    #[test]
    fn the_interval_between_searches_is_a_time_unless_a_number_of_frames_is_set() {
        let default = Config::default();
        let by_rate = [60.0, 15.0, 2.5].map(|rate_hz| by(&default, Some(rate_hz)));
        assert_eq!(by_rate, [[30, 8], [10, 2], [10, 1]]);
        let told = Config {
            find_every: Some(7),
            ..Config::default()
        };
        assert_eq!(by(&told, Some(60.0)), [7; 2]);
    }

    #[test]
    fn every_frame_is_searched_if_the_frame_rate_is_low_or_unknown() {
        let default = Config::default();
        assert_eq!(by(&default, Some(2.4)), [1; 2]);
        assert_eq!(by(&default, None), [1; 2]);
    }
}
