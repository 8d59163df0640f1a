//! The single-view step with a network: pixels in, people and the maps of their joints out.
//!
//! A network that looks at one person needs a box. While a person is seen well, the box of the next frame is that of the pose,
//! widened; now and then, and where nobody is seen well, a detector finds boxes. Keypoints that another program found take the same way,
//! without a picture.

use kernels::Rgb8View;
use keypoints::{Keypoint, Way};
use multiview::FrontEvidence;
use posenetwork::{
    Detector, JointMaps, LookError, Looker, MOST_CELLS, MapSettings, PersonMaps, PoseNetwork, Turn,
};

use crate::looks::{Looks, of_others};
use crate::network_memory::{NetworkMemory, Seen};
use crate::placed::N;
use crate::sighting::Sighting;
use crate::tracks::{MUCH_WORSE, Track};
use crate::view_result::ExtraKeypoint;

/// Source of the places of people's joints.
#[derive(Debug)]
pub enum Eyes {
    /// A network that looks into boxes, and the detector of people that finds these.
    Network(Box<PoseNetwork>, Box<Detector>),
    /// Keypoints that another program found: how the joints follow from them (`keypoints::joint_ways` of their names).
    Keypoints(Vec<Vec<Way>>),
}

/// Settings of the step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NetworkSettings {
    /// Most people of a view: each costs a run of the network.
    pub n_people: usize,
    /// Boxes are looked for in every n-th frame, and in every one in which nobody is seen well.
    pub find_every: u64,
    /// The same while people are near each other, and for [`Self::find_every`] frames after: one who is hidden for a moment is found
    /// again soon; also after one of several was lost or found.
    pub find_every_of_several: u64,
    /// By how many frames the second of these comes sooner: views that look for boxes in turn do not keep one frame waiting.
    pub find_phase: u64,
    /// Least mean heat of the joints of a person who is seen well, 0 to 1.
    pub least_heat: f64,
    /// How maps become evidence.
    pub maps: MapSettings,
    /// Standard deviation of keypoints that another program found, share of the height of the person's box enlarged by a quarter.
    pub keypoint_sigma: f64,
}

impl Default for NetworkSettings {
    fn default() -> Self {
        Self {
            n_people: 4,
            find_every: 10,
            find_every_of_several: 10,
            find_phase: 0,
            least_heat: 0.2,
            maps: MapSettings::default(),
            keypoint_sigma: 0.02,
        }
    }
}

/// Least score of an extra keypoint: below it, its place is a guess (0.3 is what mmpose and `Pose2Sim` use).
const LEAST_SCORE: f64 = 0.3;
/// Most values of the maps of a frame.
///
/// * `n_people`: most people of a view.
pub const fn most_values(n_people: usize) -> usize {
    n_people * N * MOST_CELLS
}

/// The single-view step by a network or by keypoints, for frames of one size.
#[derive(Debug)]
pub struct NetworkStep {
    eyes: Eyes,
    size: [usize; 2],
    settings: NetworkSettings,
    extras: Vec<Option<usize>>,
}

impl NetworkStep {
    /// Prepares the step.
    ///
    /// * `size`: width and height of the frames.
    pub fn new(eyes: Eyes, size: [usize; 2], settings: NetworkSettings) -> Self {
        Self {
            eyes,
            size,
            settings,
            extras: Vec::new(),
        }
    }

    /// The step with keypoints that no joint follows from: every candidate has them.
    ///
    /// * `extras`: of every wanted keypoint its number in the order of the card or of the file; `None` where these do not know it.
    #[must_use]
    pub fn with_extras(self, extras: Vec<Option<usize>>) -> Self {
        Self { extras, ..self }
    }

    /// Width and height of the frames.
    pub fn size(&self) -> [usize; 2] {
        self.size
    }

    /// Looks at a frame; what is seen stays in the memory ([`Self::sightings`], [`Self::evidence`]).
    ///
    /// Who stands still is held. Where boxes are looked for, they come before those of the frame before, so that no box shrinks or wanders off
    /// unnoticed. A person whose pose was much worse than usual is looked at in a wider box as well, and the better sight kept. Up to twice as many
    /// people as are kept are looked at, and the largest kept. While somebody is seen, a box in which nobody was seen is left out of some searches.
    ///
    /// # Errors
    ///
    /// [`LookError`] if the network or the detector fails, or gives numbers that are not finite.
    pub fn look(&self, image: Rgb8View<'_>, memory: &mut NetworkMemory) -> Result<(), LookError> {
        memory.n_seen = 0;
        let Eyes::Network(network, detector) = &self.eyes else {
            return Ok(());
        };
        let is_due = memory.is_due();
        let mut tracks = core::mem::take(&mut memory.tracks);
        let mut before = core::mem::take(&mut memory.before);
        core::mem::swap(&mut memory.seen, &mut before);
        let looks = Looks {
            looker: Looker {
                network,
                settings: &self.settings.maps,
            },
            image,
            size: self.size,
            n_most: 2 * self.settings.n_people,
            least_heat: self.settings.least_heat,
            most_lost: self.most_lost(),
        };
        memory.has_searched = is_due;
        looks.hold_still(&mut tracks, &mut before, memory);
        if is_due {
            let found = find(detector, image, &mut memory.values)?;
            looks.see_boxes(&of_others(found, memory.people()), memory)?;
        }
        for track in tracks.iter().filter(|track| !track.is_seen) {
            looks.see_once_more(track, &before, memory)?;
        }
        if memory.n_seen == 0 && !is_due {
            memory.has_searched = true;
            let found = find(detector, image, &mut memory.values)?;
            looks.see_boxes(&found, memory)?;
        }
        memory.before = before;
        memory.keep_largest(self.settings.n_people);
        if memory.n_seen == 0 {
            memory.empty.clear();
        }
        memory.note_company(tracks.len(), self.settings.find_every);
        self.plan_search(memory);
        // The memory of the list is kept.
        memory.tracks = tracks;
        memory.tracks.clear();
        Ok(())
    }

