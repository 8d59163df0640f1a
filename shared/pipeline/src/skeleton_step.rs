//! The skeleton step: combines the pairs' poses into one pose per view, decides left and right, and
//! triangulates the joints.

use std::sync::Arc;

use fmp::Pose;
use geometry::{Observation, TriangulateError, Triangulated};
use multiview::{
    ConsensusSettings, ConsensusWorkspace, Exchanges, FacingFilter, FacingHypothesis,
    FacingSettings, FusedPose, Sightings, ViewPlan, anatomical, anatomical_evidence, average,
    is_exchanged,
};
use nalgebra::{Point2, Point3, UnitVector3};
use skeleton::{JointMap, JointSet, PARSE14};

use crate::fused::Fused;
use crate::{AllViewsResult, PairResult, ViewResult};

/// How the pose of a view is made from the poses of its pairs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Combine {
    /// Their mean: the paper's section 7.
    #[default]
    Mean,
    /// For every part the result that is consistent over all views ([`multiview::consensus()`]).
    Consensus,
}

/// Settings of the skeleton step.
#[derive(Debug, Clone, PartialEq)]
pub struct SkeletonSettings {
    /// Which joints to triangulate.
    pub joints: &'static JointSet,
    /// Learned map from parts to these joints; without it a joint is the mean of its own parts.
    pub joint_map: Option<Arc<JointMap>>,
    /// How to triangulate.
    pub triangulation: geometry::Settings,
    /// Uncertainty of a joint in one view, cells of the level on which it was fused.
    pub sigma_cells: f64,
    /// Weight of the expected errors of a joint's parts, where they were predicted; they are added
    /// to `sigma_cells` as variances. 0: not used.
    pub error_weight: f64,
    /// How the pose of a view is made from the poses of its pairs.
    pub combine: Combine,
    /// How the views agree on a part. The decision about facing always uses the consensus: a mean
    /// of poses with different limbs is consistent under no assumption about left and right.
    pub consensus: ConsensusSettings,
    /// Decide which views see the person from behind.
    pub facing: bool,
    /// How facing is tracked over time.
    pub facing_filter: FacingSettings,
    /// Weight of the agreement of all views in the decision about facing: score per squared cell of
    /// distance between a part and its reprojection. It is the geometric term over all views.
    pub agreement: f64,
    /// Distance at which the penalty for disagreement is capped, cells.
    pub max_distance_cells: f64,
}

impl Default for SkeletonSettings {
    fn default() -> Self {
        Self {
            joints: &PARSE14,
            joint_map: None,
            triangulation: geometry::Settings::default(),
            sigma_cells: 1.0,
            error_weight: 1.0,
            combine: Combine::default(),
            consensus: ConsensusSettings::default(),
            facing: true,
            facing_filter: FacingSettings::default(),
            agreement: 0.01,
            max_distance_cells: 3.0,
        }
    }
}

/// One view after fusion.
#[derive(Debug, Clone, PartialEq)]
pub struct FusedView {
    /// The pose combined from its pairs; parts are named by the side of the body.
    pub pose: FusedPose,
    /// Whether the view sees the person from behind.
    pub exchanged: bool,
    /// Mean cell size of the levels on which it was fused, pixels of the frame.
    pub cell_px: f64,
    /// Score of the view's own best candidate.
    pub single_score: f64,
}

/// The result of a frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Skeleton {
    /// The joints of the joint set, each with its position or the reason why there is none.
    pub joints: Vec<Result<Triangulated, TriangulateError>>,
    /// The views of the rig; `None` for a view without a result.
    pub views: Vec<Option<FusedView>>,
    /// How many pairs were averaged.
    pub n_pairs: usize,
    /// Energy of the chosen facing assignment minus that of the best other one.
    pub facing_margin: f64,
}

/// The skeleton step for a rig; keeps the facing of the frame before.
#[derive(Debug)]
pub struct SkeletonStep {
    plans: Vec<Arc<ViewPlan>>,
    up_in_world: Option<UnitVector3<f64>>,
    settings: SkeletonSettings,
    filter: FacingFilter,
}

