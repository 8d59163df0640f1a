//! What of the next image is searched, given what was found in the last ones.

use crate::{Layout, Model, Pose, Region, Scope};

/// How closely the last pose is followed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Track {
    /// Levels either side of the last pose's that are searched.
    pub levels: u16,
    /// How far around the last pose's box is searched, as a share of the box's longer side.
    pub margin: f64,
    /// A frame this many after the last full search is searched in full; 0 and 1: every frame.
    pub full_every: u64,
    /// Largest step from one frame to the next that is followed; 1: no frame may be left out.
    pub max_gap: u64,
    /// How far below the score of the last full search a score may be before there is another.
    pub max_drop: f32,
}

impl Default for Track {
    fn default() -> Self {
        Self {
            levels: 4,
            margin: 0.25,
            full_every: 10,
            max_gap: 2,
            max_drop: 0.3,
        }
    }
}

/// Follows the best pose from frame to frame: decides where the next one is looked for.
///
/// A full search is made of the first frame, and whenever nothing was found, frames were left out,
/// the last full search is long ago, or the score has fallen; see [`Track`]. Between them only what
/// is near the last pose is looked at: a better pose elsewhere is seen at the next full search.
///
/// Knows no clock and no image: the same frames and poses give the same decisions.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Tracker {
    settings: Option<Track>,
    last: Option<Last>,
}

/// What was found in the last frame.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Last {
    frame: u64,
    level: u16,
    score: f32,
    /// Box `[x1, y1, x2, y2]` around all parts, pixels.
    around: [f64; 4],
    full: Full,
}

/// The last full search.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Full {
    frame: u64,
    score: f32,
}

impl Tracker {
    /// Begins; without settings every frame is searched in full.
    pub fn new(settings: Option<Track>) -> Self {
        Self {
            settings,
            last: None,
        }
    }

    /// What is to be searched of a frame.
    ///
    /// * `frame`: number of the frame, counted in frames that are to be answered.
    pub fn scope(&self, layout: &Layout, frame: u64) -> Scope {
        let near = || {
            let (settings, last) = (self.settings.as_ref()?, self.last.as_ref()?);
            last.leads_to(settings, frame)
                .then(|| last.near(settings, layout))?
        };
        near().unwrap_or_else(|| Scope::whole(layout))
    }

    /// Takes note of what was found there.
    ///
    /// * `frame`, `scope`: as asked for and answered by [`Self::scope`].
    /// * `best`: the best pose, if there is one.
    pub fn found(
        &mut self,
        (model, layout): (&Model, &Layout),
        (frame, scope): (u64, &Scope),
        best: Option<&Pose>,
    ) {
        let before = self.last.map(|it| it.full);
        self.last = best.map(|pose| {
            let here = Full {
                frame,
                score: pose.score,
            };
            Last {
                frame,
                level: pose.level,
                score: pose.score,
                around: pose.bounding_box(model, layout),
                full: before
                    .filter(|_| *scope != Scope::whole(layout))
                    .unwrap_or(here),
            }
        });
    }
}

impl Last {
    /// Whether a frame may be looked at near this one's pose only.
    fn leads_to(&self, settings: &Track, frame: u64) -> bool {
        let step = frame.checked_sub(self.frame).filter(|it| *it > 0);
        let age = frame.saturating_sub(self.full.frame);
        step.is_some_and(|it| it <= settings.max_gap)
            && age < settings.full_every
            && self.score >= self.full.score - settings.max_drop
    }

    /// What lies near this frame's pose, if any of it lies in the image.
    fn near(&self, settings: &Track, layout: &Layout) -> Option<Scope> {
        let [x1, y1, x2, y2] = self.around;
        let margin = settings.margin * (x2 - x1).max(y2 - y1);
        let range = |begin: f64, end: f64, side: usize| {
            let inside = |it: f64| it.clamp(0.0, side as f64) as u32;
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
