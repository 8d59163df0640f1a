//! How often boxes around people are looked for.

use deployment::network::Config;

/// Frames that are farther apart are not of a person whom a box could follow, seconds: boxes are looked for in every one.
pub const FOLLOWED_S: f64 = 0.4;

/// In every n-th frame of a view boxes are looked for: as the deployment says, else by the rate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct FindEvery {
    /// While one person is seen.
    pub(crate) alone: u64,
    /// While several are: one who is hidden for a moment is found again soon.
    pub(crate) several: u64,
}

impl FindEvery {
    /// * `rate_hz`: of the frames that are looked at; not known of pictures in a folder, which may be of any time: nobody is followed
    ///   in these.
    pub(crate) fn new(config: &Config, rate_hz: Option<f64>) -> Self {
        /// People come and go by time.
        const SECONDS: f64 = 0.5;
        const SECONDS_OF_SEVERAL: f64 = 0.125;
        /// Never more often: the network follows who it sees.
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
    fn boxes_are_looked_for_by_time_unless_it_is_told_how_often() {
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
    fn nobody_is_followed_from_one_picture_to_another_that_may_be_of_any_time() {
        let default = Config::default();
        assert_eq!(by(&default, Some(2.4)), [1; 2]);
        assert_eq!(by(&default, None), [1; 2]);
    }
}
