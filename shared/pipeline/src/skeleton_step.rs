//! The last step: one pose per view out of the pairs, left and right settled, joints in the world.

use std::sync::Arc;

use geometry::{Camera, Observation, TriangulateError, Triangulated};
use multiview::{
    FusedPose, PairEnergies, PairEstimate, ViewPlan, anatomical, anatomical_evidence, average,
    decide_facing,
};
use nalgebra::{Point2, Point3, UnitVector3};
use skeleton::{JointSet, PARSE14};

use crate::{Answer, PairAnswer};

/// Settings of the last step.
#[derive(Debug, Clone, PartialEq)]
pub struct SkeletonSettings {
    /// Which joints to triangulate.
    pub joints: &'static JointSet,
    /// How to triangulate.
    pub triangulation: geometry::Settings,
    /// Uncertainty of a joint in one view, cells of the level it was found on.
    pub sigma_cells: f64,
    /// Decide which views see the person from behind.
    pub facing: bool,
    /// Energies of two assignments of facing that count as a tie, which the previous frame breaks.
    pub facing_tie: f64,
}

impl Default for SkeletonSettings {
    fn default() -> Self {
        Self {
            joints: &PARSE14,
            triangulation: geometry::Settings::default(),
            sigma_cells: 1.0,
            facing: true,
            facing_tie: 0.05,
        }
    }
}

/// One view after fusion.
#[derive(Debug, Clone, PartialEq)]
pub struct FusedView {
    /// The averaged pose, parts named after the side of the body.
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
    memory: Memory,
}

/// What one frame tells the next.
#[derive(Debug, Clone, Default, PartialEq)]
struct Memory {
    exchanged: Option<Vec<bool>>,
    /// Evidence so far that the labels of `exchanged` are anatomically right, fading.
    evidence: f64,
}

