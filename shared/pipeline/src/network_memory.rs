//! State of the network step from frame to frame.

use multiview::FrontEvidence;
use posenetwork::{Bar, JointMaps, LookMemory, Turn, overlap};
use skeleton::MIRRORED;
use skeleton::body::N_JOINTS;
use statistics::Sorted;

use crate::thumbnail::Thumbnail;
use crate::tracks::{Moved, Pace, Track, wider};

/// Maximum distance at which two joints count as the same, as a fraction of the height of the network's window. The next constant is the
/// fraction of joints that two sightings of the same person have in common, with left and right as labelled or swapped.
const SAME_JOINT: f64 = 0.05;
const TWIN: f64 = 0.3;
/// While a gap between frames is at most this fraction of the maximum gap, nobody leaves the box of the last frame: a running person moves
/// 0.2 m in 0.07 s.
const SOON: f64 = 1.0 / 6.0;
/// Time for which the last sighting of a person who stands still is reused, as a fraction of the maximum gap between frames: a person who
/// starts to walk moves 0.1 m in 0.13 s.
const HELD: f64 = 1.0 / 3.0;
/// The network runs again on an empty box at the fourth search after the box was found empty. Most empty boxes contain a chair or a poster,
/// which does not move.
const LOOKED_AGAIN: u32 = 4;
/// After this multiple of the maximum gap between frames (2 s in total), a person may be anywhere.
pub const LOST: f64 = 5.0;

/// Cost of a search for boxes, in runs of the network.
pub(crate) const SEARCH: f64 = 1.0;
/// Maximum number of runs that a view may use in advance.
const MOST_DEBT: f64 = 4.0;
/// Time for which a person is not looked at to save runs, at most, as a fraction of the maximum gap between frames (0.2 s).
const UNSEEN: f64 = 0.5;
/// Time for which a search waits for runs at most, as a multiple of the same time (1 s).
const LONGEST_WAIT: u64 = 5;

/// State of the step from frame to frame: reusable memory, and the boxes of the people seen.
#[derive(Debug, Default)]
pub struct NetworkMemory {
    pub(crate) look: LookMemory,
    pub(crate) values: Vec<f32>,
    /// Body parts that people in front hide.
    pub(crate) bars: Vec<Bar>,
    /// Where to look for the people of this frame in the next frame.
    pub(crate) tracks: Vec<Track>,
    /// The people of this frame; entries beyond `n_seen` are spare memory.
    pub(crate) seen: Vec<Seen>,
    pub(crate) n_seen: usize,
    /// The people of the previous frame.
    pub(crate) before: Vec<Seen>,
    /// Boxes of the detector in which nobody was found.
    pub(crate) empty: Vec<Empty>,
    /// Number of frames until the next search for boxes; `None` before the first frame.
    pub(crate) until: Option<u64>,
    /// Number of frames for which frequent searches continue. Frequent searches start when people are near each other, or when one of
    /// several people is lost or found.
    n_unsettled: u64,
    /// Number of the last frame, if known ([`Self::begin`]).
    last: Option<u64>,
    /// True if the last frame is so recent that nobody has left the box.
    pub(crate) is_soon: bool,
    /// Number of frames since the last frame, and the maximum number of frames for which a person who stands still is not looked at again;
    /// `None` if the frame rate is unknown.
    pub(crate) hold: Option<Hold>,
    /// Time since the last frame, as a multiple of the maximum gap between frames, if it is more than 1. People are then first searched for
    /// around their boxes.
    pub(crate) apart: Option<f64>,
    /// True if this frame was searched for people.
    pub(crate) has_searched: bool,
    /// Number of runs of the network that are left; negative if too many were used. `None` if there is no limit.
    pub(crate) credit: Option<f64>,
    /// Number of frames for which a search has waited until there are runs left.
    n_waited: u64,
    /// Number of runs of the network in the last frame; a search counts as [`SEARCH`] runs.
    pub(crate) n_looks: f64,
}

/// How long the last sighting of a person who stands still can be reused.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Hold {
    /// Number of frames from the last frame to this frame.
    pub(crate) gap: u64,
    /// Maximum number of frames between two runs of the network on a person who stands still.
    pub(crate) most: u64,
    /// The same, if runs must be saved.
    pub(crate) most_to_save: u64,
}

