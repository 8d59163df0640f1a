//! Plausibility checks of a motion.

use std::path::Path;

use nalgebra::Vector3;
use statistics::Sorted;

use super::{Motion, MotionError};

/// Hips, knees and ankles among the joints of `skeleton::PARSE14`, left leg first.
const LEGS: [[usize; 3]; 2] = [[3, 4, 5], [2, 1, 0]];
const HEAD: usize = 13;

/// Plausible lengths of a leg, in metres: from a small child to the tallest man with badly placed markers.
const LEG_METRES: [f64; 2] = [0.3, 1.5];

/// Returns an error if the motion is impossible for a person.
pub(super) fn check(path: &Path, motion: &Motion) -> Result<(), MotionError> {
    let refuse = |what: String| {
        let path = path.to_owned();
        Err(MotionError::Implausible { path, what })
    };
    let joint = |frame: &[[f64; 3]; 14], it: usize| Vector3::from(frame[it]);
    let all = || motion.joints.iter();
    let length = |frame, [hip, knee, ankle]: [usize; 3]| {
        let [hip, knee, ankle] = [hip, knee, ankle].map(|i| joint(frame, i));
        (knee - hip).norm() + (ankle - knee).norm()
    };
    let leg = median(all().flat_map(|frame| LEGS.map(|leg| length(frame, leg))));
    if !(LEG_METRES[0]..=LEG_METRES[1]).contains(&leg) {
        return refuse(format!(
            "a leg would be {leg:.3} m long: is the unit wrong? (set unit = \"mm\" in a marker table)"
        ));
    }
    let head_above_foot = |frame: &[[f64; 3]; 14]| frame[HEAD][2] - frame[LEGS[0][2]][2];
    let head = median(all().map(head_above_foot));
    // A person may be lying. A head that is below the feet most of the time indicates a wrong axis.
    if head < -0.3 * leg {
        return refuse(format!(
            "the head would be {:.2} m below the feet: is another axis vertical? (set up = \"y\" in a marker table)",
            -head
        ));
    }
    let fold: f64 = all().map(fold).sum();
    if fold < 0.0 {
        return refuse(
            "knees would fold forward: left and right are swapped, or the axes are mirrored"
                .to_owned(),
        );
    }
    Ok(())
}

/// Measure of how far the knees bend backward: negative if they bend forward, 0 if they are straight.
fn fold(frame: &[[f64; 3]; 14]) -> f64 {
    let joint = |i: usize| Vector3::from(frame[i]);
    let left = joint(LEGS[0][0]) - joint(LEGS[1][0]);
    let of_leg = |[hip, knee, ankle]: [usize; 3]| {
        let thigh = (joint(knee) - joint(hip)).try_normalize(1e-9);
        let shin = (joint(ankle) - joint(knee)).try_normalize(1e-9);
        let axis = thigh.zip(shin).map(|(a, b)| a.cross(&b));
        let axis = axis.filter(|axis| axis.norm() > 0.2);
        axis.map_or(0.0, |axis| axis.dot(&left))
    };
    LEGS.into_iter().map(of_leg).sum()
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let values: Vec<f64> = values.collect();
    Sorted::new(values).upper_median().unwrap_or(f64::NAN)
}
