//! The result of fusing all views at once, as messages of pairs.

use messages::PairPose;
use multiview::{AllViewsEstimate, PairEstimate, PairStart};
use pipeline::{AllViewsHypothesis, AllViewsResult, PairResult};

use crate::error::{equal, index};
use crate::{WireError, pair_to_message};

/// Writes the result of all views, or that there is no result. The caller fills in stamps and timing.
///
/// Message `v - 1` is about view `v` and the first view of the result. Each message contains the energy of all views. The message has no
/// result if view `v` was not solved, or is the first view itself.
///
/// * `n_views`: number of views of the rig.
/// * `views_present`: bit `v` is set if view `v` delivered a pose in time.
///
/// # Errors
///
/// Returns a [`WireError`] if something does not fit into a message.
pub fn all_views_to_messages(
    n_views: usize,
    answer: Option<&AllViewsResult>,
    views_present: u32,
) -> Result<Vec<PairPose>, WireError> {
    let message = |view: usize| {
        let place = |all_views_result: &AllViewsResult| {
            all_views_result.views.iter().position(|other| *other == view)
        };
        let found =
            answer.and_then(|answer| Some((answer, place(answer).filter(|place| *place > 0)?)));
        let Some((answer, place)) = found else {
            return pair_to_message([view - 1, view], None, views_present);
        };
        let pair = beside_the_first(answer, place);
        let mut message = pair_to_message(pair.views, Some(&pair), views_present)?;
        for (slot, of) in message.hypotheses.iter_mut().zip(&answer.hypotheses) {
            slot.n_iterations = of.estimate.iterations.len() as u32;
        }
        Ok(message)
    };
    (1..n_views).map(message).collect()
}

/// Checks which views a message is about: they must be view `v + 1` and an earlier view, where `v` is `view` of the message's stamp.
///
/// * `n_views`: number of views of the rig.
///
/// # Errors
///
/// Returns a [`WireError`] if there is no such view, or if the message is about other views.
pub fn check_all_views(message: &PairPose, n_views: usize) -> Result<(), WireError> {
    let nth = index(
        "answer",
        0,
        message.stamp.view as usize,
        n_views.saturating_sub(1),
    )?;
    let [first, second] = message.views.map(|view| view as usize);
    let sender = |field, got, expected| {
        Err(WireError::Sender {
            field,
            got,
            expected,
        })
    };
    if second != nth + 1 {
        return sender("view of the answer", second, nth + 1);
    }
    if first > nth {
        return sender("first view of the answer", first, nth);
    }
    Ok(())
}

/// Returns the pair of the first view of a result with the view at `place`.
fn beside_the_first(answer: &AllViewsResult, place: usize) -> PairResult {
    let hypothesis = |all_views_hypothesis: &AllViewsHypothesis| PairEstimate {
        start: PairStart {
            candidates: [0, place].map(|it_is| all_views_hypothesis.candidates[it_is]),
            exchanged: all_views_hypothesis.exchanged[place] != all_views_hypothesis.exchanged[0],
        },
        energy: all_views_hypothesis.estimate.energy,
        iterations: Vec::new(),
        converged: all_views_hypothesis.estimate.converged,
        active: Vec::new(),
        poses: [0, place].map(|it_is| all_views_hypothesis.estimate.poses[it_is].clone()),
    };
    PairResult {
        views: [answer.views[0], answer.views[place]],
        hypotheses: answer.hypotheses.iter().map(hypothesis).collect(),
    }
}

/// Combines the messages into the result of all views; `None` if there is no result.
///
/// The messages contain neither the iterations nor the fraction of active terms, so the list of iterations in the result is empty, and the
/// fraction is 0.
///
/// * `pairs`: pairs of one frame, as [`pair_from_message`](crate::pair_from_message) reads them, in ascending order of
///   their second view.
///
/// # Errors
///
/// Returns a [`WireError`] if the pairs do not belong to one result: they differ in the first view, the energy or the number of hypotheses,
/// or are out of order.
pub fn all_views_from_pairs(pairs: &[PairResult]) -> Result<Option<AllViewsResult>, WireError> {
    let Some(first) = pairs.first() else {
        return Ok(None);
    };
    let mut answer = AllViewsResult {
        views: vec![first.views[0]],
        hypotheses: first.hypotheses.iter().map(alone).collect(),
    };
    for (entry, pair) in pairs.iter().enumerate() {
        equal("first view", pair.views[0], first.views[0])?;
        let last = answer.views[entry];
        index("view before", entry, last, pair.views[1])?;
        equal(
            "n_hypotheses",
            pair.hypotheses.len(),
            first.hypotheses.len(),
        )?;
        answer.views.push(pair.views[1]);
        for (into, from) in answer.hypotheses.iter_mut().zip(&pair.hypotheses) {
            if from.energy.to_bits() != into.estimate.energy.to_bits() {
                return Err(WireError::Value {
                    field: "energy",
                    entry,
                    got: from.energy,
                    expected: "that of the other views",
                });
            }
            into.exchanged.push(from.start.exchanged);
            into.candidates.push(from.start.candidates[1]);
            into.estimate.poses.push(from.poses[1].clone());
        }
    }
    Ok(Some(answer))
}

