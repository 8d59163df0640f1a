//! Measures of how far the results of a run can be trusted, computed from the results alone.

use core::fmt;

use serde::{Deserialize, Serialize};

use crate::nullable::nullable;

/// Limit of the reprojection for people who are not followed, as a multiple of the limit for the followed person. In 16 runs with four
/// or five synthetic people, the largest value of 69 ids was 0.91 of the limit (docs/guide/run.md).
const HIDDEN: f64 = 1.5;

/// Measures of the quality of results, computed from the results alone. Fractions are from 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Trust {
    /// Root mean square deviation of the bone lengths from the bone lengths of real people, in standard deviations; the median over the
    /// skeletons.
    #[serde(deserialize_with = "nullable")]
    pub body_deviation: Option<f64>,
    /// Scatter of the bone lengths over the run, in metres. This is the mean over the bones of the median absolute deviation, scaled to a
    /// standard deviation.
    #[serde(deserialize_with = "nullable")]
    pub bone_scatter_m: Option<f64>,
    /// Mean distance of the views' observations from the 3D joints, in metres; each distance counts as at most 0.3.
    #[serde(deserialize_with = "nullable")]
    pub disagreement_m: Option<f64>,
    /// Number of results in which a person was found, with a plausible or an implausible body.
    pub frames: u64,
    /// Fraction of these results whose body is implausible for a person.
    pub implausible: f64,
    /// Fraction of the joints of the skeletons that were left out, because their positions are impossible for a human body.
    pub joints_implausible: f64,
    /// Fraction of the results in which the middle of the body is farther from the middle in the previous result than a person can have
    /// moved.
    pub jumps: f64,
    /// Fraction of the results in which a joint leaves its path by more than 0.15 m, with more than 500 m/s².
    pub limb_jumps: f64,
    /// Distance of the joints' reprojections from the views' observations, as a fraction of the person's height in the frames: median
    /// over all joints, so that joints that other people or things hide have little effect.
    #[serde(deserialize_with = "nullable")]
    pub reprojection: Option<f64>,
    /// Fraction of the skeletons whose left and right are not certain.
    pub sides_unsure: f64,
}

/// A reason not to trust the results.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Doubt {
    kind: Kind,
    value: f64,
    limit: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Reprojection,
    Limbs,
    Implausible,
    Joints,
    Bones,
    Jumps,
    LimbJumps,
    Sides,
}

impl Kind {
    const ALL: [Self; 8] = [
        Self::Reprojection,
        Self::Limbs,
        Self::Implausible,
        Self::Joints,
        Self::Bones,
        Self::Jumps,
        Self::LimbJumps,
        Self::Sides,
    ];

    /// Returns the maximum tolerated value. The limits are chosen so that they are not reached by one person who is completely visible to
    /// calibrated cameras: in test data of real and synthetic people, the values are at most two thirds of each limit. In one of ten runs
    /// with several people, the reprojection reached four fifths of its limit (docs/guide/run.md).
    fn limit(self) -> f64 {
        match self {
            Self::Reprojection => 0.07,
            Self::Limbs | Self::Jumps => 0.02,
            Self::Implausible | Self::Joints => 0.15,
            Self::LimbJumps => 0.1,
            Self::Bones => 2.0,
            Self::Sides => 0.3,
        }
    }

    /// Returns the smallest value that is impossible regardless of the number of results.
    fn impossible(self) -> f64 {
        match self {
            Self::Reprojection => 0.25,
            Self::Bones => 6.0,
            _ => f64::INFINITY,
        }
    }

    fn value(self, trust: &Trust) -> Option<f64> {
        match self {
            Self::Reprojection => trust.reprojection,
            Self::Limbs => trust.expected_error_m(),
            Self::Jumps => Some(trust.jumps),
            Self::LimbJumps => Some(trust.limb_jumps),
            Self::Implausible => Some(trust.implausible),
            Self::Joints => Some(trust.joints_implausible),
            Self::Bones => trust.body_deviation,
            Self::Sides => Some(trust.sides_unsure),
        }
    }
}

impl Trust {
    /// Minimum number of results that are judged.
    pub const MIN_FRAMES: u64 = 12;

    /// Returns a number that ranks runs by their error, in metres: the geometric mean of [`disagreement_m`](Self::disagreement_m) and
    /// [`bone_scatter_m`](Self::bone_scatter_m). The number alone is not an error. A limit of 0.02 m separates runs with many wrong limbs
    /// from other runs (docs/guide/run.md).
    pub fn expected_error_m(&self) -> Option<f64> {
        Some((self.disagreement_m? * self.bone_scatter_m?).sqrt())
    }

    /// Returns the reasons not to trust the results for the followed person; empty if there are none. If there are too few results to judge,
    /// only impossible values are a reason.
    pub fn doubts(&self) -> Vec<Doubt> {
        self.doubts_beyond(Kind::limit)
    }

    /// Returns the reasons not to trust the results for a person who is not followed. Such a person is often hidden by others, so the limit
    /// of the reprojection is half as high again.
    pub fn doubts_of_another(&self) -> Vec<Doubt> {
        self.doubts_beyond(|kind| {
            let factor = if kind == Kind::Reprojection {
                HIDDEN
            } else {
                1.0
            };
            factor * kind.limit()
        })
    }

