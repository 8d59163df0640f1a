//! Expected errors of a view.

use messages::{MAX_PARTS, PairPose, Status, ViewQuality};

use crate::WireError;
use crate::error::{count, equal, finite};

/// Writes predicted errors, or that there are none. The caller fills in stamp and timing.
///
/// * `sigma_px`: expected error of every part, in pixels of the frame.
///
/// # Errors
///
/// Returns a [`WireError`] if there are more than [`MAX_PARTS`] errors, or if one is negative or not finite.
pub fn sigma_to_message(sigma_px: Option<&[f32]>) -> Result<ViewQuality, WireError> {
    let Some(sigma_px) = sigma_px else {
        return Ok(ViewQuality {
            status: Status::NO_PREDICTION,
            ..ViewQuality::default()
        });
    };
    let mut message = ViewQuality {
        status: Status::OK,
        n_parts: count("n_parts", sigma_px.len(), MAX_PARTS)? as u32,
        ..ViewQuality::default()
    };
    for (part, &sigma) in sigma_px.iter().enumerate() {
        message.sigma_px[part] = checked(part, sigma)?;
    }
    Ok(message)
}

/// Reads a prediction; `None` unless the status is [`Status::OK`].
///
/// # Errors
///
/// Returns a [`WireError`] if the prediction is not for `n_parts` parts, or if a value is negative or not finite.
pub fn sigma_from_message(
    message: &ViewQuality,
    n_parts: usize,
) -> Result<Option<Vec<f32>>, WireError> {
    if message.status != Status::OK {
        return Ok(None);
    }
    equal("n_parts", message.n_parts as usize, n_parts)?;
    count("n_parts", n_parts, MAX_PARTS)?;
    let sigma = message.sigma_px[..n_parts].iter().enumerate();
    sigma
        .map(|(part, &sigma)| checked(part, sigma))
        .collect::<Result<_, _>>()
        .map(Some)
}

/// Adds the thresholds that came with a prediction.
///
/// * `tau_px`: threshold of every part, in pixels of the frame; or empty.
///
/// # Errors
///
/// Returns a [`WireError`] if there are more than [`MAX_PARTS`] thresholds, or if one is negative or not finite.
pub fn tau_to_message(message: &mut ViewQuality, tau_px: &[f32]) -> Result<(), WireError> {
    message.n_thresholds = count("n_thresholds", tau_px.len(), MAX_PARTS)? as u32;
    for (part, &tau) in tau_px.iter().enumerate() {
        message.tau_px[part] = checked(part, tau)?;
    }
    Ok(())
}

/// Reads the thresholds that came with a prediction; `None` if there are none.
///
/// # Errors
///
/// Returns a [`WireError`] if the thresholds are not for `n_parts` parts, or if a value is negative or not finite.
pub fn tau_from_message(
    message: &ViewQuality,
    n_parts: usize,
) -> Result<Option<Vec<f32>>, WireError> {
    if message.status != Status::OK || message.n_thresholds == 0 {
        return Ok(None);
    }
    equal("n_thresholds", message.n_thresholds as usize, n_parts)?;
    count("n_thresholds", n_parts, MAX_PARTS)?;
    let tau = message.tau_px[..n_parts].iter().enumerate();
    tau.map(|(part, &tau)| checked(part, tau)).collect::<Result<_, _>>().map(Some)
}

/// Adds the predicted errors of one of the two views of a pair.
///
/// * `side`: 0 for the first view, 1 for the second.
/// * `age`: age of the prediction, in frames.
/// * `sigma_px`: expected error of every part, in pixels of the frame.
///
/// # Errors
///
/// Returns a [`WireError`] if there are more than [`MAX_PARTS`] errors, or if one is negative or not finite.
pub fn sigma_to_pair(
    message: &mut PairPose,
    side: usize,
    age: u64,
    sigma_px: &[f32],
) -> Result<(), WireError> {
    count("n_parts", sigma_px.len(), MAX_PARTS)?;
    for (part, &sigma) in sigma_px.iter().enumerate() {
        message.sigma_px[side][part] = checked(part, sigma)?;
    }
    message.sigma_age[side] = u16::try_from(age + 1).unwrap_or(u16::MAX);
    Ok(())
}

/// Reads the predicted errors of one of the two views of a pair, and the age of the prediction in frames; `None` if there is no prediction.
///
/// * `side`: 0 for the first view, 1 for the second.
///
/// # Errors
///
/// Returns a [`WireError`] if there are more than [`MAX_PARTS`] parts, or if a value is negative or not finite.
pub fn sigma_from_pair(
    message: &PairPose,
    side: usize,
    n_parts: usize,
) -> Result<Option<(u16, Vec<f32>)>, WireError> {
    let Some(age) = message.sigma_age[side].checked_sub(1) else {
        return Ok(None);
    };
    count("n_parts", n_parts, MAX_PARTS)?;
    let sigma = message.sigma_px[side][..n_parts].iter().enumerate();
    let sigma: Result<_, _> = sigma.map(|(part, &it)| checked(part, it)).collect();
    Ok(Some((age, sigma?)))
}

