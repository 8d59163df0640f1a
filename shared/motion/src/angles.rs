//! Angles between the segments of a body, computed from the positions of its joints, with standard deviations that follow from the
//! covariances of the joints.
//!
//! Definitions follow the recommendations of the International Society of Biomechanics where points suffice: Wu et al. 2002 (hip, ankle;
//! *J. Biomech.* 35:543) and Wu et al. 2005 (shoulder, elbow; *J. Biomech.* 38:981). A table in `docs/guide/smooth.md` lists the angles,
//! the joints they are computed from, and the angles that a skeleton of points cannot provide.

mod body;
mod define;
mod spread;

use nalgebra::{Matrix3, UnitVector3, Vector3};

use crate::role::{Role, Side};
use crate::track::{Estimate, State};
pub use define::Angle;
use spread::Place;

/// Sine of the smallest bend (20 degrees) of a knee or elbow from which the axis of its bending is computed.
const LEAST_BEND: f64 = 0.342;
/// Sine of the smallest angle (10 degrees) between a limb and an axis at which the limb's direction about that axis can be computed.
const LEAST_TILT: f64 = 0.1736;
/// Maximum standard deviation of a reported angle, in degrees.
pub const MOST_SD_DEGREES: f64 = 45.0;

/// Reason why an angle has no value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unknown {
    /// A joint of the angle has no position.
    Missing,
    /// The angle is not defined for these positions; for example, the rotation of a straight arm is not.
    Undefined,
    /// The standard deviation of the angle is above [`MOST_SD_DEGREES`].
    Uncertain,
}

impl Unknown {
    /// Returns the name used in files.
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
    /// The angle, in degrees.
    pub degrees: f64,
    /// Standard deviation, in degrees; `None` if a covariance is unknown.
    pub sd_degrees: Option<f64>,
    /// State of the least certain joint of the angle.
    pub state: State,
}

/// Computes all angles of one instant.
///
/// * `joints`: the joints with their roles; if several joints have the same role, the first one is used.
/// * `up`: direction against gravity in the world, if known; without it, angles that are measured from the vertical are missing.
/// * Returns all angles of the type `Angle`, in the order of its variants.
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

/// The sides in the order used in files.
pub(crate) const SIDES: [Side; 2] = Side::BOTH;

#[cfg(test)]
mod tests;
