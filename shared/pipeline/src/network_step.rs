//! The single-view step with a network in place of the filters: pixels in, maps of the joints and candidates out.
//!
//! A network that looks at one person needs a box. While a person is seen well, the box of the next frame is that of the pose,
//! widened; now and then, and where nobody is seen well, boxes are looked for: by a detector, or by the search of the filters.
//! Keypoints that another program found take the same way, without a picture.

use std::sync::Arc;

use fmp::{Bound, Bounds, Layout, Placement, Pose, Region, Responses, Scope, local_scores};
use kernels::Rgb8View;
use keypoints::{Keypoint, Way};
use multiview::FrontEvidence;
use posenetwork::springs::TurnedSprings;
use posenetwork::{
    Detector, JointMaps, LookError, Looker, MapSettings, PoseNetwork, Turn, outline_of_parts,
    outline_of_pose,
};

use skeleton::PARSE14;

use crate::network_memory::{NetworkMemory, Seen};
use crate::sightings::Sightings;
use crate::space::trunk_upward;
use crate::tracks::{MUCH_WORSE, Track};
use crate::view_result::ExtraKeypoint;
use crate::view_step::{ViewEstimate, ViewStep};

/// What tells where the joints of people are.
#[derive(Debug)]
pub enum Eyes {
    /// A network that looks into boxes, and what finds these.
    Network(Box<PoseNetwork>, Boxes),
    /// Keypoints that another program found: how the joints follow from them (`keypoints::joint_ways` of their names).
    Keypoints(Vec<Vec<Way>>),
}

/// Where boxes around people come from.
#[derive(Debug)]
pub enum Boxes {
    /// A detector of people.
    Detector(Box<Detector>),
    /// The search of the filters over the whole picture.
    Filters(Box<ViewStep>),
    /// Whoever looks by [`NetworkStep::look_by`]; they count as those of the filters. [`NetworkStep::look`] finds none.
    Caller,
}

/// Settings of the step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NetworkSettings {
    /// Most people of a view: each costs a run of the network.
    pub n_people: usize,
    /// Boxes are looked for in every n-th frame, and in every one in which nobody is seen well.
    pub find_every: u64,
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
            n_people: 3,
            find_every: 10,
            find_phase: 0,
            least_heat: 0.2,
            maps: MapSettings::default(),
            keypoint_sigma: 0.02,
        }
    }
}

/// Boxes around people, pixels, the best first; or why there are none.
type Outlines<E> = Result<Vec<[f64; 4]>, E>;

/// Least score of an extra keypoint: below it, its place is a guess (0.3 is what mmpose and `Pose2Sim` use).
const LEAST_SCORE: f64 = 0.3;
/// Most response values of a frame; the cells of the evidence become larger rather than more.
const MOST_VALUES: usize = 1 << 20;

/// Most response values of a frame of a view with a network.
pub fn most_values(layout: &Layout) -> usize {
    layout.n_responses().min(MOST_VALUES)
}

/// The single-view step by a network, for frames of one size.
#[derive(Debug)]
pub struct NetworkStep {
    eyes: Eyes,
    springs: TurnedSprings,
    layout: Arc<Layout>,
    settings: NetworkSettings,
    extras: Vec<Option<usize>>,
}

impl NetworkStep {
    /// Prepares the step.
    ///
    /// * `springs`: of a tree of [`posenetwork::springs`].
    /// * `layout`: of the frames, for that tree.
    pub fn new(
        eyes: Eyes,
        springs: TurnedSprings,
        layout: Arc<Layout>,
        settings: NetworkSettings,
    ) -> Self {
        Self {
            eyes,
            springs,
            layout,
            settings,
            extras: Vec::new(),
        }
    }

    /// The step with keypoints that no joint follows from: they are told of every candidate.
    ///
    /// * `extras`: of every wanted keypoint its number in the order of the card or of the file; `None` where these do not know it.
    #[must_use]
    pub fn with_extras(self, extras: Vec<Option<usize>>) -> Self {
        Self { extras, ..self }
    }

    /// The pyramid of the evidence.
    pub fn layout(&self) -> &Arc<Layout> {
        &self.layout
    }

