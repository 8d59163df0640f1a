//! Judges the poses of all views in 3D, under one assumption about which views have left and right swapped.

use std::borrow::Cow;
use std::sync::Arc;

use fmp::Pose;
use geometry::{Observation, TriangulateError, Triangulated};
use multiview::{
    Exchanges, FrontEvidence, ViewPlan, anatomical_evidence, front_in_view, front_log_ratio,
    is_exchanged,
};
use nalgebra::{Point2, Point3, UnitVector3, Vector3};
use skeleton::PARSE14;

use crate::fused_view::FusedView;
use crate::skeleton_settings::SkeletonSettings;
use crate::view_result::ViewResult;

/// Points of a view, in pixels of the frame.
type Points<'a> = Cow<'a, [[f64; 2]]>;

/// The cameras of a rig, and the settings for judging poses.
#[derive(Debug, Clone)]
pub(crate) struct Space {
    pub(crate) plans: Vec<Arc<ViewPlan>>,
    pub(crate) up_in_world: Option<UnitVector3<f64>>,
    pub(crate) settings: SkeletonSettings,
}

impl Space {
    /// Judges the poses of all views under one assumption about which of them see the person from behind.
    pub(crate) fn judge(
        &self,
        answers: &[Option<ViewResult>],
        views: &[Option<FusedView>],
    ) -> Judged {
        let parts = self.triangulate(views, skeleton::N_PARTS, Cow::from, &[]);
        let joints: skeleton::body::Joints = core::array::from_fn(|joint| {
            let part = parts[PARSE14.joints[joint].parts[0]].as_ref().ok();
            Some(part?.in_world)
        });
        let seen = self.seen(answers, views, &joints);
        // Half of the log-ratio is the gain in log-likelihood over views that provide no evidence.
        let evidence = self.settings.front_score * seen.log_ratio.abs() / 2.0;
        let unlike = self.settings.body.score * skeleton::body::deviation(&joints);
        Judged {
            score: self.agreement(views, &parts) + evidence - unlike,
            seen,
        }
    }

    /// Returns the mirror permutation of the parts for a view that sees the person from behind.
    pub(crate) fn mirror(&self, view: usize, exchanged: Exchanges) -> Option<&[usize]> {
        let mirror = self.plans[view].model().spec().mirror.as_deref();
        mirror.filter(|_| is_exchanged(exchanged, view))
    }

    pub(crate) fn can_exchange(&self) -> bool {
        let has_sides = |plan: &Arc<ViewPlan>| {
            let spec = plan.model().spec();
            spec.mirror.is_some() && spec.parts.len() == skeleton::N_PARTS
        };
        self.plans.first().is_some_and(has_sides)
    }

    /// Returns the evidence for left and right of a skeleton: the views' evidence of the direction in which the person faces, and the
    /// bending of the joints.
    fn seen(
        &self,
        answers: &[Option<ViewResult>],
        views: &[Option<FusedView>],
        joints: &[Option<Point3<f64>>],
    ) -> Seen {
        let settings = &self.settings.sides;
        let anatomy = anatomical_evidence(joints, self.up_in_world);
        let mut log_ratio = settings.anatomy_weight * anatomy;
        let front = multiview::front(joints);
        let known = || joints.iter().flatten();
        if let Some(front) = front {
            let place = known().fold(Vector3::zeros(), |sum, it| sum + it.coords);
            let place = Point3::from(place / known().count().max(1) as f64);
            for (view, (answer, fused)) in answers.iter().zip(views).enumerate() {
                let (Some(answer), Some(fused)) = (answer, fused) else {
                    continue;
                };
                if let Some(evidence) = self.front_evidence(view, answer, fused) {
                    let in_view = front_in_view(self.plans[view].camera(), &place, &front);
                    let weight = settings.front_weight * upright(&fused.pose.centres_px);
                    log_ratio += weight * front_log_ratio(in_view, evidence);
                }
            }
        }
        Seen { front, log_ratio }
    }

    /// Returns a view's evidence of the direction in which its fused person faces, taken from the nearest candidate.
    fn front_evidence(
        &self,
        view: usize,
        answer: &ViewResult,
        fused: &FusedView,
    ) -> Option<FrontEvidence> {
        // The centre of a pose does not depend on the names of its parts.
        let middle = |centres: &[[f64; 2]]| {
            let n = centres.len() as f64;
            let sum = centres.iter().fold([0.0, 0.0], |sum, it| [sum[0] + it[0], sum[1] + it[1]]);
            sum.map(|sum| sum / n)
        };
        let of_fused = middle(&fused.pose.centres_px);
        let distance = |pose: &Pose| {
            let [x, y] = middle(&self.plans[view].centres(pose));
            (x - of_fused[0]).hypot(y - of_fused[1])
        };
        let candidates = answer.candidates.iter().zip(&answer.front);
        let nearest = candidates.min_by(|a, b| distance(a.0).total_cmp(&distance(b.0)));
        nearest.map(|nearest| *nearest.1)
    }

