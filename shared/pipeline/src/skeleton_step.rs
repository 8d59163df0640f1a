//! The skeleton step: combines the pairs' poses into one pose per view, decides left and right, and
//! triangulates the joints.

use std::borrow::Cow;
use std::sync::Arc;

use fmp::Pose;
use geometry::{Camera, TriangulateError, Triangulated};
use multiview::{
    ConsensusWorkspace, Exchanges, FacingFilter, FacingHypothesis, Sides, SidesFilter, Sightings,
    ViewPlan, anatomical, is_exchanged,
};
use nalgebra::UnitVector3;
use skeleton::{JointSet, PARSE14};

use crate::bodies::{Bodies, Body, NoJoint};
use crate::fused::Fused;
use crate::fused_view::{Candidate, Candidates, FusedView, fuse};
use crate::motion::Motion;
use crate::people::{bodies_of_poses, find};
use crate::skeleton_settings::{Combine, SkeletonSettings};
use crate::space::{Seen, Space};
use crate::{AllViewsResult, PairResult, ViewResult};

/// The poses from which a skeleton was triangulated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Kept {
    /// The poses solved by fusion.
    #[default]
    Solved,
    /// The candidates from which fusion started; they are used if they agree better with each other.
    Start,
}

/// The result of a frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Skeleton {
    /// The joints of the joint set, each with its position or the reason why it has none.
    pub joints: Vec<Result<Triangulated, NoJoint>>,
    /// Assessment of how plausible the joints are as a human body; `None` if it was not requested, or if nothing was found.
    pub body: Option<Body>,
    /// The views of the rig; `None` for a view without a result.
    pub views: Vec<Option<FusedView>>,
    /// Number of people found in the views.
    pub n_people: usize,
    /// Number of pairs that were averaged.
    pub n_pairs: usize,
    /// Margin of the decision about which views see the person from the same side: energy of the chosen assumption minus
    /// that of the next best one.
    pub facing_margin: f64,
    /// Decision whether to swap left and right in all views; `None` if it was not made.
    pub sides: Option<Sides>,
    /// The poses from which the joints were triangulated.
    pub kept: Kept,
}

/// Inputs of a skeleton.
#[derive(Clone, Copy)]
struct Frame<'a> {
    answers: &'a [Option<ViewResult>],
    fused: &'a Fused<'a>,
    /// True if no other person was found in the views.
    is_alone: bool,
}

/// The skeleton step for a rig; remembers which views saw the person from behind in the previous frame.
#[derive(Debug)]
pub struct SkeletonStep {
    space: Space,
    bodies: Bodies,
    filter: FacingFilter,
    sides: SidesFilter,
    motion: Motion,
}

impl SkeletonStep {
    /// Prepares the step for the views of a rig, in the rig's order.
    pub fn new(
        plans: Vec<Arc<ViewPlan>>,
        up_in_world: Option<UnitVector3<f64>>,
        settings: SkeletonSettings,
    ) -> Self {
        Self {
            space: Space {
                plans,
                up_in_world,
                settings,
            },
            bodies: Bodies::default(),
            filter: FacingFilter::default(),
            sides: SidesFilter::default(),
            motion: Motion::default(),
        }
    }

    /// Begins a frame whose pictures may not have been taken at its instant ([`ViewResult::skew_s`]). The points of the views are then
    /// moved to the instant. Without this call, or if all pictures were taken at the instant, nothing is moved.
    ///
    /// * `instant_s`: instant of the frame, in seconds; `None` if the frame rate is unknown.
    pub fn begin(&mut self, instant_s: Option<f64>) {
        self.motion.begin(instant_s);
    }

    /// Computes the skeleton of one frame from pairs.
    ///
    /// * `answers`: the single-view results; a view without a pair keeps its own pose.
    /// * `pairs`: in any order; their number and views may differ from frame to frame.
    pub fn run(&mut self, answers: &[Option<ViewResult>], pairs: &[PairResult]) -> Skeleton {
        let mut pairs: Vec<&PairResult> = pairs.iter().collect();
        pairs.sort_by_key(|pair| pair.views);
        self.settle(answers, &Fused::Pairs(pairs))
    }