    /// Looks at a frame; returns what of it the responses will cover, or `None` if nobody is seen well.
    ///
    /// Where boxes are looked for, those of a detector come before those of the frame before, so that no box shrinks or wanders off
    /// unnoticed. Those of the filters fit less well and come after: every person of the frame before is then looked at in a wider box as
    /// well, and the better sight kept. So is one whose pose was much worse than usual. Up to twice as many people as are kept are
    /// looked at, and the largest kept.
    ///
    /// # Errors
    ///
    /// [`LookError`] if the network or the detector fails, or gives numbers that are not finite.
    pub fn look(
        &self,
        image: Rgb8View<'_>,
        memory: &mut NetworkMemory,
    ) -> Result<Option<Scope>, LookError> {
        let Eyes::Network(_, boxes) = &self.eyes else {
            memory.n_seen = 0;
            return Ok(None);
        };
        self.look_by(image, &mut |values| find(boxes, image, values), memory)
    }

    /// As [`Self::look`], with boxes that somebody else finds.
    ///
    /// * `find`: boxes around the people of the frame, the best first; asked when they are looked for. Its argument is memory.
    ///
    /// # Errors
    ///
    /// As for [`Self::look`], and those of `find`.
    pub fn look_by<E: From<LookError>>(
        &self,
        image: Rgb8View<'_>,
        find: &mut dyn FnMut(&mut Vec<f32>) -> Outlines<E>,
        memory: &mut NetworkMemory,
    ) -> Result<Option<Scope>, E> {
        let Eyes::Network(network, boxes) = &self.eyes else {
            memory.n_seen = 0;
            return Ok(None);
        };
        let first = self.settings.find_every - self.settings.find_phase % self.settings.find_every;
        let next = memory.until.map_or(first, |_| self.settings.find_every);
        let (rests, is_due) = (memory.rests(), memory.is_due());
        memory.has_searched = is_due;
        memory.n_seen = 0;
        let mut tracks = core::mem::take(&mut memory.tracks);
        let mut before = core::mem::take(&mut memory.before);
        core::mem::swap(&mut memory.seen, &mut before);
        let sightings = Sightings {
            looker: Looker {
                network,
                springs: &self.springs,
                layout: &self.layout,
                settings: &self.settings.maps,
            },
            image,
            n_most: 2 * self.settings.n_people,
            least_heat: self.settings.least_heat,
            most_lost: self.most_lost(),
        };
        if is_due {
            memory.found = find(&mut memory.values)?;
            memory.n_looked_into = 0;
        }
        if is_due && matches!(boxes, Boxes::Detector(_)) {
            let found = core::mem::take(&mut memory.found);
            sightings.see_all(&found, usize::MAX, memory)?;
            for track in &tracks {
                sightings.see_again(track, before.get(track.index), memory)?;
            }
        } else {
            // Frames that are farther apart show people elsewhere: nothing can wait for the next.
            let mut n_more = if memory.is_soon { 1 } else { usize::MAX };
            for (nth, track) in tracks.iter_mut().enumerate() {
                track.is_to_widen |= is_due;
                sightings.see_once_more((nth, track), &mut n_more, &mut before, memory)?;
            }
            sightings.see_found(n_more, memory)?;
            if memory.n_seen == 0 && !is_due && !rests {
                memory.has_searched = true;
                memory.found = find(&mut memory.values)?;
                memory.n_looked_into = 0;
                sightings.see_found(n_more, memory)?;
            }
        }
        memory.before = before;
        let until = if memory.has_searched {
            Some(next)
        } else {
            memory.until
        };
        memory.until = until.map(|it| it.saturating_sub(1));
        memory.keep_largest(self.settings.n_people);
        // The memory of the list is kept.
        memory.tracks = tracks;
        memory.tracks.clear();
        Ok(self.scope(memory))
    }

    /// Takes the people of a frame whose keypoints another program found; returns what of the frame the responses will cover, or
    /// `None` if nobody is seen well.
    ///
    /// * `people`: keypoints of every person, pixels of the frame.
    pub fn take<P: AsRef<[Option<Keypoint>]>>(
        &self,
        people: impl Iterator<Item = P>,
        memory: &mut NetworkMemory,
    ) -> Option<Scope> {
        memory.tracks.clear();
        memory.n_seen = 0;
        let Eyes::Keypoints(rows) = &self.eyes else {
            return None;
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
            let is_there = seen
                .maps
                .of_keypoints(keypoints.as_ref(), rows, maps, *keypoint_sigma);
            if is_there && seen.judge(&self.layout, self.settings.least_heat) {
                memory.n_seen += 1;
            }
        }
        self.scope(memory)
    }

