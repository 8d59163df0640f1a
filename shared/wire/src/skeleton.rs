//! The result: joints in the world and the views that were used.

use geometry::Triangulated;
use messages::{
    FusedView, Joint3d, Kept, MAX_JOINTS, MAX_KEYPOINTS, MAX_PARTS, MAX_VIEWS, Pose3d, Sides,
    Stamp, Status, Timing,
};
use pipeline::{NoJoint, Skeleton};

use crate::WireError;
use crate::error::{count, equal, finite};

/// Writes a skeleton; the caller fills in stamp and timing.
///
/// * `views_present`: bit `v` is set if view `v` delivered a pose in time.
///
/// # Errors
///
/// [`WireError::TooMany`] if there are more joints, views or parts than fit.
pub fn skeleton_to_message(skeleton: &Skeleton, views_present: u32) -> Result<Pose3d, WireError> {
    let n_joints = count("n_joints", skeleton.joints.len(), MAX_JOINTS)?;
    let n_views = count("n_views", skeleton.views.len(), MAX_VIEWS)?;
    let mut message = empty();
    message.views_present = views_present;
    message.n_joints = n_joints as u32;
    message.n_views = n_views as u32;
    message.n_pairs = skeleton.n_pairs as u32;
    message.n_people = skeleton.n_people as u32;
    message.facing_margin = skeleton.facing_margin;
    (message.sides, message.sides_margin) = match skeleton.sides {
        None => (Sides::AS_SEEN, 0.0),
        Some(it) if it.unsure => (Sides::UNSURE, it.margin),
        Some(it) => (Sides::SURE, it.margin),
    };
    message.kept = match skeleton.kept {
        pipeline::Kept::Solved => Kept::SOLVED,
        pipeline::Kept::Start => Kept::START,
    };
    for (slot, joint) in message.joints.iter_mut().zip(&skeleton.joints) {
        *slot = joint_to_message(joint);
        message.views_used |= slot.views_used;
    }
    for (slot, view) in message.views.iter_mut().zip(&skeleton.views) {
        *slot = view.as_ref().map_or(Ok(absent()), view_to_message)?;
    }
    if let Some(body) = &skeleton.body {
        message.stature_m = body.stature_m.unwrap_or(0.0);
        message.body_deviation = body.deviation;
        if body.nobody.is_some() {
            message.status = Status::IMPLAUSIBLE;
        }
    }
    if skeleton.joints.iter().any(Result::is_ok) {
        message.status = Status::OK;
    }
    Ok(message)
}

/// Adds the extra keypoints.
///
/// # Errors
///
/// [`WireError::TooMany`] if there are more than fit.
pub fn keypoints_to_message(
    message: &mut Pose3d,
    keypoints: &[Result<Triangulated, NoJoint>],
) -> Result<(), WireError> {
    message.n_keypoints = count("n_keypoints", keypoints.len(), MAX_KEYPOINTS)? as u32;
    for (slot, keypoint) in message.keypoints.iter_mut().zip(keypoints) {
        *slot = joint_to_message(keypoint);
    }
    Ok(())
}

/// The end of stream of the results.
pub fn end_of_results(session: u64) -> Pose3d {
    let mut message = empty();
    message.stamp.session = session;
    message.status = Status::END;
    message
}

/// Checks the counts of a result against the receiver's rig and joint set, and that its coordinates are
/// finite.
///
/// # Errors
///
/// [`WireError`] if it is for other views or joints, a count is larger than its array, or a joint or
/// a part that was found has a coordinate that is not finite. A result
/// without a skeleton may have counts of 0.
pub fn check_pose3d(message: &Pose3d, n_views: usize, n_joints: usize) -> Result<(), WireError> {
    let joints = count("n_joints", message.n_joints as usize, MAX_JOINTS)?;
    let views = count("n_views", message.n_views as usize, MAX_VIEWS)?;
    for view in &message.views[..views] {
        let n = count("n_parts", view.n_parts as usize, MAX_PARTS)?;
        if view.status == Status::OK {
            all_finite("centres", view.centres_px[..n].as_flattened())?;
        }
    }
    let keypoints = count("n_keypoints", message.n_keypoints as usize, MAX_KEYPOINTS)?;
    let keypoints = &message.keypoints[..keypoints];
    for joint in message.joints[..joints].iter().chain(keypoints) {
        if joint.status == Status::OK {
            all_finite("in_world", &joint.in_world)?;
        }
    }
    if message.status != Status::OK && message.n_views == 0 {
        return Ok(());
    }
    equal("n_views", message.n_views as usize, n_views)?;
    equal("n_joints", message.n_joints as usize, n_joints)
}

