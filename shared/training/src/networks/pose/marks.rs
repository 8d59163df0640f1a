//! True keypoints of a person, combined from two sources: positions marked by an annotator, and positions found by another network, the
//! teacher.

use super::person::Target;
use super::{MIRROR, N_JOINTS, N_KEYPOINTS};

/// Height of the peak in the teacher's map above which a joint is used to decide about left and right.
const SURE_OF_SIDES: f32 = 0.55;
/// If the teacher contradicts a mark, the teacher's joint is kept as an alternative if its peak is higher than this.
const SURE: f32 = 0.7;
/// If the teacher agrees with a mark, the two positions are averaged if the teacher's peak is higher than this.
const USABLE: f32 = 0.4;
/// If there is no mark, the teacher's joint is used if its peak is higher than this.
const ALONE: f32 = 0.5;
/// Largest distance at which a mark and the teacher agree, in lengths of the trunk.
const AGREED: f32 = 0.24;
/// Minimum distance between a left joint and the corresponding right joint, in lengths of the trunk. Joints that are closer are not used to
/// decide about left and right.
const APART: f32 = 0.23;
/// The marks of the left and right limb are swapped if the swap reduces their distance from the teacher's joints to at most this fraction
/// of the distance without the swap.
const NEARER: f32 = 0.6;

/// Certainty of the teacher above which its extra keypoints are used.
const SURE_OF_EXTRAS: f32 = 0.6;
/// Largest distance at which a mark and the teacher agree about the joint near an extra keypoint, in lengths of the trunk.
const AGREED_BESIDE: f32 = 0.18;
/// The joint near every extra keypoint: neck, then the ankles.
const BESIDE: [usize; N_KEYPOINTS - N_JOINTS] = [12, 5, 0, 5, 0];

/// Joints of both legs, then joints of both arms.
const LIMBS: [[usize; 6]; 2] = [[0, 1, 2, 3, 4, 5], [6, 7, 8, 9, 10, 11]];

/// Keypoints of a person according to the annotator and the teacher, in the order of [`Person::targets`](super::Person::targets). Unknown
/// positions are not finite.
#[derive(Debug, Clone, PartialEq)]
pub struct Marks {
    /// Positions marked by the annotator, in pixels, with the person's own left and right.
    pub marked: [[f32; 2]; N_KEYPOINTS],
    /// Positions found by the teacher, and the heights of the peaks, 0 to 1.
    pub taught: [([f32; 2], f32); N_KEYPOINTS],
    /// Length of the trunk, in pixels.
    pub trunk: f32,
}

/// The same keypoints with left and right swapped.
///
/// * `of`: all keypoints, or only the joints.
pub fn exchange_sides<T: Copy, const N: usize>(of: &[T; N]) -> [T; N] {
    core::array::from_fn(|keypoint| of[MIRROR[keypoint]])
}

fn distance(a: [f32; 2], b: [f32; 2]) -> f32 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

fn mean(of: &[f32]) -> f32 {
    of.iter().sum::<f32>() / of.len().max(1) as f32
}

impl Marks {
    /// Swaps the marks of left and right legs, or of left and right arms, if the teacher clearly contradicts them.
    ///
    /// * Returns two values: true if the legs were swapped, and true if the arms were swapped.
    pub fn mend_sides(&mut self) -> [bool; 2] {
        LIMBS.map(|limb| {
            let is_sure = |joint: &usize| {
                [*joint, MIRROR[*joint]].into_iter().all(|joint| {
                    self.marked[joint][0].is_finite() && self.taught[joint].1 > SURE_OF_SIDES
                })
            };
            let joints: Vec<usize> = limb.into_iter().filter(is_sure).collect();
            if joints.len() < 4 {
                return false;
            }
            let each = |of: &dyn Fn(usize) -> f32| {
                mean(&joints.iter().map(|joint| of(*joint)).collect::<Vec<f32>>())
            };
            let apart = each(&|joint| distance(self.marked[joint], self.marked[MIRROR[joint]]));
            let exchanged =
                each(&|joint| distance(self.marked[MIRROR[joint]], self.taught[joint].0));
            let as_marked = each(&|joint| distance(self.marked[joint], self.taught[joint].0));
            let is_wrong = apart >= APART * self.trunk && exchanged < NEARER * as_marked;
            if is_wrong {
                let before = self.marked;
                for joint in limb {
                    self.marked[joint] = before[MIRROR[joint]];
                }
            }
            is_wrong
        })
    }