    /// By how much the score of a pose may be lower than those of its person usually are.
    fn most_lost(&self) -> f32 {
        -MUCH_WORSE * self.settings.maps.floor()
    }

    /// What the responses of the people of a frame cover: one level, fine enough for the smallest of them if there is room.
    fn scope(&self, memory: &NetworkMemory) -> Option<Scope> {
        let join = |a: Region, b: Region| {
            let side = |a: [u32; 2], b: [u32; 2]| [a[0].min(b[0]), a[1].max(b[1])];
            Region {
                x: side(a.x, b.x),
                y: side(a.y, b.y),
            }
        };
        let people = memory.people().iter();
        let region = people
            .filter_map(|it| it.maps.region(&self.layout))
            .reduce(join)?;
        let finest = memory.people().iter().map(|it| it.level).min()?;
        let mut levels = finest..self.layout.levels.len() as u16;
        levels.find_map(|level| {
            let scope = Scope::new(&self.layout, level..level + 1, region).ok()?;
            (self.layout.n_values(&scope) <= MOST_VALUES).then_some(scope)
        })
    }

    /// Fills the responses of a frame that was looked at, and solves the tree of every person.
    ///
    /// * `scope`: what [`Self::look`] returned; `responses`: as many values as it has.
    ///
    /// # Panics
    ///
    /// If there are fewer values.
    pub fn fill(
        &self,
        scope: Scope,
        responses: &mut [f32],
        memory: &mut NetworkMemory,
    ) -> ViewEstimate {
        let level = scope.levels().start;
        let n_seen = memory.n_seen;
        let mut found: Vec<(Pose, usize)> = Vec::with_capacity(n_seen);
        for (nth, seen) in memory.seen[..n_seen].iter_mut().enumerate() {
            if nth == 0 {
                seen.maps.fill(&self.layout, &scope, responses);
            } else {
                seen.maps.raise(&self.layout, &scope, responses);
            }
            // Who was not looked at has a pose and a track already.
            if seen.next.is_none() {
                let is_alone = n_seen == 1 && seen.level == level;
                self.solve(seen, is_alone.then_some((&*responses, scope)));
            }
            memory.tracks.extend(seen.next.map(|track| Track {
                index: nth,
                ..track
            }));
            if let Some(pose) = &seen.pose {
                found.push((self.at_level(pose.clone(), &scope), nth));
            }
        }
        found.sort_by(|a, b| b.0.score.total_cmp(&a.0.score));
        let extras = found
            .iter()
            .flat_map(|(_, nth)| self.extras_of(&memory.seen[*nth].maps));
        let extras: Vec<ExtraKeypoint> = extras.collect();
        // Of every candidate, or of none.
        let fronts = found
            .iter()
            .map(|(pose, nth)| self.front_of(pose, &memory.seen[*nth]));
        let front: Option<Vec<FrontEvidence>> = fronts.collect();
        let candidates: Vec<Pose> = found.into_iter().map(|it| it.0).collect();
        let levels = [level];
        let evidence = Responses::within(&self.layout, responses, &levels, scope);
        let best = candidates.first();
        let local = best.map(|pose| local_scores(self.springs.model(), &evidence, pose));
        let heats = candidates.iter().map(|pose| self.heats(pose, &evidence));
        ViewEstimate {
            local: local.unwrap_or_default(),
            heats: heats.collect(),
            candidates,
            front: front.unwrap_or_default(),
            extras,
            levels: vec![level],
            bounds: Bounds::new(vec![Bound::UNKNOWN; self.layout.levels.len()]),
            scope,
        }
    }

    /// Solves the tree of a person who was looked at, and says where the person is looked for next.
    ///
    /// * `alone`: responses of nobody else, of the person's own level.
    fn solve(&self, seen: &mut Seen, alone: Option<(&[f32], Scope)>) {
        let solver = self.springs.of(seen.turn);
        seen.pose = match alone {
            Some((responses, scope)) => {
                let levels: Vec<u16> = scope.levels().collect();
                let evidence = Responses::within(&self.layout, responses, &levels, scope);
                solver.best(&evidence, None)
            }
            None => seen.maps.pose(solver, &self.layout, &mut seen.responses),
        };
        let tree = (&**self.springs.model(), &*self.layout);
        let pose = seen.pose.as_ref();
        let around = pose.and_then(|pose| Some((outline_of_pose(pose, tree)?, pose.score)));
        let before = ((seen.outline, seen.turn), seen.usual_score);
        seen.next = around.map(|around| Track {
            is_to_widen: seen.is_to_widen,
            speed: seen.speed,
            ..Track::next(before, around, self.most_lost())
        });
    }

