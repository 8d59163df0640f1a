//! What the step with a network keeps from frame to frame.

use fmp::Layout;
use multiview::FrontEvidence;
use posenetwork::{JointMaps, LookMemory, Turn};

use crate::tracks::Track;

/// People half of whose joints are nearer to each other, as a share of the height of the network's window, are one.
const TWIN: f64 = 0.05;
/// Nobody leaves the box of the last frame within this share of the time for which people can be followed without a frame: a person
/// who runs moves 0.2 m in 0.07 s.
const SOON: f64 = 1.0 / 6.0;

/// What the step keeps from frame to frame: memory that is used again, and the boxes of the people it sees.
#[derive(Debug, Default)]
pub struct NetworkMemory {
    pub(crate) look: LookMemory,
    pub(crate) values: Vec<f32>,
    /// Where the people of this frame are looked for in the next one.
    pub(crate) tracks: Vec<Track>,
    /// The people of this frame; those beyond `n_seen` are memory for more.
    pub(crate) seen: Vec<Seen>,
    pub(crate) n_seen: usize,
    /// Boxes that showed somebody who is known.
    pub(crate) shown: Vec<[f64; 4]>,
    /// Frames until boxes are looked for; none before the first frame.
    pub(crate) until: Option<u64>,
    /// The number of the last frame, where it is told ([`Self::begin`]).
    last: Option<u64>,
    /// Whether the last frame is so short a time ago that nobody has left their box.
    pub(crate) is_soon: bool,
    /// Whether they were looked for in this frame.
    pub(crate) has_searched: bool,
}

/// A person in a frame.
#[derive(Debug, Default)]
pub(crate) struct Seen {
    pub(crate) maps: JointMaps,
    pub(crate) outline: [f64; 4],
    /// How the picture was turned for the network.
    pub(crate) turn: Turn,
    /// The score that the person's poses had in the frames before; `None` for somebody new.
    pub(crate) usual_score: Option<f32>,
    /// Mean heat of the joints at their peaks, 0 to 1.
    pub(crate) heat: f64,
    /// In which direction the trunk faces, if the network tells.
    pub(crate) front: Option<FrontEvidence>,
    pub(crate) level: u16,
    pub(crate) responses: Vec<f32>,
}

impl NetworkMemory {
    /// The people that the network sees in this frame.
    pub(crate) fn people(&self) -> &[Seen] {
        &self.seen[..self.n_seen]
    }

    /// What the network tells of the people of this frame, those first who are seen best.
    pub fn maps(&self) -> impl Iterator<Item = &JointMaps> {
        self.people().iter().map(|it| &it.maps)
    }

    /// Memory for looking, and for one more person of this frame.
    pub(crate) fn next(&mut self) -> (&mut LookMemory, &mut Seen) {
        if self.seen.len() == self.n_seen {
            self.seen.push(Seen::default());
        }
        (&mut self.look, &mut self.seen[self.n_seen])
    }

    /// Begins with a frame; people are looked for in it if it is long after the last one: frames between were dropped, or lost.
    ///
    /// * `frame`: its number.
    /// * `most_apart`: most frames from one in which people are seen to the next one in which they can be followed.
    pub fn begin(&mut self, frame: u64, most_apart: Option<u64>) {
        let apart = self.last.map(|last| frame.saturating_sub(last));
        let share = apart.zip(most_apart);
        let share = share.map(|(it, most)| it as f64 / most as f64);
        self.is_soon = share.is_some_and(|it| it <= SOON);
        if share.is_some_and(|it| it > 1.0) {
            // The first frame is searched anyway, and sets its own phase.
            self.until = self.until.map(|_| 0);
        }
        self.last = Some(frame);
    }

    /// Whether boxes were looked for in this frame.
    pub fn has_searched(&self) -> bool {
        self.has_searched
    }
}

impl Seen {
    /// Judges what is seen of a person; returns whether the person is seen well, and in the frame.
    ///
    /// * `layout`: of the frame; `least_heat`: mean heat of the joints of somebody who is seen well, 0 to 1.
    pub(crate) fn judge(&mut self, layout: &Layout, least_heat: f64) -> bool {
        self.heat = self.maps.heat();
        self.level = self.maps.level(layout);
        self.heat >= least_heat && self.maps.region(layout).is_some()
    }
}

/// Whether the person after the first `n` is one of these: two boxes can be of one person.
pub(crate) fn is_known(seen: &[Seen], n: usize) -> bool {
    let (before, last) = seen[..=n].split_at(n);
    before.iter().any(|it| {
        let [_, top, _, bottom] = it.maps.extent();
        let both = it.maps.peaks().iter().zip(last[0].maps.peaks());
        let both = both.filter_map(|(a, b)| Some((a.as_ref()?.at, b.as_ref()?.at)));
        let mut distances: Vec<f64> = both
            .map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1]))
            .collect();
        distances.sort_by(f64::total_cmp);
        let middle = distances.get(distances.len() / 2);
        middle.is_some_and(|it| *it < TWIN * (bottom - top))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn people_are_looked_for_after_frames_that_are_missing() {
        let after = |frames: &[u64], most_apart: Option<u64>| {
            let mut memory = NetworkMemory {
                until: Some(7),
                ..NetworkMemory::default()
            };
            for frame in frames {
                memory.begin(*frame, most_apart);
            }
            memory.until
        };
        assert_eq!(after(&[3, 4, 6], Some(2)), Some(7));
        assert_eq!(after(&[3, 4, 7], Some(2)), Some(0));
        assert_eq!(after(&[30], Some(2)), Some(7), "the first frame");
        assert_eq!(after(&[3, 90], None), Some(7), "no rate is known");
    }

    #[test]
    fn nobody_leaves_their_box_between_two_frames_of_a_fast_camera() {
        let is_soon = |frames: &[u64], most_apart: Option<u64>| {
            let mut memory = NetworkMemory::default();
            for frame in frames {
                memory.begin(*frame, most_apart);
            }
            memory.is_soon
        };
        assert!(is_soon(&[3, 4], Some(24)), "at 60 frames a second");
        assert!(!is_soon(&[3, 4], Some(2)), "at 5 frames a second");
        assert!(!is_soon(&[3, 8], Some(24)), "four frames were dropped");
        assert!(!is_soon(&[3], Some(24)), "the first frame");
        assert!(!is_soon(&[3, 4], None), "no rate is known");
    }
}