fn checked(part: usize, sigma: f32) -> Result<f32, WireError> {
    finite("sigma_px", part, f64::from(sigma))?;
    if sigma < 0.0 {
        return Err(WireError::Value {
            field: "sigma_px",
            entry: part,
            got: f64::from(sigma),
            expected: "at least 0",
        });
    }
    Ok(sigma)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Few of the errors are invalid, so that a message of 26 is often valid.
    fn any_sigma() -> impl Strategy<Value = [f32; MAX_PARTS]> {
        let invalid = any::<u32>().prop_map(f32::from_bits);
        prop::array::uniform32(prop_oneof![60 => 0.0_f32..1e3, 1 => invalid])
    }

    proptest! {
        #[test]
        fn a_prediction_survives_a_round_trip(
            sigma in prop::collection::vec(0.0_f32..1e3, 1..=MAX_PARTS),
        ) {
            let message = sigma_to_message(Some(&sigma)).unwrap();
            prop_assert_eq!(sigma_from_message(&message, sigma.len()).unwrap(), Some(sigma));
        }

        #[test]
        fn any_message_is_refused_or_not_negative(
            status in 0_u32..8,
            n_parts in prop_oneof![4 => 0_u32..40, 1 => any::<u32>()],
            sigma_px in any_sigma(),
        ) {
            let message = ViewQuality { status: Status(status), n_parts, sigma_px, ..ViewQuality::default() };
            for n in [3, n_parts as usize] {
                if let Ok(Some(sigma)) = sigma_from_message(&message, n) {
                    prop_assert_eq!(sigma.len(), n);
                    prop_assert!(sigma.iter().all(|value| value.is_finite() && *value >= 0.0));
                }
            }
        }
    }

    proptest! {
        #[test]
        fn a_prediction_in_a_pair_survives_a_round_trip(
            sigma in prop::collection::vec(0.0_f32..1e3, 1..=MAX_PARTS),
            side in 0_usize..2,
            age in 0_u64..70_000,
        ) {
            let mut message = PairPose::default();
            sigma_to_pair(&mut message, side, age, &sigma).unwrap();
            let got = sigma_from_pair(&message, side, sigma.len()).unwrap();
            prop_assert_eq!(got, Some((age.min(65_534) as u16, sigma)));
            prop_assert_eq!(sigma_from_pair(&message, 1 - side, 3).unwrap(), None);
        }

        #[test]
        fn any_prediction_in_a_pair_is_refused_or_not_negative(
            sigma_age in any::<[u16; 2]>(),
            sigma_px in any_sigma(),
            n_parts in 0_usize..40,
        ) {
            let sigma_px = [sigma_px; 2];
            let message = PairPose { sigma_age, sigma_px, ..PairPose::default() };
            for side in 0..2 {
                if let Ok(Some((_, sigma))) = sigma_from_pair(&message, side, n_parts) {
                    prop_assert_eq!(sigma.len(), n_parts);
                    prop_assert!(sigma.iter().all(|value| value.is_finite() && *value >= 0.0));
                }
            }
        }
    }

    #[test]
    fn a_missing_prediction_differs_from_a_prediction_of_zero() {
        let message = sigma_to_message(None).unwrap();
        assert_eq!(message.status, Status::NO_PREDICTION);
        assert_eq!(sigma_from_message(&message, 26).unwrap(), None);
    }

    #[test]
    fn thresholds_are_read_with_their_prediction_only() {
        let mut message = sigma_to_message(Some(&[1.0, 2.0])).unwrap();
        assert_eq!(tau_from_message(&message, 2).unwrap(), None);
        tau_to_message(&mut message, &[3.0, 4.0]).unwrap();
        assert_eq!(tau_from_message(&message, 2).unwrap(), Some(vec![3.0, 4.0]));
        let error = tau_from_message(&message, 3).unwrap_err().to_string();
        assert_eq!(error, "n_thresholds is 2, expected 3");
        assert!(tau_to_message(&mut message, &[f32::NAN]).is_err());
        message.status = Status::NO_PREDICTION;
        assert_eq!(tau_from_message(&message, 2).unwrap(), None);
    }

    #[test]
    fn refuses_a_negative_error() {
        let got = sigma_to_message(Some(&[1.0, -1.0])).unwrap_err();
        assert_eq!(
            got.to_string(),
            "sigma_px of entry 1 is -1, expected at least 0"
        );
    }
}
