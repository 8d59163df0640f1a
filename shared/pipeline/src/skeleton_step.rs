//! The last step: one pose per view out of the pairs, left and right settled, joints in the world.

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

/// How a view's pose is made of those of its pairs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Combine {
    /// Their mean: the paper's section 7.
    #[default]
    Mean,
    /// Part by part the answers that all views can mean together ([`multiview::consensus()`]).
    Consensus,
}

/// Settings of the last step.
#[derive(Debug, Clone, PartialEq)]
pub struct SkeletonSettings {
    /// Which joints to triangulate.
    pub joints: &'static JointSet,
    /// From parts to these joints, as learned; each the mean of its own parts without it.
    pub joint_map: Option<Arc<JointMap>>,
    /// How to triangulate.
    pub triangulation: geometry::Settings,
    /// Uncertainty of a joint in one view, cells of the level it was found on.
    pub sigma_cells: f64,
    /// How much of the expected errors of a joint's parts is added to that (as variances are), where they
    /// were predicted; 0 for nothing.
    pub error_weight: f64,
    /// How a view's pose is made of those of its pairs.
    pub combine: Combine,
    /// How the views come to agree on a part. Facing is always decided on poses that do: mixtures of
    /// poses that found different limbs fit together under no assumption about left and right.
    pub consensus: ConsensusSettings,
    /// Decide which views see the person from behind.
    pub facing: bool,
    /// How facing is followed over time.
    pub facing_filter: FacingSettings,
    /// Weight of the agreement of all views in the decision about facing: score per squared cell of
    /// distance between a part and its reprojection, the all-views form of the geometric term.
    pub agreement: f64,
    /// Distance beyond which disagreement counts no more, cells.
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
    /// The pose that its pairs make, parts named after the side of the body.
    pub pose: FusedPose,
    /// Whether the view sees the person from behind.
    pub exchanged: bool,
    /// Mean size of a cell of the levels it was found on, pixels of the frame.
    pub cell_px: f64,
    /// Score of the view's own best candidate.
    pub single_score: f64,
}

/// The result of a frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Skeleton {
    /// The joints of the joint set, each with its position or why there is none.
    pub joints: Vec<Result<Triangulated, TriangulateError>>,
    /// The views of the rig; `None` where a view gave no answer.
    pub views: Vec<Option<FusedView>>,
    /// How many pairs were averaged.
    pub n_pairs: usize,
    /// Energy of the chosen assignment of facing less that of the best other one.
    pub facing_margin: f64,
}

