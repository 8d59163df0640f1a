//! One joint over time: its measurements, and the result of a smoother.

use nalgebra::{Matrix3, Vector3};

/// Measured position of a joint at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measured {
    /// Position in the world, in metres.
    pub position: Vector3<f64>,
    /// Covariance of the position, in square metres; `None` if it is unknown.
    pub covariance: Option<Matrix3<f64>>,
}

/// Where a position in a smoothed track comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    /// From a measurement of this joint, and from the measurements around it.
    Measured,
    /// From the measurement of the same joint on the other side of the body, because it fits and the joint's own measurement does not: left
    /// and right were swapped.
    Exchanged,
    /// Only from measurements before and after, because there was no measurement.
    Filled,
    /// Only from measurements before and after, because the measurement contradicts them, or because its side is uncertain.
    Rejected,
}

impl State {
    /// Returns the name used in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Measured => "measured",
            Self::Exchanged => "exchanged",
            Self::Filled => "filled",
            Self::Rejected => "rejected",
        }
    }
}

/// Smoothed position of a joint at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// Position in the world, in metres.
    pub position: Vector3<f64>,
    /// Covariance of the position, in square metres; `None` if the method does not provide it.
    pub covariance: Option<Matrix3<f64>>,
    /// Where the position comes from.
    pub state: State,
}

/// Reason why there is no position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Absent {
    /// There is no measurement, and the gap cannot be filled: it is too long, or has a measurement on one side only.
    Gap,
    /// The measurement contradicts the others, and the gap that it leaves is too long to be filled.
    Rejected,
}

impl Absent {
    /// Returns the name used in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Gap => "gap",
            Self::Rejected => "rejected",
        }
    }
}

/// One instant of a smoothed track.
pub type Smoothed = Result<Estimate, Absent>;

/// Standard deviation that is assumed, until the scale has been estimated, for a measurement without a covariance, in metres.
const UNKNOWN_SD_M: f64 = 0.02;
/// Limits to which standard deviations of a measurement are clipped, in metres. Smaller ones are due to rounding; measurements with larger
/// ones carry no information.
const SD_M: [f64; 2] = [1e-5, 10.0];
/// Maximum distance of a measurement from the origin, in metres.
const FARTHEST_M: f64 = 1e6;

/// Returns the measurement with a finite position and a positive definite covariance; `None` if the position cannot be used.
pub(crate) fn usable(it: &Measured) -> Option<(Vector3<f64>, Matrix3<f64>)> {
    let is_near = |x: &f64| x.abs() < FARTHEST_M;
    if !it.position.iter().all(is_near) {
        return None;
    }
    let unknown = Matrix3::identity() * UNKNOWN_SD_M.powi(2);
    let Some(covariance) = it.covariance else {
        return Some((it.position, unknown));
    };
    let is_finite = covariance.iter().all(|x| x.is_finite());
    let covariance = if is_finite {
        bounded(covariance)
    } else {
        unknown
    };
    Some((it.position, covariance))
}

/// Returns the covariance with standard deviations within [`SD_M`] along its own axes.
fn bounded(covariance: Matrix3<f64>) -> Matrix3<f64> {
    let symmetric = (covariance + covariance.transpose()) * 0.5;
    let [least, most] = SD_M.map(|sd_m| sd_m * sd_m);
    let trace = symmetric.trace();
    // Most covariances are far from both limits: the determinant over the square of the trace bounds the smallest eigenvalue from below.
    if trace < most && symmetric.determinant() > least * trace * trace {
        return symmetric;
    }
    let mut axes = symmetric.symmetric_eigen();
    axes.eigenvalues.apply(|eigenvalue| *eigenvalue = eigenvalue.clamp(least, most));
    axes.recompose()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn measured(position: [f64; 3], covariance: Option<Matrix3<f64>>) -> Measured {
        Measured {
            position: position.into(),
            covariance,
        }
    }

    #[test]
    fn a_position_that_is_not_finite_is_no_measurement() {
        for x in [f64::NAN, f64::INFINITY, -1e7] {
            assert_eq!(usable(&measured([x, 0.0, 0.0], None)), None);
        }
    }

    #[test]
    fn every_covariance_becomes_positive_definite() {
        let nan = Matrix3::from_element(f64::NAN);
        let minus = Matrix3::identity() * -1.0;
        let flat = Matrix3::from_diagonal(&Vector3::new(1e-3, 0.0, 1e-3));
        let huge = Matrix3::identity() * 1e12;
        for covariance in [nan, minus, flat, huge, Matrix3::zeros()] {
            let (_, got) = usable(&measured([0.0; 3], Some(covariance))).unwrap();
            assert!(got.cholesky().is_some(), "{covariance} became {got}");
            assert!(got.trace() <= 3.0 * 100.0 * 1.001, "{got}");
        }
    }

    #[test]
    fn a_valid_covariance_is_unchanged() {
        let usual = Matrix3::new(4e-4, 1e-4, 0.0, 1e-4, 9e-4, 2e-5, 0.0, 2e-5, 1e-4);
        let (_, got) = usable(&measured([0.0; 3], Some(usual))).unwrap();
        assert!((got - usual).norm() < 1e-12);
    }
}