    /// How sure the network is of every joint of a pose, 0 to 1.
    fn heats(&self, pose: &Pose, evidence: &Responses<'_>) -> Vec<f32> {
        let level = usize::from(pose.level);
        let window = evidence.window(level);
        let heat = |(joint, it): (usize, &skeleton::Joint)| {
            let at = pose.parts[it.parts[0]];
            let row = usize::from(at.y).checked_sub(window.top)?;
            let column = usize::from(at.x).checked_sub(window.left)?;
            let value = evidence.map(level, joint).get(row * window.cols + column)?;
            Some(self.settings.maps.heat(*value) as f32)
        };
        let joints = PARSE14.joints.iter().enumerate();
        joints.map(|it| heat(it).unwrap_or(0.0)).collect()
    }

    /// In which direction a person faces; nothing of one who is seen head down in a picture that was not turned.
    fn front_of(&self, pose: &Pose, seen: &Seen) -> Option<FrontEvidence> {
        let front = seen.front?;
        let centre = |part| pose.centre(self.springs.model(), &self.layout, part);
        let centres: Vec<[f64; 2]> = (0..pose.parts.len()).map(centre).collect();
        let is_told = seen.turn != Turn::Up || trunk_upward(&centres) > 0.0;
        Some(if is_told {
            front
        } else {
            FrontEvidence::default()
        })
    }

    /// The extra keypoints of a person.
    fn extras_of(&self, maps: &JointMaps) -> impl Iterator<Item = ExtraKeypoint> {
        let each = self.extras.iter();
        each.map(|it| {
            let (found, sigma_px) = it.and_then(|it| maps.keypoint(it))?;
            let is_seen = found.score >= LEAST_SCORE;
            is_seen.then_some((found.at, sigma_px))
        })
    }

    /// The same pose on the level of a scope.
    fn at_level(&self, pose: Pose, scope: &Scope) -> Pose {
        let level = scope.levels().start;
        if pose.level == level {
            return pose;
        }
        let window = self.layout.window(scope, usize::from(level));
        let mut moved = pose.clone();
        moved.level = level;
        for (part, at) in moved.parts.iter_mut().enumerate() {
            let centre = pose.centre(self.springs.model(), &self.layout, part);
            let cell = cell_at(&self.layout, level, centre);
            let within = |it: f64, first: usize, n: usize| {
                it.round().clamp(first as f64, (first + n - 1) as f64) as u16
            };
            *at = Placement {
                x: within(cell[0], window.left, window.cols),
                y: within(cell[1], window.top, window.rows),
                mixture: at.mixture,
            };
        }
        moved
    }
}

/// Boxes around people, pixels, the best first.
fn find(
    boxes: &Boxes,
    image: Rgb8View<'_>,
    values: &mut Vec<f32>,
) -> Result<Vec<[f64; 4]>, LookError> {
    match boxes {
        Boxes::Detector(detector) => {
            let mut found = detector.people(image, values)?;
            // Who is sure and large first: the frame has room for a few.
            let weight = |it: &keypoints::PersonBox| it.score * (it.outline[3] - it.outline[1]);
            found.sort_by(|a, b| weight(b).total_cmp(&weight(a)));
            Ok(found.into_iter().map(|it| it.outline).collect())
        }
        Boxes::Filters(step) => {
            let whole = Scope::whole(step.layout());
            values.resize(values.len().max(step.layout().n_values(&whole)), 0.0);
            let found = step.run(image, whole, values);
            let outline = |it: &Pose| outline_of_parts(step.bounding_box(it));
            Ok(found.candidates.iter().map(outline).collect())
        }
        Boxes::Caller => Ok(Vec::new()),
    }
}

/// The cell of a level at a point of the frame, of filters of one cell; with fractions.
pub(crate) fn cell_at(layout: &Layout, level: u16, at: [f64; 2]) -> [f64; 2] {
    let level = usize::from(level);
    let first = Placement {
        x: 0,
        y: 0,
        mixture: 0,
    };
    let origin = layout.centre(level, [1, 1], first);
    let scale = layout.levels[level].scale;
    [0, 1].map(|axis| (at[axis] - origin[axis]) / scale)
}
