//! The single-view step with a network: turns a picture into people and the maps of their joints.
//!
//! A network that finds the joints of one person needs a box around that person. While a person is clearly visible, the box for the next
//! frame is the widened box of the pose. From time to time, and whenever nobody is clearly visible, a detector searches for boxes.
//! Keypoints found by another program go through the same step, without a picture.

use kernels::Rgb8View;
use keypoints::{Keypoint, Way};
use multiview::FrontEvidence;
use posenetwork::{
    Detector, JointMaps, LookError, Looker, MOST_CELLS, MapSettings, PersonMaps, PoseNetwork, Turn,
};

use crate::colour::trunk_colour;
use crate::looks::{Looks, of_others};
use crate::network_memory::{NetworkMemory, Seen};
use crate::placed::N;
use crate::sighting::Sighting;
use crate::thumbnail::Thumbnail;
use crate::tracks::{MUCH_WORSE, Track};
use crate::view_result::ExtraKeypoint;

/// Source of the positions of people's joints.
#[derive(Debug)]
pub enum Eyes {
    /// A network that finds the joints of the person in a box, and the person detector that finds the boxes.
    Network(Box<PoseNetwork>, Box<Detector>),
    /// Keypoints found by another program, with the rules that derive the joints from them (`keypoints::joint_ways` of their names).
    Keypoints(Vec<Vec<Way>>),
}

/// Settings of the step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NetworkSettings {
    /// Maximum number of people per view; each person costs a run of the network.
    pub n_people: usize,
    /// Number of frames from one search for boxes to the next. Frames in which nobody is clearly visible are always searched.
    pub find_every: u64,
    /// Search interval while people are near each other, and for [`Self::find_every`] frames afterwards, so that a person who was hidden
    /// briefly is soon found again. It also applies after one of several people was lost or found.
    pub find_every_of_several: u64,
    /// Number of frames by which the second regular search comes early. With different values for different views, the views do not all
    /// search in the same frame.
    pub find_phase: u64,
    /// Time between two frames of the footage, in seconds; 0 if unknown.
    pub frame_s: f64,
    /// Minimum mean heat of the joints of a clearly visible person, 0 to 1.
    pub least_heat: f64,
    /// Settings that control how maps are turned into evidence.
    pub maps: MapSettings,
    /// Standard deviation of keypoints found by another program, as a fraction of the height of the person's box enlarged by a quarter.
    pub keypoint_sigma: f64,
}

impl Default for NetworkSettings {
    fn default() -> Self {
        Self {
            n_people: 4,
            find_every: 10,
            find_every_of_several: 10,
            find_phase: 0,
            frame_s: 0.0,
            least_heat: 0.2,
            maps: MapSettings::default(),
            keypoint_sigma: 0.02,
        }
    }
}

