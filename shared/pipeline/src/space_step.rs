//! The step in space: where the joints of a person are, over the maps of networks of all views in place.

use std::sync::Arc;

use fmp::{Pose, Responses};
use geometry::Triangulated;
use multiview::{
    FrontEvidence, Sides, SidesFilter, SidesSettings, SolvedPerson, SpaceSettings, SpaceView,
    ViewPlan, anatomical_evidence, front, front_log_ratio_of, solve_person,
};
use nalgebra::{Point2, UnitVector3};
use posenetwork::MapSettings;
use skeleton::{JointSet, PARSE14, SIDES};

use crate::bodies::{Bodies, Body, NoJoint};
use crate::disagreement::{self, FoundByViews};
use crate::fused_view::FusedView;
use crate::motion::Motion;
use crate::network_step::NetworkSettings;
use crate::person_evidence::PersonEvidence;
use crate::placed::{N, PartView, Places, joints_at, of_set, shown_in};
use crate::skeleton_settings::BodySettings;
use crate::skeleton_step::{Kept, Skeleton};
use crate::space::trunk_upward;
use crate::view_result::ViewResult;
use crate::who::FramePeople;

/// Least number of joints that two views see well of a person: half of it is often hidden. Of what was seen in six empty rooms the
/// seventh best joint had a heat of 0.41 in two views at most, of people who stood, sat or ran before three cameras or four 0.58 at least.
const WELL_SEEN: usize = 7;
/// Least number of joints that a view sees of a person in which it has a part.
const SEEN: usize = 3;

/// Settings of the step.
#[derive(Debug, Clone, PartialEq)]
pub struct SpaceStepSettings {
    /// The energy in space, and its solution.
    pub space: SpaceSettings,
    /// How the maps became evidence.
    pub maps: MapSettings,
    /// Heat that half of a person's joints have in two views each, 0 to 1.
    pub least_heat: f64,
    /// Least score of a candidate of a view that has no part in a solution, for which the view counts as one that sees the person
    /// elsewhere.
    pub least_score: f32,
    /// Joints of the result.
    pub joints: &'static JointSet,
    /// Knowledge about bodies.
    pub body: BodySettings,
    /// How left and right of the whole body are decided, where those of the views follow the picture; `None` where the views name the
    /// sides of the body.
    pub sides: Option<SidesSettings>,
}

impl SpaceStepSettings {
    /// The settings for what views find.
    ///
    /// * `least_heat`: mean heat of the joints of a person who is seen in a view, 0 to 1. In space the views have to agree: what is seen
    ///   badly in one is nobody there, and half of the joints need twice as much.
    /// * `as_seen`: left and right follow the picture, so that those of the whole body are to be decided.
    pub fn for_views(least_heat: f64, as_seen: bool) -> Self {
        let maps = MapSettings::default();
        Self {
            space: SpaceSettings {
                as_seen,
                ..SpaceSettings::default()
            },
            maps,
            least_heat: 2.0 * least_heat,
            least_score: maps.score_of_heat(least_heat),
            joints: &PARSE14,
            body: BodySettings::default(),
            sides: as_seen.then(SidesSettings::default),
        }
    }
}

impl Default for SpaceStepSettings {
    fn default() -> Self {
        Self::for_views(NetworkSettings::default().least_heat, false)
    }
}

/// The step in space, for a rig whose views have the maps of networks; keeps sides, bone lengths and motion of the frames before.
#[derive(Debug)]
pub struct SpaceStep {
    plans: Vec<Arc<ViewPlan>>,
    up_in_world: Option<UnitVector3<f64>>,
    settings: SpaceStepSettings,
    bodies: Bodies,
    sides: SidesFilter,
    /// Motion of the candidates in the pictures.
    seen: Motion,
    /// Motion of the solution in the pictures.
    solved: Motion,
}

/// A person in the views of a frame.
struct Shown<'a> {
    view: usize,
    front: FrontEvidence,
    evidence: PersonEvidence<'a>,
}

/// A solution with its sides.
struct Solution<'a> {
    places: Places,
    energy: f64,
    views: Vec<PartView<'a>>,
    sides: Option<Sides>,
}

impl SpaceStep {
    /// Prepares the step.
    ///
    /// * `plans`: the views of the rig, in the rig's order, with a tree of [`posenetwork::springs`].
    pub fn new(
        plans: Vec<Arc<ViewPlan>>,
        up_in_world: Option<UnitVector3<f64>>,
        settings: SpaceStepSettings,
    ) -> Self {
        Self {
            plans,
            up_in_world,
            settings,
            bodies: Bodies::default(),
            sides: SidesFilter::default(),
            seen: Motion::default(),
            solved: Motion::default(),
        }
    }