/// Returns a hypothesis that contains only the first view.
fn alone(it: &PairEstimate) -> AllViewsHypothesis {
    AllViewsHypothesis {
        exchanged: vec![false],
        candidates: vec![it.start.candidates[0]],
        estimate: AllViewsEstimate {
            energy: it.energy,
            iterations: Vec::new(),
            converged: it.converged,
            active: 0.0,
            poses: vec![it.poses[0].clone()],
        },
    }
}

#[cfg(test)]
mod tests {
    use fmp::Pose;
    use messages::Status;
    use proptest::prelude::*;

    use super::*;
    use crate::pair_from_message;
    use crate::testing::{any_pose, plans_of};

    const N_VIEWS: usize = 5;

    /// Results of views 0 to 4, some of which are missing.
    fn any_answer() -> impl Strategy<Value = AllViewsResult> {
        let views = prop::sample::subsequence((0..N_VIEWS).collect::<Vec<_>>(), 2..=N_VIEWS);
        views.prop_flat_map(|views| {
            let n = views.len();
            let hypothesis = (
                prop::collection::vec(any_pose(), n),
                prop::collection::vec(any::<bool>(), n),
                -5.0..5.0,
                any::<bool>(),
            );
            let hypotheses = prop::collection::vec(hypothesis.prop_map(any_hypothesis), 1..=2);
            hypotheses.prop_map(move |hypotheses| AllViewsResult {
                views: views.clone(),
                hypotheses,
            })
        })
    }

    fn any_hypothesis(
        (poses, mut exchanged, energy, converged): (Vec<Pose>, Vec<bool>, f64, bool),
    ) -> AllViewsHypothesis {
        exchanged[0] = false;
        AllViewsHypothesis {
            candidates: (0..poses.len()).map(|i| i % 8).collect(),
            exchanged,
            estimate: AllViewsEstimate {
                energy,
                iterations: Vec::new(),
                converged,
                active: 0.0,
                poses,
            },
        }
    }

    fn read(messages: &[PairPose]) -> Vec<PairResult> {
        let plans = plans_of(N_VIEWS);
        let read = messages.iter().map(|message| pair_from_message(message, &plans));
        read.filter_map(|pair| pair.unwrap()).collect()
    }

    proptest! {
        #[test]
        fn a_result_survives_a_round_trip(answer in any_answer()) {
            let messages = all_views_to_messages(N_VIEWS, Some(&answer), 0b11111).unwrap();
            prop_assert_eq!(messages.len(), N_VIEWS - 1);
            prop_assert_eq!(all_views_from_pairs(&read(&messages)).unwrap(), Some(answer));
        }

        #[test]
        fn a_view_whose_message_is_lost_is_left_out(answer in any_answer(), lost in 1..N_VIEWS) {
            let mut messages = all_views_to_messages(N_VIEWS, Some(&answer), 0b11111).unwrap();
            messages.remove(lost - 1);
            let first = answer.views[0];
            let expected = answer.only(|view| view == first || view != lost);
            prop_assert_eq!(all_views_from_pairs(&read(&messages)).unwrap(), expected);
        }
    }

    #[test]
    fn a_missing_result_is_sent_as_such() {
        let messages = all_views_to_messages(3, None, 0b001).unwrap();
        assert_eq!(messages.len(), 2);
        assert!(messages.iter().all(|message| message.status == Status::TOO_FEW_VIEWS));
        assert_eq!(all_views_from_pairs(&read(&messages)).unwrap(), None);
    }

    /// The pairs of views 0, 1 and 2.
    fn pairs() -> [PairResult; 2] {
        let pose = || Pose {
            parts: vec![fmp::Placement::default(); 3],
            ..Pose::default()
        };
        let poses = [pose(), pose(), pose()].to_vec();
        let hypothesis = any_hypothesis((poses, vec![false; 3], 2.0, true));
        let answer = AllViewsResult {
            views: vec![0, 1, 2],
            hypotheses: vec![hypothesis],
        };
        [1, 2].map(|place| beside_the_first(&answer, place))
    }

    #[test]
    fn refuses_messages_of_different_results() {
        let change = |change: fn(&mut [PairResult; 2])| {
            let mut pairs = pairs();
            change(&mut pairs);
            all_views_from_pairs(&pairs).unwrap_err().to_string()
        };
        let got = change(|pairs| pairs[1].views = [1, 2]);
        assert_eq!(got, "first view is 1, expected 0");
        let got = change(|pairs| pairs[1].views = [0, 1]);
        assert_eq!(got, "view before of entry 1 is 1, but the limit is 1");
        let got = change(|pairs| pairs[1].hypotheses.clear());
        assert_eq!(got, "n_hypotheses is 0, expected 1");
        let got = change(|pairs| pairs[1].hypotheses[0].energy = 3.0);
        assert_eq!(
            got,
            "energy of entry 1 is 3, expected that of the other views"
        );
        all_views_from_pairs(&pairs()).unwrap();
    }
}
