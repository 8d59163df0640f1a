//! Live smoothing, which only uses earlier measurements.

mod kalman;

use crate::prior::prior;
use crate::recorded::{Counts, Motion, Recorded, Report, Sides};
use crate::role::Role;
use crate::track::{Absent, Measured, Smoothed};
use kalman::Models;

/// Default for how long a joint without measurements is given predicted positions, in seconds.
pub const FILL_S: f64 = 0.25;

/// Smooths the joints of a person as they arrive. Each joint has several Kalman filters with different jerk densities, which are weighted
/// by how good their predictions are.
#[derive(Debug)]
pub struct Smoother {
    joints: Vec<Models>,
    /// For every joint, true if it belongs to the left or right side.
    is_sided: Vec<bool>,
    fill_s: f64,
    delay: Delay,
}

/// Mean delay over all steps.
#[derive(Debug, Default)]
struct Delay {
    sum_s: f64,
    n: f64,
}

impl Smoother {
    /// * `names`: names of the joints.
    /// * `fill_s`: how long an unmeasured joint is given a predicted position, in seconds.
    pub fn new(names: &[&str], fill_s: f64) -> Self {
        let models = |name: &&str| Models::new(prior(Role::of(name)));
        Self {
            joints: names.iter().map(models).collect(),
            is_sided: names.iter().map(|name| crate::mirrored_name(name).is_some()).collect(),
            fill_s,
            delay: Delay::default(),
        }
    }

    /// Returns the joints at an instant.
    ///
    /// * `time_s`: time of the instant; if it is not later than the previous instant, the smoother starts again without history.
    /// * `measured`: measurements in the order of the names. The list may be shorter; the remaining joints then count as not measured.
    /// * `sides`: whether left and right are certain; if not, left and right joints are left out.
    pub fn step(
        &mut self,
        time_s: f64,
        measured: &[Option<Measured>],
        sides: Sides,
    ) -> Vec<Smoothed> {
        let fill_s = self.fill_s;
        let mut all = Vec::with_capacity(self.joints.len());
        for (joint, models) in self.joints.iter_mut().enumerate() {
            let it = measured.get(joint).copied().flatten();
            let is_withheld = self.is_sided[joint] && sides == Sides::Unsure;
            let used = it.filter(|_| !is_withheld);
            let (smoothed, delay_s) = models.step(time_s, used.as_ref(), fill_s);
            if let Some(delay_s) = delay_s {
                self.delay.sum_s += delay_s;
                self.delay.n += 1.0;
            }
            all.push(match smoothed {
                Err(Absent::Gap) if it.is_some() => Err(Absent::Rejected),
                other => other,
            });
        }
        all
    }

    /// Returns the mean delay that the smoother causes for movement at 1 Hz, in seconds; `None` until a joint has been measured twice.
    pub fn delay_s(&self) -> Option<f64> {
        (self.delay.n > 0.0).then(|| self.delay.sum_s / self.delay.n)
    }
}

/// Runs a causal smoother over a finished run.
///
/// The times must be [checked](Recorded::check).
pub fn over(recorded: &Recorded, fill_s: f64) -> Motion {
    let names: Vec<&str> = recorded.joints.iter().map(|joint| joint.name.as_str()).collect();
    let mut smoother = Smoother::new(&names, fill_s);
    let n = recorded.times.len();
    let mut joints: Vec<Vec<Smoothed>> = vec![Vec::with_capacity(n); names.len()];
    for (at, &time_s) in recorded.times.iter().enumerate() {
        let measured: Vec<_> = recorded.joints.iter().map(|joint| joint.measured[at]).collect();
        let smoothed = smoother.step(time_s, &measured, recorded.sides[at]);
        for (track, it) in joints.iter_mut().zip(smoothed) {
            track.push(it);
        }
    }
    let report = Report {
        noise: vec![None; joints.len()],
        counts: joints.iter().map(|joint| Counts::of(joint)).collect(),
        unsure: [
            0,
            0,
            recorded.sides.iter().filter(|side| **side == Sides::Unsure).count(),
        ],
        delay_s: smoother.delay_s().unwrap_or(0.0),
        ..Report::default()
    };
    Motion { joints, report }
}