    /// Begins a frame whose pictures may have been taken at other times than its instant ([`ViewResult::skew_s`]): what the views
    /// show is then moved there. Without it, or with all pictures of the instant, nothing is moved.
    ///
    /// * `instant_s`: of the frame, seconds; `None` where the rate of the frames is not known.
    pub fn begin(&mut self, instant_s: Option<f64>) {
        self.seen.begin(instant_s);
        self.solved.begin(instant_s);
    }

    /// Solves for the first person of a frame.
    ///
    /// * `answers`, `evidence`: by view; a view without either has no part.
    /// * Returns a skeleton without joints if fewer than two views show the person: what networks see in an empty room is nowhere the
    ///   same in two.
    pub fn run(
        &mut self,
        answers: &[Option<ViewResult>],
        evidence: &[Option<Responses<'_>>],
        people: &FramePeople,
    ) -> Skeleton {
        let candidates = people.people.first().map(|person| &person.candidates[..]);
        let shown = self.shown(answers, evidence, candidates.unwrap_or_default());
        let plans = self.plans.clone();
        let solution = self.solve(&plans, &shown);
        let solution = solution.as_ref();
        let joints = match solution {
            Some(it) => joints_at(&it.places, &it.views, &self.settings.maps),
            None => joints_at(&[None; N], &[], &self.settings.maps),
        };
        let of_set = of_set(self.settings.joints, &joints);
        let settings = self.settings.body;
        let settled = self
            .bodies
            .settle(&settings, &joints, (self.settings.joints, of_set));
        let (mut settled, body): (Vec<Result<Triangulated, NoJoint>>, Option<Body>) = settled;
        let takes_part =
            |view: usize| solution.is_some_and(|it| it.views.iter().any(|part| part.view == view));
        let takes_part: Vec<bool> = (0..self.plans.len()).map(takes_part).collect();
        let found_by = FoundByViews {
            plans: &self.plans,
            answers,
            takes_part: &takes_part,
            least_score: self.settings.least_score,
            joints: self.settings.joints,
        };
        disagreement::measure(&found_by, &mut self.solved, &mut settled);
        Skeleton {
            joints: settled,
            body,
            views: self.views(answers, solution),
            n_people: people.n_seen,
            n_pairs: pairs_of(takes_part.iter().filter(|takes_part| **takes_part).count()),
            facing_margin: f64::INFINITY,
            sides: solution.and_then(|it| it.sides),
            kept: Kept::Solved,
        }
    }

    /// The views that show the person by a candidate, at the instant of the frame.
    fn shown<'a>(
        &mut self,
        answers: &[Option<ViewResult>],
        evidence: &[Option<Responses<'a>>],
        candidates: &[Option<usize>],
    ) -> Vec<Shown<'a>> {
        let floor = self.settings.maps.floor();
        let mut shown = Vec::new();
        for (view, candidate) in candidates.iter().enumerate() {
            let (Some(candidate), Some(Some(answer)), Some(Some(responses))) =
                (*candidate, answers.get(view), evidence.get(view))
            else {
                continue;
            };
            let Some(pose) = answer.candidates.get(candidate) else {
                continue;
            };
            if !answer.is_within(responses) {
                continue;
            }
            let mut evidence = PersonEvidence::new(&self.plans[view], responses, pose, floor);
            let found = self.joints(view, pose);
            if let Some(by) = self.seen.since_instant(view, [answer.skew_s; 2], found) {
                evidence.move_to_instant(by);
            }
            shown.push(Shown {
                view,
                front: self.front(view, candidate, answer),
                evidence,
            });
        }
        shown
    }