impl SkeletonStep {
    /// Prepares the step for the views of a rig, in the rig's order.
    pub fn new(
        plans: Vec<Arc<ViewPlan>>,
        up_in_world: Option<UnitVector3<f64>>,
        settings: SkeletonSettings,
    ) -> Self {
        Self {
            plans,
            up_in_world,
            settings,
            filter: FacingFilter::default(),
        }
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
        let (exchanged, facing_margin) = if self.settings.facing && self.can_exchange() {
            self.decide_facing(answers, fused)
        } else {
            (0, f64::INFINITY)
        };
        let candidates = self.candidates(answers, fused, exchanged);
        let views = match self.settings.combine {
            Combine::Mean => fuse(&candidates, exchanged),
            Combine::Consensus => self.agreed(&candidates, exchanged),
        };
        let n_joints = self.settings.joints.joints.len();
        let expected_px = self.expected_errors(answers, exchanged);
        let points = |centres: &[[f64; 2]]| match &self.settings.joint_map {
            Some(map) => map.from_parts(centres),
            None => self.settings.joints.from_parts(centres),
        };
        let joints = self.triangulate(&views, n_joints, points, &expected_px);
        Skeleton {
            joints,
            views,
            n_pairs: fused.n_pairs(),
            facing_margin,
        }
    }

    /// The weighted expected errors of the joints of every view, pixels of the frame; empty where
    /// nothing was predicted. The expected error of a joint is the mean over its parts, each capped
    /// at the diagonal of the frame.
    fn expected_errors(
        &self,
        answers: &[Option<ViewResult>],
        exchanged: Exchanges,
    ) -> Vec<Vec<f64>> {
        let of_view = |(view, answer): (usize, &Option<ViewResult>)| {
            let of_parts = answer.as_ref()?.sigma_px.as_ref()?.iter();
            let [width, height] = self.plans[view].camera().intrinsics.size.map(f64::from);
            let weighed = |sigma: &f32| {
                let sigma = f64::from(*sigma).min(width.hypot(height));
                sigma * self.settings.error_weight
            };
            // The second number is only there because `anatomical` and `from_parts` take points.
            let of_parts: Vec<[f64; 2]> = of_parts.map(|it| [weighed(it), 0.0]).collect();
            let of_parts = anatomical(&of_parts, self.mirror(view, exchanged));
            let of_joints = self.settings.joints.from_parts(&of_parts).into_iter();
            Some(of_joints.map(|[sigma, _]| sigma).collect())
        };
        let views = answers.iter().enumerate();
        views
            .map(|view| of_view(view).unwrap_or_default())
            .collect()
    }

    /// The mirror permutation of the parts for a view that sees the person from behind.
    fn mirror(&self, view: usize, exchanged: Exchanges) -> Option<&[usize]> {
        let mirror = self.plans[view].model().spec().mirror.as_deref();
        mirror.filter(|_| is_exchanged(exchanged, view))
    }

    fn can_exchange(&self) -> bool {
        let has_sides = |plan: &Arc<ViewPlan>| {
            let spec = plan.model().spec();
            spec.mirror.is_some() && spec.parts.len() == skeleton::N_PARTS
        };
        self.plans.first().is_some_and(has_sides)
    }

    /// The views that see the person from behind, and the margin of the decision.
    fn decide_facing(
        &mut self,
        answers: &[Option<ViewResult>],
        fused: &Fused<'_>,
    ) -> (Exchanges, f64) {
        let present = answers.iter().enumerate().fold(0, |mask, (view, answer)| {
            mask | Exchanges::from(answer.is_some()) << view
        });
        let hypotheses: Vec<FacingHypothesis> = fused
            .facing(present)
            .into_iter()
            .map(|(exchanges, energy)| {
                let views = self.agreed(&self.candidates(answers, fused, exchanges), exchanges);
                let parts = self.triangulate(&views, skeleton::N_PARTS, <[_]>::to_vec, &[]);
                let joints: Vec<Option<Point3<f64>>> = PARSE14
                    .joints
                    .iter()
                    .map(|joint| {
                        parts[joint.parts[0]]
                            .as_ref()
                            .ok()
                            .map(|point| point.in_world)
                    })
                    .collect();
                FacingHypothesis {
                    exchanges,
                    energy: energy + self.agreement(&views, &parts),
                    anatomy: anatomical_evidence(&joints, self.up_in_world),
                }
            })
            .collect();
        let facing = self
            .filter
            .decide(&self.settings.facing_filter, &hypotheses, present);
        (facing.exchanges, facing.margin)
    }