    /// Returns the geometric term over all views: the squared distance of every part from its reprojection.
    pub(crate) fn agreement(
        &self,
        views: &[Option<FusedView>],
        parts: &[Result<Triangulated, TriangulateError>],
    ) -> f64 {
        let cap = self.settings.max_distance_cells.powi(2);
        let of_view = |residual_px: f64, view: &FusedView| {
            let cells = residual_px / view.cell_px;
            // A view that cannot see the point is given the maximum disagreement.
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
                Ok(point) => {
                    present.map(|(view, fused)| of_view(point.residuals_px[view], fused)).sum()
                }
                Err(_) => present.count() as f64 * cap,
            }
        };
        -self.settings.agreement * parts.iter().map(of_part).sum::<f64>()
    }

    /// Triangulates points of the fused poses.
    ///
    /// * `points`: computes the `n_points` wanted points from the part centres of a view.
    /// * `expected_px`: expected errors of these points, for the views that have them, in pixels.
    pub(crate) fn triangulate<'a>(
        &self,
        views: &'a [Option<FusedView>],
        n_points: usize,
        points: impl Fn(&'a [[f64; 2]]) -> Points<'a>,
        expected_px: &[Vec<f64>],
    ) -> Vec<Result<Triangulated, TriangulateError>> {
        let present = views.iter().enumerate();
        let present: Vec<(usize, &FusedView, Points<'_>)> = present
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
            observations.extend(present.iter().map(|(view, fused, points)| {
                Observation {
                    camera: self.plans[*view].camera(),
                    point_px: Point2::from(points[point]),
                    sigma_px: (fused.cell_px * self.settings.sigma_cells)
                        .hypot(expected_px(*view, point).unwrap_or(0.0)),
                }
            }));
            let found = geometry::triangulate(&observations, &self.settings.triangulation)?;
            Ok(by_view(found, present.iter().map(|present| present.0)))
        };
        (0..n_points).map(triangulate).collect()
    }
}

/// Returns the weight of a view's evidence of the direction in which the person faces: the squared cosine of the angle between the trunk in
/// the picture and the vertical, or 0 for a person upside down. The detector was not trained on the heads of people who bend down.
fn upright(centres_px: &[[f64; 2]]) -> f64 {
    let cosine = trunk_upward(centres_px);
    if cosine > 0.0 { cosine * cosine } else { 0.0 }
}

/// Returns the cosine of the angle between the trunk in the picture and the upward direction: -1 upside down.
pub(crate) fn trunk_upward(centres_px: &[[f64; 2]]) -> f64 {
    const NECK: usize = 1;
    const HIPS: [usize; 2] = [9, 21];
    let [Some(neck), Some(right), Some(left)] =
        [NECK, HIPS[0], HIPS[1]].map(|part| centres_px.get(part))
    else {
        return 1.0;
    };
    let [x, y] = [0, 1].map(|axis| neck[axis] - f64::midpoint(right[axis], left[axis]));
    -y / x.hypot(y)
}

/// Rating of an assumption about left and right in the views.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Judged {
    /// Agreement of the views, plus the likelihood of their evidence of the direction in which the person faces; added to the energy of
    /// fusion.
    pub(crate) score: f64,
    /// Evidence about left and right of the whole body.
    pub(crate) seen: Seen,
}

/// Evidence about left and right of a skeleton.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Seen {
    /// The direction in which the skeleton faces according to its labels.
    pub(crate) front: Option<Vector3<f64>>,
    /// Log-likelihood ratio of the labels over the swapped labels, in nats.
    pub(crate) log_ratio: f64,
}

/// Reorders the observations of a joint by the views of the rig.
pub(crate) fn by_view(
    mut triangulated: Triangulated,
    views: impl Iterator<Item = usize>,
) -> Triangulated {
    let (used, residuals) = (triangulated.views_used, triangulated.residuals_px);
    triangulated.views_used = 0;
    triangulated.residuals_px.fill(f64::NAN);
    for (i, view) in views.enumerate() {
        triangulated.views_used |= (used >> i & 1) << view;
        triangulated.residuals_px[view] = residuals[i];
    }
    triangulated
}
