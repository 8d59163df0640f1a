//! A person over time, as measured, and as smoothed.

use nalgebra::Vector3;

use crate::noise::Noise;
use crate::role::{Role, mirrored_name};
use crate::track::{Absent, Measured, Smoothed, State, usable};

/// Certainty of left and right of a measured skeleton.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Sides {
    /// They are, or nothing says otherwise.
    #[default]
    Sure,
    /// Left and right may be exchanged.
    Unsure,
}

/// One joint over time.
#[derive(Debug, Clone, PartialEq)]
pub struct Joint {
    /// Its name.
    pub name: String,
    /// Role of the joint; `None` for a keypoint that has no role here.
    pub role: Option<Role>,
    /// Measurement at every instant.
    pub measured: Vec<Option<Measured>>,
}

impl Joint {
    /// Where it was measured, if at all.
    pub(crate) fn position(&self, at: usize) -> Option<Vector3<f64>> {
        usable(self.measured[at].as_ref()?).map(|measured| measured.0)
    }

    /// Why there is no position where nothing was filled.
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
    /// The instants, seconds, ascending.
    pub times: Vec<f64>,
    /// Certainty of the sides at every instant.
    pub sides: Vec<Sides>,
    /// The joints.
    pub joints: Vec<Joint>,
}

/// The instants cannot be worked with.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum TimesError {
    /// An instant is not after the one before.
    #[error("instant {at} is at {time_s} s, not after the one before it at {before_s} s")]
    Order {
        /// Which, from 0.
        at: usize,
        /// Its time.
        time_s: f64,
        /// The time of the one before it.
        before_s: f64,
    },
    /// A time is no number.
    #[error("instant {at} has no time")]
    NotFinite {
        /// Which, from 0.
        at: usize,
    },
    /// Some row is longer or shorter than there are instants.
    #[error("{got} values for {expected} instants")]
    Length {
        /// Values.
        got: usize,
        /// Instants.
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

    /// Returns a predicate of a joint and an instant: true if the measurement is left out because its side is not
    /// certain. Where no instant's sides are, nothing is left out: it would be everything.
    pub(crate) fn withheld(&self) -> impl Fn(usize, usize) -> bool {
        let others = self.other_sides();
        let is_some_sure = self.sides.contains(&Sides::Sure);
        move |joint, at| is_some_sure && others[joint].is_some() && self.sides[at] == Sides::Unsure
    }

    /// Counts the instants with uncertain sides where nothing decides them: kept, exchanged, left out.
    pub(crate) fn unsure(&self) -> [usize; 3] {
        let n = self.sides.iter().filter(|side| **side == Sides::Unsure).count();
        if self.sides.contains(&Sides::Sure) {
            [0, 0, n]
        } else {
            [n, 0, 0]
        }
    }

    /// Returns for every joint the index of that on the other side.
    pub(crate) fn other_sides(&self) -> Vec<Option<usize>> {
        let at = |name: &str| self.joints.iter().position(|joint| joint.name == name);
        let other = |joint: &Joint| mirrored_name(&joint.name).and_then(|name| at(&name));
        self.joints.iter().map(other).collect()
    }

    /// The indices at which another person, or the same person elsewhere, begins: the whole body is somewhere else than
    /// a person can have gone, and stays there.
    ///
    /// The limit is half a metre and 12 m/s, which nobody runs; the body is the median of its joints in each axis.
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

/// The middle value; 0 of none.
pub(crate) fn median(values: Vec<f64>) -> f64 {
    statistics::Sorted::new(values).interpolated(0.5).unwrap_or(0.0)
}

/// A person over time, smoothed.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Motion {
    /// Smoothed positions of every joint, in the order of [`Recorded::joints`], at every instant.
    pub joints: Vec<Vec<Smoothed>>,
    /// Findings about the person.
    pub report: Report,
}

/// Findings about a person over time.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Report {
    /// Noise of every joint; `None` where the method does not ask, or nothing was measured.
    pub noise: Vec<Option<Noise>>,
    /// Counts of the states of every joint's instants.
    pub counts: Vec<Counts>,
    /// Instants at which another person began.
    pub breaks: Vec<usize>,
    /// Instants whose sides were not certain: how many were kept as measured, exchanged, and left out.
    pub unsure: [usize; 3],
    /// Lengths of bones that were kept constant: two joints, metres.
    pub bones: Vec<([usize; 2], f64)>,
    /// Largest difference of an instant from its place on the uniform grid, seconds; `None` where there is none.
    pub resampled_s: Option<f64>,
    /// Amount by which a causal method lags, seconds; 0 for those that look ahead.
    pub delay_s: f64,
}

/// How many instants of a joint are what.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    /// Measured and used.
    pub measured: usize,
    /// Measured as the other side's joint.
    pub exchanged: usize,
    /// Not measured, filled.
    pub filled: usize,
    /// Measured, left out, filled.
    pub rejected: usize,
    /// Without a position.
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