/// The last step for a rig; remembers the facing of the frame before.
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

    /// Settles one frame.
    ///
    /// * `answers`: the single-view answers; a view without a pair keeps its own.
    /// * `pairs`: in any order; their number and views may differ from frame to frame.
    pub fn run(&mut self, answers: &[Option<ViewResult>], pairs: &[PairResult]) -> Skeleton {
        let mut pairs: Vec<&PairResult> = pairs.iter().collect();
        pairs.sort_by_key(|it| it.views);
        self.settle(answers, &Fused::Pairs(pairs))
    }

    /// Settles one frame whose views were solved at once.
    ///
    /// * `answers`: the single-view answers; a view that was not solved keeps its own.
    pub fn run_all_views(
        &mut self,
        answers: &[Option<ViewResult>],
        found: &AllViewsResult,
    ) -> Skeleton {
        self.settle(answers, &Fused::AllViews(found))
    }

    fn settle(&mut self, answers: &[Option<ViewResult>], found: &Fused<'_>) -> Skeleton {
        let (exchanged, facing_margin) = if self.settings.facing && self.can_exchange() {
            self.decide_facing(answers, found)
        } else {
            (0, f64::INFINITY)
        };
        let candidates = self.candidates(answers, found, exchanged);
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
            n_pairs: found.n_pairs(),
            facing_margin,
        }
    }

    /// Of every view: the expected errors of its joints, pixels of the frame, weighed; none where nothing was
    /// predicted. That of a joint is the mean of those of its parts, of which none is further off than the
    /// frame is large.
    fn expected_errors(
        &self,
        answers: &[Option<ViewResult>],
        exchanged: Exchanges,
    ) -> Vec<Vec<f64>> {
        let of_view = |(view, answer): (usize, &Option<ViewResult>)| {
            let of_parts = answer.as_ref()?.sigma_px.as_ref()?.iter();
            let [width, height] = self.plans[view].camera().intrinsics.size.map(f64::from);
            let weighed = |it: &f32| {
                let it = f64::from(*it).min(width.hypot(height));
                it * self.settings.error_weight
            };
            // The second number is there for the sake of what is written for points.
            let of_parts: Vec<[f64; 2]> = of_parts.map(|it| [weighed(it), 0.0]).collect();
            let of_parts = anatomical(&of_parts, self.mirror(view, exchanged));
            let of_joints = self.settings.joints.from_parts(&of_parts).into_iter();
            Some(of_joints.map(|[it, _]| it).collect())
        };
        let views = answers.iter().enumerate();
        views.map(|it| of_view(it).unwrap_or_default()).collect()
    }

    /// The mirror of the parts where a view sees the person from behind.
    fn mirror(&self, view: usize, exchanged: Exchanges) -> Option<&[usize]> {
        let mirror = self.plans[view].model().spec().mirror.as_deref();
        mirror.filter(|_| is_exchanged(exchanged, view))
    }

    fn can_exchange(&self) -> bool {
        let has_sides = |it: &Arc<ViewPlan>| {
            let spec = it.model().spec();
            spec.mirror.is_some() && spec.parts.len() == skeleton::N_PARTS
        };
        self.plans.first().is_some_and(has_sides)
    }

    /// Which views see the person from behind, and by what margin.
    fn decide_facing(
        &mut self,
        answers: &[Option<ViewResult>],
        found: &Fused<'_>,
    ) -> (Exchanges, f64) {
        let present = answers.iter().enumerate().fold(0, |mask, (view, it)| {
            mask | Exchanges::from(it.is_some()) << view
        });
        let hypotheses: Vec<FacingHypothesis> = found
            .facing(present)
            .into_iter()
            .map(|(exchanges, energy)| {
                let views = self.agreed(&self.candidates(answers, found, exchanges), exchanges);
                let parts = self.triangulate(&views, skeleton::N_PARTS, <[_]>::to_vec, &[]);
                let joints: Vec<Option<Point3<f64>>> = PARSE14
                    .joints
                    .iter()
                    .map(|it| parts[it.parts[0]].as_ref().ok().map(|it| it.in_world))
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

    /// The geometric term over all views at once: how far every part is from its reprojection.
    fn agreement(
        &self,
        views: &[Option<FusedView>],
        parts: &[Result<Triangulated, TriangulateError>],
    ) -> f64 {
        let cap = self.settings.max_distance_cells.powi(2);
        let of_view = |residual_px: f64, view: &FusedView| {
            let cells = residual_px / view.cell_px;
            // A view that does not show the point disagrees as much as one can.
            if cells.is_nan() {
                cap
            } else {
                (cells * cells).min(cap)
            }
        };
        let of_part = |part: &Result<Triangulated, TriangulateError>| -> f64 {
            let seen = views.iter().enumerate();
            let seen = seen.filter_map(|(view, it)| Some((view, it.as_ref()?)));
            match part {
                Ok(it) => seen
                    .map(|(view, of)| of_view(it.residuals_px[view], of))
                    .sum(),
                Err(_) => seen.count() as f64 * cap,
            }
        };
        -self.settings.agreement * parts.iter().map(of_part).sum::<f64>()
    }

    /// What every view was found to be, by each of its pairs or by all views, under an assignment of facing.
    fn candidates(
        &self,
        answers: &[Option<ViewResult>],
        found: &Fused<'_>,
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
            let found = found.poses(view, exchanged).into_iter();
            Some(Candidates {
                found: found
                    .map(|(energy, pose)| candidate(energy, pose))
                    .collect(),
                own: candidate(f64::from(best.score), best),
            })
        };
        (0..self.plans.len()).map(of_view).collect()
    }

    /// One pose per view, of what the views agree on.
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

    /// What the pairs of a view saw, yet without points.
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
    /// * `points`: from the part centres of a view to the `n_points` points wanted.
    /// * `expected_px`: expected errors of these points in the views that have any.
    fn triangulate(
        &self,
        views: &[Option<FusedView>],
        n_points: usize,
        points: impl Fn(&[[f64; 2]]) -> Vec<[f64; 2]>,
        expected_px: &[Vec<f64>],
    ) -> Vec<Result<Triangulated, TriangulateError>> {
        let seen = views.iter().enumerate();
        let seen: Vec<(usize, &FusedView, Vec<[f64; 2]>)> = seen
            .filter_map(|(view, it)| {
                let it = it.as_ref()?;
                Some((view, it, points(&it.pose.centres_px)))
            })
            .collect();
        let expected_px = |view: usize, point: usize| {
            let of_view = expected_px.get(view)?;
            of_view.get(point).copied()
        };
        let mut observations: Vec<Observation<'_>> = Vec::with_capacity(seen.len());
        let triangulate = |point: usize| {
            observations.clear();
            let observed = seen.iter();
            observations.extend(observed.map(|(view, fused, points)| {
                Observation {
                    camera: self.plans[*view].camera(),
                    point_px: Point2::from(points[point]),
                    sigma_px: (fused.cell_px * self.settings.sigma_cells)
                        .hypot(expected_px(*view, point).unwrap_or(0.0)),
                }
            }));
            let found = geometry::triangulate(&observations, &self.settings.triangulation)?;
            Ok(by_view(found, seen.iter().map(|it| it.0)))
        };
        (0..n_points).map(triangulate).collect()
    }
}

/// A pose of one view, parts named after the side of the body.
#[derive(Debug, Clone)]
struct Candidate {
    energy: f64,
    cell_px: f64,
    centres_px: Vec<[f64; 2]>,
}

/// The poses that one view's pairs found, and the one it found alone.
#[derive(Debug, Clone)]
struct Candidates {
    found: Vec<Candidate>,
    own: Candidate,
}

impl Candidates {
    /// The pairs' poses, or the view's own where it is in no pair.
    fn all(&self) -> &[Candidate] {
        if self.found.is_empty() {
            std::slice::from_ref(&self.own)
        } else {
            &self.found
        }
    }
}

/// The mean pose of every view.
fn fuse(views: &[Option<Candidates>], exchanged: Exchanges) -> Vec<Option<FusedView>> {
    let fuse_view = |(view, it): (usize, &Option<Candidates>)| {
        let it = it.as_ref()?;
        let candidates: Vec<_> = it
            .all()
            .iter()
            .map(|it| (it.energy, it.centres_px.as_slice()))
            .collect();
        let n = candidates.len() as f64;
        Some(FusedView {
            pose: FusedPose {
                n_pairs: it.found.len(),
                ..average(&candidates)?
            },
            exchanged: is_exchanged(exchanged, view),
            cell_px: it.all().iter().map(|it| it.cell_px).sum::<f64>() / n,
            single_score: it.own.energy,
        })
    };
    views.iter().enumerate().map(fuse_view).collect()
}

/// Renumbers the observations of a joint as the views of the rig.
fn by_view(mut found: Triangulated, views: impl Iterator<Item = usize>) -> Triangulated {
    let (used, residuals) = (found.views_used, found.residuals_px);
    found.views_used = 0;
    found.residuals_px.fill(f64::NAN);
    for (i, view) in views.enumerate() {
        found.views_used |= (used >> i & 1) << view;
        found.residuals_px[view] = residuals[i];
    }
    found
}