    /// Computes the skeleton of one frame whose views were solved all at once.
    ///
    /// * `answers`: the single-view results; a view that was not solved keeps its own pose.
    pub fn run_all_views(
        &mut self,
        answers: &[Option<ViewResult>],
        fused: &AllViewsResult,
    ) -> Skeleton {
        self.settle(answers, &Fused::AllViews(fused))
    }

    fn settle(&mut self, answers: &[Option<ViewResult>], fused: &Fused<'_>) -> Skeleton {
        let plans = &self.space.plans;
        let cameras: Vec<&Camera> = plans.iter().map(|plan| plan.camera()).collect();
        let bodies = plans.iter().zip(answers);
        let bodies = bodies.map(|(plan, answer)| bodies_of_poses(plan, answer.as_ref()));
        let n_people = find(&cameras, bodies.collect()).people.len();
        let frame = Frame {
            answers,
            fused,
            is_alone: n_people < 2,
        };
        let (exchanged, facing_margin, sides) =
            if self.space.settings.facing && self.space.can_exchange() {
                let (exchanged, margin, sides) = self.decide_facing(&frame);
                (exchanged, margin, Some(sides))
            } else {
                (0, f64::INFINITY, None)
            };
        let candidates = self.candidates(&frame, exchanged);
        let solved = match self.space.settings.combine {
            Combine::Mean => fuse(&candidates, exchanged),
            Combine::Consensus => {
                self.agreed(&candidates, exchanged, &mut ConsensusWorkspace::default())
            }
        };
        let (views, kept) = self.better(solved, self.starts(&frame, exchanged));
        let n_joints = self.space.settings.joints.joints.len();
        let (at_instant, more_px) = self.at_instant(answers, &views);
        let mut expected_px = self.expected_errors(answers, exchanged, self.space.settings.joints);
        add(&mut expected_px, &more_px, self.space.settings.joints);
        // The check of the body does not use expected errors.
        let mut of_body_px = Vec::new();
        add(&mut of_body_px, &more_px, &PARSE14);
        let points = |centres: &[[f64; 2]]| match &self.space.settings.joint_map {
            Some(map) => Cow::from(map.from_parts(centres)),
            None => self.space.settings.joints.from_parts(centres).into(),
        };
        let joints = self.space.triangulate(&at_instant, n_joints, points, &expected_px);
        let (joints, body) = self.as_body(joints, &at_instant, &of_body_px);
        Skeleton {
            joints,
            body,
            views,
            n_people,
            n_pairs: fused.n_pairs(),
            facing_margin,
            sides,
            kept,
        }
    }

