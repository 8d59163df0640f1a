//! How far what every view found by itself lies from the result.

use geometry::Triangulated;
use multiview::Exchanges;
use nalgebra::Point2;
use skeleton::JointSet;

use crate::bodies::NoJoint;
use crate::fused_view::FusedView;
use crate::motion::Motion;
use crate::space::Space;
use crate::view_result::ViewResult;

/// Measures the joints of a result that was solved in space against the poses that the views found by themselves.
///
/// The poses that come from such a solution are its own projections: they agree with it whatever the views show. What a view found is the
/// candidate that lies nearest, with its sides as they are or exchanged; of a view that was left out as well, if it sees somebody there
/// ([`SkeletonSettings::least_score`](crate::SkeletonSettings::least_score)). The residuals of every joint are replaced, and with them
/// their root mean square.
///
/// * `views`: the poses of the views that have a part in the result.
/// * `motion`: of what the views show, as the solution has it.
pub(crate) fn measure(
    space: &Space,
    motion: &mut Motion,
    answers: &[Option<ViewResult>],
    (views, joints): (&[Option<FusedView>], &mut [Result<Triangulated, NoJoint>]),
) {
    let set = space.settings.joints;
    for it in joints.iter_mut().flatten() {
        it.residuals_px.fill(f64::NAN);
    }
    for (view, answer) in answers.iter().enumerate() {
        let Some(answer) = answer else {
            continue;
        };
        let camera = space.plans[view].camera();
        let [width, height] = camera.intrinsics.size.map(f64::from);
        let inside =
            |at: &Point2<f64>| (0.0..width).contains(&at.x) && (0.0..height).contains(&at.y);
        let mut projected: Vec<Option<Point2<f64>>> = joints
            .iter()
            .map(|it| camera.project(&it.as_ref().ok()?.in_world).filter(inside))
            .collect();
        // A picture that was taken at another time shows them elsewhere.
        if let Some(by) = motion.since_instant(view, [answer.skew_s, 0.0], projected.clone()) {
            for (at, by) in projected.iter_mut().zip(by) {
                *at = at.map(|at| at + by);
            }
        }
        let least_score = match views.get(view) {
            Some(Some(_)) => f32::NEG_INFINITY,
            _ => space.settings.least_score,
        };
        let nearest = readings(space, (view, least_score), answer, set)
            .map(|points| {
                let both = projected.iter().zip(&points);
                let distance = |(at, point): (&Option<Point2<f64>>, &[f64; 2])| {
                    at.map_or(f64::NAN, |at| (at - Point2::from(*point)).norm())
                };
                both.map(distance).collect::<Vec<f64>>()
            })
            .min_by(|a, b| sum(a).total_cmp(&sum(b)));
        for (joint, residual) in joints.iter_mut().zip(nearest.unwrap_or_default()) {
            if let Ok(joint) = joint {
                joint.residuals_px[view] = residual;
            }
        }
    }
    for it in joints.iter_mut().flatten() {
        let known = it.residuals_px.iter().filter(|it| it.is_finite());
        let squares: Vec<f64> = known.map(|it| it * it).collect();
        if !squares.is_empty() {
            it.reprojection_px = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
        }
    }
}

/// The joints of all candidates of a view, with their sides as they are and exchanged.
///
/// * `least_score`: of a candidate.
fn readings<'a>(
    space: &'a Space,
    (view, least_score): (usize, f32),
    answer: &'a ViewResult,
    set: &'a JointSet,
) -> impl Iterator<Item = Vec<[f64; 2]>> + 'a {
    let seen = answer.candidates.iter();
    let seen = seen.filter(move |pose| pose.score >= least_score);
    let each = seen.flat_map(move |pose| {
        [0, Exchanges::MAX].map(|exchanges| (pose, space.mirror(view, exchanges)))
    });
    each.map(move |(pose, mirror)| {
        let plan = &space.plans[view];
        let centre = |part: usize| plan.centre(pose, mirror.map_or(part, |it| it[part]));
        let centres: Vec<[f64; 2]> = (0..pose.parts.len()).map(centre).collect();
        set.from_parts(&centres)
    })
}

fn sum(distances: &[f64]) -> f64 {
    distances.iter().filter(|it| it.is_finite()).sum()
}
