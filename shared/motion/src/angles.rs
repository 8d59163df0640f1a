//! Angles between the segments of a body, from the places of its joints, with what the covariances of these make of them.
//!
//! Definitions follow the recommendations of the International Society of Biomechanics as far as points determine them:
//! Wu et al. 2002 (hip, ankle; *J. Biomech.* 35:543) and Wu et al. 2005 (shoulder, elbow; *J. Biomech.* 38:981). `docs/guide/smooth.md`
//! has the table of what is measured, from which joints, and what a skeleton of points cannot give.

mod body;
mod define;
mod spread;

use nalgebra::{Matrix3, UnitVector3, Vector3};

use crate::role::{Role, Side};
use crate::track::{Estimate, State};
pub use define::Angle;
use spread::Place;

/// The sine of the least bend of a knee or elbow that shows about which axis it bends: 20 degrees.
const LEAST_BEND: f64 = 0.342;
/// The sine of the least angle between a limb and an axis about which its direction is determined: 10 degrees.
const LEAST_TILT: f64 = 0.1736;
/// An angle that is less certain is not reported, degrees.
pub const MOST_SD_DEGREES: f64 = 45.0;

/// Why an angle has no value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unknown {
    /// A joint that it is between has no position.
    Missing,
    /// The joints lie so that the angle is not defined, as the rotation of a straight arm.
    Undefined,
    /// Its standard deviation is above [`MOST_SD_DEGREES`].
    Uncertain,
}

impl Unknown {
    /// The word in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Missing => "missing",
            Self::Undefined => "undefined",
            Self::Uncertain => "uncertain",
        }
    }
}

/// The value of an angle at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Value {
    /// Degrees.
    pub degrees: f64,
    /// Standard deviation, degrees; `None` where a covariance is not known.
    pub sd_degrees: Option<f64>,
    /// State of the least certain of its joints.
    pub state: State,
}

/// All angles of one instant.
///
/// * `joints`: with a role; of several of one role the first counts.
/// * `up`: against gravity in the world, where that is known: without it, angles with the vertical are missing.
/// * Returns every angle of `Angle`, in their order.
pub fn angles(
    joints: &[(Role, Estimate)],
    up: Option<UnitVector3<f64>>,
) -> Vec<(Angle, Result<Value, Unknown>)> {
    let value = |angle: Angle| (angle, value(angle, joints, up));
    Angle::all().into_iter().map(value).collect()
}

fn value(
    angle: Angle,
    joints: &[(Role, Estimate)],
    up: Option<UnitVector3<f64>>,
) -> Result<Value, Unknown> {
    let roles = angle.roles();
    let of = |role: Role| joints.iter().find(|joint| joint.0 == role).map(|joint| joint.1);
    let mut found: Vec<Estimate> = Vec::with_capacity(roles.len());
    for role in &roles {
        found.push(of(*role).ok_or(Unknown::Missing)?);
    }
    if angle.needs_up() && up.is_none() {
        return Err(Unknown::Missing);
    }
    let up = up.unwrap_or_else(Vector3::z_axis);
    let places: Vec<Place> = found
        .iter()
        .map(|estimate| (estimate.position, estimate.covariance.filter(is_finite)))
        .collect();
    let points: Vec<Vector3<f64>> = found.iter().map(|estimate| estimate.position).collect();
    let degrees = angle.degrees(&points, &up).ok_or(Unknown::Undefined)?;
    let sd_degrees = spread::sd(degrees, &places, |points| angle.degrees(points, &up))?;
    if sd_degrees.is_some_and(|sd_degree| sd_degree > MOST_SD_DEGREES) {
        return Err(Unknown::Uncertain);
    }
    let is_any = |state: State| found.iter().any(|estimate| estimate.state == state);
    let order = [State::Rejected, State::Filled, State::Exchanged];
    let state = order.into_iter().find(|state| is_any(*state));
    Ok(Value {
        degrees,
        sd_degrees,
        state: state.unwrap_or(State::Measured),
    })
}

fn is_finite(covariance: &Matrix3<f64>) -> bool {
    covariance.iter().all(|value| value.is_finite())
}

/// The sides in the order of files.
pub(crate) const SIDES: [Side; 2] = Side::BOTH;

#[cfg(test)]
mod tests;
