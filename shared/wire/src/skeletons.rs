//! The result: the people of a frame, their joints in the world, and the views that were used.

use geometry::Triangulated;
use messages::{
    FusedView, Joint3d, Kept, MAX_JOINTS, MAX_KEYPOINTS, MAX_PARTS, MAX_PEOPLE, MAX_VIEWS, Sides,
    SkeletonMessage, Skeletons, Stamp, Status,
};
use pipeline::{NoJoint, Skeleton};

use crate::WireError;
use crate::error::{count, equal, finite};

/// A person with a skeleton and extra keypoints.
#[derive(Debug, Clone, Copy)]
pub struct SolvedPerson<'a> {
    /// The person's id within the run, counted from 1.
    pub id: u64,
    /// Skeleton of the person, which may have no joints.
    pub skeleton: &'a Skeleton,
    /// Extra keypoints of the person.
    pub keypoints: &'a [Result<Triangulated, NoJoint>],
}

/// Writes the people of a frame. The caller fills in stamp and timing.
///
/// * `people`: the people, the followed person first.
/// * `n_seen`: number of people that several views agree on.
/// * `views_present`: bit `v` is set if the result of view `v` arrived in time.
///
/// # Errors
///
/// Returns [`WireError::TooMany`] if there are more people, joints, views, parts or extra keypoints than fit.
pub fn skeletons_to_message(
    people: &[SolvedPerson<'_>],
    n_seen: usize,
    views_present: u32,
) -> Result<Box<Skeletons>, WireError> {
    let n_people = count("n_people", people.len(), MAX_PEOPLE)?;
    let mut message = Box::new(Skeletons::default());
    message.views_present = views_present;
    message.n_seen = n_seen as u32;
    message.n_people = n_people as u32;
    for (slot, person) in message.people.iter_mut().zip(people) {
        person_to_message(slot, person)?;
    }
    let is_any = |state| message.listed().iter().any(|person| person.status == state);
    let states = [Status::OK, Status::IMPLAUSIBLE];
    let best = states.into_iter().find(|state| is_any(*state));
    message.status = best.unwrap_or(Status::TOO_FEW_VIEWS);
    Ok(message)
}

fn person_to_message(
    message: &mut SkeletonMessage,
    person: &SolvedPerson<'_>,
) -> Result<(), WireError> {
    let SolvedPerson {
        id,
        skeleton,
        keypoints,
    } = *person;
    message.id = id;
    message.status = Status::TOO_FEW_VIEWS;
    message.n_joints = count("n_joints", skeleton.joints.len(), MAX_JOINTS)? as u32;
    message.n_keypoints = count("n_keypoints", keypoints.len(), MAX_KEYPOINTS)? as u32;
    message.n_views = count("n_views", skeleton.views.len(), MAX_VIEWS)? as u32;
    message.n_pairs = skeleton.n_pairs as u32;
    message.facing_margin = skeleton.facing_margin;
    (message.sides, message.sides_margin) = match skeleton.sides {
        None => (Sides::AS_SEEN, 0.0),
        Some(sides) if sides.unsure => (Sides::UNSURE, sides.margin),
        Some(sides) => (Sides::SURE, sides.margin),
    };
    message.kept = match skeleton.kept {
        pipeline::Kept::Solved => Kept::SOLVED,
        pipeline::Kept::Start => Kept::START,
    };
    for (slot, joint) in message.joints.iter_mut().zip(&skeleton.joints) {
        *slot = joint_to_message(joint);
        message.views_used |= slot.views_used;
    }
    for (slot, keypoint) in message.keypoints.iter_mut().zip(keypoints) {
        *slot = joint_to_message(keypoint);
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
    Ok(())
}

/// Returns the message that ends the stream of the results.
pub fn end_of_results(session: u64) -> Skeletons {
    Skeletons {
        stamp: Stamp {
            session,
            ..Stamp::default()
        },
        status: Status::END,
        ..Skeletons::default()
    }
}

/// Checks the counts of a result against the receiver's rig and joint set. Also checks that ids are unique and coordinates are finite.
///
/// # Errors
///
/// Returns a [`WireError`] in these cases:
///
/// * There are too many people, a person has no id, or two people have the same id.
/// * The result is for other views or joints, or a count is larger than its array.
/// * A joint, an extra keypoint or a part that was found has a coordinate that is not finite.
pub fn check_skeletons(
    message: &Skeletons,
    n_views: usize,
    n_joints: usize,
) -> Result<(), WireError> {
    let n_people = count("n_people", message.n_people as usize, MAX_PEOPLE)?;
    let people = &message.people[..n_people];
    for (nth, person) in people.iter().enumerate() {
        let n_named = people[..=nth].iter().filter(|other| other.id == person.id);
        equal("people of an identity", n_named.count(), 1)?;
        equal("people without an identity", usize::from(person.id == 0), 0)?;
        check_person(person)?;
        equal("n_views", person.n_views as usize, n_views)?;
        equal("n_joints", person.n_joints as usize, n_joints)?;
    }
    Ok(())
}

fn check_person(person: &SkeletonMessage) -> Result<(), WireError> {
    count("n_joints", person.n_joints as usize, MAX_JOINTS)?;
    count("n_keypoints", person.n_keypoints as usize, MAX_KEYPOINTS)?;
    count("n_views", person.n_views as usize, MAX_VIEWS)?;
    for view in person.listed_views() {
        let n = count("n_parts", view.n_parts as usize, MAX_PARTS)?;
        if view.status == Status::OK {
            let is_known = |centre: &&[f64; 2]| !centre.iter().all(|side| side.is_nan());
            let mut known = view.centres_px[..n].iter().filter(is_known);
            known.try_for_each(|centre| all_finite("centres", centre))?;
        }
    }
    let points = person.listed_joints().iter();
    for point in points.chain(person.listed_keypoints()) {
        if point.status == Status::OK {
            all_finite("in_world", &point.in_world)?;
        }
    }
    Ok(())
}

fn all_finite(field: &'static str, numbers: &[f64]) -> Result<(), WireError> {
    let mut entries = numbers.iter().enumerate();
    entries.try_for_each(|(entry, number)| finite(field, entry, *number).map(|_| ()))
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
    use proptest::prelude::*;

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

    fn person(id: u64, skeleton: &Skeleton) -> SolvedPerson<'_> {
        SolvedPerson {
            id,
            skeleton,
            keypoints: &[],
        }
    }

    /// A frame with one person.
    fn one(skeleton: &Skeleton) -> Box<Skeletons> {
        skeletons_to_message(&[person(1, skeleton)], 0, 0b11).unwrap()
    }

    #[test]
    fn every_field_survives_a_round_trip() {
        let frame = skeletons_to_message(&[person(7, &skeleton())], 2, 0b11).unwrap();
        assert_eq!((frame.n_people, frame.n_seen), (1, 2));
        assert_eq!((frame.status, frame.views_present), (Status::OK, 0b11));
        let got = frame.followed().unwrap();
        assert_eq!((got.id, got.status), (7, Status::OK));
        assert_eq!((got.n_joints, got.n_views, got.n_pairs), (3, 2, 1));
        assert_eq!((got.stature_m, got.body_deviation), (1.75, 0.5));
        assert_eq!(got.views_used, 0b101);
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
        check_skeletons(&frame, 2, 3).unwrap();
    }

    #[test]
    fn extra_keypoints_survive_a_round_trip_and_are_checked() {
        let extras = [skeleton().joints[0], skeleton().joints[2]];
        let skeleton = skeleton();
        let with = |keypoints| {
            let person = SolvedPerson {
                id: 1,
                skeleton: &skeleton,
                keypoints,
            };
            skeletons_to_message(&[person], 0, 0b11)
        };
        let mut got = with(&extras).unwrap();
        assert_eq!(got.people[0].n_keypoints, 2);
        assert_eq!(got.people[0].keypoints[0].in_world, [0.1, 0.2, 0.3]);
        assert_eq!(got.people[0].keypoints[1].status, Status::IMPLAUSIBLE);
        check_skeletons(&got, 2, 3).unwrap();
        got.people[0].keypoints[0].in_world[1] = f64::NAN;
        check_skeletons(&got, 2, 3).unwrap_err();
        got.people[0].n_keypoints = u32::MAX;
        check_skeletons(&got, 2, 3).unwrap_err();
        with(&vec![extras[0]; MAX_KEYPOINTS + 1]).unwrap_err();
    }

    #[test]
    fn the_status_of_a_frame_is_the_best_status_of_its_people() {
        let found = skeleton();
        let mut lost = skeleton();
        lost.joints = lost.joints.split_off(1);
        let mut nobody = lost.clone();
        nobody.body.as_mut().unwrap().nobody = Some(skeleton::body::Reason::TooFewBones {
            bones: 2,
            needed: 4,
        });
        let state = |people: &[&Skeleton]| {
            let each = people.iter().zip(1..);
            let people: Vec<_> = each.map(|(skeleton, id)| person(id, skeleton)).collect();
            skeletons_to_message(&people, 0, 1).unwrap().status
        };
        assert_eq!(state(&[]), Status::TOO_FEW_VIEWS);
        assert_eq!(state(&[&lost]), Status::TOO_FEW_VIEWS);
        assert_eq!(state(&[&lost, &nobody]), Status::IMPLAUSIBLE);
        assert_eq!(state(&[&nobody, &found, &lost]), Status::OK);
    }

    #[test]
    fn refuses_the_result_of_another_rig() {
        let got = one(&skeleton());
        let error = check_skeletons(&got, 4, 2).unwrap_err();
        assert_eq!(error.to_string(), "n_views is 2, expected 4");
    }

    #[test]
    fn refuses_counts_beyond_their_arrays() {
        let mut got = one(&skeleton());
        got.people[0].views[1].n_parts = 33;
        assert!(check_skeletons(&got, 2, 3).is_err());
        got.people[0].views[1].n_parts = 0;
        got.people[0].n_views = u32::MAX;
        assert!(check_skeletons(&got, 2, 3).is_err());
        got = one(&skeleton());
        got.n_people = 9;
        let error = check_skeletons(&got, 2, 3).unwrap_err();
        assert_eq!(error.to_string(), "n_people is 9, but the limit is 8");
        let skeleton = skeleton();
        let nine = vec![person(1, &skeleton); 9];
        assert_eq!(skeletons_to_message(&nine, 0, 0).unwrap_err(), error);
    }

    #[test]
    fn an_id_belongs_to_one_person() {
        let skeleton = skeleton();
        let people = [4, 9, 4].map(|id| person(id, &skeleton));
        let mut got = skeletons_to_message(&people, 3, 0b11).unwrap();
        let error = check_skeletons(&got, 2, 3).unwrap_err();
        assert_eq!(error.to_string(), "people of an identity is 2, expected 1");
        got.n_people = 2;
        check_skeletons(&got, 2, 3).unwrap();
    }

    #[test]
    fn refuses_coordinates_that_are_not_finite() {
        let good = one(&skeleton());
        let refused = |change: fn(&mut SkeletonMessage)| {
            let mut message = good.clone();
            change(&mut message.people[0]);
            check_skeletons(&message, 2, 3).is_err()
        };
        assert!(refused(|person| person.joints[0].in_world[2] = f64::NAN));
        assert!(refused(
            |person| person.views[0].centres_px[1][0] = f64::INFINITY
        ));
        assert!(refused(|person| person.views[0].centres_px[1][0] = f64::NAN));
        // The position of a part may be unknown.
        assert!(!refused(
            |person| person.views[0].centres_px[1] = [f64::NAN; 2]
        ));
        // Joints that were not found are not checked.
        assert!(!refused(|person| person.joints[1].in_world[0] = f64::NAN));
        assert!(!refused(
            |person| person.views[1].centres_px[0][0] = f64::NAN
        ));
    }

    #[test]
    fn refuses_to_send_more_joints_than_fit() {
        let mut many = skeleton();
        many.joints = vec![many.joints[1]; MAX_JOINTS + 1];
        assert!(matches!(
            skeletons_to_message(&[person(1, &many)], 0, 0),
            Err(WireError::TooMany {
                field: "n_joints",
                ..
            })
        ));
    }

    proptest! {
        #[test]
        fn people_keep_their_order_in_a_round_trip(ids in prop::collection::hash_set(1_u64.., 0..=MAX_PEOPLE)) {
            let skeleton = skeleton();
            let people: Vec<_> = ids.iter().map(|id| person(*id, &skeleton)).collect();
            let got = skeletons_to_message(&people, ids.len(), 0b11).unwrap();
            check_skeletons(&got, 2, 3).unwrap();
            prop_assert!(got.listed().iter().map(|person| person.id).eq(ids));
        }

        #[test]
        fn any_counts_and_identities_are_refused_or_fit(
            n_people in prop_oneof![9 => 0_u32..10, 1 => any::<u32>()],
            counts in prop::array::uniform8(prop_oneof![
                20 => (0_u32..4, 0_u32..33).prop_map(|(n_keypoints, n_parts)| [3, 2, n_keypoints, n_parts]),
                1 => prop::array::uniform4(prop_oneof![Just(2_u32), Just(3), any::<u32>()]),
            ]),
            ids in prop::array::uniform8(0_u64..200),
        ) {
            let mut message = one(&skeleton());
            let (first, others) = message.people.split_at_mut(1);
            others.fill(first[0]);
            message.n_people = n_people;
            for (person, (id, counts)) in message.people.iter_mut().zip(ids.into_iter().zip(counts)) {
                person.id = id;
                [person.n_joints, person.n_views, person.n_keypoints, person.views[0].n_parts] = counts;
            }
            if check_skeletons(&message, 2, 3).is_ok() {
                let people = message.listed();
                prop_assert_eq!(people.len(), n_people as usize);
                for (nth, person) in people.iter().enumerate() {
                    prop_assert_eq!((person.listed_joints().len(), person.listed_views().len()), (3, 2));
                    prop_assert_eq!(person.listed_keypoints().len(), person.n_keypoints as usize);
                    prop_assert!(person.views[0].n_parts as usize <= MAX_PARTS);
                    let mut others = people[..nth].iter();
                    prop_assert!(person.id > 0 && others.all(|other| other.id != person.id));
                }
            }
        }
    }
}
