//! The result of fusing a pair of views.

use fmp::Pose;
use messages::{PairHypothesis, PairPose, Status};
use multiview::{PairEstimate, PairStart, ViewPlan};
use pipeline::PairResult;

use crate::error::{count, equal, finite, index};
use crate::{WireError, pose_from_message, pose_to_message};

/// Writes the result of a pair, or that there is no result. The caller fills in stamp and timing.
///
/// The message contains only the length of [`PairEstimate::iterations`].
///
/// * `views_present`: bit `v` is set if view `v` delivered a pose in time.
///
/// # Errors
///
/// Returns a [`WireError`] if something does not fit into the message.
pub fn pair_to_message(
    views: [usize; 2],
    answer: Option<&PairResult>,
    views_present: u32,
) -> Result<PairPose, WireError> {
    let mut message = PairPose {
        status: Status::TOO_FEW_VIEWS,
        views: views.map(|view| view as u32),
        views_present,
        ..PairPose::default()
    };
    let Some(answer) = answer else {
        return Ok(message);
    };
    message.status = Status::OK;
    let most = message.hypotheses.len();
    message.n_hypotheses = count("n_hypotheses", answer.hypotheses.len(), most)? as u32;
    for (slot, estimate) in message.hypotheses.iter_mut().zip(&answer.hypotheses) {
        *slot = hypothesis(estimate)?;
    }
    Ok(message)
}

fn hypothesis(estimate: &PairEstimate) -> Result<PairHypothesis, WireError> {
    count("active", estimate.active.len(), u64::BITS as usize)?;
    let [first, second] = estimate.start.candidates;
    let bits = estimate.active.iter().enumerate();
    Ok(PairHypothesis {
        energy: finite("energy", 0, estimate.energy)?,
        n_iterations: estimate.iterations.len() as u32,
        converged: u32::from(estimate.converged),
        exchanged: u32::from(estimate.start.exchanged),
        start: [first as u8, second as u8],
        active_parts: bits.fold(0, |mask, (part, on)| mask | u64::from(*on) << part),
        poses: [
            pose_to_message(&estimate.poses[0])?,
            pose_to_message(&estimate.poses[1])?,
        ],
        ..PairHypothesis::default()
    })
}

/// Reads the result of a pair; `None` unless the status is [`Status::OK`].
///
/// The iterations of the result are empty.
///
/// * `plans`: plans of the views of the rig.
///
/// # Errors
///
/// Returns a [`WireError`] if the views are not two views of the rig in ascending order, or if a pose is malformed.
pub fn pair_from_message(
    message: &PairPose,
    plans: &[impl AsRef<ViewPlan>],
) -> Result<Option<PairResult>, WireError> {
    if message.status != Status::OK {
        return Ok(None);
    }
    let [first, second] = message.views.map(|view| view as usize);
    index("views", 1, second, plans.len())?;
    index("views", 0, first, second)?;
    let most = message.hypotheses.len();
    let n = count("n_hypotheses", message.n_hypotheses as usize, most)?;
    let plans = [plans[first].as_ref(), plans[second].as_ref()];
    let hypotheses = message.hypotheses[..n]
        .iter()
        .map(|hypothesis| estimate(hypothesis, plans))
        .collect::<Result<_, _>>()?;
    Ok(Some(PairResult {
        views: [first, second],
        hypotheses,
    }))
}

/// Checks that a result is about the views of its pair.
///
/// * `pairs`: all pairs of the deployment.
///
/// # Errors
///
/// Returns a [`WireError`] if there is no such pair, or if it has other views.
pub fn check_views(message: &PairPose, pairs: &[[usize; 2]]) -> Result<(), WireError> {
    let pair = index("pair", 0, message.stamp.view as usize, pairs.len())?;
    for (got, expected) in message.views.iter().zip(pairs[pair]) {
        if *got as usize != expected {
            return Err(WireError::Sender {
                field: "view of the pair",
                got: *got as usize,
                expected,
            });
        }
    }
    Ok(())
}

fn estimate(message: &PairHypothesis, plans: [&ViewPlan; 2]) -> Result<PairEstimate, WireError> {
    let read = |side: usize| -> Result<Pose, WireError> {
        pose_from_message(
            &message.poses[side],
            plans[side].model(),
            plans[side].layout(),
        )
    };
    let poses = [read(0)?, read(1)?];
    equal("n_parts", poses[1].parts.len(), poses[0].parts.len())?;
    Ok(PairEstimate {
        start: PairStart {
            candidates: message.start.map(usize::from),
            exchanged: message.exchanged == 1,
        },
        energy: finite("energy", 0, message.energy)?,
        iterations: Vec::new(),
        converged: message.converged == 1,
        active: (0..poses[0].parts.len())
            .map(|part| message.active_parts >> part & 1 == 1)
            .collect(),
        poses,
    })
}

