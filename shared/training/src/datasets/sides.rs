//! Conventions for left and right: anatomical, or as seen in the picture.

use core::str::FromStr;

use statistics::Sorted;

use crate::datasets::Person;

/// The convention of left and right for the joints of a data set.
///
/// A model made of parts calls an arm left or right by its position in the picture, because a single view shows nothing else with
/// certainty. In LSP and LSP-extended, left and right are anatomical. The two conventions differ for people seen from behind.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Sides {
    /// Left and right as annotated.
    #[default]
    Marked,
    /// Left and right as if all people faced the camera: they are swapped for people seen from behind.
    Seen,
}

/// Error for an unknown name of a convention.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("expected marked or seen")]
pub struct UnknownSides;

impl FromStr for Sides {
    type Err = UnknownSides;

    fn from_str(name: &str) -> Result<Self, UnknownSides> {
        match name {
            "marked" => Ok(Self::Marked),
            "seen" => Ok(Self::Seen),
            _ => Err(UnknownSides),
        }
    }
}

impl Sides {
    /// Applies the convention to the joints of a person.
    ///
    /// * `joint_mirror`: for every joint, the joint on the other side, see
    ///   [`SkeletonTable::joint_mirror`](crate::datasets::SkeletonTable::joint_mirror).
    ///
    /// # Panics
    ///
    /// Panics if `joint_mirror` does not have one entry per joint, or has an index out of range.
    #[must_use]
    pub fn of(self, person: Person, joint_mirror: &[usize]) -> Person {
        assert_eq!(
            joint_mirror.len(),
            person.joints.len(),
            "the mirror must have one entry for each joint"
        );
        if self == Self::Marked || !is_from_behind(&person.joints, joint_mirror) {
            return person;
        }
        let mirror = |i: &usize| (person.joints[*i], person.visible[*i]);
        let (joints, visible) = joint_mirror.iter().map(mirror).unzip();
        Person {
            joints,
            visible,
            ..person
        }
    }
}

/// Returns true if the joints on the right of the body are to the right of the corresponding left joints in the picture. The median over
/// all known pairs is used, so that crossed hands or feet have no influence.
///
/// The first of two joints that mirror each other is the right one, as in PARSE and LSP.
fn is_from_behind(joints: &[[f64; 2]], joint_mirror: &[usize]) -> bool {
    let pairs = joint_mirror.iter().enumerate();
    let ahead: Vec<f64> = pairs
        .filter(|(right, left)| right < *left)
        .map(|(right, &left)| joints[right][0] - joints[left][0])
        .filter(|value| value.is_finite())
        .collect();
    Sorted::new(ahead).median().is_some_and(|median| median > 0.0)
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use proptest::prelude::*;

    use super::*;
    use crate::datasets::SkeletonTable;

    /// A person facing the camera with arms and legs apart: the right side is on the left of the picture.
    fn facing() -> Person {
        let right = [[40, 90], [41, 70], [42, 50], [58, 50], [59, 70], [60, 90]];
        let arms = [[30, 50], [33, 40], [40, 30], [60, 30], [67, 40], [70, 50]];
        let trunk = [[50, 25], [50, 10]];
        let joints = right.iter().chain(&arms).chain(&trunk);
        Person {
            image: PathBuf::from("a.png"),
            row: "person 1".to_owned(),
            joints: joints.map(|joint| joint.map(f64::from)).collect(),
            visible: (0..14).map(|i| i != 7).collect(),
        }
    }

    fn mirror() -> Vec<usize> {
        SkeletonTable::published().joint_mirror().to_vec()
    }

    /// The annotation of the same picture if it showed the person's back: left and right joints are swapped.
    fn from_behind(person: &Person) -> Person {
        let mirror = mirror();
        Person {
            joints: mirror.iter().map(|&mirror| person.joints[mirror]).collect(),
            visible: mirror.iter().map(|&mirror| person.visible[mirror]).collect(),
            ..person.clone()
        }
    }

    #[test]
    fn a_person_facing_the_camera_stays_as_annotated() {
        assert_eq!(Sides::Seen.of(facing(), &mirror()), facing());
    }

    #[test]
    fn a_person_seen_from_behind_gets_the_sides_of_the_picture() {
        let behind = from_behind(&facing());
        assert_eq!(Sides::Seen.of(behind.clone(), &mirror()), facing());
        assert_eq!(Sides::Marked.of(behind.clone(), &mirror()), behind);
    }

    #[test]
    fn crossed_hands_and_unknown_joints_do_not_affect_the_sides() {
        let mut crossed = facing();
        crossed.joints.swap(6, 11);
        crossed.joints[0] = [f64::NAN; 2];
        let same = |a: &Person, b: &Person| format!("{a:?}") == format!("{b:?}");
        assert!(same(&Sides::Seen.of(crossed.clone(), &mirror()), &crossed));
        let behind = from_behind(&crossed);
        assert!(same(&Sides::Seen.of(behind, &mirror()), &crossed));
    }

    #[test]
    fn without_mirrored_joints_no_sides_are_swapped() {
        let own: Vec<usize> = (0..14).collect();
        assert_eq!(
            Sides::Seen.of(from_behind(&facing()), &own),
            from_behind(&facing())
        );
    }

    proptest! {
        #[test]
        fn applying_a_convention_twice_is_the_same_as_once(xs in prop::collection::vec(-100.0..100.0_f64, 14)) {
            let mut person = facing();
            for (joint, x) in person.joints.iter_mut().zip(xs) {
                joint[0] = x;
            }
            let once = Sides::Seen.of(person, &mirror());
            prop_assert_eq!(Sides::Seen.of(once.clone(), &mirror()), once);
        }
    }
}