    /// Solves for the person; `None` if fewer than two views show the person well.
    fn solve<'a>(
        &mut self,
        plans: &'a [Arc<ViewPlan>],
        shown: &'a [Shown<'_>],
    ) -> Option<Solution<'a>> {
        let views = shown.iter().map(|it| SpaceView {
            camera: plans[it.view].camera(),
            evidence: &it.evidence,
            exchanged: [false; 2],
            front: it.front,
        });
        let views: Vec<SpaceView<'a>> = views.collect();
        if views.len() < 2 {
            return None;
        }
        let found = solve_person(&views, &self.settings.space)?;
        let used = found.views.iter().zip(&views).zip(shown);
        let used = used.filter_map(|((exchanged, view), it)| {
            Some(PartView {
                view: it.view,
                shown: SpaceView {
                    exchanged: (*exchanged)?,
                    ..*view
                },
                window_px: it.evidence.window_px,
            })
        });
        let mut used: Vec<PartView<'a>> = used.collect();
        if !self.is_well_seen(&found, &used) {
            return None;
        }
        used.retain(|part| self.shows(&found, part));
        if used.len() < 2 {
            return None;
        }
        Some(self.with_sides(&found, used))
    }

    /// Decides left and right of the whole body where those of the views follow the picture.
    fn with_sides<'a>(
        &mut self,
        found: &SolvedPerson,
        mut views: Vec<PartView<'a>>,
    ) -> Solution<'a> {
        let mut places = found.pose.joints;
        let sides = self.settings.sides.as_ref().map(|settings| {
            let said = views.iter().map(|it| (it.shown.camera, it.shown.front));
            let said: Vec<_> = said.collect();
            let evidence = settings.anatomy_weight * anatomical_evidence(&places, self.up_in_world)
                + settings.front_weight * front_log_ratio_of(&places, &said);
            self.sides.decide(settings, front(&places), evidence)
        });
        if sides.is_some_and(|sides| sides.exchange) {
            for [right, left] in SIDES {
                places.swap(right, left);
            }
            for part in &mut views {
                part.shown.exchanged = part.shown.exchanged.map(|exchanged| !exchanged);
            }
        }
        Solution {
            places,
            energy: found.pose.energy,
            views,
            sides,
        }
    }

    /// Whether enough joints of a solution are seen well by two views.
    fn is_well_seen(&self, found: &SolvedPerson, views: &[PartView<'_>]) -> bool {
        let is_seen = |joint: &usize| {
            let heats = views.iter().map(|view| self.heat_of(*joint, found, view));
            let well = heats.filter(|heat| *heat >= self.settings.least_heat);
            well.count() >= 2
        };
        (0..N).filter(is_seen).count() >= WELL_SEEN
    }

    /// The heat of a joint of a solution in a view, 0 to 1.
    fn heat_of(&self, joint: usize, found: &SolvedPerson, view: &PartView<'_>) -> f64 {
        let at = found.pose.joints[joint];
        at.map_or(0.0, |at| {
            self.settings.maps.heat(view.shown.evidence_at(joint, &at))
        })
    }

    /// Whether a view shows the person of a solution at all. One that looks at something else had nothing to say of it, and its pixels
    /// are not those of the person.
    fn shows(&self, found: &SolvedPerson, view: &PartView<'_>) -> bool {
        let heats = (0..N).map(|joint| self.heat_of(joint, found, view));
        let seen = heats.filter(|heat| *heat >= self.settings.least_heat / 2.0);
        seen.count() >= SEEN
    }

    /// What a view says of the direction in which the person of a candidate faces.
    fn front(&self, view: usize, candidate: usize, answer: &ViewResult) -> FrontEvidence {
        let told = answer.front.get(candidate).map(|told| {
            let centres = self.plans[view].centres(&answer.candidates[candidate]);
            // Who stands on the hands was upright for the network. Of who lies it tells nothing of up and down in the picture.
            let weight = trunk_upward(&centres).powi(2) as f32;
            told.map(|told| weight * told)
        });
        let told = told.filter(|told| told.iter().all(|number| number.is_finite()));
        told.unwrap_or_default()
    }

    /// Where a pose has the joints, by what the view calls them.
    fn joints(&self, view: usize, pose: &Pose) -> Vec<Option<Point2<f64>>> {
        let joints = PARSE14.joints.iter();
        let centre = |part: usize| Point2::from(self.plans[view].centre(pose, part));
        joints.map(|joint| Some(centre(joint.parts[0]))).collect()
    }

    /// Where the views that have a part in a solution show it.
    fn views(
        &self,
        answers: &[Option<ViewResult>],
        solution: Option<&Solution<'_>>,
    ) -> Vec<Option<FusedView>> {
        let mut views = vec![None; self.plans.len()];
        let Some(solution) = solution else {
            return views;
        };
        for part in &solution.views {
            let best = answers[part.view].as_ref();
            let best = best.and_then(|answer| answer.candidates.first());
            let score = best.map_or(0.0, |pose| f64::from(pose.score));
            let exchanged = solution.sides.is_some_and(|sides| sides.exchange);
            views[part.view] = Some(FusedView {
                exchanged,
                ..shown_in(
                    &self.plans[part.view],
                    &solution.places,
                    solution.energy,
                    score,
                )
            });
        }
        views
    }
}

/// Number of pairs of views.
fn pairs_of(n_views: usize) -> usize {
    n_views * n_views.saturating_sub(1) / 2
}
