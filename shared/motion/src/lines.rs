//! From the lines of a run's results to measurements, and from smoothed joints back to lines.

use std::collections::BTreeMap;

use nalgebra::Matrix3;
use runfiles::{FrameLine, JointLine, PlacedJoint, SmoothLine};

use crate::recorded::Sides;
use crate::track::{Estimate, Measured, Smoothed};

/// What was measured of a joint; `None` if it has no position.
pub fn measured(line: &JointLine) -> Option<Measured> {
    let it = line.placed()?;
    let [xx, xy, xz, yy, yz, zz] = it.covariance_m2;
    Some(Measured {
        position: it.position_m.into(),
        covariance: Some(Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)),
    })
}

/// Whether the sides of a frame are certain: everything but a frame that says that they are not. Sides as seen in the pictures are not
/// decided either, but are the same in all frames of a run.
pub fn sides(line: &FrameLine) -> Sides {
    if line.sides == Some(runfiles::Sides::Unsure) {
        Sides::Unsure
    } else {
        Sides::Sure
    }
}

/// A line with its joints smoothed.
///
/// * `joints`: by name; whether it is an extra keypoint; what it was smoothed to. Others are left out.
pub fn smoothed<'a>(
    mut line: FrameLine,
    joints: impl IntoIterator<Item = (&'a str, bool, &'a Smoothed)>,
) -> SmoothLine {
    let had_result = line.has_result();
    let old = [
        core::mem::take(&mut line.joints),
        core::mem::take(&mut line.keypoints),
    ];
    let mut states = BTreeMap::new();
    for (name, is_keypoint, smoothed) in joints {
        let old = old[usize::from(is_keypoint)].get(name);
        let new = match smoothed {
            Ok(it) => {
                states.insert(name.to_owned(), it.state.name().to_owned());
                JointLine::Placed(placed(it, old))
            }
            Err(why) => match old {
                // Why it has none stays, if it had none before.
                Some(missing @ JointLine::Missing { .. }) => missing.clone(),
                _ => JointLine::Missing {
                    status: why.name().to_owned(),
                },
            },
        };
        let part = if is_keypoint {
            &mut line.keypoints
        } else {
            &mut line.joints
        };
        part.insert(name.to_owned(), new);
    }
    if !states.is_empty() {
        FrameLine::OK.clone_into(&mut line.status);
        line.reason = None;
    } else if !had_result {
        // As in the file that was read, a line without a result has no joints.
        line.joints.clear();
        line.keypoints.clear();
    }
    SmoothLine {
        frame: line,
        states,
    }
}

fn placed(it: &Estimate, old: Option<&JointLine>) -> PlacedJoint {
    let covariance = it.covariance;
    let halved = |it: Matrix3<f64>| [it.m11, it.m12, it.m13, it.m22, it.m23, it.m33];
    let views = old.and_then(JointLine::placed).map(|it| it.views.clone());
    PlacedJoint {
        covariance_m2: covariance.map_or([f64::NAN; 6], halved),
        position_m: it.position.into(),
        reprojection_px: None,
        views: views.unwrap_or_default(),
    }
}
