//! Poses and the candidates of a view.

use fmp::{Layout, LocalScore, Model, Placement, Pose};
use messages::{
    LocalMessage, MAX_CANDIDATES, MAX_KEYPOINTS, MAX_PARTS, MAX_VIEW_KEYPOINTS, PoseMessage,
    Sightings, Status,
};
use multiview::FrontEvidence;
use pipeline::ExtraKeypoint;

use crate::WireError;
use crate::error::{count, equal, finite, index};
use crate::stamp::at_most;

/// Maximum time from the instant of a frame to its picture. At one frame in ten seconds, this is more than half a frame period.
const MOST_SKEW_NANOS: u64 = 10_000_000_000;

/// Writes a pose.
///
/// # Errors
///
/// Returns [`WireError::TooMany`] if the pose has more than [`MAX_PARTS`] parts.
pub fn pose_to_message(pose: &Pose) -> Result<PoseMessage, WireError> {
    let n_parts = count("n_parts", pose.parts.len(), MAX_PARTS)?;
    let mut message = PoseMessage {
        score: pose.score,
        level: pose.level,
        n_parts: n_parts as u16,
        ..PoseMessage::default()
    };
    for (part, placement) in pose.parts.iter().enumerate() {
        message.x[part] = placement.x;
        message.y[part] = placement.y;
        message.mixture[part] = placement.mixture;
    }
    Ok(message)
}

/// Reads a pose, which must be within `layout` and have the parts of `model`.
///
/// # Errors
///
/// Returns a [`WireError`] if the number of parts, the level, a cell or a type does not exist in the model or the layout, or if the score
/// is not finite.
pub fn pose_from_message(
    message: &PoseMessage,
    model: &Model,
    layout: &Layout,
) -> Result<Pose, WireError> {
    equal("n_parts", usize::from(message.n_parts), model.n_parts())?;
    let n_parts = count("n_parts", model.n_parts(), MAX_PARTS)?;
    finite("score", 0, f64::from(message.score))?;
    let level = index("level", 0, usize::from(message.level), layout.levels.len())?;
    let [rows, cols] = [layout.levels[level].rows, layout.levels[level].cols];
    let parts = (0..n_parts)
        .map(|part| {
            let (x, y) = (message.x[part], message.y[part]);
            let mixture = message.mixture[part];
            index("x", part, usize::from(x), cols)?;
            index("y", part, usize::from(y), rows)?;
            index("mixture", part, usize::from(mixture), model.n_types(part))?;
            Ok(Placement { x, y, mixture })
        })
        .collect::<Result<_, WireError>>()?;
    Ok(Pose {
        score: message.score,
        level: message.level,
        parts,
    })
}

/// Writes the candidates of a view, best first, and the image size `[width, height]`. The caller
/// fills in stamp and timing.
///
/// If there are no candidates, the status is [`Status::NO_DETECTION`].
///
/// # Errors
///
/// Returns [`WireError::TooMany`] if there are more than [`MAX_CANDIDATES`] candidates, or too many parts.
pub fn candidates_to_message(
    candidates: &[Pose],
    image_size: [usize; 2],
) -> Result<Sightings, WireError> {
    let n_candidates = count("n_candidates", candidates.len(), MAX_CANDIDATES)?;
    let mut message = Sightings {
        status: if n_candidates == 0 {
            Status::NO_DETECTION
        } else {
            Status::OK
        },
        n_candidates: n_candidates as u32,
        width: image_size[0] as u32,
        height: image_size[1] as u32,
        ..Sightings::default()
    };
    for (slot, pose) in message.candidates.iter_mut().zip(candidates) {
        *slot = pose_to_message(pose)?;
    }
    Ok(message)
}

/// Reads the candidates of a view, best first. The list is empty unless the status is [`Status::OK`].
///
/// # Errors
///
/// Returns a [`WireError`] if the image size is not that of `layout`, or if a candidate is malformed.
pub fn candidates_from_message(
    message: &Sightings,
    model: &Model,
    layout: &Layout,
) -> Result<Vec<Pose>, WireError> {
    if message.status != Status::OK {
        return Ok(Vec::new());
    }
    equal("width", message.width as usize, layout.image_size[0])?;
    equal("height", message.height as usize, layout.image_size[1])?;
    let n = count(
        "n_candidates",
        message.n_candidates as usize,
        MAX_CANDIDATES,
    )?;
    message.candidates[..n]
        .iter()
        .map(|candidate| pose_from_message(candidate, model, layout))
        .collect()
}

