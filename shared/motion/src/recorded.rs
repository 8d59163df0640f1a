//! A person over time: the measurements, and the smoothed result.

use nalgebra::Vector3;

use crate::noise::Noise;
use crate::role::{Role, mirrored_name};
use crate::track::{Absent, Measured, Smoothed, State, usable};

/// How certain left and right of a measured skeleton are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Sides {
    /// Left and right are correct, or at least nothing indicates that they are wrong.
    #[default]
    Sure,
    /// Left and right may be swapped.
    Unsure,
}

/// One joint over time.
#[derive(Debug, Clone, PartialEq)]
pub struct Joint {
    /// Name of the joint.
    pub name: String,
    /// Role of the joint; `None` for a keypoint without a role in this crate.
    pub role: Option<Role>,
    /// Measurement at every instant.
    pub measured: Vec<Option<Measured>>,
}

impl Joint {
    /// Returns the measured position, if there is a measurement.
    pub(crate) fn position(&self, at: usize) -> Option<Vector3<f64>> {
        usable(self.measured[at].as_ref()?).map(|measured| measured.0)
    }

    /// Returns the reason why there is no position at an instant that was not filled.
    pub(crate) fn absent(&self, at: usize) -> Absent {
        if self.measured[at].is_some() {
            Absent::Rejected
        } else {
            Absent::Gap
        }
    }
}

/// A person over time.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Recorded {
    /// The instants, in seconds, in ascending order.
    pub times: Vec<f64>,
    /// States whether left and right are certain, at every instant.
    pub sides: Vec<Sides>,
    /// The joints of the person.
    pub joints: Vec<Joint>,
}

/// Reason why the instants were rejected.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum TimesError {
    /// An instant is not later than the previous instant.
    #[error(
        "times must increase: instant {at} is at {time_s} s, but the previous instant is at {before_s} s"
    )]
    Order {
        /// Index of the instant, counted from 0.
        at: usize,
        /// Time of the instant, in seconds.
        time_s: f64,
        /// Time of the previous instant, in seconds.
        before_s: f64,
    },
    /// A time is not a number.
    #[error("instant {at} has no time")]
    NotFinite {
        /// Index of the instant, counted from 0.
        at: usize,
    },
    /// The number of values in a list differs from the number of instants.
    #[error("there are {got} values for {expected} instants")]
    Length {
        /// Number of values in the list.
        got: usize,
        /// Number of instants.
        expected: usize,
    },
}

impl Recorded {
    /// Checks times and lengths.
    ///
    /// # Errors
    ///
    /// [`TimesError`].
    pub fn check(&self) -> Result<(), TimesError> {
        let expected = self.times.len();
        let lengths = self.joints.iter().map(|joint| joint.measured.len());
        for got in lengths.chain([self.sides.len()]) {
            if got != expected {
                return Err(TimesError::Length { got, expected });
            }
        }
        for (at, &time_s) in self.times.iter().enumerate() {
            if !time_s.is_finite() {
                return Err(TimesError::NotFinite { at });
            }
            let before_s =
                at.checked_sub(1).map_or(f64::NEG_INFINITY, |difference| self.times[difference]);
            if time_s <= before_s {
                return Err(TimesError::Order {
                    at,
                    time_s,
                    before_s,
                });
            }
        }
        Ok(())
    }

    /// Returns true if left and right are certain at an instant with a measurement. An instant without one is [`Sides::Sure`] too.
    pub(crate) fn is_some_sure(&self) -> bool {
        let is_measured = |at: usize| self.joints.iter().any(|joint| joint.measured[at].is_some());
        let mut sides = self.sides.iter().enumerate();
        sides.any(|(at, side)| *side == Sides::Sure && is_measured(at))
    }

    /// Returns a function of a joint and an instant that returns true if the measurement is left out because its side is uncertain. If left
    /// and right are uncertain at all instants with a measurement, nothing is left out, because otherwise nothing would remain.
    pub(crate) fn withheld(&self) -> impl Fn(usize, usize) -> bool {
        let others = self.other_sides();
        let is_some_sure = self.is_some_sure();
        move |joint, at| is_some_sure && others[joint].is_some() && self.sides[at] == Sides::Unsure
    }

    /// Counts the instants at which left and right are uncertain, for a method that does not decide them. The counts are: kept, swapped,
    /// left out.
    pub(crate) fn unsure(&self) -> [usize; 3] {
        let n = self.sides.iter().filter(|side| **side == Sides::Unsure).count();
        if self.is_some_sure() {
            [0, 0, n]
        } else {
            [n, 0, 0]
        }
    }