    /// The geometric term over all views: the squared distance of every part from its reprojection.
    fn agreement(
        &self,
        views: &[Option<FusedView>],
        parts: &[Result<Triangulated, TriangulateError>],
    ) -> f64 {
        let cap = self.settings.max_distance_cells.powi(2);
        let of_view = |residual_px: f64, view: &FusedView| {
            let cells = residual_px / view.cell_px;
            // A view that cannot see the point counts as the largest disagreement.
            if cells.is_nan() {
                cap
            } else {
                (cells * cells).min(cap)
            }
        };
        let of_part = |part: &Result<Triangulated, TriangulateError>| -> f64 {
            let present = views.iter().enumerate();
            let present = present.filter_map(|(view, fused)| Some((view, fused.as_ref()?)));
            match part {
                Ok(point) => present
                    .map(|(view, fused)| of_view(point.residuals_px[view], fused))
                    .sum(),
                Err(_) => present.count() as f64 * cap,
            }
        };
        -self.settings.agreement * parts.iter().map(of_part).sum::<f64>()
    }

    /// The poses of every view, one per pair or that of all views, under a facing assignment.
    fn candidates(
        &self,
        answers: &[Option<ViewResult>],
        fused: &Fused<'_>,
        exchanged: Exchanges,
    ) -> Vec<Option<Candidates>> {
        let of_view = |view: usize| {
            let best = answers[view].as_ref()?.candidates.first()?;
            let plan = &self.plans[view];
            let mirror = self.mirror(view, exchanged);
            let candidate = |energy: f64, pose: &Pose| Candidate {
                energy,
                cell_px: plan.scale(usize::from(pose.level)),
                centres_px: (0..pose.parts.len())
                    .map(|part| plan.centre(pose, mirror.map_or(part, |mirror| mirror[part])))
                    .collect(),
            };
            let poses = fused.poses(view, exchanged).into_iter();
            Some(Candidates {
                of_pairs: poses
                    .map(|(energy, pose)| candidate(energy, pose))
                    .collect(),
                own: candidate(f64::from(best.score), best),
            })
        };
        (0..self.plans.len()).map(of_view).collect()
    }

    /// One pose per view, from the consensus of the views.
    fn agreed(
        &self,
        candidates: &[Option<Candidates>],
        exchanged: Exchanges,
    ) -> Vec<Option<FusedView>> {
        let mut views = fuse(candidates, exchanged);
        let n_parts = self.plans.first().map_or(0, |it| it.model().n_parts());
        let mut sightings: Vec<Sightings<'_>> = views
            .iter()
            .zip(&self.plans)
            .map(|(view, plan)| self.sightings(view.as_ref(), plan))
            .collect();
        let mut workspace = ConsensusWorkspace::default();
        for part in 0..n_parts {
            for (sightings, candidates) in sightings.iter_mut().zip(candidates) {
                let all = candidates.iter().flat_map(Candidates::all);
                sightings.points_px.clear();
                sightings
                    .points_px
                    .extend(all.map(|it| it.centres_px[part]));
            }
            let agreed = workspace.agree(&self.settings.consensus, &sightings);
            for (view, agreed) in views.iter_mut().zip(agreed) {
                if let (Some(view), Some(agreed)) = (view, agreed) {
                    view.pose.centres_px[part] = agreed;
                }
            }
        }
        views
    }