/// Returns the time from the instant of the frame until the picture of the view was taken, in seconds.
///
/// # Errors
///
/// Returns [`WireError::Frame`] if it is more than ten seconds.
pub fn skew_from_message(message: &Sightings) -> Result<f64, WireError> {
    at_most(
        "skew_nanos",
        message.skew_nanos.unsigned_abs(),
        MOST_SKEW_NANOS,
    )?;
    Ok(message.skew_nanos as f64 * 1e-9)
}

/// Adds, for every candidate, the evidence of the picture about the direction in which the person faces.
///
/// # Errors
///
/// Returns a [`WireError`] if there are more entries than the message has room for candidates, or if a number is not finite.
pub fn front_to_message(message: &mut Sightings, front: &[FrontEvidence]) -> Result<(), WireError> {
    count("front", front.len(), MAX_CANDIDATES)?;
    for (candidate, (slot, evidence)) in message.front.iter_mut().zip(front).enumerate() {
        *slot = checked_front(candidate, *evidence)?;
    }
    Ok(())
}

/// Reads, for every candidate, the evidence of the picture about the direction in which the person faces.
///
/// * `n_candidates`: number of candidates of the message.
///
/// # Errors
///
/// Returns a [`WireError`] if there are more than [`MAX_CANDIDATES`] candidates, or if a number is not finite.
pub fn front_from_message(
    message: &Sightings,
    n_candidates: usize,
) -> Result<Vec<FrontEvidence>, WireError> {
    let n = count("front", n_candidates, MAX_CANDIDATES)?;
    let of_candidates = message.front[..n].iter().enumerate();
    of_candidates.map(|(candidate, it)| checked_front(candidate, *it)).collect()
}

fn checked_front(candidate: usize, evidence: FrontEvidence) -> Result<FrontEvidence, WireError> {
    for number in evidence {
        finite("front", candidate, f64::from(number))?;
    }
    Ok(evidence)
}

/// Adds the extra keypoints of the first candidates: of as many as fit completely into the message.
///
/// * `n`: number of extra keypoints of a candidate.
///
/// # Errors
///
/// Returns a [`WireError`] if a candidate has more than [`MAX_KEYPOINTS`] keypoints, or if a number is not finite.
pub fn extras_to_message(
    message: &mut Sightings,
    n: usize,
    extras: &[ExtraKeypoint],
) -> Result<(), WireError> {
    message.n_keypoints = count("n_keypoints", n, MAX_KEYPOINTS)? as u32;
    let n_sent = room_of(n).min(extras.len());
    for (entry, (slot, it)) in message.keypoints.iter_mut().zip(&extras[..n_sent]).enumerate() {
        if let Some(([x, y], sigma)) = it {
            *slot = [*x as f32, *y as f32, *sigma as f32];
            checked_extra(entry, slot)?;
        }
    }
    Ok(())
}

/// Returns the number of entries that are used if only candidates with all `n` extra keypoints are stored.
fn room_of(n: usize) -> usize {
    MAX_VIEW_KEYPOINTS - MAX_VIEW_KEYPOINTS % n.max(1)
}

/// Reads the extra keypoints of the candidates, one candidate after the other. The keypoints of the last candidates may be missing.
///
/// * `n`: number of extra keypoints of a candidate in the deployment.
/// * `n_candidates`: number of candidates of the message.
///
/// # Errors
///
/// Returns a [`WireError`] if the number of keypoints is not that of the deployment, or if a number is not finite.
pub fn extras_from_message(
    message: &Sightings,
    n: usize,
    n_candidates: usize,
) -> Result<Vec<ExtraKeypoint>, WireError> {
    if n_candidates == 0 {
        return Ok(Vec::new());
    }
    equal("n_keypoints", message.n_keypoints as usize, n)?;
    let n_candidates = count("n_candidates", n_candidates, MAX_CANDIDATES)?;
    let n_sent = (n * n_candidates).min(room_of(n));
    let sent = message.keypoints[..n_sent].iter().enumerate();
    sent.map(|(entry, it)| checked_extra(entry, it)).collect()
}