    /// Returns the poses of the views at the instant of the frame, and the standard deviations to add to the standard deviations of their
    /// parts, in pixels.
    fn at_instant<'a>(
        &mut self,
        answers: &[Option<ViewResult>],
        views: &'a [Option<FusedView>],
    ) -> (Cow<'a, [Option<FusedView>]>, Vec<Vec<f64>>) {
        let sigma_cells = self.space.settings.sigma_cells;
        let moved = self.motion.at_instant(answers, views, sigma_cells);
        moved.map_or_else(
            || (views.into(), Vec::new()),
            |moved| (moved.views.into(), moved.more_px),
        )
    }

    /// Assesses how plausible the joints are as a human body.
    fn as_body(
        &mut self,
        joints: Vec<Result<Triangulated, TriangulateError>>,
        views: &[Option<FusedView>],
        expected_px: &[Vec<f64>],
    ) -> (Vec<Result<Triangulated, NoJoint>>, Option<Body>) {
        let settings = &self.space.settings;
        let set = settings.joints;
        if !self.space.can_exchange() {
            // The parts differ from those of the 14 joints.
            let joints = joints.into_iter().map(|joint| joint.map_err(NoJoint::from));
            return (joints.collect(), None);
        }
        let of_body = if set == &PARSE14 {
            joints.clone()
        } else {
            let points = |centres: &[[f64; 2]]| Cow::from(PARSE14.from_parts(centres));
            self.space.triangulate(views, PARSE14.joints.len(), points, expected_px)
        };
        self.bodies.settle(&settings.body, &of_body, (set, joints))
    }

    /// Returns the weighted expected errors of the joints of every view, in pixels of the frame; empty without a prediction. The expected
    /// error of a joint is the mean over its parts, each capped at the diagonal of the frame.
    fn expected_errors(
        &self,
        answers: &[Option<ViewResult>],
        exchanged: Exchanges,
        joints: &JointSet,
    ) -> Vec<Vec<f64>> {
        let of_view = |(view, answer): (usize, &Option<ViewResult>)| {
            let of_parts = answer.as_ref()?.sigma_px.as_ref()?.iter();
            let [width, height] = self.space.plans[view].camera().intrinsics.size.map(f64::from);
            let weighed = |sigma: &f32| {
                let sigma = f64::from(*sigma).min(width.hypot(height));
                sigma * self.space.settings.error_weight
            };
            // The second coordinate is a dummy because `anatomical` and `from_parts` take points.
            let of_parts: Vec<[f64; 2]> = of_parts.map(|part| [weighed(part), 0.0]).collect();
            let of_parts = anatomical(&of_parts, self.space.mirror(view, exchanged));
            let of_joints = joints.from_parts(&of_parts).into_iter();
            Some(of_joints.map(|[sigma, _]| sigma).collect())
        };
        let views = answers.iter().enumerate();
        views.map(|view| of_view(view).unwrap_or_default()).collect()
    }

    /// Returns the views that see the person from behind, the margin of that decision, and the decision about left and right for all views
    /// together.
    fn decide_facing(&mut self, frame: &Frame<'_>) -> (Exchanges, f64, Sides) {
        let Frame { answers, fused, .. } = *frame;
        let present = answers.iter().enumerate().fold(0, |mask, (view, answer)| {
            mask | Exchanges::from(answer.is_some()) << view
        });
        let mut workspace = ConsensusWorkspace::default();
        let (hypotheses, seen): (Vec<FacingHypothesis>, Vec<Seen>) = fused
            .facing(present)
            .into_iter()
            .map(|(exchanges, energy)| {
                let views = self.agreed(
                    &self.candidates(frame, exchanges),
                    exchanges,
                    &mut workspace,
                );
                let judged = self.space.judge(answers, &views);
                let hypothesis = FacingHypothesis {
                    exchanges,
                    energy: energy + judged.score,
                };
                (hypothesis, judged.seen)
            })
            .unzip();
        let facing = self.filter.decide(&self.space.settings.facing_filter, &hypotheses, present);
        let Seen { front, log_ratio } = seen[facing.hypothesis];
        let sides = self.sides.decide(&self.space.settings.sides, front, log_ratio);
        let exchanges = if sides.exchange {
            !facing.exchanges & present
        } else {
            facing.exchanges
        };
        (exchanges, facing.margin, sides)
    }

    /// Returns the solved poses, unless the poses from which fusion started agree better.
    ///
    /// Both are compared by the geometric term over all views ([`agreement`](Self::agreement)), in cells of
    /// the start.
    fn better(
        &self,
        mut solved: Vec<Option<FusedView>>,
        start: Vec<Option<FusedView>>,
    ) -> (Vec<Option<FusedView>>, Kept) {
        if start.iter().flatten().count() < 2 {
            return (solved, Kept::Solved);
        }
        let agreement = |views: &[Option<FusedView>]| {
            let n_parts = self.space.plans.first().map_or(0, |plan| plan.model().n_parts());
            let parts = self.space.triangulate(views, n_parts, Cow::from, &[]);
            self.space.agreement(views, &parts)
        };
        let cells: Vec<Option<f64>> =
            solved.iter().map(|pose| Some(pose.as_ref()?.cell_px)).collect();
        let set = |views: &mut [Option<FusedView>], cells: &[Option<f64>]| {
            for (view, cell_px) in views.iter_mut().zip(cells) {
                if let (Some(view), Some(cell_px)) = (view, cell_px) {
                    view.cell_px = *cell_px;
                }
            }
        };
        let of_start: Vec<Option<f64>> =
            start.iter().map(|pose| Some(pose.as_ref()?.cell_px)).collect();
        set(&mut solved, &of_start);
        let is_better = agreement(&start) > agreement(&solved);
        set(&mut solved, &cells);
        if is_better {
            (start, Kept::Start)
        } else {
            (solved, Kept::Solved)
        }
    }

    /// Returns the poses from which fusion started; `None` for a view that did not take part in fusion.
    fn starts(&self, frame: &Frame<'_>, exchanged: Exchanges) -> Vec<Option<FusedView>> {
        let Frame { answers, fused, .. } = *frame;
        let of_view = |view: usize| {
            let found = &answers[view].as_ref()?.candidates;
            let pose = found.get(fused.start(view, exchanged)?)?;
            let mirror = self.space.mirror(view, exchanged);
            let start =
                Candidate::of_pose(pose, f64::from(pose.score), &self.space.plans[view], mirror);
            Some(FusedView {
                single_score: f64::from(found.first()?.score),
                ..start.alone(is_exchanged(exchanged, view))
            })
        };
        (0..self.space.plans.len()).map(of_view).collect()
    }

    /// Returns the poses of every view under an assumption about which views see the person from behind: one per pair, or the pose that was
    /// solved with all views.
    ///
    /// A view that did not take part in fusion keeps its own best pose, unless that pose may belong to another person.
    fn candidates(&self, frame: &Frame<'_>, exchanged: Exchanges) -> Vec<Option<Candidates>> {
        let Frame { answers, fused, .. } = *frame;
        let of_view = |view: usize| {
            let best = answers[view].as_ref()?.candidates.first()?;
            let plan = &self.space.plans[view];
            let mirror = self.space.mirror(view, exchanged);
            let candidate =
                |energy: f64, pose: &Pose| Candidate::of_pose(pose, energy, plan, mirror);
            let poses = fused.poses(view, exchanged).into_iter();
            let mut poses: Vec<Candidate> =
                poses.map(|(energy, pose)| candidate(energy, pose)).collect();
            let (n_pairs, single_score) = (poses.len(), f64::from(best.score));
            if poses.is_empty() {
                if !frame.is_alone {
                    return None;
                }
                poses.push(candidate(single_score, best));
            }
            Some(Candidates {
                poses,
                n_pairs,
                single_score,
            })
        };
        (0..self.space.plans.len()).map(of_view).collect()
    }

    /// Computes one pose per view from the consensus of the views.
    fn agreed(
        &self,
        candidates: &[Option<Candidates>],
        exchanged: Exchanges,
        workspace: &mut ConsensusWorkspace,
    ) -> Vec<Option<FusedView>> {
        let mut views = fuse(candidates, exchanged);
        let n_parts = self.space.plans.first().map_or(0, |plan| plan.model().n_parts());
        let mut sightings: Vec<Sightings<'_>> = views
            .iter()
            .zip(&self.space.plans)
            .map(|(view, plan)| self.sightings(view.as_ref(), plan))
            .collect();
        for part in 0..n_parts {
            for (sightings, candidates) in sightings.iter_mut().zip(candidates) {
                let all = candidates.iter().flat_map(|candidate| &candidate.poses);
                sightings.points_px.clear();
                sightings.points_px.extend(all.map(|pose| pose.centres_px[part]));
            }
            let agreed = workspace.agree(&self.space.settings.consensus, &sightings);
            for (view, agreed) in views.iter_mut().zip(agreed) {
                if let (Some(view), Some(agreed)) = (view, agreed) {
                    view.pose.centres_px[part] = agreed;
                }
            }
        }
        views
    }

    /// Returns the camera and uncertainty of a view, without points.
    fn sightings<'a>(&self, view: Option<&FusedView>, plan: &'a ViewPlan) -> Sightings<'a> {
        let cell_px = view.map_or(1.0, |view| view.cell_px);
        Sightings {
            camera: plan.camera(),
            sigma_px: cell_px * self.space.settings.sigma_cells,
            points_px: Vec::new(),
        }
    }
}

/// Adds the deviations of parts to the expected errors of joints, as variances.
///
/// * `more_px`: deviations by view and part, in pixels; empty for a view that was not moved.
fn add(expected_px: &mut Vec<Vec<f64>>, more_px: &[Vec<f64>], joints: &JointSet) {
    if more_px.is_empty() {
        return;
    }
    expected_px.resize(more_px.len().max(expected_px.len()), Vec::new());
    for (expected, more) in expected_px.iter_mut().zip(more_px) {
        // The second coordinate is a dummy because `from_parts` takes points.
        let of_parts: Vec<[f64; 2]> = more.iter().map(|more| [*more, 0.0]).collect();
        if of_parts.is_empty() {
            continue;
        }
        let of_joints = joints.from_parts(&of_parts);
        expected.resize(of_joints.len(), 0.0);
        for (expected, [more, _]) in expected.iter_mut().zip(of_joints) {
            *expected = expected.hypot(more);
        }
    }
}
