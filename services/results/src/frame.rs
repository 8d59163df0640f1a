//! All messages about one frame.

use fmp::Pose;
use messages::{
    FrameHeader, FusedView, PairPose, People, SkeletonMessage, Skeletons, Status, Timing, ViewPose,
    ViewQuality,
};

use pipeline::Sighting;

use crate::{Missing, Scene};

/// The messages of one view about one frame; `None` where none came.
#[derive(Debug, Clone, Default)]
pub struct ViewRecord {
    /// The frame itself, without its pixels.
    pub frame: Option<FrameHeader>,
    /// Its candidates.
    pub pose: Option<ViewPose>,
    /// Its expected errors.
    pub quality: Option<ViewQuality>,
    /// Its pixels, if they are to be drawn on.
    pub picture: Option<Picture>,
    /// Why it has no part in the result, if it has none.
    pub missing: Option<Missing>,
}

/// A frame's pixels, copied for drawing.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Picture {
    /// Width and height, pixels.
    pub size: [usize; 2],
    /// RGB, row major.
    pub rgb: Vec<u8>,
}

/// A frame without a result.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Absent {
    /// Index of the frame in the footage.
    pub frame: u64,
    /// Why there is no result.
    pub reason: String,
    /// Why every view would have had no part in it.
    pub views: Vec<Missing>,
}

/// A message of a fusion process, without what it found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FusedRecord {
    /// Index of the pair; 0 for all views at once in space.
    pub index: usize,
    /// Status of the result: good, or why it is missing.
    pub status: Status,
    /// When it was received and sent.
    pub timing: Timing,
    /// The views whose expected errors were used, each with their age in frames plus 1; 0 without any.
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
    /// The followed person; `None` if there is nobody. Candidates of the views have no names, so their best ones are
    /// compared with this person.
    pub fn followed(&self) -> Option<&SkeletonMessage> {
        self.skeletons.followed()
    }

    /// Returns the pose of the person who is followed in a view; `None` if it has none.
    pub(crate) fn fused(&self, view: usize) -> Option<&FusedView> {
        let fused = self.followed()?.listed_views().get(view)?;
        (fused.status == Status::OK).then_some(fused)
    }

    /// Index of the frame in the footage.
    pub fn frame(&self) -> u64 {
        self.skeletons.stamp.frame
    }

    /// The candidates of a view, best first; none if it had none, or sent what cannot be read.
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
            tracing::warn!(view, frame = self.frame(), %error, "unreadable candidates");
            Vec::new()
        })
    }

    /// The candidate of a view that is the person, as far as the view itself can tell: the best one of the filters; of the people that a
    /// network sees, the one nearest to where fusion put the person; the largest one where fusion left out the view.
    pub(crate) fn own(&self, scene: &Scene, view: usize) -> Option<Own> {
        let candidates = self.candidates(scene, view);
        if !scene.has_maps || candidates.len() < 2 {
            return candidates.into_iter().next();
        }
        let fused = self.fused(view).filter(|fused| fused.n_parts > 0);
        let distance = |own: &Own| -> f64 {
            let known = own.centres_px.iter().copied();
            let Some(fused) = fused else {
                let known = known.filter(|at| at[0].is_finite());
                return -geometry::longer_side(known).unwrap_or(0.0);
            };
            let both = known.zip(&fused.centres_px);
            let each = both.map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1]));
            each.filter(|px| px.is_finite()).sum()
        };
        let distances = candidates.into_iter().map(|own| (distance(&own), own));
        let nearest = distances.min_by(|a, b| a.0.total_cmp(&b.0));
        nearest.map(|(_, own)| own)
    }

    /// How many frames ago the expected errors were predicted that fusion used for a view, at least: the
    /// workers may differ. `None` if no pair of the view used any.
    pub(crate) fn sigma_used(&self, view: usize) -> Option<u16> {
        let ages = self.fused.iter().flat_map(|fused| fused.sigma_ages);
        let ages = ages.filter(|(other, _)| *other == view);
        ages.filter_map(|(_, age)| age.checked_sub(1)).max()
    }

    /// The expected errors of a view's parts, pixels of the frame.
    pub(crate) fn sigma_px(&self, scene: &Scene, view: usize) -> Option<Vec<f32>> {
        let message = self.views.get(view)?.quality.as_ref()?;
        wire::sigma_from_message(message, scene.model.n_parts()).ok().flatten()
    }
}

/// The pose of one person that a view found alone.
#[derive(Debug, Clone)]
pub(crate) struct Own {
    /// The parts of the body, pixels of the frame, by the names of the view; NaN for one that is not seen.
    pub(crate) centres_px: Vec<[f64; 2]>,
    pub(crate) score: f32,
    /// True if the view is sure that it is a person.
    pub(crate) is_clear: bool,
    /// By the paper's method.
    pub(crate) pose: Option<Pose>,
}

impl Own {
    fn seen(person: &Sighting, least_heat: f64) -> Self {
        Self {
            centres_px: pipeline::parts_of(&person.places(false)),
            score: person.score,
            is_clear: person.is_clear(least_heat),
            pose: None,
        }
    }

    fn solved(pose: Pose, scene: &Scene, view: usize) -> Self {
        Self {
            centres_px: pose.centres(&scene.model, &scene.views[view].layout),
            score: pose.score,
            is_clear: true,
            pose: Some(pose),
        }
    }
}