fn checked_extra(entry: usize, it: &[f32; 3]) -> Result<ExtraKeypoint, WireError> {
    let [x, y, sigma] = it.map(f64::from);
    for number in [x, y, sigma] {
        finite("keypoints", entry, number)?;
    }
    Ok((sigma > 0.0).then_some(([x, y], sigma)))
}

/// Adds the local scores of the parts of the first candidate.
///
/// # Errors
///
/// Returns a [`WireError`] if there are more than [`MAX_PARTS`] scores, or if a number is not finite.
pub fn local_to_message(message: &mut Sightings, scores: &[LocalScore]) -> Result<(), WireError> {
    count("local", scores.len(), MAX_PARTS)?;
    for (part, (slot, score)) in message.local.iter_mut().zip(scores).enumerate() {
        let LocalScore {
            response,
            contrast,
            margin,
        } = checked(part, *score)?;
        *slot = LocalMessage {
            response,
            contrast,
            margin,
        };
    }
    Ok(())
}

/// Reads the local scores of the parts of the first candidate.
///
/// # Errors
///
/// Returns a [`WireError`] if there are more than [`MAX_PARTS`] parts, or if a number is not finite.
pub fn local_from_message(
    message: &Sightings,
    n_parts: usize,
) -> Result<Vec<LocalScore>, WireError> {
    let n = count("local", n_parts, MAX_PARTS)?;
    let parts = message.local[..n].iter().enumerate();
    let score = |(part, it): (usize, &LocalMessage)| {
        let score = LocalScore {
            response: it.response,
            contrast: it.contrast,
            margin: it.margin,
        };
        checked(part, score)
    };
    parts.map(score).collect()
}

