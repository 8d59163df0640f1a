//! Chooses the part of the next image to search, based on the last poses.

use crate::{Layout, Model, Pose, Region, Scope};

/// Number and time of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameTime {
    /// Number of the frame among the processed frames.
    pub frame: u64,
    /// Time of the frame in the footage, in seconds; `None` if the frame rate is unknown.
    pub seconds: Option<f64>,
}

impl From<u64> for FrameTime {
    fn from(frame: u64) -> Self {
        Self {
            frame,
            seconds: None,
        }
    }
}

/// Settings of the tracker.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrackSettings {
    /// Number of levels that are searched on each side of the last pose's level.
    pub levels: u16,
    /// Search distance around the last pose's box, as a fraction of the box's longer side.
    pub margin: f64,
    /// Interval between full searches, in frames; 0 and 1 mean a full search in every frame.
    pub full_every: u64,
    /// Maximum difference between frame numbers across which a pose is tracked; 1 means that no frame may be skipped.
    pub max_gap: u64,
    /// Maximum drop of the score below that of the last full search. If the score drops further, the same frame is searched again in full.
    pub max_drop: f32,
    /// Maximum movement of a pose per second, as a fraction of its box's longer side; at low frame rates, the resulting distance exceeds
    /// `margin`.
    pub speed: f64,
    /// Maximum time between frames across which a pose is tracked, in seconds.
    pub max_gap_s: f64,
    /// Interval between full searches, in seconds.
    pub full_every_s: f64,
}

impl Default for TrackSettings {
    fn default() -> Self {
        Self {
            levels: 4,
            margin: 0.25,
            full_every: 10,
            max_gap: 2,
            max_drop: 0.3,
            // 3.4 m per second for a person 1.7 m tall, which is the speed of hands and feet in fast walking.
            speed: 2.0,
            max_gap_s: 0.25,
            full_every_s: 0.5,
        }
    }
}

/// Tracks the best pose from frame to frame and chooses where to search the next frame.
///
/// The first frame is searched in full. A full search is also made in these cases (see [`TrackSettings`]): no pose was found, frames were
/// skipped, frames are too far apart in time, or the last full search is too long ago (in frames, or in seconds if the frame rate is
/// known). Otherwise, only the surroundings of the last pose are searched; a better pose elsewhere is found at the next full search. A
/// frame in which no pose was found, or whose score has dropped, is searched again in full ([`Self::needs_full_search`]).
///
/// The tracker uses no clock and no image: the same frames and poses give the same decisions.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Tracker {
    settings: Option<TrackSettings>,
    last: Option<Last>,
}

/// The result of the last frame.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Last {
    at: FrameTime,
    level: u16,
    /// Box `[x1, y1, x2, y2]` around all parts, in pixels.
    around: [f64; 4],
    full: Full,
}

/// The last full search.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Full {
    at: FrameTime,
    score: f32,
}

impl Tracker {
    /// Creates a tracker; without settings, every frame is searched in full.
    pub fn new(settings: Option<TrackSettings>) -> Self {
        Self {
            settings,
            last: None,
        }
    }

    /// Returns the part of a frame to search.
    ///
    /// * `at`: number and time of the frame.
    pub fn scope(&self, layout: &Layout, at: impl Into<FrameTime>) -> Scope {
        let at = at.into();
        let near = || {
            let (settings, last) = (self.settings.as_ref()?, self.last.as_ref()?);
            last.allows_tracking_to(settings, at).then(|| last.near(settings, layout, at))?
        };
        near().unwrap_or_else(|| Scope::whole(layout))
    }

    /// Returns true if the result near the last pose is unreliable, so that the frame must be searched in full: no pose was
    /// found, or its score has dropped since the last full search.
    ///
    /// * `scope`: as returned by [`Self::scope`].
    /// * `best`: the best pose found in the scope, if there is one.
    pub fn needs_full_search(&self, layout: &Layout, scope: &Scope, best: Option<&Pose>) -> bool {
        let (Some(settings), Some(last)) = (&self.settings, &self.last) else {
            return false;
        };
        let least = last.full.score - settings.max_drop;
        *scope != Scope::whole(layout) && best.is_none_or(|best| best.score < least)
    }

    /// Updates the tracker with the result of a frame.
    ///
    /// * `at`: as passed to [`Self::scope`].
    /// * `scope`: the part that was searched last: as returned by [`Self::scope`], or the whole frame.
    /// * `best`: the best pose, if there is one.
    pub fn update(
        &mut self,
        (model, layout): (&Model, &Layout),
        (at, scope): (impl Into<FrameTime>, &Scope),
        best: Option<&Pose>,
    ) {
        let at = at.into();
        let before = self.last.map(|last| last.full);
        self.last = best.map(|pose| {
            let here = Full {
                at,
                score: pose.score,
            };
            Last {
                at,
                level: pose.level,
                around: pose.bounding_box(model, layout),
                full: before.filter(|_| *scope != Scope::whole(layout)).unwrap_or(here),
            }
        });
    }
}

impl Last {
    /// Returns true if a later frame may be searched only near this frame's pose.
    fn allows_tracking_to(&self, settings: &TrackSettings, at: FrameTime) -> bool {
        let step = at.frame.checked_sub(self.at.frame).filter(|difference| *difference > 0);
        let age = at.frame.saturating_sub(self.full.at.frame);
        let within =
            |from: FrameTime, most: f64| seconds(from, at).is_none_or(|second| second <= most);
        let is_recent = |most: f64| seconds(self.full.at, at).is_none_or(|second| second < most);
        step.is_some_and(|value| value <= settings.max_gap)
            && age < settings.full_every
            && within(self.at, settings.max_gap_s)
            && is_recent(settings.full_every_s)
    }

    /// Returns the surroundings of this frame's pose as a scope, if any part of them is inside the image.
    fn near(&self, settings: &TrackSettings, layout: &Layout, at: FrameTime) -> Option<Scope> {
        let [x1, y1, x2, y2] = self.around;
        let moved = seconds(self.at, at).map_or(0.0, |second| settings.speed * second);
        let margin = settings.margin.max(moved) * (x2 - x1).max(y2 - y1);
        let range = |begin: f64, end: f64, side: usize| {
            let inside = |value: f64| value.clamp(0.0, side as f64) as u32;
            [
                inside((begin - margin).floor()),
                inside((end + margin).ceil() + 1.0),
            ]
        };
        let [width, height] = layout.image_size;
        let region = Region {
            x: range(x1, x2, width),
            y: range(y1, y2, height),
        };
        let first = self.level.saturating_sub(settings.levels);
        let end = self.level.saturating_add(settings.levels).saturating_add(1);
        let end = end.min(layout.levels.len() as u16);
        Scope::new(layout, first..end, region).ok()
    }
}

/// Returns the time between two frames, if both times are known.
fn seconds(from: FrameTime, to: FrameTime) -> Option<f64> {
    Some(to.seconds? - from.seconds?)
}
