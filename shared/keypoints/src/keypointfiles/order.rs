//! Checks whether 25 keypoints without names are arranged like those of `body-25`.
//!
//! OpenPose has two sets of 25 keypoints, and files do not state which of them they use: `body-25`, and `body-25b` of its experimental
//! model. The first set has a pelvis in the middle of the hips. The second set has an elbow, a wrist and a hip at the positions of the
//! pelvis and the two hips in the first set; these three points are far from each other.

use crate::BODY_25;
use crate::files::SeenKeypoints;

/// Maximum distance of the pelvis from the middle of the hips, as a fraction of the longer side of a person's box. If the distance is
/// larger in half of the people, the point is not the pelvis. In the demonstration of Pose2Sim, which uses `body-25b`, the median for each
/// camera is 0.17 to 0.51.
const MOST_OFF: f64 = 0.1;

/// Returns the median distance of the pelvis from the middle of the hips. Returns `None` if it is small enough, or if no person
/// has all three keypoints.
pub(crate) fn pelvis_off(people: &mut dyn Iterator<Item = &SeenKeypoints>) -> Option<f64> {
    let mut off: Vec<f64> = people.filter_map(off).collect();
    off.sort_by(f64::total_cmp);
    let median = off.get(off.len() / 2).copied()?;
    (median > MOST_OFF).then_some(median)
}

fn off(person: &SeenKeypoints) -> Option<f64> {
    let at = |name: &str| {
        let nth = BODY_25.iter().position(|known| *known == name)?;
        Some(person.keypoints.get(nth)?.as_ref()?.at)
    };
    let [pelvis, right, left] = [at("pelvis")?, at("right hip")?, at("left hip")?];
    let [x0, y0, x1, y1] = person.outline()?;
    let side = (x1 - x0).max(y1 - y0).max(1.0);
    let away = [0, 1].map(|axis| pelvis[axis] - f64::midpoint(right[axis], left[axis]));
    Some(away[0].hypot(away[1]) / side)
}