/// Minimum score of an extra keypoint: below it, the position is a guess (mmpose and `Pose2Sim` use 0.3).
const LEAST_SCORE: f64 = 0.3;
/// Returns the maximum number of map values of a frame.
///
/// * `n_people`: maximum number of people per view.
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

    /// Adds keypoints that are not joints; every candidate then includes them.
    ///
    /// * `extras`: for every wanted keypoint, its index in the order of the card or of the file; `None` if the card or file does not have
    ///   it.
    #[must_use]
    pub fn with_extras(self, extras: Vec<Option<usize>>) -> Self {
        Self { extras, ..self }
    }

    /// Returns the width and height of the frames.
    pub fn size(&self) -> [usize; 2] {
        self.size
    }

    /// Finds the people in a frame, and stores the result in the memory ([`Self::sightings`], [`Self::evidence`]).
    ///
    /// For people who stand still, the last sighting is reused. In a frame with a search, the detector's boxes come before the boxes of the
    /// previous frame, so that a box that shrinks or drifts is noticed. For a person whose pose was much worse than usual, the network also
    /// runs on a wider box, and the better sighting is kept. The network runs on up to twice as many people as are kept; the largest are
    /// kept. While a person is visible, boxes in which nobody was found are skipped in some searches.
    ///
    /// # Errors
    ///
    /// [`LookError`] if the network or the detector fails or returns numbers that are not finite.
    pub fn look(&self, image: Rgb8View<'_>, memory: &mut NetworkMemory) -> Result<(), LookError> {
        memory.n_seen = 0;
        memory.n_looks = 0.0;
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
        let n_runs = memory.look.workspace().n_runs();
        looks.hold_still(&mut tracks, &mut before, memory);
        looks.hold_to_save(&mut tracks, &mut before, memory);
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
        let n_runs = memory.look.workspace().n_runs() - n_runs;
        memory.spend(n_runs);
        memory.before = before;
        memory.keep_largest(self.settings.n_people);
        let n_seen = memory.n_seen;
        for seen in memory.seen[..n_seen].iter_mut().filter(|seen| seen.age == 0) {
            seen.colour = trunk_colour(image, &Sighting::new(seen.maps.peaks(), 0.0).joints);
            // A person whose sighting was reused keeps the picture on which the network ran.
            if seen.next.is_none() {
                seen.thumbnail = Thumbnail::new(image, seen.outline);
            }
        }
        if memory.n_seen == 0 {
            memory.empty.clear();
        }
        memory.note_company(tracks.len(), self.settings.find_every);
        self.plan_search(memory);
        // Reuse the memory of the list.
        memory.tracks = tracks;
        memory.tracks.clear();
        Ok(())
    }

    /// Plans the frame of the next search for boxes.
    fn plan_search(&self, memory: &mut NetworkMemory) {
        let settings = &self.settings;
        let first = settings.find_every - settings.find_phase % settings.find_every;
        // Frequent searches leave too few runs for the people who are known.
        let is_limited = memory.credit.is_some();
        let every = if memory.n_seen > 1 && memory.is_unsettled() && !is_limited {
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

    /// Uses the people and keypoints that another program found in a frame; they are stored in the memory as after [`Self::look`]. If there
    /// are more people than are kept, the largest and clearest are kept.
    ///
    /// * `people`: keypoints of every person, in pixels of the frame.
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
            let (_, seen) = memory.next();
            let NetworkSettings {
                maps,
                keypoint_sigma,
                ..
            } = &self.settings;
            (seen.turn, seen.colour) = (Turn::Up, None);
            let is_there = seen.maps.of_keypoints(keypoints.as_ref(), rows, maps, *keypoint_sigma);
            if is_there && seen.judge(self.size, self.settings.least_heat) {
                seen.outline = seen.maps.around().unwrap_or_default();
                memory.n_seen += 1;
            }
        }
        if memory.n_seen > self.settings.n_people {
            memory.keep_largest(self.settings.n_people);
        }
    }

    /// Returns the maximum amount by which the score of a pose may be below the usual score of its person.
    fn most_lost(&self) -> f32 {
        -MUCH_WORSE * self.settings.maps.floor()
    }

    /// Returns the people of the frame, the largest and clearest first. Stores where to look for them in the next frame.
    pub fn sightings(&self, memory: &mut NetworkMemory) -> Vec<Sighting> {
        let n_seen = memory.n_seen;
        let mut people = Vec::with_capacity(n_seen);
        for (nth, seen) in memory.seen[..n_seen].iter_mut().enumerate() {
            let score = seen.maps.score(&self.settings.maps);
            // A person whose sighting was reused already has a track.
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
                colour: seen.colour,
                age_s: (seen.age as f64 * self.settings.frame_s) as f32,
                ..sighting
            });
        }
        people
    }

    /// Returns the maps of the people returned by [`Self::sightings`], in the same order.
    pub fn evidence<'a>(&self, memory: &'a NetworkMemory) -> impl Iterator<Item = PersonMaps<'a>> {
        let people = memory.people().iter();
        people.filter_map(|seen| seen.maps.evidence())
    }

    /// Plans where to look next for a person on whom the network has run.
    fn track(&self, seen: &mut Seen, score: f32) {
        let before = ((seen.outline, seen.turn), seen.usual_score);
        let around = seen.maps.around();
        seen.next = around.map(|around| Track {
            pace: seen.pace,
            ..Track::next(before, (around, score), self.most_lost())
        });
    }

    /// Returns the extra keypoints of a person.
    fn extras_of(&self, maps: &JointMaps) -> impl Iterator<Item = ExtraKeypoint> {
        let each = self.extras.iter();
        each.map(|extra| {
            let (found, sigma_px) = extra.and_then(|joint| maps.keypoint(joint))?;
            let is_seen = found.score >= LEAST_SCORE;
            is_seen.then_some((found.at, sigma_px))
        })
    }
}

/// Returns the evidence of the direction in which a person faces. There is none for a person who is upside down in a picture that was not
/// rotated.
fn front_of(sighting: &Sighting, seen: &Seen) -> FrontEvidence {
    let is_told = seen.turn != Turn::Up || sighting.trunk_upward().is_none_or(|up| up > 0.0);
    seen.front.filter(|_| is_told).unwrap_or_default()
}

/// Finds boxes around people, in pixels. Certain and large boxes come first, because only a few boxes are used per frame.
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

#[cfg(test)]
mod tests {
    use keypoints::{LSP_14, joint_ways};

    use super::*;

    #[test]
    fn of_more_people_than_are_kept_the_largest_stay() {
        let names: Vec<String> = LSP_14.iter().map(|name| (*name).to_owned()).collect();
        let settings = NetworkSettings {
            n_people: 2,
            ..NetworkSettings::default()
        };
        let step = NetworkStep::new(Eyes::Keypoints(joint_ways(&names)), [640, 480], settings);
        // People next to each other, of these heights.
        let heights = [40.0, 300.0, 60.0, 200.0];
        let people = heights.iter().enumerate().map(|(nth, height)| {
            let keypoint = |joint: usize| Keypoint {
                at: [
                    150.0 * nth as f64 + 9.0 * (joint % 3) as f64,
                    50.0 + height * joint as f64 / 13.0,
                ],
                score: 0.9,
            };
            (0..N).map(|joint| Some(keypoint(joint))).collect::<Vec<_>>()
        });
        let mut memory = NetworkMemory::default();
        step.take(people, &mut memory);
        let seen = step.sightings(&mut memory);
        let ankles: Vec<f64> = seen.iter().map(|sighting| sighting.joint(0).unwrap()[0]).collect();
        assert_eq!(ankles, [150.0, 450.0]);
    }
}
