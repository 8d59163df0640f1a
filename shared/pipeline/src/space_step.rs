//! The fusion step over the maps of networks: one person in space, over the evidence of all views in place.

use std::sync::Arc;

use fmp::{Placement, Pose, Responses};
use multiview::{
    AllViewsEstimate, FrontEvidence, SeenPerson, SolvedPerson, SpaceSettings, SpaceView, ViewPlan,
    same_person, solve_person,
};
use nalgebra::{Point2, Point3};
use posenetwork::springs::joint_of;
use posenetwork::{MapSettings, expected_error};
use skeleton::{N_PARTS, PARENT, PARSE14};

use crate::following::Others;
use crate::fuse_step::{AllViewsHypothesis, AllViewsResult};
use crate::motion::Motion;
use crate::network_step::cell_at;
use crate::person_evidence::PersonEvidence;
use crate::space::trunk_upward;
use crate::view_result::ViewResult;

/// Number of joints.
const N: usize = PARSE14.joints.len();
/// Least number of joints that two views see well of a person: half of it is often hidden. Of what was seen in six empty rooms the
/// seventh best joint had a heat of 0.41 in two views at most, of people who stood, sat or ran before three cameras or four 0.58 at least.
const WELL_SEEN: usize = 7;
/// Least number of joints that a view sees of a person in which it has a part.
const SEEN: usize = 3;
/// The person of a frame in space.
#[derive(Debug, Clone, PartialEq)]
pub struct SpaceResult {
    /// The poses of the views that show the person: where the solution is projected.
    pub views: AllViewsResult,
    /// Expected error of every part, pixels of the frame; of the views of the result, in their order.
    pub sigma_px: Vec<Vec<f32>>,
}

/// The fusion step in space, for a rig whose views have the maps of networks.
#[derive(Debug)]
pub struct SpaceStep {
    plans: Vec<Arc<ViewPlan>>,
    settings: SpaceSettings,
    maps: MapSettings,
    least_heat: f64,
    between: Between,
}

impl SpaceStep {
    /// Prepares the step.
    ///
    /// * `plans`: the views of the rig, in the rig's order, with a tree of [`posenetwork::springs`].
    /// * `maps`: how the maps became evidence.
    /// * `least_heat`: that half of a person's joints have in two views each, 0 to 1.
    pub fn new(
        plans: Vec<Arc<ViewPlan>>,
        settings: SpaceSettings,
        maps: MapSettings,
        least_heat: f64,
    ) -> Self {
        Self {
            plans,
            settings,
            maps,
            least_heat,
            between: between(),
        }
    }