/// A box of the detector in which nobody was found.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Empty {
    /// The box, in pixels: left, top, right, bottom.
    pub(crate) outline: [f64; 4],
    /// Number of searches since the box was found empty.
    pub(crate) n_searches: u32,
}

/// A person in a frame.
#[derive(Debug, Default)]
pub(crate) struct Seen {
    /// Where to look for the person next; `None` if the network has just run on the person.
    pub(crate) next: Option<Track>,
    /// Number of frames since the network last ran on the person, if the person was left out to save runs; otherwise 0.
    pub(crate) age: u64,
    /// Velocity of the person, as in [`Track`].
    pub(crate) pace: Option<Pace>,
    pub(crate) maps: JointMaps,
    pub(crate) outline: [f64; 4],
    /// Rotation of the picture for the network.
    pub(crate) turn: Turn,
    /// Usual score of the person's poses in the earlier frames; `None` for a new person.
    pub(crate) usual_score: Option<f32>,
    /// Mean heat of the joints at their peaks, 0 to 1.
    pub(crate) heat: f64,
    /// Evidence of the direction in which the trunk faces, if the network provides it.
    pub(crate) front: Option<FrontEvidence>,
    /// Colour of the trunk, as in [`Sighting`](crate::Sighting).
    pub(crate) colour: Option<[f32; 3]>,
    /// The picture of the person when the network last ran on it.
    pub(crate) thumbnail: Option<Thumbnail>,
}

impl NetworkMemory {
    /// Returns the people seen by the network in this frame.
    pub(crate) fn people(&self) -> &[Seen] {
        &self.seen[..self.n_seen]
    }

    /// Iterates over the network's maps of the people of this frame; the largest and clearest people come first.
    pub fn maps(&self) -> impl Iterator<Item = &JointMaps> {
        self.people().iter().map(|person| &person.maps)
    }

    /// Returns the heat of the person who is most clearly visible in this frame, 0 to 1; 0 if nobody is visible.
    pub(crate) fn best_heat(&self) -> f64 {
        let heats = self.people().iter().map(|known| known.heat);
        heats.fold(0.0, f64::max)
    }

    /// Returns memory for a run of the network, and for one more person of this frame.
    pub(crate) fn next(&mut self) -> (&mut LookMemory, &mut Seen) {
        if self.seen.len() == self.n_seen {
            self.seen.push(Seen::default());
        }
        (&mut self.look, &mut self.seen[self.n_seen])
    }

    /// Counts one more search for every empty box, and forgets the boxes that must be looked into again.
    pub(crate) fn age_empty_boxes(&mut self) {
        self.empty.retain_mut(|empty| {
            empty.n_searches += 1;
            empty.n_searches < LOOKED_AGAIN
        });
    }

    /// Keeps only the largest and clearest people of this frame.
    pub(crate) fn keep_largest(&mut self, n_most: usize) {
        let size = |seen: &Seen| seen.heat * (seen.outline[3] - seen.outline[1]);
        self.seen[..self.n_seen].sort_by(|a, b| size(b).total_cmp(&size(a)));
        self.n_seen = self.n_seen.min(n_most);
    }

    /// Starts frequent searches if people are near each other in this frame, or if their number has changed.
    ///
    /// * `n_before`: number of people in the previous frame.
    /// * `n_frames`: number of frames with frequent searches after such an event.
    pub(crate) fn note_company(&mut self, n_before: usize, n_frames: u64) {
        let people = self.people();
        let are_near = |(nth, person): (usize, &Seen)| {
            let around = wider(person.outline);
            people[..nth].iter().any(|other| overlap(wider(other.outline), around) > 0.0)
        };
        let has_changed = self.n_seen != n_before && self.n_seen.max(n_before) > 1;
        self.n_unsettled = if has_changed || people.iter().enumerate().any(are_near) {
            n_frames
        } else {
            self.n_unsettled.saturating_sub(1)
        };
    }

    /// Returns true if the last frame is so recent that people are roughly in their boxes.
    pub(crate) fn is_followed(&self) -> bool {
        self.hold.is_some() && self.apart.is_none()
    }

    /// Returns true if boxes should be searched for frequently.
    pub(crate) fn is_unsettled(&self) -> bool {
        self.n_unsettled > 0
    }