/// Share of the anatomical evidence that one frame passes on to the next.
const EVIDENCE_KEPT: f64 = 0.95;

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
            memory: Memory::default(),
        }
    }

    /// Settles one frame.
    ///
    /// * `answers`: the single-view answers; a view without a pair keeps its own.
    /// * `pairs`: in any order; their number and views may differ from frame to frame.
    pub fn run(&mut self, answers: &[Option<Answer>], pairs: &[PairAnswer]) -> Skeleton {
        let mut pairs: Vec<&PairAnswer> = pairs.iter().collect();
        pairs.sort_by_key(|it| it.views);
        let (mut exchanged, facing_margin) = self.relative_facing(&pairs);
        if self.settings.facing && self.can_exchange() {
            self.settle_sides(answers, &pairs, &mut exchanged);
        }
        let views = self.fuse(answers, &pairs, &exchanged);
        let joints = self.triangulate(&views, self.settings.joints);
        Skeleton {
            joints,
            views,
            n_pairs: pairs.len(),
            facing_margin,
        }
    }

    fn can_exchange(&self) -> bool {
        let has_sides = |it: &Arc<ViewPlan>| {
            let spec = it.model().spec();
            spec.mirror.is_some() && spec.parts.len() == skeleton::N_PARTS
        };
        self.plans.first().is_some_and(has_sides)
    }

    /// Which views are exchanged with respect to each other.
    fn relative_facing(&self, pairs: &[&PairAnswer]) -> (Vec<bool>, f64) {
        let energies: Vec<PairEnergies> = pairs
            .iter()
            .filter_map(|it| match &it.hypotheses[..] {
                [same, opposite] => Some(PairEnergies {
                    views: it.views,
                    same_or_opposite: [same.energy, opposite.energy],
                }),
                _ => None,
            })
            .collect();
        let previous = self.memory.exchanged.as_deref();
        let facing = decide_facing(
            self.plans.len(),
            &energies,
            previous,
            self.settings.facing_tie,
        );
        (facing.exchanged, facing.margin)
    }

    /// Chooses between `exchanged` and its complement: as in the previous frame, unless the
    /// anatomical evidence of all frames so far speaks against it.
    fn settle_sides(
        &mut self,
        answers: &[Option<Answer>],
        pairs: &[&PairAnswer],
        exchanged: &mut [bool],
    ) {
        let flip = |exchanged: &mut [bool]| exchanged.iter_mut().for_each(|it| *it = !*it);
        if let Some(previous) = &self.memory.exchanged {
            let changed = previous
                .iter()
                .zip(exchanged.iter())
                .filter(|(a, b)| a != b)
                .count();
            if 2 * changed > exchanged.len() {
                flip(exchanged);
            }
        }
        let views = self.fuse(answers, pairs, exchanged);
        let joints: Vec<Option<Point3<f64>>> = self
            .triangulate(&views, &PARSE14)
            .into_iter()
            .map(|it| it.ok().map(|it| it.in_world))
            .collect();
        let evidence = anatomical_evidence(&joints, self.up_in_world);
        self.memory.evidence = EVIDENCE_KEPT * self.memory.evidence + evidence;
        if self.memory.evidence < 0.0 {
            flip(exchanged);
            self.memory.evidence = -self.memory.evidence;
        }
        self.memory.exchanged = Some(exchanged.to_vec());
    }

    fn fuse(
        &self,
        answers: &[Option<Answer>],
        pairs: &[&PairAnswer],
        exchanged: &[bool],
    ) -> Vec<Option<FusedView>> {
        (0..self.plans.len())
            .map(|view| {
                let best = answers[view].as_ref()?.candidates.first()?;
                let plan = &self.plans[view];
                let mirror = exchanged[view]
                    .then(|| plan.model().spec().mirror.as_deref())
                    .flatten();
                let found: Vec<(f64, &fmp::Pose)> = pairs
                    .iter()
                    .filter_map(|it| chosen(it, exchanged).zip(Some(it.views)))
                    .filter_map(|(estimate, views)| {
                        let side = views.iter().position(|it| *it == view)?;
                        Some((estimate.energy, &estimate.poses[side]))
                    })
                    .collect();
                let scale = |pose: &fmp::Pose| plan.scale(usize::from(pose.level));
                let candidates: Vec<_> = found
                    .iter()
                    .map(|(energy, pose)| (*energy, plan.centres(pose)))
                    .collect();
                let pose = average(&candidates, mirror).unwrap_or_else(|| FusedPose {
                    centres_px: anatomical(&plan.centres(best), mirror),
                    n_pairs: 0,
                    energy: f64::from(best.score),
                });
                let cell_px = if found.is_empty() {
                    scale(best)
                } else {
                    found.iter().map(|it| scale(it.1)).sum::<f64>() / found.len() as f64
                };
                Some(FusedView {
                    pose,
                    exchanged: exchanged[view],
                    cell_px,
                    single_score: f64::from(best.score),
                })
            })
            .collect()
    }

    fn triangulate(
        &self,
        views: &[Option<FusedView>],
        joints: &JointSet,
    ) -> Vec<Result<Triangulated, TriangulateError>> {
        let seen: Vec<(usize, &Camera, f64, Vec<[f64; 2]>)> = views
            .iter()
            .enumerate()
            .filter_map(|(view, it)| {
                let it = it.as_ref()?;
                let sigma = it.cell_px * self.settings.sigma_cells;
                let joints = joints.from_parts(&it.pose.centres_px);
                Some((view, self.plans[view].camera(), sigma, joints))
            })
            .collect();
        (0..joints.joints.len())
            .map(|joint| {
                let observations: Vec<Observation<'_>> = seen
                    .iter()
                    .map(|(_, camera, sigma_px, joints)| Observation {
                        camera,
                        point_px: Point2::from(joints[joint]),
                        sigma_px: *sigma_px,
                    })
                    .collect();
                let found = geometry::triangulate(&observations, &self.settings.triangulation)?;
                Ok(by_view(
                    found,
                    &seen.iter().map(|it| it.0).collect::<Vec<_>>(),
                ))
            })
            .collect()
    }
}

/// Renumbers the observations of a joint as the views of the rig.
fn by_view(mut found: Triangulated, views: &[usize]) -> Triangulated {
    let (used, residuals) = (found.views_used, found.residuals_px);
    found.views_used = 0;
    found.residuals_px.fill(f64::NAN);
    for (i, &view) in views.iter().enumerate() {
        found.views_used |= (used >> i & 1) << view;
        found.residuals_px[view] = residuals[i];
    }
    found
}

/// The hypothesis of a pair that agrees with the joint decision.
fn chosen<'a>(pair: &'a PairAnswer, exchanged: &[bool]) -> Option<&'a PairEstimate> {
    let opposite = exchanged[pair.views[0]] != exchanged[pair.views[1]];
    pair.hypotheses
        .iter()
        .find(|it| it.start.exchanged == opposite)
        .or_else(|| pair.hypotheses.first())
}
