//! Keeps the bone lengths of the limbs constant.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use crate::recorded::{Recorded, median};
use crate::role::{RIGID, Role};
use crate::track::{Estimate, Smoothed, State};

/// Number of steps of the projection; it converges quadratically if the start is a few centimetres off.
const N_STEPS: usize = 6;
/// Maximum deviation of a bone's length, as a fraction of the length; a bone that deviates more is taken as wrong and is not corrected.
const MOST_OFF: f64 = 0.5;
/// Standard deviation that is assumed for a position without a covariance, in metres.
const UNKNOWN_SD_M: f64 = 0.02;
/// Minimum number of frames from which a bone length is computed.
const LEAST_FRAMES: usize = 10;

/// Moves joints so that each limb bone has its median length. The displacement is the smallest one, measured by the covariances.
///
/// At every instant, the most likely joints that satisfy this constraint are found by Gauss-Newton steps. With the covariances `P` and the
/// derivatives `J` of the lengths, `x -= P J' (J P J')^-1 (lengths - constant)`, and `P` is reduced by the information in the lengths. The
/// lengths are constant over the run and the input is smooth, so the result is smooth as well.
///
/// * Returns the bones and their lengths.
pub(crate) fn constant(
    recorded: &Recorded,
    tracks: &mut [Vec<Smoothed>],
) -> Vec<([usize; 2], f64)> {
    let at_role = |role: Role| recorded.joints.iter().position(|joint| joint.role == Some(role));
    let mut bones = Vec::new();
    for [a, b] in RIGID {
        let (Some(a), Some(b)) = (at_role(a), at_role(b)) else {
            continue;
        };
        let measured = |smoothed: &Smoothed| {
            smoothed.ok().filter(|estimate| estimate.state == State::Measured)
        };
        let lengths: Vec<f64> = tracks[a]
            .iter()
            .zip(&tracks[b])
            .filter_map(|(a, b)| Some((measured(a)?.position - measured(b)?.position).norm()))
            .collect();
        if lengths.len() >= LEAST_FRAMES {
            bones.push(([a, b], median(lengths)));
        }
    }
    for at in 0..recorded.times.len() {
        project(tracks, at, &bones);
    }
    // HumanEva names some joints twice; the second joint of such a pair is placed where the first one is.
    bones
}

/// Moves the joints at one instant to the required bone lengths.
fn project(tracks: &mut [Vec<Smoothed>], at: usize, bones: &[([usize; 2], f64)]) {
    let here: Vec<([usize; 2], f64)> = bones
        .iter()
        .filter(|([a, b], length)| {
            let (Ok(a), Ok(b)) = (tracks[*a][at], tracks[*b][at]) else {
                return false;
            };
            ((a.position - b.position).norm() - length).abs() < MOST_OFF * length
        })
        .copied()
        .collect();
    let mut joints: Vec<usize> = here.iter().flat_map(|bone| bone.0).collect();
    joints.sort_unstable();
    joints.dedup();
    let found: Vec<Estimate> = joints.iter().filter_map(|&joint| tracks[joint][at].ok()).collect();
    if found.is_empty() {
        return;
    }
    let places: Vec<([usize; 2], f64)> = here
        .iter()
        .filter_map(|(ends, length)| {
            let [a, b] = ends.map(|end| joints.binary_search(&end).ok());
            Some(([a?, b?], *length))
        })
        .collect();
    let Some((positions, covariances)) = projected(&found, &places) else {
        return;
    };
    for ((joint, old), (position, covariance)) in
        joints.iter().zip(found).zip(positions.into_iter().zip(covariances))
    {
        tracks[*joint][at] = Ok(Estimate {
            position,
            covariance: old.covariance.map(|_| covariance),
            ..old
        });
    }
}

/// Positions and their covariances.
type Projected = (Vec<Vector3<f64>>, Vec<Matrix3<f64>>);

/// Returns the most likely positions for the given bone lengths, and their covariances; `None` if they cannot be computed.
fn projected(found: &[Estimate], bones: &[([usize; 2], f64)]) -> Option<Projected> {
    let n = found.len();
    let unknown = Matrix3::identity() * UNKNOWN_SD_M.powi(2);
    let covariances: Vec<Matrix3<f64>> =
        found.iter().map(|estimate| estimate.covariance.unwrap_or(unknown)).collect();
    let mut positions: Vec<Vector3<f64>> = found.iter().map(|estimate| estimate.position).collect();
    let mut last = None;
    for _ in 0..N_STEPS {
        // P J': one column for every bone; a bone moves two joints.
        let mut spread = DMatrix::zeros(3 * n, bones.len());
        let mut derivative = DMatrix::zeros(bones.len(), 3 * n);
        let mut off = DVector::zeros(bones.len());
        for (nth, ([a, b], length)) in bones.iter().enumerate() {
            let bone = positions[*b] - positions[*a];
            let now = bone.norm();
            if now < 1e-6 {
                return None;
            }
            let along = bone / now;
            // The linearisation is about the current position, but the least squares displacement is measured from the unprojected
            // position.
            let moved = (positions[*b] - found[*b].position) - (positions[*a] - found[*a].position);
            off[nth] = now - length - along.dot(&moved);
            for (joint, sign) in [(*a, -1.0), (*b, 1.0)] {
                let column: Vector3<f64> = covariances[joint] * along * sign;
                spread.fixed_view_mut::<3, 1>(3 * joint, nth).copy_from(&column);
                derivative
                    .fixed_view_mut::<1, 3>(nth, 3 * joint)
                    .copy_from(&(along * sign).transpose());
            }
        }
        let root = (&derivative * &spread).cholesky()?;
        let step = &spread * root.solve(&off);
        for (joint, it) in positions.iter_mut().enumerate() {
            *it = found[joint].position - step.fixed_rows::<3>(3 * joint);
        }
        last = Some((spread, root));
    }
    let (spread, root) = last?;
    let told = &spread * root.solve(&spread.transpose());
    let reduced =
        (0..n).map(|joint| covariances[joint] - told.fixed_view::<3, 3>(3 * joint, 3 * joint));
    Some((positions, reduced.collect()))
}