    /// Begins a frame. If the last frame is long ago, because frames were dropped or lost, people are first searched for around their old
    /// boxes. If it is very long ago, the whole picture is searched, unless it was already searched in the last frame. Without this
    /// exception, slow searches could delay frames so much that every frame is searched.
    ///
    /// * `frame`: number of the frame.
    /// * `most_apart`: maximum number of frames after which people can still be expected in their boxes.
    pub fn begin(&mut self, frame: u64, most_apart: Option<f64>) {
        let apart = self.last.map(|last| frame.saturating_sub(last));
        let share = apart.zip(most_apart);
        let share = share.map(|(apart, most)| apart as f64 / most);
        self.is_soon = share.is_some_and(|share| share <= SOON);
        self.hold = apart.zip(most_apart).map(|(gap, most)| Hold {
            gap,
            most: (HELD * most) as u64,
            most_to_save: ((UNSEEN * most) as u64).max(gap),
        });
        self.apart = share.filter(|share| *share > 1.0);
        if share.is_some_and(|share| share > LOST) && !self.has_searched {
            // The first frame is searched in any case, and determines which later frames are searched.
            self.until = self.until.map(|_| 0);
        }
        self.last = Some(frame);
    }

    /// Limits the number of runs of the network. Runs that a frame does not use are left for the next frame; runs beyond the limit are
    /// taken from later frames.
    ///
    /// There is no limit in the first frame, or if the frame rate is unknown: nobody can then be predicted.
    ///
    /// * `looks`: number of runs per frame, on average; `None` for no limit.
    pub fn allow(&mut self, looks: Option<f64>) {
        self.credit = looks.filter(|_| self.hold.is_some()).map(|looks| {
            let left = self.credit.unwrap_or(0.0).clamp(-MOST_DEBT, looks.max(1.0));
            left + looks
        });
    }

    /// Returns the number of runs of the network in the last frame, for [`LookBudget::spent`](crate::LookBudget::spent).
    pub fn n_looks(&self) -> f64 {
        self.n_looks
    }

    /// Returns the difference between the numbers of the last two frames; 0 if there was only one, or if the frame rate is unknown.
    pub fn n_frames(&self) -> u64 {
        self.hold.map_or(0, |hold| hold.gap)
    }

    /// Takes note of the runs of a frame.
    pub(crate) fn spend(&mut self, n_runs: u64) {
        self.n_looks = n_runs as f64 + if self.has_searched { SEARCH } else { 0.0 };
        self.credit = self.credit.map(|credit| credit - self.n_looks);
    }

    /// Returns true if this frame must be searched for boxes, even if people are seen. A search waits until there are runs left, but not
    /// longer than [`LONGEST_WAIT`], so that new people are found however few runs there are.
    pub(crate) fn is_due(&mut self) -> bool {
        let is_due = self.until.is_none_or(|until| until == 0);
        let is_affordable = self.credit.is_none_or(|credit| credit > 0.0);
        let is_late =
            self.hold.is_some_and(|hold| self.n_waited >= LONGEST_WAIT * hold.most_to_save);
        let has_to_wait = is_due && !is_affordable && !is_late;
        self.n_waited = if has_to_wait { self.n_waited + 1 } else { 0 };
        is_due && !has_to_wait
    }

    /// Returns true if this frame was searched for boxes.
    pub fn has_searched(&self) -> bool {
        self.has_searched
    }
}

impl Seen {
    /// Checks a person on whom the network has run; returns true if the person is clearly visible and inside the frame.
    ///
    /// * `size`: width and height of the frame; `least_heat`: minimum mean heat of the joints of a clearly visible person, 0 to 1.
    pub(crate) fn judge(&mut self, size: [usize; 2], least_heat: f64) -> bool {
        (self.next, self.age) = (None, 0);
        self.heat = self.maps.heat();
        self.heat >= least_heat && self.maps.overlaps(size)
    }
}

/// Returns true if the person at index `n` is the same as one of the `n` people before in the list. This occurs because two boxes can show
/// the same person.
pub(crate) fn is_known(seen: &[Seen], n: usize) -> bool {
    let (before, last) = seen[..=n].split_at(n);
    before.iter().any(|known| in_common(&known.maps, &last[0].maps) >= TWIN)
}

