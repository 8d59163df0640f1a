//! Identifies the people of a frame: groups the candidates of all views into people with lasting ids.

use ::people::{Detection, Keypoint, Memory, Person, Remembered, Settings, State, Tracker, View};
use geometry::Camera;
use posenetwork::expected_error;

use crate::following::Follow;
use crate::network_step::NetworkSettings;
use crate::sighting::{Sighting, ViewSightings};

/// Size of the network's window around a person, as a multiple of the longer side of the box around the joints.
const WINDOW: f64 = 1.25;
/// Speed of a person whom the network has not just seen, in heights of the person per second.
const SPEED: f64 = 0.6;
/// Number of ids reserved for each start of the process: a restarted process without memory starts after the reserved ids, so that no id is
/// used twice.
const IDS_OF_A_PROCESS: u64 = 1000;

/// A person of a frame.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct KnownPerson {
    /// Id within the run, counted from 1.
    pub id: u64,
    /// Index of the person among the candidates of every view; `None` if the view does not show the person.
    pub candidates: Vec<Option<usize>>,
}

/// The people of a frame.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct FramePeople {
    /// The people, the followed person first. The followed person keeps an entry even if only other people are seen.
    pub people: Vec<KnownPerson>,
    /// Number of people on which several views agree.
    pub n_seen: usize,
}

/// Settings of the step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WhoSettings {
    /// Rule that decides which of several people comes first.
    pub follow: Follow,
    /// True if views name left and right as they appear in the picture, so that two views may disagree.
    pub as_seen: bool,
    /// Minimum heat that half of the joints of a new person must have in two views, 0 to 1.
    pub least_heat: f64,
    /// Maximum number of people at the same time.
    pub n_people: usize,
    /// Number of restarts of the process.
    pub n_restarts: u64,
}

impl Default for WhoSettings {
    fn default() -> Self {
        Self {
            follow: Follow::default(),
            as_seen: false,
            least_heat: 2.0 * NetworkSettings::default().least_heat,
            n_people: NetworkSettings::default().n_people,
            n_restarts: 0,
        }
    }
}

/// The step that identifies people, using only what each view found.
#[derive(Debug)]
pub struct WhoStep {
    tracker: Tracker,
    follow: Follow,
    n_people: usize,
    /// Id of the followed person; 0 before the first person.
    followed: u64,
}

impl WhoStep {
    /// Prepares the step.
    ///
    /// * `cameras`: the cameras of the views, in the rig's order.
    pub fn new(cameras: Vec<Camera>, settings: WhoSettings) -> Self {
        let memory = Memory {
            last_id: settings.n_restarts * IDS_OF_A_PROCESS,
            ..Memory::default()
        };
        Self::remembering(cameras, settings, &memory, 0)
    }

    /// Prepares the step so that it continues where an earlier step stopped, with the same people and ids; `None` if the numbers do not
    /// come from [`memory`](Self::memory).
    pub fn resume(cameras: Vec<Camera>, settings: WhoSettings, memory: &[f64]) -> Option<Self> {
        let (followed, memory) = memory.split_first()?;
        let memory = Memory::from_numbers(memory)?;
        let is_known = |person: &&Remembered| person.id as f64 == *followed;
        let followed = memory.people.iter().find(is_known);
        let followed = followed.map_or(0, |person| person.id);
        Some(Self::remembering(cameras, settings, &memory, followed))
    }

    /// Returns the state that another step needs to continue from here, as plain numbers.
    pub fn memory(&self) -> Vec<f64> {
        let mut numbers = self.tracker.memory().to_numbers();
        numbers.insert(0, self.followed as f64);
        numbers
    }

    fn remembering(
        cameras: Vec<Camera>,
        settings: WhoSettings,
        memory: &Memory,
        followed: u64,
    ) -> Self {
        let of_tracker = Settings {
            max: settings.n_people,
            as_seen: settings.as_seen,
            least_heat: settings.least_heat,
            ..Settings::default()
        };
        Self {
            tracker: Tracker::resume(cameras, of_tracker, memory),
            follow: settings.follow,
            n_people: settings.n_people,
            followed,
        }
    }

    /// Returns the people of the next frame, at most [`WhoSettings::n_people`]: somebody who was hidden may return after another person took
    /// the last place. The followed person and the lowest ids come first.
    ///
    /// * `time_s`: time at which the frame was taken, in seconds; not earlier than the time of the last frame.
    /// * `answers`: the sightings of each view.
    pub fn run(&mut self, time_s: f64, answers: &[Option<ViewSightings>]) -> FramePeople {
        let views: Vec<View> = answers.iter().map(|seen| view(seen.as_ref())).collect();
        let mut found = self.tracker.step(time_s, &views);
        let is_seen = |person: &Person| {
            person.state != State::Lost && person.detections.iter().flatten().count() >= 2
        };
        let n_seen = found.iter().filter(|person| is_seen(person)).count();
        self.choose(&found, answers);
        let followed = self.followed;
        found.retain(|person| is_seen(person) || (person.id == followed && n_seen > 0));
        // Sort by id, but put the followed person first.
        found.sort_by_key(|person| (person.id != followed, person.id));
        found.truncate(self.n_people);
        let known = |person: Person| KnownPerson {
            candidates: if is_seen(&person) {
                person.detections
            } else {
                vec![None; answers.len()]
            },
            id: person.id,
        };
        FramePeople {
            people: found.into_iter().map(known).collect(),
            n_seen,
        }
    }

    /// Chooses the person who is followed.
    fn choose(&mut self, found: &[Person], answers: &[Option<ViewSightings>]) {
        let is_known = found.iter().any(|person| person.id == self.followed);
        if self.follow == Follow::Last && is_known {
            return;
        }
        let size = |person: &Person| -> f64 {
            let seen = answers.iter().zip(&person.detections);
            let seen = seen.filter_map(|(seen, index)| seen.as_ref()?.people.get((*index)?));
            match self.follow {
                Follow::Largest => seen.map(longer_px).sum(),
                Follow::Last | Follow::Clearest => {
                    let heats = seen.flat_map(|sighting| sighting.heats);
                    heats.map(f64::from).sum()
                }
            }
        };
        let sizes = found.iter().map(|person| (size(person), person.id));
        // Among equal sizes, take the first.
        let largest = sizes.rev().max_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((_, id)) = largest.filter(|(size, _)| *size > 0.0) {
            self.followed = id;
        }
    }
}

/// Returns the longer side of the box around a person, in pixels.
fn longer_px(sighting: &Sighting) -> f64 {
    let [left, top, right, bottom] = sighting.outline().unwrap_or_default();
    (right - left).max(bottom - top)
}

/// Converts the sightings of a view to detections with their standard deviations.
pub(crate) fn view(seen: Option<&ViewSightings>) -> View {
    let detection = |sighting: &Sighting| {
        let window_px = WINDOW * longer_px(sighting);
        let moved_px = SPEED * longer_px(sighting) * f64::from(sighting.age_s);
        let joint = |joint: usize| {
            let heat = f64::from(sighting.heats[joint]);
            Some(Keypoint {
                at_px: sighting.joint(joint)?,
                sd_px: (expected_error(heat) * window_px).max(1.0).hypot(moved_px),
                heat,
            })
        };
        Detection {
            joints: core::array::from_fn(joint),
            colour: sighting.colour.map(|colour| colour.map(f64::from)),
        }
    };
    let people = seen.iter().flat_map(|seen| &seen.people);
    View {
        detections: people.map(detection).collect(),
        loose: Vec::new(),
    }
}

#[cfg(test)]
mod tests;