    /// Solves a frame.
    ///
    /// * `answers`, `evidence`: of the views that have both.
    /// * `others`: candidates that are somebody else ([`Following::others`](crate::Following::others)).
    /// * `motion`: of what the views found, after [`Motion::begin`]; brings pictures to the instant of the frame.
    /// * Returns `None` if fewer than two views show the person: what networks see in an empty room is nowhere the same in two.
    pub fn run(
        &self,
        answers: &[Option<ViewResult>],
        evidence: &[Option<Responses<'_>>],
        others: &Others,
        motion: &mut Motion,
    ) -> Option<SpaceResult> {
        let floor = self.maps.floor();
        let chosen = self.candidates(answers, evidence, others);
        let mut views: Vec<(usize, usize, PersonEvidence<'_>)> = Vec::new();
        for (view, candidate) in chosen.into_iter().enumerate() {
            let (Some(candidate), Some(answer), Some(responses)) =
                (candidate, &answers[view], &evidence[view])
            else {
                continue;
            };
            let pose = &answer.candidates[candidate];
            let mut it = PersonEvidence::new(&self.plans[view], responses, pose, floor);
            let found = self.joints(view, pose);
            if let Some(by) = motion.since_instant(view, [answer.skew_s; 2], found) {
                it.move_to_instant(by);
            }
            views.push((view, candidate, it));
        }
        let each: Vec<SpaceView<'_>> = views
            .iter()
            .map(|(view, candidate, evidence)| SpaceView {
                camera: self.plans[*view].camera(),
                evidence,
                exchanged: [false; 2],
                front: self.front(*view, *candidate, answers),
            })
            .collect();
        if each.len() < 2 {
            return None;
        }
        let found = solve_person(&each, &self.settings)?;
        if !self.is_well_seen(&found, &each) {
            return None;
        }
        self.result(&found, &views, &each)
    }

    /// Whether enough joints of a solution are seen well by two views.
    fn is_well_seen(&self, found: &SolvedPerson, each: &[SpaceView<'_>]) -> bool {
        let used = found.views.iter().zip(each).filter_map(|(used, view)| {
            let exchanged = (*used)?;
            Some(SpaceView { exchanged, ..*view })
        });
        let used: Vec<SpaceView<'_>> = used.collect();
        let is_seen = |joint: usize| {
            let heats = used.iter().map(|it| self.heat_of(joint, found, it));
            heats.filter(|it| *it >= self.least_heat).count() >= 2
        };
        (0..N).filter(|it| is_seen(*it)).count() >= WELL_SEEN
    }

    /// The heat of a joint of a solution in a view, 0 to 1.
    fn heat_of(&self, joint: usize, found: &SolvedPerson, view: &SpaceView<'_>) -> f64 {
        let at = found.pose.joints[joint];
        at.map_or(0.0, |at| self.maps.heat(view.evidence_at(joint, &at)))
    }

    /// Whether a view shows the person of a solution at all. One that looks at something else had nothing to say of it, and its pixels
    /// are not those of the person.
    fn shows(&self, found: &SolvedPerson, view: &SpaceView<'_>) -> bool {
        let heats = (0..N).map(|it| self.heat_of(it, found, view));
        heats.filter(|it| *it >= self.least_heat / 2.0).count() >= SEEN
    }

    /// What a view says of the direction in which the person of a candidate faces.
    fn front(
        &self,
        view: usize,
        candidate: usize,
        answers: &[Option<ViewResult>],
    ) -> FrontEvidence {
        let told = answers[view].as_ref().and_then(|answer| {
            let centres = self.plans[view].centres(answer.candidates.get(candidate)?);
            // Who stands on the hands was upright for the network. Of who lies it tells nothing of up and down in the picture.
            let weight = trunk_upward(&centres).powi(2) as f32;
            let told = answer.front.get(candidate)?.map(|it| weight * it);
            told.iter().all(|it| it.is_finite()).then_some(told)
        });
        told.unwrap_or_default()
    }

    /// Where a pose has the joints, by what the view calls them.
    fn joints(&self, view: usize, pose: &Pose) -> Vec<Option<Point2<f64>>> {
        let centre = |joint: usize| self.plans[view].centre(pose, PARSE14.joints[joint].parts[0]);
        (0..N)
            .map(|joint| Some(Point2::from(centre(joint))))
            .collect()
    }

    /// The candidate of every view that is the same person: the one who is followed where the view sees it, else among those who are
    /// nobody else.
    fn candidates(
        &self,
        answers: &[Option<ViewResult>],
        evidence: &[Option<Responses<'_>>],
        others: &Others,
    ) -> Vec<Option<usize>> {
        let mut indices: Vec<Vec<usize>> = vec![Vec::new(); answers.len()];
        let mut people: Vec<Vec<SeenPerson>> = vec![Vec::new(); answers.len()];
        for (view, (answer, evidence)) in answers.iter().zip(evidence).enumerate() {
            let (Some(answer), Some(evidence)) = (answer, evidence) else {
                continue;
            };
            if others.only(view) || !answer.is_within(evidence) {
                continue;
            }
            for (index, pose) in answer.candidates.iter().enumerate() {
                let is_own = others.own(view).is_none_or(|own| own == index);
                if is_own && others.of_view(view) >> index & 1 == 0 {
                    indices[view].push(index);
                    people[view].push(self.seen(view, pose, evidence));
                }
            }
        }
        let views = self.plans.iter().zip(&people);
        let views: Vec<_> = views.map(|(plan, it)| (plan.camera(), &it[..])).collect();
        let chosen = same_person(&views, self.settings.as_seen)
            .into_iter()
            .zip(indices);
        chosen.map(|(it, of)| of.get(it?).copied()).collect()
    }

    /// The person of a candidate.
    fn seen(&self, view: usize, pose: &Pose, evidence: &Responses<'_>) -> SeenPerson {
        let plan = &self.plans[view];
        let level = usize::from(pose.level);
        let window = evidence.window(level);
        let joint = |joint: usize| {
            let part = PARSE14.joints[joint].parts[0];
            let at = pose.parts[part];
            let row = usize::from(at.y).checked_sub(window.top)?;
            let column = usize::from(at.x).checked_sub(window.left)?;
            let value = evidence.map(level, joint).get(row * window.cols + column)?;
            Some((plan.centre(pose, part), self.maps.heat(*value)))
        };
        let [_, height] = plan.layout().image_size;
        SeenPerson {
            joints: (0..N).map(joint).collect(),
            height: plan.size(pose) / height as f64,
        }
    }

    /// The solution as poses of the views.
    fn result(
        &self,
        found: &SolvedPerson,
        views: &[(usize, usize, PersonEvidence<'_>)],
        each: &[SpaceView<'_>],
    ) -> Option<SpaceResult> {
        let mut result = SpaceResult {
            views: AllViewsResult {
                views: Vec::new(),
                hypotheses: Vec::new(),
            },
            sigma_px: Vec::new(),
        };
        let mut hypothesis = AllViewsHypothesis {
            exchanged: Vec::new(),
            candidates: Vec::new(),
            estimate: AllViewsEstimate {
                energy: found.pose.energy,
                iterations: Vec::new(),
                converged: true,
                active: 1.0,
                poses: Vec::new(),
            },
        };
        for ((used, (view, candidate, evidence)), space) in found.views.iter().zip(views).zip(each)
        {
            let Some(exchanged) = used else {
                continue;
            };
            let space = SpaceView {
                exchanged: *exchanged,
                ..*space
            };
            if !self.shows(found, &space) {
                continue;
            }
            let (pose, sigma_px) = self.projected(found, *view, evidence, &space);
            result.views.views.push(*view);
            result.sigma_px.push(sigma_px);
            hypothesis.exchanged.push(false);
            hypothesis.candidates.push(*candidate);
            hypothesis.estimate.poses.push(pose);
        }
        result.views.hypotheses.push(hypothesis);
        (result.views.views.len() >= 2).then_some(result)
    }

    /// Where a view shows the parts, on the finest level, and how far off each may be.
    fn projected(
        &self,
        found: &SolvedPerson,
        view: usize,
        evidence: &PersonEvidence<'_>,
        space: &SpaceView<'_>,
    ) -> (Pose, Vec<f32>) {
        let plan = &self.plans[view];
        let finest = &plan.layout().levels[0];
        let [width, height] = plan.layout().image_size.map(|it| it as f64);
        let far = width.hypot(height);
        let mut parts = Vec::with_capacity(N_PARTS);
        let mut sigma_px = Vec::with_capacity(N_PARTS);
        for (joints, weight) in &self.between {
            let ends = joints.map(|it| found.pose.joints[it]);
            let place = |[a, b]: [Point3<f64>; 2]| a + (b - a) * *weight;
            let seen = match ends {
                [Some(a), Some(b)] => plan.camera().project(&place([a, b])),
                _ => None,
            };
            let at = seen.map_or([width / 2.0, height / 2.0], |it| [it.x, it.y]);
            let cell = cell_at(plan.layout(), 0, at);
            let inside = |axis: usize, n: usize| {
                cell[axis].round() >= 0.0 && cell[axis].round() <= (n - 1) as f64
            };
            let is_there = seen.is_some() && inside(0, finest.cols) && inside(1, finest.rows);
            let held = |axis: usize, n: usize| cell[axis].round().clamp(0.0, (n - 1) as f64) as u16;
            parts.push(Placement {
                x: held(0, finest.cols),
                y: held(1, finest.rows),
                mixture: 0,
            });
            let of_joint = |it: usize| {
                let heat = ends[0]
                    .filter(|_| is_there)
                    .and(found.pose.joints[it])
                    .map_or(0.0, |at| self.maps.heat(space.evidence_at(it, &at)));
                expected_error(heat) * evidence.window_px
            };
            let sigma = (1.0 - weight) * of_joint(joints[0]) + weight * of_joint(joints[1]);
            sigma_px.push(if is_there { sigma.min(far) } else { far } as f32);
        }
        let pose = Pose {
            score: found.pose.energy as f32,
            level: 0,
            parts,
        };
        (pose, sigma_px)
    }
}

/// Between which joints every part lies, and how far along.
type Between = [([usize; 2], f64); N_PARTS];

fn between() -> Between {
    core::array::from_fn(|part| {
        if let Some(joint) = joint_of(part) {
            return ([joint, joint], 0.0);
        }
        // Up to the next joint, and down to the next.
        let (mut up, mut n_up) = (part, 0);
        let above = loop {
            if let Some(joint) = joint_of(up) {
                break joint;
            }
            let Some(parent) = PARENT[up] else { break 0 };
            (up, n_up) = (parent, n_up + 1);
        };
        let (mut down, mut n_down) = (part, 0);
        let below = loop {
            if let Some(joint) = joint_of(down) {
                break joint;
            }
            let child = (0..N_PARTS).find(|it| PARENT[*it] == Some(down));
            let Some(child) = child else { break above };
            (down, n_down) = (child, n_down + 1);
        };
        let n = f64::from(n_up + n_down);
        ([above, below], f64::from(n_up) / n.max(1.0))
    })
}