/// Returns the fraction of joints that two sightings have in common, with left and right as labelled or swapped.
fn in_common(first: &JointMaps, second: &JointMaps) -> f64 {
    let [_, top, _, bottom] = first.extent();
    let near = SAME_JOINT * (bottom - top);
    let [first, second] = [first, second].map(JointMaps::peaks);
    let share = |mirror: &dyn Fn(usize) -> usize| {
        let both = first.iter().enumerate().filter_map(|(joint, peak)| {
            let [a, b] = [peak.as_ref()?.at, second.get(mirror(joint))?.as_ref()?.at];
            Some((a[0] - b[0]).hypot(a[1] - b[1]) < near)
        });
        let (n, n_near) = both.fold((0_u32, 0_u32), |(n, n_near), is_near| {
            (n + 1, n_near + u32::from(is_near))
        });
        f64::from(n_near) / f64::from(n.max(1))
    };
    share(&|joint| joint).max(share(&|joint| MIRRORED[joint]))
}

/// Returns the displacement of each joint from one sighting to another, in pixels; `None` for joints that one of them lacks.
fn steps(first: &JointMaps, second: &JointMaps) -> impl Iterator<Item = Option<Step>> {
    let both = first.peaks().iter().zip(second.peaks());
    both.map(|(a, b)| {
        let (a, b) = (a.as_ref()?, b.as_ref()?);
        Some(Step {
            by: [b.at[0] - a.at[0], b.at[1] - a.at[1]],
            score: a.score.min(b.score),
        })
    })
}

/// Displacement of a joint between two sightings.
struct Step {
    by: [f64; 2],
    /// Lower one of the two heats, 0 to 1.
    score: f64,
}

pub(crate) fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    Sorted::new(values.collect::<Vec<f64>>()).upper_median()
}