fn all_finite(field: &'static str, numbers: &[f64]) -> Result<(), WireError> {
    let mut entries = numbers.iter().enumerate();
    entries.try_for_each(|(entry, it)| finite(field, entry, *it).map(|_| ()))
}

/// An empty result.
fn empty() -> Pose3d {
    Pose3d {
        stamp: Stamp::default(),
        timing: Timing::default(),
        status: Status::TOO_FEW_VIEWS,
        n_joints: 0,
        n_views: 0,
        views_present: 0,
        views_used: 0,
        n_pairs: 0,
        facing_margin: 0.0,
        sides_margin: 0.0,
        stature_m: 0.0,
        body_deviation: 0.0,
        sides: Sides::AS_SEEN,
        kept: Kept::SOLVED,
        n_people: 0,
        n_keypoints: 0,
        joints: [Joint3d::default(); MAX_JOINTS],
        views: [FusedView::default(); MAX_VIEWS],
        keypoints: [Joint3d::default(); MAX_KEYPOINTS],
    }
}

fn absent() -> FusedView {
    FusedView {
        status: Status::NO_DETECTION,
        ..FusedView::default()
    }
}

fn joint_to_message(joint: &Result<Triangulated, NoJoint>) -> Joint3d {
    match joint {
        Ok(it) => {
            let c = &it.covariance;
            Joint3d {
                in_world: it.in_world.coords.into(),
                covariance: [
                    c[(0, 0)],
                    c[(0, 1)],
                    c[(0, 2)],
                    c[(1, 1)],
                    c[(1, 2)],
                    c[(2, 2)],
                ],
                reprojection_px: it.reprojection_px,
                views_used: it.views_used,
                status: Status::OK,
            }
        }
        Err(NoJoint::Implausible) => Joint3d {
            status: Status::IMPLAUSIBLE,
            ..Joint3d::default()
        },
        // All other errors mean that too few views could be used.
        Err(_) => Joint3d {
            status: Status::TOO_FEW_VIEWS,
            ..Joint3d::default()
        },
    }
}

fn view_to_message(view: &pipeline::FusedView) -> Result<FusedView, WireError> {
    let centres = &view.pose.centres_px;
    let mut message = FusedView {
        energy: view.pose.energy,
        n_pairs: view.pose.n_pairs as u32,
        status: Status::OK,
        exchanged: u32::from(view.exchanged),
        n_parts: count("n_parts", centres.len(), MAX_PARTS)? as u32,
        single_score: view.single_score,
        ..FusedView::default()
    };
    message.centres_px[..centres.len()].copy_from_slice(centres);
    Ok(message)
}

#[cfg(test)]
mod tests {
    use multiview::FusedPose;
    use nalgebra::{Matrix3, Point3};

    use super::*;

    fn skeleton() -> Skeleton {
        let covariance = Matrix3::new(1.0, 2.0, 3.0, 2.0, 4.0, 5.0, 3.0, 5.0, 6.0);
        let found = Triangulated {
            in_world: Point3::new(0.1, 0.2, 0.3),
            covariance,
            reprojection_px: 1.25,
            views_used: 0b101,
            residuals_px: [0.0; geometry::MAX_VIEWS],
        };
        let view = pipeline::FusedView {
            pose: FusedPose {
                centres_px: vec![[3.0, 4.0], [5.0, 6.0]],
                n_pairs: 2,
                energy: 7.0,
            },
            exchanged: true,
            cell_px: 4.0,
            single_score: -0.5,
        };
        Skeleton {
            n_people: 0,
            joints: vec![
                Ok(found),
                Err(NoJoint::Triangulation(
                    geometry::TriangulateError::TooFewViews {
                        views: 1,
                        needed: 2,
                    },
                )),
                Err(NoJoint::Implausible),
            ],
            body: Some(pipeline::Body {
                stature_m: Some(1.75),
                deviation: 0.5,
                nobody: None,
            }),
            views: vec![Some(view), None],
            n_pairs: 1,
            facing_margin: 0.25,
            sides: Some(multiview::Sides {
                exchange: true,
                margin: 1.5,
                unsure: true,
            }),
            kept: pipeline::Kept::Start,
        }
    }