    /// Returns, for every joint, the index of the same joint on the other side.
    pub(crate) fn other_sides(&self) -> Vec<Option<usize>> {
        let at = |name: &str| self.joints.iter().position(|joint| joint.name == name);
        let other = |joint: &Joint| mirrored_name(&joint.name).and_then(|name| at(&name));
        self.joints.iter().map(other).collect()
    }

    /// Returns the indices at which the track jumps to another person, or to the same person somewhere else. At such an index, the whole
    /// body is farther away than a person can move, and stays there.
    ///
    /// The limit is half a metre, plus 12 m for every second, which is faster than anyone runs. The position of the body is the median of
    /// its joints along each axis.
    pub(crate) fn breaks(&self) -> Vec<usize> {
        let centres: Vec<(usize, Vector3<f64>)> =
            (0..self.times.len()).filter_map(|at| Some((at, self.centre(at)?))).collect();
        let median_of = |range: &[(usize, Vector3<f64>)]| {
            Vector3::from_fn(|axis, _| median(range.iter().map(|range| range.1[axis]).collect()))
        };
        let mut breaks = Vec::new();
        for nth in 1..centres.len() {
            let ((from, before), (to, after)) = (centres[nth - 1], centres[nth]);
            let limit = 0.5 + 12.0 * (self.times[to] - self.times[from]);
            if (after - before).norm() <= limit {
                continue;
            }
            let earlier = median_of(&centres[nth.saturating_sub(5)..nth]);
            let later = median_of(&centres[nth..(nth + 5).min(centres.len())]);
            if (later - earlier).norm() > limit {
                breaks.push(to);
            }
        }
        breaks
    }

    fn centre(&self, at: usize) -> Option<Vector3<f64>> {
        let points: Vec<Vector3<f64>> = self
            .joints
            .iter()
            .filter_map(|joint| Some(joint.measured[at]?.position))
            .filter(|position| position.iter().all(|x| x.is_finite()))
            .collect();
        let is_enough = points.len() * 2 >= self.joints.len().min(14) && !points.is_empty();
        is_enough.then(|| {
            Vector3::from_fn(|axis, _| median(points.iter().map(|point| point[axis]).collect()))
        })
    }
}

/// Returns the median; 0 if there are no values.
pub(crate) fn median(values: Vec<f64>) -> f64 {
    statistics::Sorted::new(values).interpolated(0.5).unwrap_or(0.0)
}

/// A smoothed person over time.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Motion {
    /// Smoothed positions of every joint, in the order of [`Recorded::joints`], at every instant.
    pub joints: Vec<Vec<Smoothed>>,
    /// Report on how the person was smoothed.
    pub report: Report,
}

/// Report on how a person's joints were smoothed.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Report {
    /// Noise parameters of every joint; `None` if the method does not estimate them, or if nothing was measured.
    pub noise: Vec<Option<Noise>>,
    /// For every joint, the number of instants in each state.
    pub counts: Vec<Counts>,
    /// Instants at which another person began.
    pub breaks: Vec<usize>,
    /// Numbers of instants with uncertain left and right that were kept as measured, swapped, and left out.
    pub unsure: [usize; 3],
    /// Bones that were kept at a constant length: two joints, and the length in metres.
    pub bones: Vec<([usize; 2], f64)>,
    /// Largest difference between an instant and the uniform grid, in seconds; `None` if no grid was used.
    pub resampled_s: Option<f64>,
    /// Delay, in seconds, of a method that only uses earlier measurements; 0 for methods that also use later ones.
    pub delay_s: f64,
}

/// Number of instants of a joint in each state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    /// Instants at which the joint was measured and used.
    pub measured: usize,
    /// Instants at which the measurement named after the same joint on the other side was used.
    pub exchanged: usize,
    /// Instants at which the joint was not measured, but filled.
    pub filled: usize,
    /// Instants at which the joint was measured, but left out and filled.
    pub rejected: usize,
    /// Instants at which the joint has no position.
    pub absent: usize,
}

impl Counts {
    pub(crate) fn of(track: &[Smoothed]) -> Self {
        let mut counts = Self::default();
        for it in track {
            let count = match it.map(|estimate| estimate.state) {
                Ok(State::Measured) => &mut counts.measured,
                Ok(State::Exchanged) => &mut counts.exchanged,
                Ok(State::Filled) => &mut counts.filled,
                Ok(State::Rejected) => &mut counts.rejected,
                Err(_) => &mut counts.absent,
            };
            *count += 1;
        }
        counts
    }
}