    /// Plans in how many frames boxes are searched for next.
    fn plan_search(&self, memory: &mut NetworkMemory) {
        let settings = &self.settings;
        let first = settings.find_every - settings.find_phase % settings.find_every;
        let every = if memory.n_seen > 1 && memory.is_unsettled() {
            settings.find_every_of_several
        } else {
            settings.find_every
        };
        let next = memory.until.map_or(first.min(every), |_| every);
        let until = if memory.has_searched {
            Some(next)
        } else {
            memory.until.map(|left| left.min(every))
        };
        memory.until = until.map(|left| left.saturating_sub(1));
    }

    /// Takes the people of a frame whose keypoints another program found; they stay in the memory as after [`Self::look`].
    ///
    /// * `people`: keypoints of every person, pixels of the frame.
    pub fn take<P: AsRef<[Option<Keypoint>]>>(
        &self,
        people: impl Iterator<Item = P>,
        memory: &mut NetworkMemory,
    ) {
        memory.tracks.clear();
        memory.n_seen = 0;
        let Eyes::Keypoints(rows) = &self.eyes else {
            return;
        };
        for keypoints in people {
            if memory.n_seen == self.settings.n_people {
                break;
            }
            let (_, seen) = memory.next();
            let NetworkSettings {
                maps,
                keypoint_sigma,
                ..
            } = &self.settings;
            seen.turn = Turn::Up;
            let is_there = seen.maps.of_keypoints(keypoints.as_ref(), rows, maps, *keypoint_sigma);
            if is_there && seen.judge(self.size, self.settings.least_heat) {
                memory.n_seen += 1;
            }
        }
    }

    /// Amount by which the score of a pose may be lower than usual for its person.
    fn most_lost(&self) -> f32 {
        -MUCH_WORSE * self.settings.maps.floor()
    }

    /// The people of the frame that was looked at, the largest and best seen first; keeps where they are looked for in the next one.
    pub fn sightings(&self, memory: &mut NetworkMemory) -> Vec<Sighting> {
        let n_seen = memory.n_seen;
        let mut people = Vec::with_capacity(n_seen);
        for (nth, seen) in memory.seen[..n_seen].iter_mut().enumerate() {
            let score = seen.maps.score(&self.settings.maps);
            // Who was not looked at has a track already.
            if seen.next.is_none() {
                self.track(seen, score);
            }
            let next = seen.next.map(|track| Track {
                index: nth,
                ..track
            });
            memory.tracks.extend(next);
            let sighting = Sighting::new(seen.maps.peaks(), score);
            people.push(Sighting {
                front: front_of(&sighting, seen),
                extras: self.extras_of(&seen.maps).collect(),
                ..sighting
            });
        }
        people
    }

    /// The maps of the people of [`Self::sightings`], in their order.
    pub fn evidence<'a>(&self, memory: &'a NetworkMemory) -> impl Iterator<Item = PersonMaps<'a>> {
        let people = memory.people().iter();
        people.filter_map(|seen| seen.maps.evidence())
    }

    /// Plans where to search next for a person who was looked at.
    fn track(&self, seen: &mut Seen, score: f32) {
        let before = ((seen.outline, seen.turn), seen.usual_score);
        let around = seen.maps.around();
        seen.next = around.map(|around| Track {
            pace: seen.pace,
            ..Track::next(before, (around, score), self.most_lost())
        });
    }

    /// The extra keypoints of a person.
    fn extras_of(&self, maps: &JointMaps) -> impl Iterator<Item = ExtraKeypoint> {
        let each = self.extras.iter();
        each.map(|extra| {
            let (found, sigma_px) = extra.and_then(|joint| maps.keypoint(joint))?;
            let is_seen = found.score >= LEAST_SCORE;
            is_seen.then_some((found.at, sigma_px))
        })
    }
}

/// In which direction a person faces; nothing of one who is seen head down in a picture that was not turned.
fn front_of(sighting: &Sighting, seen: &Seen) -> FrontEvidence {
    let is_told = seen.turn != Turn::Up || sighting.trunk_upward().is_none_or(|up| up > 0.0);
    seen.front.filter(|_| is_told).unwrap_or_default()
}

/// Boxes around people, pixels, who is sure and large first: the frame has room for a few.
fn find(
    detector: &Detector,
    image: Rgb8View<'_>,
    values: &mut Vec<f32>,
) -> Result<Vec<[f64; 4]>, LookError> {
    let mut found = detector.people(image, values)?;
    let weight = |found: &keypoints::PersonBox| found.score * (found.outline[3] - found.outline[1]);
    found.sort_by(|a, b| weight(b).total_cmp(&weight(a)));
    Ok(found.into_iter().map(|found| found.outline).collect())
}