    #[test]
    fn every_field_survives_a_round_trip() {
        let got = skeleton_to_message(&skeleton(), 0b11).unwrap();
        assert_eq!((got.n_joints, got.n_views, got.n_pairs), (3, 2, 1));
        assert_eq!((got.stature_m, got.body_deviation), (1.75, 0.5));
        assert_eq!((got.views_present, got.views_used), (0b11, 0b101));
        assert_eq!(got.status, Status::OK);
        assert_eq!((got.sides, got.sides_margin), (Sides::UNSURE, 1.5));
        assert_eq!(got.kept, Kept::START);
        assert_eq!(got.joints[0].in_world, [0.1, 0.2, 0.3]);
        assert_eq!(got.joints[0].covariance, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        assert_eq!(got.joints[0].reprojection_px, 1.25);
        assert_eq!(got.joints[1].status, Status::TOO_FEW_VIEWS);
        assert_eq!(got.joints[2].status, Status::IMPLAUSIBLE);
        assert_eq!(got.views[0].centres_px[..2], [[3.0, 4.0], [5.0, 6.0]]);
        assert_eq!((got.views[0].exchanged, got.views[0].n_pairs), (1, 2));
        assert_eq!(got.views[1].status, Status::NO_DETECTION);
        check_pose3d(&got, 2, 3).unwrap();
    }

    #[test]
    fn extra_keypoints_survive_a_round_trip_and_are_checked() {
        let mut got = skeleton_to_message(&skeleton(), 0b11).unwrap();
        let extras = [skeleton().joints[0], skeleton().joints[2]];
        keypoints_to_message(&mut got, &extras).unwrap();
        assert_eq!(got.n_keypoints, 2);
        assert_eq!(got.keypoints[0].in_world, [0.1, 0.2, 0.3]);
        assert_eq!(got.keypoints[1].status, Status::IMPLAUSIBLE);
        check_pose3d(&got, 2, 3).unwrap();
        got.keypoints[0].in_world[1] = f64::NAN;
        check_pose3d(&got, 2, 3).unwrap_err();
        got.n_keypoints = u32::MAX;
        check_pose3d(&got, 2, 3).unwrap_err();
        let many = vec![extras[0]; MAX_KEYPOINTS + 1];
        keypoints_to_message(&mut got, &many).unwrap_err();
    }

    #[test]
    fn without_a_joint_there_is_no_skeleton() {
        let mut it = skeleton();
        it.joints = it.joints.split_off(1);
        let got = skeleton_to_message(&it, 0b01).unwrap();
        assert_eq!(got.status, Status::TOO_FEW_VIEWS);
    }

    #[test]
    fn refuses_the_result_of_another_rig() {
        let got = skeleton_to_message(&skeleton(), 0b11).unwrap();
        let error = check_pose3d(&got, 4, 2).unwrap_err();
        assert_eq!(error.to_string(), "n_views is 2, expected 4");
    }

    #[test]
    fn refuses_counts_beyond_their_arrays() {
        let mut got = skeleton_to_message(&skeleton(), 0b11).unwrap();
        got.views[1].n_parts = 33;
        assert!(check_pose3d(&got, 2, 3).is_err());
        got.views[1].n_parts = 0;
        got.n_views = u32::MAX;
        assert!(check_pose3d(&got, 2, 3).is_err());
    }

    #[test]
    fn refuses_coordinates_that_are_not_finite() {
        let good = skeleton_to_message(&skeleton(), 0b11).unwrap();
        let refused = |change: fn(&mut Pose3d)| {
            let mut message = good;
            change(&mut message);
            check_pose3d(&message, 2, 3).is_err()
        };
        assert!(refused(|message| message.joints[0].in_world[2] = f64::NAN));
        assert!(refused(
            |message| message.views[0].centres_px[1][0] = f64::INFINITY
        ));
        // Entries that were not found are not checked.
        assert!(!refused(|message| message.joints[1].in_world[0] = f64::NAN));
        assert!(!refused(
            |message| message.views[1].centres_px[0][0] = f64::NAN
        ));
    }

    #[test]
    fn refuses_to_send_more_joints_than_fit() {
        let mut it = skeleton();
        it.joints = vec![it.joints[1]; MAX_JOINTS + 1];
        assert!(matches!(
            skeleton_to_message(&it, 0),
            Err(WireError::TooMany {
                field: "n_joints",
                ..
            })
        ));
    }
}
