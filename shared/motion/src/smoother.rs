//! The offline smoother over all joints of a person: noise, outliers, exchanged sides, gaps, bones.

use crate::bones;
use crate::exchange;
use crate::joint_track::Track;
use crate::prior::prior;
use crate::recorded::{Counts, Joint, Motion, Recorded, Report};
use crate::rts::Usable;
use crate::track::{Absent, Estimate, Measured, Smoothed, State, usable};

/// A joint that was not measured for longer is smoothed anew, seconds: what was before says nothing of what is after.
const SPLIT_S: f64 = 1.0;

/// How to smooth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// The longest time between two measurements that is filled, seconds.
    pub fill_s: f64,
    /// Keep the lengths of the limbs' bones constant.
    pub constant_bones: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            fill_s: 0.25,
            constant_bones: false,
        }
    }
}

/// Smooths a person's joints with everything before and after.
///
/// 1. Where the person is suddenly another person, everything begins anew.
/// 2. Of every joint the jerk density and the scale of the covariances are found from the measurements.
/// 3. Every joint is smoothed; measurements that contradict all others are rejected. Joints with a side are left out where sides
///    are not certain.
/// 4. Where left and right fit better exchanged, they are exchanged; instants whose sides are not certain are taken as what fits,
///    or left out; the joints that this changes are smoothed again.
/// 5. Gaps are filled as far as they are short, and marked.
/// 6. If asked for, the limbs' bones get the median of their lengths.
///
/// The times must be [checked](Recorded::check).
pub fn smooth(recorded: &Recorded, settings: &Settings) -> Motion {
    let breaks = recorded.breaks();
    let stretches = |used: &[Usable]| stretches(&recorded.times, used, &breaks, settings.fill_s);
    let withheld = recorded.withheld();
    let mut tracks: Vec<Track> = recorded
        .joints
        .iter()
        .enumerate()
        .map(|(nth, joint)| {
            let all: Vec<Usable> =
                joint.measured.iter().map(|measured| usable(measured.as_ref()?)).collect();
            let mut track = Track::new(all);
            for at in (0..track.used.len()).filter(|&at| withheld(nth, at)) {
                track.used[at] = None;
            }
            track.noise = track.tuned(&recorded.times, &stretches(&track.used), prior(joint.role));
            track.smooth(&recorded.times, &stretches(&track.used));
            track
        })
        .collect();
    let (changed, unsure) = exchange::settle(recorded, &recorded.other_sides(), &mut tracks);
    for joint in changed {
        let track = &mut tracks[joint];
        track.smooth(&recorded.times, &stretches(&track.used));
    }
    let noise = tracks.iter().map(Track::known_noise).collect();
    // Each track goes when its joint is there: a long run would need both at once.
    let filled = |track: Track| track.filled(&recorded.times, settings.fill_s);
    let mut motion = Motion {
        joints: tracks.into_iter().map(filled).collect(),
        report: Report {
            noise,
            breaks,
            unsure,
            ..Report::default()
        },
    };
    if settings.constant_bones {
        motion.report.bones = bones::constant(recorded, &mut motion.joints);
    }
    motion.report.counts = motion.joints.iter().map(|joint| Counts::of(joint)).collect();
    motion
}

/// Where a track can be smoothed as a whole: from the first to after the last measurement, without long gaps and breaks.
fn stretches(times: &[f64], used: &[Usable], breaks: &[usize], fill_s: f64) -> Vec<[usize; 2]> {
    let mut stretches: Vec<[usize; 2]> = Vec::new();
    for at in (0..used.len()).filter(|&at| used[at].is_some()) {
        let goes_on = stretches.last().is_some_and(|&[_, end]| {
            let is_near = times[at] - times[end - 1] <= SPLIT_S.max(fill_s);
            is_near && !breaks.iter().any(|index| (end..=at).contains(index))
        });
        match stretches.last_mut() {
            Some(last) if goes_on => last[1] = at + 1,
            _ => stretches.push([at, at + 1]),
        }
    }
    stretches
}

/// Returns the measurements unchanged: also joints with a side where sides are not certain.
pub fn as_measured(recorded: &Recorded) -> Motion {
    let estimate = |measured: &Option<Measured>| -> Smoothed {
        let measured = measured
            .as_ref()
            .filter(|measured| usable(measured).is_some())
            .ok_or(Absent::Gap)?;
        Ok(Estimate {
            position: measured.position,
            covariance: measured.covariance,
            state: State::Measured,
        })
    };
    let of = |joint: &Joint| joint.measured.iter().map(estimate).collect();
    let joints: Vec<Vec<Smoothed>> = recorded.joints.iter().map(of).collect();
    let report = Report {
        noise: vec![None; joints.len()],
        counts: joints.iter().map(|joint| Counts::of(joint)).collect(),
        ..Report::default()
    };
    Motion { joints, report }
}