/// Returns the displacement of a person from one sighting to another, as fractions of the height of the first window. The displacement of
/// the whole person is the median over the joints along each axis, so that errors of single joints have little effect.
///
/// * `least_score`: minimum heat of a joint in both sightings for its own displacement, 0 to 1.
pub(crate) fn shift(first: &JointMaps, second: &JointMaps, least_score: f64) -> Option<Moved> {
    let [_, top, _, bottom] = first.extent();
    let along = |axis: usize| median(steps(first, second).flatten().map(|step| step.by[axis]));
    let share = |by: [f64; 2]| by.map(|along| along / (bottom - top));
    let mut joints = [None; N_JOINTS];
    for (joint, step) in joints.iter_mut().zip(steps(first, second)) {
        *joint = step.filter(|step| step.score >= least_score).map(|step| share(step.by));
    }
    Some(Moved {
        whole: share([along(0)?, along(1)?]),
        joints,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_missing_frames_trigger_a_search_for_people() {
        let after = |frames: &[u64], most_apart: Option<f64>| {
            let mut memory = NetworkMemory {
                until: Some(7),
                ..NetworkMemory::default()
            };
            for frame in frames {
                memory.begin(*frame, most_apart);
            }
            memory.until
        };
        assert_eq!(after(&[3, 4, 14], Some(2.0)), Some(7));
        assert_eq!(after(&[3, 4, 15], Some(2.0)), Some(0));
        assert_eq!(after(&[30], Some(2.0)), Some(7), "the first frame");
        assert_eq!(after(&[3, 90], None), Some(7), "no rate is known");
    }

    #[test]
    fn searches_are_more_frequent_if_people_may_hide_each_other_or_one_was_lost() {
        let seen = |lefts: &[f64]| NetworkMemory {
            seen: lefts
                .iter()
                .map(|left| Seen {
                    outline: [*left, 0.0, left + 40.0, 100.0],
                    ..Seen::default()
                })
                .collect(),
            n_seen: lefts.len(),
            ..NetworkMemory::default()
        };
        let n_often = |lefts: &[f64], n_before: usize| {
            let mut memory = seen(lefts);
            let mut n_often = 0;
            memory.note_company(n_before, 5);
            while memory.is_unsettled() && n_often < 9 {
                n_often += 1;
                memory.note_company(lefts.len(), 5);
            }
            n_often
        };
        assert_eq!(n_often(&[0.0, 200.0], 2), 0, "apart");
        assert_eq!(n_often(&[0.0, 80.0], 2), 9, "near");
        assert_eq!(n_often(&[0.0, 200.0], 3), 5, "one was lost");
        assert_eq!(n_often(&[0.0], 2), 5, "one of two was lost");
        assert_eq!(n_often(&[0.0], 0), 0, "a person alone");
    }

    #[test]
    fn an_empty_box_is_searched_again_in_the_fourth_search() {
        let mut memory = NetworkMemory::default();
        memory.empty.push(Empty {
            outline: [0.0, 0.0, 40.0, 100.0],
            n_searches: 0,
        });
        let is_left_out = |_: u32| {
            memory.age_empty_boxes();
            !memory.empty.is_empty()
        };
        let left_out: Vec<bool> = (1..=4).map(is_left_out).collect();
        assert_eq!(left_out, [true, true, true, false]);
    }

    #[test]
    fn a_slow_search_does_not_cause_a_search_of_the_next_frame() {
        let mut memory = NetworkMemory {
            until: Some(7),
            ..NetworkMemory::default()
        };
        memory.begin(3, Some(2.0));
        memory.has_searched = true;
        memory.begin(30, Some(2.0));
        assert_eq!((memory.until, memory.apart), (Some(7), Some(13.5)));
        memory.has_searched = false;
        memory.begin(32, Some(2.0));
        assert_eq!((memory.until, memory.apart), (Some(7), None));
        memory.begin(60, Some(2.0));
        assert_eq!(memory.until, Some(0));
    }

    #[test]
    fn a_still_person_is_observed_at_time_intervals_or_without_a_rate_in_every_frame() {
        let hold = |most_apart: Option<f64>, frames: [u64; 2]| {
            let mut memory = NetworkMemory::default();
            for frame in frames {
                memory.begin(frame, most_apart);
            }
            memory.hold.map(|hold| (hold.gap, hold.most))
        };
        assert_eq!(hold(Some(24.0), [3, 4]), Some((1, 8)), "60 Hz");
        assert_eq!(hold(Some(12.0), [3, 5]), Some((2, 4)), "30 Hz");
        assert_eq!(hold(Some(2.0), [3, 4]), Some((1, 0)), "5 Hz");
        assert_eq!(hold(None, [3, 4]), None);
    }

    #[test]
    fn unused_network_runs_are_kept_for_one_frame_only() {
        let mut memory = NetworkMemory::default();
        memory.allow(Some(1.5));
        assert_eq!(memory.credit, None, "no rate is known");
        (0..2).for_each(|frame| memory.begin(frame, Some(24.0)));
        let mut left = |looks: Option<f64>, n_runs: u64| {
            memory.allow(looks);
            let credit = memory.credit;
            memory.spend(n_runs);
            credit
        };
        assert_eq!(left(Some(1.5), 0), Some(1.5));
        assert_eq!(left(Some(1.5), 1), Some(3.0));
        assert_eq!(
            left(Some(1.5), 0),
            Some(3.0),
            "no more than two frames' runs"
        );
        assert_eq!(left(Some(1.5), 20), Some(3.0));
        assert_eq!(left(Some(1.5), 0), Some(-2.5), "a limited debt");
        assert_eq!(left(None, 3), None);
        assert_eq!(left(Some(1.5), 0), Some(1.5));
    }

    #[test]
    fn a_search_waits_a_limited_time_for_network_runs() {
        let mut memory = NetworkMemory {
            until: Some(0),
            ..NetworkMemory::default()
        };
        (0..2).for_each(|frame| memory.begin(frame, Some(24.0)));
        memory.credit = Some(1.0);
        assert!(memory.is_due());
        memory.credit = Some(-4.0);
        let n_waited = (0..1000).take_while(|_| !memory.is_due()).count();
        assert_eq!(n_waited, 60, "one second at 60 Hz");
        assert!(!memory.is_due(), "it waits again");
    }

    #[test]
    fn nobody_leaves_their_box_between_two_frames_of_a_fast_camera() {
        let is_soon = |frames: &[u64], most_apart: Option<f64>| {
            let mut memory = NetworkMemory::default();
            for frame in frames {
                memory.begin(*frame, most_apart);
            }
            memory.is_soon
        };
        assert!(is_soon(&[3, 4], Some(24.0)), "at 60 frames a second");
        assert!(!is_soon(&[3, 4], Some(2.0)), "at 5 frames a second");
        assert!(!is_soon(&[3, 8], Some(24.0)), "four frames were dropped");
        assert!(!is_soon(&[3], Some(24.0)), "the first frame");
        assert!(!is_soon(&[3, 4], None), "no rate is known");
    }
}
