//! The fusion step over the maps of networks: one person in space, over the evidence of all views in place.

use std::sync::Arc;

use fmp::{Placement, Pose, Responses, Window};
use multiview::{
    AllViewsEstimate, FrontEvidence, JointEvidence, SeenPerson, SolvedPerson, SpaceSettings,
    SpaceView, ViewPlan, same_person, solve_person,
};
use nalgebra::{Point2, Point3, Vector2};
use posenetwork::springs::joint_of;
use posenetwork::{MapSettings, expected_error, interpolate};
use skeleton::{N_PARTS, PARENT, PARSE14};

use crate::following::Others;
use crate::fuse_step::{AllViewsHypothesis, AllViewsResult};
use crate::motion::Motion;
use crate::network_step::cell_at;
use crate::space::upright;
use crate::view_result::ViewResult;

/// Number of joints.
const N: usize = PARSE14.joints.len();
/// Most places of a joint that a view offers.
const N_MAXIMA: usize = 3;
/// How far beyond the parts of a candidate its person is looked for, share of the longer side of the rectangle around them.
const BEYOND: f64 = 0.3;
/// The window of a network about a person, as a multiple of the longer side of the rectangle around the parts.
const WINDOW: f64 = 1.375;

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
    between: Between,
}

/// The responses of a view near one person, as evidence for joints.
struct PersonEvidence<'a> {
    /// The responses of the level, joint by joint.
    maps: &'a [f32],
    window: Window,
    /// The pixel at the centre of the window's first cell, and pixels for each cell.
    first_px: [f64; 2],
    cell_px: f64,
    /// The part of the picture where the person may be: left, top, right, bottom, pixels.
    near: [f64; 4],
    floor: f32,
    maxima: Vec<Vec<([f64; 2], f32)>>,
    /// By how much every joint had moved from the instant of the frame when the picture was taken, pixels; empty if that was then.
    since_instant: Vec<Vector2<f64>>,
    /// Height of the window of a network about the person, pixels.
    window_px: f64,
}

impl<'a> PersonEvidence<'a> {
    fn new(plan: &ViewPlan, responses: &Responses<'a>, pose: &Pose, floor: f32) -> Self {
        let mut near = [
            f64::INFINITY,
            f64::INFINITY,
            f64::NEG_INFINITY,
            f64::NEG_INFINITY,
        ];
        for [x, y] in plan.centres(pose) {
            near = [
                near[0].min(x),
                near[1].min(y),
                near[2].max(x),
                near[3].max(y),
            ];
        }
        let longer = (near[2] - near[0]).max(near[3] - near[1]);
        let level = usize::from(pose.level);
        let window = responses.window(level);
        let more = BEYOND * longer;
        let mut evidence = Self {
            maps: responses.maps(level),
            first_px: first_cell(plan, level, &window),
            cell_px: plan.scale(level),
            window,
            near: [
                near[0] - more,
                near[1] - more,
                near[2] + more,
                near[3] + more,
            ],
            floor,
            maxima: Vec::new(),
            since_instant: Vec::new(),
            window_px: WINDOW * longer,
        };
        evidence.maxima = (0..N).map(|joint| evidence.highest(joint)).collect();
        evidence
    }

    /// Moves all that it shows to the instant of the frame.
    ///
    /// * `since_instant`: by joint.
    fn move_to_instant(&mut self, since_instant: Vec<Vector2<f64>>) {
        for (maxima, by) in self.maxima.iter_mut().zip(&since_instant) {
            for (at, _) in maxima {
                *at = [at[0] - by.x, at[1] - by.y];
            }
        }
        self.since_instant = since_instant;
    }

    /// The highest maxima of a joint's map near the person: pixels of the frame, and the evidence there.
    fn highest(&self, joint: usize) -> Vec<([f64; 2], f32)> {
        let window = &self.window;
        let map = self.map(joint);
        let least = self.floor + 1e-3;
        let mut found: Vec<([f64; 2], f32)> = Vec::new();
        for (row, line) in map.chunks_exact(window.cols.max(1)).enumerate() {
            // Most of a map is the floor.
            let above = line.iter().enumerate().filter(|(_, here)| **here > least);
            for (column, here) in above {
                let at = self.pixel(row, column);
                if !self.is_near(at) {
                    continue;
                }
                let mut rows = row.saturating_sub(1)..(row + 2).min(window.rows);
                let is_highest = rows.all(|it| {
                    let first = it * window.cols;
                    let columns = column.saturating_sub(1)..(column + 2).min(window.cols);
                    map[first + columns.start..first + columns.end]
                        .iter()
                        .all(|other| other <= here)
                });
                if is_highest {
                    found.push((at, *here));
                }
            }
        }
        found.sort_by(|a, b| b.1.total_cmp(&a.1));
        found.truncate(N_MAXIMA);
        found
    }

    fn map(&self, joint: usize) -> &'a [f32] {
        let area = self.window.rows * self.window.cols;
        &self.maps[joint * area..(joint + 1) * area]
    }

    /// The centre of a cell of the window, pixels of the frame.
    fn pixel(&self, row: usize, column: usize) -> [f64; 2] {
        let cell = [column as f64, row as f64];
        [0, 1].map(|axis| self.first_px[axis] + cell[axis] * self.cell_px)
    }

    fn is_near(&self, [x, y]: [f64; 2]) -> bool {
        let [left, top, right, bottom] = self.near;
        (left..=right).contains(&x) && (top..=bottom).contains(&y)
    }
}

/// The centre of the first cell of a window, pixels of the frame.
fn first_cell(plan: &ViewPlan, level: usize, window: &Window) -> [f64; 2] {
    let at = Placement {
        x: window.left as u16,
        y: window.top as u16,
        mixture: 0,
    };
    plan.layout().centre(level, [1, 1], at)
}

impl JointEvidence for PersonEvidence<'_> {
    fn at(&self, joint: usize, mut point: [f64; 2]) -> f32 {
        if let Some(by) = self.since_instant.get(joint) {
            point = [point[0] + by.x, point[1] + by.y];
        }
        if !self.is_near(point) {
            return self.floor;
        }
        let cell = [0, 1].map(|axis| (point[axis] - self.first_px[axis]) / self.cell_px);
        let map = self.map(joint);
        interpolate(map, [self.window.cols, self.window.rows], cell).unwrap_or(self.floor)
    }

    fn maxima(&self, joint: usize) -> &[([f64; 2], f32)] {
        &self.maxima[joint]
    }

    fn floor(&self) -> f32 {
        self.floor
    }
}

impl SpaceStep {
    /// Prepares the step.
    ///
    /// * `plans`: the views of the rig, in the rig's order, with a tree of [`posenetwork::springs`].
    /// * `maps`: how the maps became evidence.
    pub fn new(plans: Vec<Arc<ViewPlan>>, settings: SpaceSettings, maps: MapSettings) -> Self {
        Self {
            plans,
            settings,
            maps,
            between: between(),
        }
    }

    /// Solves a frame.
    ///
    /// * `answers`, `evidence`: of the views that have both.
    /// * `others`: candidates that are somebody else ([`Following::others`](crate::Following::others)).
    /// * `motion`: of what the views found, after [`Motion::begin`]; brings pictures to the instant of the frame.
    /// * Returns `None` if fewer than two views show the person.
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
        self.result(&found, &views, &each)
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
            let weight = upright(&centres) as f32;
            Some(answer.front.get(candidate)?.map(|it| weight * it))
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
