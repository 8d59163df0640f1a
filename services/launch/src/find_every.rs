//! How often boxes around people are looked for.

use deployment::Deployment;
use deployment::capture::Mode;
use deployment::network::Config;

/// Frames that are farther apart are not of a person whom a box could follow, seconds: boxes are looked for in every one.
pub const FOLLOWED_S: f64 = 0.4;

/// In every n-th frame of a view boxes are looked for: as the deployment says, else by the rate.
///
/// * `rate_hz`: of the frames that are looked at.
pub(crate) fn find_every(config: &Config, rate_hz: Option<f64>) -> u64 {
    let by_rate = || find_every_at(rate_hz, config.has_own_detector());
    config.find_every.unwrap_or_else(by_rate)
}

/// As [`find_every`], while several people are seen: one who is hidden for a moment is found again soon, where a detector looks.
pub(crate) fn find_every_of_several(config: &Config, rate_hz: Option<f64>) -> u64 {
    const SECONDS: f64 = 0.125;
    let every = find_every(config, rate_hz);
    if config.find_every.is_some() || !config.has_detector() {
        return every;
    }
    let often = rate_hz.map_or(1.0, |rate_hz| (SECONDS * rate_hz).round());
    (often.clamp(1.0, 1e6) as u64).min(every)
}

/// In every n-th frame boxes are looked for.
///
/// * `rate_hz`: of the frames; not known of pictures in a folder, which may be of any time: nobody is followed in these.
fn find_every_at(rate_hz: Option<f64>, has_detector: bool) -> u64 {
    /// Never more often: the network follows who it sees.
    const OFTEN: f64 = 10.0;
    let Some(rate_hz) = rate_hz.filter(|it| it * FOLLOWED_S >= 1.0) else {
        return 1;
    };
    // People come and go by time: a detector looks twice a second, the filters, which take longer, once.
    let seconds = if has_detector { 0.5 } else { 1.0 };
    (seconds * rate_hz).round().clamp(OFTEN, 1e6) as u64
}

/// Most of the time that searches for boxes may take while people are seen well, a share. None where the deployment says how often they
/// are made, and where no frame is left out, however long it takes.
pub(crate) fn search_share(deployment: &Deployment) -> Option<f64> {
    const SHARE: f64 = 0.125;
    let is_free =
        deployment.network.find_every.is_none() && deployment.capture.mode == Mode::Realtime;
    is_free.then_some(SHARE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_are_looked_for_by_time() {
        assert_eq!(find_every_at(Some(60.0), false), 60);
        assert_eq!(find_every_at(Some(60.0), true), 30);
        assert_eq!(find_every_at(Some(15.0), true), 10);
        assert_eq!(find_every_at(Some(2.5), false), 10);
    }

    #[test]
    fn a_detector_looks_more_often_while_it_sees_several_people_unless_it_is_told_how_often() {
        let by =
            |config: &Config| [60.0, 15.0, 2.0].map(|hz| find_every_of_several(config, Some(hz)));
        assert_eq!(by(&Config::default()), [8, 2, 1]);
        let told = Config {
            find_every: Some(7),
            ..Config::default()
        };
        assert_eq!(by(&told), [7; 3]);
        let filters = Config {
            detector: "none".into(),
            ..Config::default()
        };
        assert_eq!(by(&filters), [60, 15, 1]);
    }

    #[test]
    fn nobody_is_followed_from_one_picture_to_another_that_may_be_of_any_time() {
        assert_eq!(find_every_at(Some(2.4), false), 1);
        assert_eq!(find_every_at(Some(1.0), true), 1);
        assert_eq!(find_every_at(None, false), 1);
    }
}