#[cfg(test)]
mod tests {
    use messages::Refusal;
    use proptest::prelude::*;

    use super::*;
    use crate::testing::{any_pose, plans, pose_message};

    fn any_estimate() -> impl Strategy<Value = PairEstimate> {
        let flags = (
            any::<bool>(),
            any::<bool>(),
            prop::collection::vec(any::<bool>(), 3),
        );
        (any_pose(), any_pose(), -5.0..5.0, 0_usize..8, flags).prop_map(
            |(first, second, energy, candidate, (exchanged, converged, active))| PairEstimate {
                start: PairStart {
                    candidates: [candidate, 0],
                    exchanged,
                },
                energy,
                iterations: Vec::new(),
                converged,
                active,
                poses: [first, second],
            },
        )
    }

    proptest! {
        #[test]
        fn a_result_survives_a_round_trip(
            hypotheses in prop::collection::vec(any_estimate(), 1..=2),
        ) {
            let answer = PairResult { views: [0, 1], hypotheses };
            let message = pair_to_message(answer.views, Some(&answer), 0b11).unwrap();
            prop_assert_eq!(pair_from_message(&message, &plans()).unwrap(), Some(answer));
        }

        #[test]
        fn any_message_is_refused_or_names_two_views_of_the_rig(
            poses in prop::array::uniform2(pose_message()),
            views in prop_oneof![4 => Just([0_u32, 1]), 1 => prop::array::uniform2(0_u32..4), 1 => any::<[u32; 2]>()],
            n_hypotheses in prop_oneof![4 => 0_u32..4, 1 => any::<u32>()],
            energy in prop_oneof![4 => -9.0..9.0, 1 => any::<u64>().prop_map(f64::from_bits)],
        ) {
            let hypothesis = PairHypothesis {
                energy,
                poses,
                ..PairHypothesis::default()
            };
            let message = PairPose {
                views,
                n_hypotheses,
                hypotheses: [hypothesis; 2],
                ..PairPose::default()
            };
            if let Ok(Some(answer)) = pair_from_message(&message, &plans()) {
                prop_assert_eq!(answer.views, [0, 1]);
                prop_assert!(answer.hypotheses.iter().all(|hypothesis| hypothesis.energy.is_finite()));
            }
        }
    }

    #[test]
    fn a_missing_result_is_sent_as_such() {
        let message = pair_to_message([0, 1], None, 0b01).unwrap();
        assert_eq!(message.status, Status::TOO_FEW_VIEWS);
        assert_eq!(message.views_present, 0b01);
        assert_eq!(pair_from_message(&message, &plans()).unwrap(), None);
    }

    #[test]
    fn refuses_views_out_of_order() {
        let mut message = pair_to_message([0, 1], None, 0).unwrap();
        message.status = Status::OK;
        message.views = [1, 1];
        let got = pair_from_message(&message, &plans()).unwrap_err();
        assert_eq!(got.to_string(), "views of entry 0 is 1, but the limit is 1");
    }

    #[test]
    fn refuses_an_energy_that_is_not_a_number() {
        let message = PairPose {
            views: [0, 1],
            n_hypotheses: 1,
            hypotheses: [PairHypothesis {
                energy: f64::NAN,
                poses: [pose_to_message(&pose()).unwrap(); 2],
                ..PairHypothesis::default()
            }; 2],
            ..PairPose::default()
        };
        let got = pair_from_message(&message, &plans()).unwrap_err();
        assert!(matches!(
            got,
            WireError::Value {
                field: "energy",
                ..
            }
        ));
    }

    fn pose() -> Pose {
        Pose {
            parts: vec![fmp::Placement::default(); 3],
            ..Pose::default()
        }
    }

    #[test]
    fn a_result_of_other_views_than_its_pair_is_refused() {
        let pairs = [[0, 1], [0, 2], [1, 2]];
        let mut message = pair_to_message([0, 2], None, 0).unwrap();
        message.stamp.view = 1;
        check_views(&message, &pairs).unwrap();
        for (pair, cause) in [
            (0, Refusal::Sender),
            (2, Refusal::Sender),
            (3, Refusal::Index),
            (u32::MAX, Refusal::Index),
        ] {
            message.stamp.view = pair;
            let error = check_views(&message, &pairs).unwrap_err();
            assert_eq!(error.refusal(), cause, "{error}");
        }
    }
}
