//! Converts the lines of a run's results to measurements, and smoothed joints back to lines.

use nalgebra::Matrix3;
use runfiles::{FrameLine, JointLine, PersonLine, PlacedJoint};

use crate::recorded::Sides;
use crate::track::{Estimate, Measured, Smoothed};

/// Returns the measurement of a joint; `None` if it has no position.
pub fn measured(line: &JointLine) -> Option<Measured> {
    let it = line.placed()?;
    let [xx, xy, xz, yy, yz, zz] = it.covariance_m2;
    Some(Measured {
        position: it.position_m.into(),
        covariance: Some(Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)),
    })
}

/// Returns how certain left and right of a person are. They are certain unless the line says otherwise. If left and right are labelled as
/// they appear in the pictures, they are not decided either, but they are consistent over all frames of a run.
pub fn sides(person: &PersonLine) -> Sides {
    if person.sides == Some(runfiles::Sides::Unsure) {
        Sides::Unsure
    } else {
        Sides::Sure
    }
}

/// Returns a person's entry in a line, with smoothed joints; `None` if the person was not measured and has no smoothed joint.
///
/// * `person`: the person as measured; `None` if the person is not in the line.
/// * `joints`: for each joint, its name, whether it is an extra keypoint, and its smoothed value. Joints that are not listed are left out.
pub fn smoothed<'a>(
    id: u64,
    person: Option<PersonLine>,
    joints: impl IntoIterator<Item = (&'a str, bool, &'a Smoothed)>,
) -> Option<PersonLine> {
    let was_there = person.is_some();
    let mut person = person.unwrap_or_else(|| PersonLine {
        id,
        ..PersonLine::default()
    });
    let old = [
        core::mem::take(&mut person.joints),
        core::mem::take(&mut person.keypoints),
    ];
    for (name, is_keypoint, smoothed) in joints {
        let old = old[usize::from(is_keypoint)].get(name);
        let new = match smoothed {
            Ok(estimate) => {
                let state = estimate.state.name().to_owned();
                person.states.insert(name.to_owned(), state);
                JointLine::Placed(placed(estimate, old))
            }
            Err(why) => match old {
                // The joint had no measured position either; the original reason is kept.
                Some(missing @ JointLine::Missing { .. }) => missing.clone(),
                _ => JointLine::Missing {
                    status: why.name().to_owned(),
                },
            },
        };
        let part = if is_keypoint {
            &mut person.keypoints
        } else {
            &mut person.joints
        };
        part.insert(name.to_owned(), new);
    }
    if !person.states.is_empty() {
        FrameLine::OK.clone_into(&mut person.status);
    }
    (was_there || !person.states.is_empty()).then_some(person)
}

/// Returns the line with the given people instead of its own.
pub fn with_people(mut line: FrameLine, people: Vec<PersonLine>) -> FrameLine {
    if people.iter().any(|person| person.status == FrameLine::OK) {
        FrameLine::OK.clone_into(&mut line.status);
        line.reason = None;
    }
    line.people = people;
    line
}

fn placed(it: &Estimate, old: Option<&JointLine>) -> PlacedJoint {
    let covariance = it.covariance;
    let halved = |matrix3: Matrix3<f64>| {
        [
            matrix3.m11,
            matrix3.m12,
            matrix3.m13,
            matrix3.m22,
            matrix3.m23,
            matrix3.m33,
        ]
    };
    let views = old.and_then(JointLine::placed).map(|placed| placed.views.clone());
    PlacedJoint {
        covariance_m2: covariance.map_or([f64::NAN; 6], halved),
        position_m: it.position.into(),
        reprojection_px: None,
        views: views.unwrap_or_default(),
    }
}