    fn doubts_beyond(&self, limit: impl Fn(Kind) -> f64) -> Vec<Doubt> {
        let is_few = self.frames < Self::MIN_FRAMES;
        let doubt = |kind: Kind| {
            let value = kind.value(self)?;
            let limit = if is_few {
                kind.impossible()
            } else {
                limit(kind)
            };
            (value > limit).then_some(Doubt { kind, value, limit })
        };
        Kind::ALL.into_iter().filter_map(doubt).collect()
    }

    /// Returns the numbers for users, in one line.
    pub fn text(&self) -> String {
        let percent = |share: f64| format!("{:.1} %", 100.0 * share);
        let reprojection = self.reprojection.map_or_else(String::new, |reprojection| {
            format!(
                "reprojection {} of the person's height, ",
                percent(reprojection)
            )
        });
        let bones = self.body_deviation.map_or_else(String::new, |body_deviation| {
            format!("bones {body_deviation:.1} sd from average people's, ")
        });
        let limbs = self.expected_error_m().map_or_else(String::new, |expected_error_m| {
            format!("limb wavering {:.1} cm, ", 100.0 * expected_error_m)
        });
        format!(
            "{reprojection}{limbs}{bones}{} of bodies and {} of joints left out, left and right uncertain in {} of frames",
            percent(self.implausible),
            percent(self.joints_implausible),
            percent(self.sides_unsure)
        )
    }
}

impl Doubt {
    /// Returns true if both are the same reason, regardless of the numbers.
    pub fn is_like(&self, other: &Self) -> bool {
        self.kind == other.kind
    }
}

impl fmt::Display for Doubt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (value, limit) = (100.0 * self.value, 100.0 * self.limit);
        match self.kind {
            Kind::Reprojection => write!(
                f,
                "3D joints are {value:.0} % of the person's height away from the joints detected in the views (limit {limit:.0} %): run \
                 `parallax calib check`, and check that all footage was recorded at the same time"
            ),
            Kind::Limbs => write!(
                f,
                "bone lengths vary and views disagree, by {value:.1} cm in total (limit {limit:.0} cm): limbs are wrong in some frames, or \
                 the calibration does not fit the cameras"
            ),
            Kind::Jumps => write!(
                f,
                "the person jumps in {value:.1} % of the results (limit {limit:.0} %), because two people are taken for one: change \
                 `person.follow`, or limit the space that the cameras see"
            ),
            Kind::LimbJumps => write!(
                f,
                "a joint jumps out of its path in {value:.0} % of the results (limit {limit:.0} %): limbs are hidden or taken for others, or \
                 frames of a camera are out of order"
            ),
            Kind::Implausible => write!(
                f,
                "{value:.0} % of the detected bodies are impossible (limit {limit:.0} %): is one person completely visible, and is the \
                 unit of the calibration right?"
            ),
            Kind::Joints => write!(
                f,
                "{value:.0} % of the joints are in impossible positions (limit {limit:.0} %): is one person completely visible to every \
                 camera?"
            ),
            Kind::Bones => write!(
                f,
                "bone lengths are {:.1} standard deviations from the average of people (limit {:.1}): is the unit of the calibration \
                 right?",
                self.value,
                self.kind.limit()
            ),
            Kind::Sides => write!(
                f,
                "left and right are uncertain in {value:.0} % of the frames (limit {limit:.0} %): add cameras that see the person's face"
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    type Spoil = fn(&mut Trust);

    fn good() -> Trust {
        Trust {
            body_deviation: Some(0.8),
            bone_scatter_m: Some(0.004),
            disagreement_m: Some(0.04),
            frames: 100,
            jumps: 0.0,
            limb_jumps: 0.07,
            implausible: 0.01,
            joints_implausible: 0.02,
            reprojection: Some(0.02),
            sides_unsure: 0.05,
        }
    }

    #[test]
    fn good_results_raise_no_doubt_and_each_limit_raises_one() {
        assert_eq!(good().doubts(), []);
        let cases: [(Spoil, &str); 8] = [
            (|trust| trust.reprojection = Some(0.2), "joints are 20 %"),
            (
                |trust| trust.bone_scatter_m = Some(0.0163),
                "by 2.6 cm in total",
            ),
            (|trust| trust.jumps = 0.087, "jumps in 8.7 %"),
            (|trust| trust.limb_jumps = 0.2, "out of its path in 20 % of"),
            (
                |trust| trust.implausible = 0.4,
                "40 % of the detected bodies",
            ),
            (|trust| trust.joints_implausible = 0.3, "30 % of the joints"),
            (
                |trust| trust.body_deviation = Some(3.0),
                "bone lengths are 3.0",
            ),
            (|trust| trust.sides_unsure = 0.5, "uncertain in 50 %"),
        ];
        for (spoil, said) in cases {
            let mut trust = good();
            spoil(&mut trust);
            let doubts: Vec<String> = trust.doubts().iter().map(ToString::to_string).collect();
            assert!(doubts.len() == 1 && doubts[0].contains(said), "{doubts:?}");
        }
    }

    #[test]
    fn few_results_are_checked_only_for_impossible_values() {
        let few = Trust {
            frames: 1,
            sides_unsure: 1.0,
            reprojection: Some(0.2),
            ..good()
        };
        assert_eq!(few.doubts(), []);
        let impossible = Trust {
            reprojection: Some(0.458),
            ..few
        };
        let doubts: Vec<String> = impossible.doubts().iter().map(ToString::to_string).collect();
        assert!(
            doubts.len() == 1 && doubts[0].contains("46 %"),
            "{doubts:?}"
        );
    }
}
