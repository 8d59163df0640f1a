//! All messages about one frame.

use fmp::Pose;
use messages::{
    FrameHeader, FusedView, PairPose, People, Sightings, SkeletonMessage, Skeletons, Status,
    Timing, ViewQuality,
};

use pipeline::Sighting;

use crate::{Missing, Scene};

/// The messages of one view about one frame; `None` for a message that was not received.
#[derive(Debug, Clone, Default)]
pub struct ViewRecord {
    /// The frame itself, without its pixels.
    pub frame: Option<FrameHeader>,
    /// Candidates of the view.
    pub pose: Option<Sightings>,
    /// Expected errors of the view.
    pub quality: Option<ViewQuality>,
    /// Pixels of the frame, if a picture is to be drawn.
    pub picture: Option<Picture>,
    /// Reason why the view did not contribute to the result, if it did not.
    pub missing: Option<Missing>,
}

/// A frame's pixels, copied for drawing.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Picture {
    /// Width and height, in pixels.
    pub size: [usize; 2],
    /// RGB pixels, row major.
    pub rgb: Vec<u8>,
}

/// A frame without a result.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Absent {
    /// Index of the frame in the footage.
    pub frame: u64,
    /// Reason why there is no result.
    pub reason: String,
    /// For every view, the reason why it could not have contributed to the result.
    pub views: Vec<Missing>,
}

/// A message of a fusion process, without its poses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FusedRecord {
    /// Index of the pair of views; 0 if all views are solved at once in 3D.
    pub index: usize,
    /// Status of the result: good, or why it is missing.
    pub status: Status,
    /// Times at which the message was received and sent.
    pub timing: Timing,
    /// The views whose expected errors were used, each with the age of these errors in frames plus 1; 0 if no errors were used.
    pub sigma_ages: [(usize, u16); 2],
}

impl From<&PairPose> for FusedRecord {
    fn from(message: &PairPose) -> Self {
        let [first, second] = message.views.map(|view| view as usize);
        let [age_first, age_second] = message.sigma_age;
        Self {
            index: message.stamp.view as usize,
            status: message.status,
            timing: message.timing,
            sigma_ages: [(first, age_first), (second, age_second)],
        }
    }
}

impl From<&People> for FusedRecord {
    fn from(message: &People) -> Self {
        Self {
            index: 0,
            status: message.status,
            timing: message.timing,
            sigma_ages: [(0, 0); 2],
        }
    }
}

/// All messages about one frame.
#[derive(Debug, Clone)]
pub struct FrameRecord {
    /// The result.
    pub skeletons: Box<Skeletons>,
    /// The views.
    pub views: Vec<ViewRecord>,
    /// The messages of fusion processes, in order of arrival.
    pub fused: Vec<FusedRecord>,
}

impl FrameRecord {
    /// Returns the followed person; `None` if there is nobody. Candidates of views have no identities, so this person is the one with whom
    /// the best candidate of each view is compared.
    pub fn followed(&self) -> Option<&SkeletonMessage> {
        self.skeletons.followed()
    }

    /// Returns the pose of the followed person in a view, if there is one.
    pub(crate) fn fused(&self, view: usize) -> Option<&FusedView> {
        let fused = self.followed()?.listed_views().get(view)?;
        (fused.status == Status::OK).then_some(fused)
    }

    /// Returns the index of the frame in the footage.
    pub fn frame(&self) -> u64 {
        self.skeletons.stamp.frame
    }

    /// Returns the candidates of a view, best first. The list is empty if the view had none, or sent a message that cannot be read.
    pub(crate) fn candidates(&self, scene: &Scene, view: usize) -> Vec<Own> {
        let Some(message) = self.views.get(view).and_then(|view| view.pose.as_ref()) else {
            return Vec::new();
        };
        let read = if scene.has_maps {
            wire::sightings_from_message(message, message.n_keypoints as usize).map(|seen| {
                let people = seen.into_iter().flat_map(|seen| seen.people);
                people.map(|person| Own::seen(&person, scene.least_heat)).collect()
            })
        } else {
            let layout = &scene.views[view].layout;
            let candidates = wire::candidates_from_message(message, &scene.model, layout);
            candidates.map(|poses| {
                let poses = poses.into_iter();
                poses.map(|pose| Own::solved(pose, scene, view)).collect()
            })
        };
        read.unwrap_or_else(|error| {
            tracing::warn!(view, frame = self.frame(), %error, "the candidates of a view cannot be read");
            Vec::new()
        })
    }

    /// Returns the age in frames of the expected errors that fusion used for a view. It is the lowest age, because workers may differ.
    /// Returns `None` if no pair of the view used any.
    pub(crate) fn sigma_used(&self, view: usize) -> Option<u16> {
        let ages = self.fused.iter().flat_map(|fused| fused.sigma_ages);
        let ages = ages.filter(|(other, _)| *other == view);
        ages.filter_map(|(_, age)| age.checked_sub(1)).max()
    }

    /// Returns the expected errors of a view's parts, in pixels of the frame.
    pub(crate) fn sigma_px(&self, scene: &Scene, view: usize) -> Option<Vec<f32>> {
        let message = self.views.get(view)?.quality.as_ref()?;
        wire::sigma_from_message(message, scene.model.n_parts()).ok().flatten()
    }
}

/// The pose of one person, found from a single view.
#[derive(Debug, Clone)]
pub(crate) struct Own {
    /// The parts of the body in pixels of the frame, with the side names of the view. A part that is not seen is NaN.
    pub(crate) centres_px: Vec<[f64; 2]>,
    pub(crate) score: f32,
    /// True if the view is sure that this is a person.
    pub(crate) is_clear: bool,
    /// True if the person was looked for in this frame; false for a sighting of an earlier frame that was reused to save time.
    pub(crate) is_fresh: bool,
    /// The pose found by the paper's method.
    pub(crate) pose: Option<Pose>,
}

impl Own {
    fn seen(person: &Sighting, least_heat: f64) -> Self {
        Self {
            centres_px: pipeline::parts_of(&person.places(false)),
            score: person.score,
            is_clear: person.is_clear(least_heat),
            is_fresh: person.age_s <= 0.0,
            pose: None,
        }
    }

    fn solved(pose: Pose, scene: &Scene, view: usize) -> Self {
        Self {
            centres_px: pose.centres(&scene.model, &scene.views[view].layout),
            score: pose.score,
            is_clear: true,
            is_fresh: true,
            pose: Some(pose),
        }
    }
}