    /// The camera and uncertainty of a view, still without points.
    fn sightings<'a>(&self, view: Option<&FusedView>, plan: &'a ViewPlan) -> Sightings<'a> {
        let cell_px = view.map_or(1.0, |it| it.cell_px);
        Sightings {
            camera: plan.camera(),
            sigma_px: cell_px * self.settings.sigma_cells,
            points_px: Vec::new(),
        }
    }

    /// Triangulates points of the fused poses.
    ///
    /// * `points`: computes the `n_points` wanted points from the part centres of a view.
    /// * `expected_px`: expected errors of these points, for the views that have them.
    fn triangulate(
        &self,
        views: &[Option<FusedView>],
        n_points: usize,
        points: impl Fn(&[[f64; 2]]) -> Vec<[f64; 2]>,
        expected_px: &[Vec<f64>],
    ) -> Vec<Result<Triangulated, TriangulateError>> {
        let present = views.iter().enumerate();
        let present: Vec<(usize, &FusedView, Vec<[f64; 2]>)> = present
            .filter_map(|(view, fused)| {
                let fused = fused.as_ref()?;
                Some((view, fused, points(&fused.pose.centres_px)))
            })
            .collect();
        let expected_px = |view: usize, point: usize| {
            let of_view = expected_px.get(view)?;
            of_view.get(point).copied()
        };
        let mut observations: Vec<Observation<'_>> = Vec::with_capacity(present.len());
        let triangulate = |point: usize| {
            observations.clear();
            let observed = present.iter();
            observations.extend(observed.map(|(view, fused, points)| {
                Observation {
                    camera: self.plans[*view].camera(),
                    point_px: Point2::from(points[point]),
                    sigma_px: (fused.cell_px * self.settings.sigma_cells)
                        .hypot(expected_px(*view, point).unwrap_or(0.0)),
                }
            }));
            let found = geometry::triangulate(&observations, &self.settings.triangulation)?;
            Ok(by_view(found, present.iter().map(|view| view.0)))
        };
        (0..n_points).map(triangulate).collect()
    }
}

/// A pose of one view; parts are named by the side of the body.
#[derive(Debug, Clone)]
struct Candidate {
    energy: f64,
    cell_px: f64,
    centres_px: Vec<[f64; 2]>,
}

/// The poses of one view's pairs, and its own single-view pose.
#[derive(Debug, Clone)]
struct Candidates {
    of_pairs: Vec<Candidate>,
    own: Candidate,
}

impl Candidates {
    /// The pairs' poses, or the view's own if it is in no pair.
    fn all(&self) -> &[Candidate] {
        if self.of_pairs.is_empty() {
            std::slice::from_ref(&self.own)
        } else {
            &self.of_pairs
        }
    }
}

/// The mean pose of every view.
fn fuse(views: &[Option<Candidates>], exchanged: Exchanges) -> Vec<Option<FusedView>> {
    let fuse_view = |(view, candidates): (usize, &Option<Candidates>)| {
        let candidates = candidates.as_ref()?;
        let poses: Vec<_> = candidates
            .all()
            .iter()
            .map(|pose| (pose.energy, pose.centres_px.as_slice()))
            .collect();
        let n = poses.len() as f64;
        Some(FusedView {
            pose: FusedPose {
                n_pairs: candidates.of_pairs.len(),
                ..average(&poses)?
            },
            exchanged: is_exchanged(exchanged, view),
            cell_px: candidates
                .all()
                .iter()
                .map(|pose| pose.cell_px)
                .sum::<f64>()
                / n,
            single_score: candidates.own.energy,
        })
    };
    views.iter().enumerate().map(fuse_view).collect()
}

/// Reorders the observations of a joint by the views of the rig.
fn by_view(mut triangulated: Triangulated, views: impl Iterator<Item = usize>) -> Triangulated {
    let (used, residuals) = (triangulated.views_used, triangulated.residuals_px);
    triangulated.views_used = 0;
    triangulated.residuals_px.fill(f64::NAN);
    for (i, view) in views.enumerate() {
        triangulated.views_used |= (used >> i & 1) << view;
        triangulated.residuals_px[view] = residuals[i];
    }
    triangulated
}
