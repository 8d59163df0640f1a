//! Converts a person solved in 3D to the joints and views of a result.

use ::people::Solved;
use geometry::{MAX_VIEWS, TriangulateError, Triangulated};
use multiview::{FusedPose, SpaceView, ViewPlan};
use nalgebra::{Matrix3, Point3};
use posenetwork::{MapSettings, expected_error};
use skeleton::{Joint, JointSet, N_PARTS, PARENT, PARSE14};

use crate::fused_view::FusedView;

/// Number of joints in `skeleton::PARSE14`.
pub(crate) const N: usize = PARSE14.joints.len();

/// The joints of `skeleton::PARSE14`, in metres in the world; `None` for a joint that fewer than two views show.
pub(crate) type Places = [Option<Point3<f64>>; N];

/// A view that contributes to a solution.
#[derive(Clone, Copy)]
pub(crate) struct PartView<'a> {
    /// Index of the view in the rig.
    pub(crate) view: usize,
    /// Evidence of the view, with left and right named as in the solution.
    pub(crate) shown: SpaceView<'a>,
    /// Height of the network's window around the person, in pixels.
    pub(crate) window_px: f64,
}

impl PartView<'_> {
    /// Returns the expected error of a joint in the view, in pixels along one axis, derived from the heat at the solution; `None` if the
    /// view does not show that position.
    fn sigma_px(&self, maps: &MapSettings, joint: usize, at: &Point3<f64>) -> Option<f64> {
        let pixel = self.shown.camera.project(at)?;
        let [width, height] = self.shown.camera.intrinsics.size.map(f64::from);
        let is_inside = (0.0..width).contains(&pixel.x) && (0.0..height).contains(&pixel.y);
        let heat = maps.heat(self.shown.evidence_at(joint, at));
        is_inside.then(|| expected_error(heat) * self.window_px)
    }
}

