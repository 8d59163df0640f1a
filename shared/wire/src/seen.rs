//! What a view with a network or keypoints found.

use messages::{MAX_CANDIDATES, MAX_JOINTS, ViewPose};
use multiview::ViewPlan;
use pipeline::ViewResult;
use skeleton::PARSE14;

use crate::error::count;
use crate::{WireError, candidates_from_message, front_from_message, skew_from_message};

/// Reads all that a view with a network or keypoints found but extra keypoints; `None` if it found nobody.
///
/// # Errors
///
/// [`WireError`] if a candidate, what is said about it, or the time of the picture is malformed.
pub fn seen_from_message(
    message: &ViewPose,
    plan: &ViewPlan,
) -> Result<Option<ViewResult>, WireError> {
    let candidates = candidates_from_message(message, plan.model(), plan.layout())?;
    let n = candidates.len();
    let seen = ViewResult {
        front: front_from_message(message, n)?,
        heats: heats_from_message(message, n, PARSE14.joints.len())?,
        candidates,
        sigma_px: None,
        tau_px: None,
        skew_s: skew_from_message(message)?,
    };
    Ok((n > 0).then_some(seen))
}

/// Adds how sure the network is of every joint of every candidate.
///
/// # Errors
///
/// [`WireError`] if there are more candidates or joints than fit, or a number is not between 0 and 1.
pub fn heats_to_message(message: &mut ViewPose, heats: &[Vec<f32>]) -> Result<(), WireError> {
    count("heats", heats.len(), MAX_CANDIDATES)?;
    for (candidate, (slot, heats)) in message.heats.iter_mut().zip(heats).enumerate() {
        count("joints", heats.len(), MAX_JOINTS)?;
        for (slot, heat) in slot.iter_mut().zip(heats) {
            *slot = checked_heat(candidate, *heat)?;
        }
    }
    Ok(())
}

/// Reads how sure the network is of every joint of every candidate, 0 to 1.
///
/// * `n_candidates`: of the message; `n_joints`: of a candidate.
///
/// # Errors
///
/// [`WireError`] if there are more than fit, or a number is not between 0 and 1.
pub fn heats_from_message(
    message: &ViewPose,
    n_candidates: usize,
    n_joints: usize,
) -> Result<Vec<Vec<f32>>, WireError> {
    let n_candidates = count("heats", n_candidates, MAX_CANDIDATES)?;
    let n_joints = count("joints", n_joints, MAX_JOINTS)?;
    let candidates = message.heats[..n_candidates].iter().enumerate();
    let read = |(candidate, heats): (usize, &[f32; MAX_JOINTS])| {
        let heats = heats[..n_joints].iter();
        heats.map(|heat| checked_heat(candidate, *heat)).collect()
    };
    candidates.map(read).collect()
}

fn checked_heat(candidate: usize, heat: f32) -> Result<f32, WireError> {
    if (0.0..=1.0).contains(&heat) {
        return Ok(heat);
    }
    Err(WireError::Value {
        field: "heats",
        entry: candidate,
        got: f64::from(heat),
        expected: "0 to 1",
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heats_survive_a_round_trip_and_are_shares() {
        let heats = vec![vec![0.0, 0.5, 1.0], vec![0.25; 3]];
        let mut message = ViewPose::default();
        heats_to_message(&mut message, &heats).unwrap();
        assert_eq!(heats_from_message(&message, 2, 3).unwrap(), heats);
        for wrong in [f32::NAN, -0.1, 1.1] {
            message.heats[1][2] = wrong;
            heats_from_message(&message, 2, 3).unwrap_err();
            heats_to_message(&mut message, &[vec![wrong]]).unwrap_err();
        }
        heats_from_message(&message, MAX_CANDIDATES + 1, 3).unwrap_err();
        heats_from_message(&message, 1, MAX_JOINTS + 1).unwrap_err();
    }
}