fn checked(part: usize, score: LocalScore) -> Result<LocalScore, WireError> {
    for number in [score.response, score.contrast, score.margin] {
        finite("local", part, f64::from(number))?;
    }
    Ok(score)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::testing::{any_pose, layout, model, pose_message};

    #[test]
    fn extra_keypoints_of_whole_candidates_survive_a_round_trip() {
        let extras: Vec<ExtraKeypoint> = (0..500_u32)
            .map(|i| (i % 3 > 0).then_some(([f64::from(i), 2.0], 0.5)))
            .collect();
        let mut message = Sightings::default();
        extras_to_message(&mut message, 100, &extras).unwrap();
        let back = extras_from_message(&message, 100, 5).unwrap();
        assert_eq!(back, extras[..300], "there is room for three");
        assert_eq!(extras_from_message(&message, 100, 0).unwrap(), []);
        assert_eq!(extras_from_message(&message, 100, 2).unwrap().len(), 200);
        extras_from_message(&message, 99, 5).unwrap_err();
        message.keypoints[1][2] = f32::NAN;
        extras_from_message(&message, 100, 5).unwrap_err();
        extras_to_message(&mut message, MAX_KEYPOINTS + 1, &extras).unwrap_err();
    }

    proptest! {
        #[test]
        fn a_pose_survives_a_round_trip(pose in any_pose()) {
            let message = pose_to_message(&pose).unwrap();
            prop_assert_eq!(pose_from_message(&message, &model(), &layout()).unwrap(), pose);
        }

        #[test]
        fn candidates_keep_their_order(
            poses in prop::collection::vec(any_pose(), 0..=MAX_CANDIDATES),
        ) {
            let message = candidates_to_message(&poses, layout().image_size).unwrap();
            prop_assert_eq!(message.status == Status::OK, !poses.is_empty());
            let back = candidates_from_message(&message, &model(), &layout()).unwrap();
            prop_assert_eq!(back, poses);
        }

        #[test]
        fn any_message_is_refused_or_within_the_layout(
            message in pose_message(),
            status in 0_u32..8,
            n_candidates in prop_oneof![4 => 0_u32..10, 1 => any::<u32>()],
        ) {
            let (model, layout) = (model(), layout());
            if let Ok(pose) = pose_from_message(&message, &model, &layout) {
                prop_assert!(pose.centres(&model, &layout).iter().flatten().all(|centre| centre.is_finite()));
                let level = &layout.levels[usize::from(pose.level)];
                for part in &pose.parts {
                    prop_assert!(usize::from(part.x) < level.cols && usize::from(part.y) < level.rows);
                }
            }
            let view = Sightings {
                status: Status(status),
                n_candidates,
                width: 80,
                height: 60,
                candidates: [message; MAX_CANDIDATES],
                ..Sightings::default()
            };
            if let Ok(poses) = candidates_from_message(&view, &model, &layout) {
                prop_assert!(poses.len() <= MAX_CANDIDATES);
            }
        }
    }

    #[test]
    fn local_scores_survive_a_round_trip_and_must_be_finite() {
        let score = LocalScore {
            response: 1.5,
            contrast: -2.0,
            margin: 0.25,
        };
        let mut message = Sightings::default();
        local_to_message(&mut message, &[score, LocalScore::default(), score]).unwrap();
        let back = local_from_message(&message, 3).unwrap();
        assert_eq!(back, [score, LocalScore::default(), score]);
        message.local[1].margin = f32::NAN;
        let error = local_from_message(&message, 3).unwrap_err().to_string();
        assert_eq!(error, "local of entry 1 is NaN, expected a finite number");
        let error = local_from_message(&message, MAX_PARTS + 1).unwrap_err();
        assert_eq!(error.to_string(), "local is 33, but the limit is 32");
    }

    fn sent() -> PoseMessage {
        let pose = Pose {
            score: 1.0,
            level: 1,
            parts: vec![Placement::default(); model().n_parts()],
        };
        pose_to_message(&pose).unwrap()
    }

    fn refused(message: PoseMessage) -> WireError {
        pose_from_message(&message, &model(), &layout()).unwrap_err()
    }

    #[test]
    fn refuses_the_pose_of_another_model() {
        let got = refused(PoseMessage {
            n_parts: 7,
            ..sent()
        });
        assert_eq!(got.to_string(), "n_parts is 7, expected 3");
    }

    #[test]
    fn refuses_a_missing_level() {
        let limit = layout().levels.len();
        let level = limit as u16;
        let got = refused(PoseMessage { level, ..sent() });
        assert_eq!(
            got,
            WireError::OutOfRange {
                field: "level",
                entry: 0,
                got: limit,
                limit
            }
        );
    }

    #[test]
    fn refuses_a_cell_outside_the_map() {
        let mut message = sent();
        let level = layout().levels[1];
        message.x[2] = level.cols as u16;
        assert!(matches!(
            refused(message),
            WireError::OutOfRange {
                field: "x",
                entry: 2,
                ..
            }
        ));
        message.x[2] = 0;
        message.y[1] = level.rows as u16;
        assert!(matches!(
            refused(message),
            WireError::OutOfRange {
                field: "y",
                entry: 1,
                ..
            }
        ));
    }

    #[test]
    fn refuses_a_type_that_the_part_does_not_have() {
        let mut message = sent();
        message.mixture[0] = 1;
        assert!(matches!(
            refused(message),
            WireError::OutOfRange {
                field: "mixture",
                entry: 0,
                got: 1,
                limit: 1
            }
        ));
    }

    #[test]
    fn refuses_a_score_that_is_not_a_number() {
        let got = refused(PoseMessage {
            score: f32::NAN,
            ..sent()
        });
        assert!(matches!(got, WireError::Value { field: "score", .. }));
    }

    #[test]
    fn refuses_candidates_of_another_image_size() {
        let pose = pose_from_message(&sent(), &model(), &layout()).unwrap();
        let message = candidates_to_message(&[pose], [81, 60]).unwrap();
        let got = candidates_from_message(&message, &model(), &layout()).unwrap_err();
        assert_eq!(got.to_string(), "width is 81, expected 80");
    }

    #[test]
    fn refuses_to_send_more_than_fits() {
        let pose = Pose {
            parts: vec![Placement::default(); MAX_PARTS + 1],
            ..Pose::default()
        };
        assert!(matches!(
            pose_to_message(&pose),
            Err(WireError::TooMany {
                got: 33,
                limit: 32,
                ..
            })
        ));
        let many = vec![Pose::default(); MAX_CANDIDATES + 1];
        assert!(matches!(
            candidates_to_message(&many, [80, 60]),
            Err(WireError::TooMany {
                field: "n_candidates",
                ..
            })
        ));
    }
}
