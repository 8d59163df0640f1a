//! The offline smoother over all joints of a person: handles noise, outliers, swapped left and right, gaps and bone lengths.

use crate::bones;
use crate::exchange;
use crate::joint_track::Track;
use crate::prior::prior;
use crate::recorded::{Counts, Joint, Motion, Recorded, Report};
use crate::rts::Usable;
use crate::track::{Absent, Estimate, Measured, Smoothed, State, usable};

/// Maximum time without a measurement of a joint, in seconds. After a longer time, the joint is smoothed as a separate stretch, because
/// earlier measurements carry no information.
const SPLIT_S: f64 = 1.0;

/// Settings of the smoother.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Maximum time between two measurements, in seconds, for the gap to be filled.
    pub fill_s: f64,
    /// If true, keep the bone lengths of the limbs constant.
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

/// Smooths a person's joints, using all measurements before and after.
///
/// 1. If the track suddenly jumps to another person, the smoother starts again without history.
/// 2. The jerk density and the scale of the covariances are estimated for every joint from the measurements.
/// 3. Every joint is smoothed; measurements that contradict all others are rejected. Left and right joints are left out while left and
///    right are uncertain.
/// 4. Left and right are swapped if that fits better. At instants at which they are uncertain, the assignment that fits is used; if neither
///    fits clearly, the instant is left out. The changed joints are smoothed again.
/// 5. Short gaps are filled and marked.
/// 6. If requested, each bone of the limbs gets its median length.
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
    // Each track is dropped once its joint is finished. Otherwise, a long run would need the memory for the tracks and the results at the
    // same time.
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

/// Returns the stretches of a track that can be smoothed as a whole: each extends from the first measurement to one past the last, without
/// long gaps and breaks.
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

/// Returns the measurements unchanged, including those of left and right joints at instants at which left and right are uncertain.
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