    /// Takes extra keypoints that the teacher does not have from another teacher, if the other teacher finds the nearby joint at its mark.
    ///
    /// * `other`: results of the other teacher, as in [`taught`](Self::taught), with the same convention for left and right.
    pub fn add_extras(&mut self, other: &[([f32; 2], f32); N_KEYPOINTS]) {
        for keypoint in N_JOINTS..N_KEYPOINTS {
            if self.taught[keypoint].1 <= 0.0 && self.is_beside(keypoint, other) {
                self.taught[keypoint] = other[keypoint];
            }
        }
    }

    /// Returns true if a teacher finds the joint near an extra keypoint close to the annotator's mark of that joint.
    fn is_beside(&self, keypoint: usize, taught: &[([f32; 2], f32); N_KEYPOINTS]) -> bool {
        let beside = BESIDE[keypoint - N_JOINTS];
        distance(self.marked[beside], taught[beside].0) < AGREED_BESIDE * self.trunk
    }

    /// Swaps left and right, both in the marks and in the teacher's results.
    pub fn exchange(&mut self) {
        self.marked = exchange_sides(&self.marked);
        self.taught = exchange_sides(&self.taught);
    }

    /// Returns the keypoints that the network should find.
    ///
    /// If mark and teacher agree, the target is their mean. If they differ and the teacher is certain, both positions are targets. Without
    /// a mark, the target is the teacher's position, weighted by its peak. An extra keypoint without a mark is taken from the teacher if
    /// the teacher is certain of it and finds the nearby joint at its mark.
    pub fn targets(&self) -> [Target; N_KEYPOINTS] {
        core::array::from_fn(|joint| {
            let marked = self.marked[joint];
            let (taught, peak) = self.taught[joint];
            let is_marked = marked[0].is_finite() && marked[1].is_finite();
            let target = Target {
                at: marked,
                or: None,
                weight: 1.0,
                is_marked,
            };
            if !is_marked && joint >= N_JOINTS {
                return self.extra(joint);
            }
            if !is_marked {
                let weight = if peak > ALONE { peak.min(1.0) } else { 0.0 };
                return Target {
                    at: taught,
                    weight,
                    ..target
                };
            }
            let agree = distance(marked, taught) < AGREED * self.trunk;
            if agree && peak > USABLE {
                let at = [0, 1].map(|axis| f32::midpoint(marked[axis], taught[axis]));
                Target { at, ..target }
            } else if !agree && peak > SURE {
                Target {
                    or: Some(taught),
                    ..target
                }
            } else {
                target
            }
        })
    }

    /// An extra keypoint found by the teacher.
    fn extra(&self, keypoint: usize) -> Target {
        let (at, peak) = self.taught[keypoint];
        if peak > SURE_OF_EXTRAS && self.is_beside(keypoint, &self.taught) {
            Target {
                at,
                or: None,
                weight: 1.0,
                is_marked: true,
            }
        } else {
            Target::UNKNOWN
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_extra_keypoint_is_trained_if_the_teacher_is_certain_and_agrees_on_the_nearest_joint() {
        let heel = N_JOINTS + 2;
        let ankle = BESIDE[2];
        let mut marks = Marks {
            marked: [[f32::NAN; 2]; N_KEYPOINTS],
            taught: [([f32::NAN; 2], 0.0); N_KEYPOINTS],
            trunk: 50.0,
        };
        marks.marked[ankle] = [10.0, 80.0];
        marks.taught[ankle] = ([12.0, 81.0], 0.9);
        marks.taught[heel] = ([8.0, 90.0], 0.9);
        let target = marks.targets()[heel];
        assert_eq!((target.at, target.weight), ([8.0, 90.0], 1.0));
        marks.taught[heel].1 = 0.4;
        assert_eq!(marks.targets()[heel].weight, 0.0, "it is not sure");
        marks.taught[heel].1 = 0.9;
        marks.taught[ankle].0 = [30.0, 80.0];
        assert_eq!(marks.targets()[heel].weight, 0.0, "another foot");

        let mut other = marks.taught;
        other[heel].0 = [7.0, 91.0];
        marks.taught[ankle].0 = [12.0, 81.0];
        marks.add_extras(&other);
        assert_eq!(marks.targets()[heel].at, [8.0, 90.0], "the first knows it");
        marks.taught[heel].1 = 0.0;
        marks.add_extras(&other);
        assert_eq!(marks.targets()[heel].weight, 0.0, "the other's foot");
        other[ankle].0 = [9.0, 79.0];
        marks.add_extras(&other);
        assert_eq!(marks.targets()[heel].at, [7.0, 91.0]);
    }

    #[test]
    fn the_nearest_joint_of_a_keypoint_has_the_same_side() {
        for extra in 0..BESIDE.len() {
            let mirrored = MIRROR[N_JOINTS + extra] - N_JOINTS;
            assert_eq!(MIRROR[BESIDE[extra]], BESIDE[mirrored], "{extra}");
        }
    }
}