/// Returns the joints at the positions of a solution, each with its covariance. The covariance is the inverse of the curvature `sum_v J_v^T
/// J_v / s_v^2`. `J_v` is the derivative of the projection in view `v` with respect to the position, and `s_v` is the error expected for
/// the heat at that pixel.
///
/// [`crate::disagreement`] sets the residuals and their root mean square.
pub(crate) fn joints_at(
    places: &Places,
    views: &[PartView<'_>],
    maps: &MapSettings,
) -> Vec<Result<Triangulated, TriangulateError>> {
    let joint = |(joint, place): (usize, &Option<Point3<f64>>)| {
        let too_few = |views| TriangulateError::TooFewViews { views, needed: 2 };
        let at = place.ok_or(too_few(0))?;
        let mut curvature = Matrix3::zeros();
        let mut views_used = 0;
        for part in views {
            let derivative = part.shown.camera.project_with_jacobian(&at);
            let sigma_px = part.sigma_px(maps, joint, &at);
            if let (Some((_, derivative)), Some(sigma_px)) = (derivative, sigma_px) {
                curvature += derivative.transpose() * derivative / sigma_px.powi(2);
                views_used |= 1_u32 << part.view;
            }
        }
        if views_used.count_ones() < 2 {
            return Err(too_few(views_used.count_ones() as usize));
        }
        let covariance = curvature.cholesky().map(|factor| factor.inverse());
        let covariance =
            covariance.filter(|covariance| covariance.iter().all(|entry| entry.is_finite()));
        Ok(Triangulated {
            in_world: at,
            covariance: covariance.ok_or(TriangulateError::Diverged { iterations: 0 })?,
            reprojection_px: 0.0,
            views_used,
            residuals_px: [f64::NAN; MAX_VIEWS],
        })
    };
    places.iter().enumerate().map(joint).collect()
}

/// A joint that fewer than two views show is left out if its standard deviation along any direction is larger, in metres. The result would
/// say as much about it as [`crate::disagreement`] says about a joint on which no two views agree.
const MOST_SD_M: f64 = 0.3;

/// Returns a joint that fewer than two views show, as solved from keypoints; `None` if its position is too uncertain.
pub(crate) fn hidden(solved: &Solved, joint: usize) -> Option<Triangulated> {
    let covariance = solved.covariances[joint]?;
    let widest = covariance.symmetric_eigenvalues().max();
    (widest <= MOST_SD_M * MOST_SD_M).then_some(Triangulated {
        in_world: solved.joints[joint]?,
        covariance,
        reprojection_px: 0.0,
        views_used: 0,
        residuals_px: [f64::NAN; MAX_VIEWS],
    })
}

/// Returns the joints of another joint set: each is the mean of the joints of `skeleton::PARSE14` that have the same parts.
pub(crate) fn of_set(
    set: &JointSet,
    of_body: &[Result<Triangulated, TriangulateError>],
) -> Vec<Result<Triangulated, TriangulateError>> {
    let mean = |joint: &Joint| {
        let of_part = |part: &usize| {
            let own = |joint: &&Joint| joint.parts.contains(part);
            let index = PARSE14.joints.iter().position(|joint| own(&joint));
            let missing = TriangulateError::TooFewViews {
                views: 0,
                needed: 2,
            };
            index.map_or(Err(missing), |index| of_body[index])
        };
        let parts: Vec<Triangulated> = joint.parts.iter().map(of_part).collect::<Result<_, _>>()?;
        let [first, rest @ ..] = &parts[..] else {
            return Err(TriangulateError::TooFewViews {
                views: 0,
                needed: 2,
            });
        };
        let n = parts.len() as f64;
        let mut mean = *first;
        for other in rest {
            mean.in_world += other.in_world.coords;
            mean.covariance += other.covariance;
            mean.views_used &= other.views_used;
        }
        mean.in_world /= n;
        mean.covariance /= n * n;
        Ok(mean)
    };
    set.joints.iter().map(mean).collect()
}

/// Returns the positions of a person's parts in a view; NaN for a part next to joints without a position.
///
/// * `places`: positions of the joints of `skeleton::PARSE14`.
/// * `energy`: energy of the solution.
/// * `single_score`: score of the best candidate of the view.
pub(crate) fn shown_in(
    plan: &ViewPlan,
    places: &Places,
    energy: f64,
    single_score: f64,
) -> FusedView {
    let centre = |between: &Between| {
        let [above, below] = between.joints.map(|joint| places[joint]);
        let at = match (above, below) {
            (Some(above), Some(below)) => Some(above + (below - above) * between.share),
            (one, other) => one.or(other),
        };
        let pixel = at.and_then(|at| plan.camera().project(&at));
        pixel.map_or([f64::NAN; 2], |pixel| [pixel.x, pixel.y])
    };
    FusedView {
        pose: FusedPose {
            centres_px: (0..N_PARTS).map(|part| centre(&between(part))).collect(),
            n_pairs: 1,
            energy,
        },
        exchanged: false,
        cell_px: 1.0,
        single_score,
    }
}

/// Position of a part between two joints.
pub(crate) struct Between {
    /// The nearest joint towards the head, and the nearest joint away from it.
    pub(crate) joints: [usize; 2],
    /// Position between the two joints as a fraction, 0 to 1.
    pub(crate) share: f64,
}

/// Returns the joint at a part, as an index in `skeleton::PARSE14`; `None` if the part lies between joints.
fn joint_of(part: usize) -> Option<usize> {
    PARSE14.joints.iter().position(|joint| joint.parts == [part])
}

pub(crate) fn between(part: usize) -> Between {
    if let Some(joint) = joint_of(part) {
        return Between {
            joints: [joint; 2],
            share: 0.0,
        };
    }
    let parent = |part: usize| PARENT[part];
    let child = |part: usize| (0..N_PARTS).find(|i| PARENT[*i] == Some(part));
    let (above, n_above) = next_joint(part, parent).unwrap_or((0, 1));
    let (below, n_below) = next_joint(part, child).unwrap_or((above, 1));
    Between {
        joints: [above, below],
        share: f64::from(n_above) / f64::from(n_above + n_below),
    }
}

/// Returns the first joint among the parts that follow a part, and its distance in steps.
fn next_joint(mut part: usize, next: impl Fn(usize) -> Option<usize>) -> Option<(usize, u32)> {
    let mut n = 0;
    loop {
        if let Some(joint) = joint_of(part) {
            return Some((joint, n));
        }
        part = next(part)?;
        n += 1;
    }
}
