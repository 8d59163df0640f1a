//! Left and right: as people call their own sides, or as they are seen.

use core::str::FromStr;

use crate::Person;

/// Whose left and right the joints of a data set are called by.
///
/// A model of parts knows an arm by the side of the picture that it is on, since that is all one view
/// shows for certain; LSP and LSP-extended name the arms as their owner would. The two differ for
/// people who are seen from behind.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Sides {
    /// As they were marked.
    #[default]
    Marked,
    /// As if everybody faced the camera: who is seen from behind has left and right exchanged.
    Seen,
}

/// A name that is not one of sides.
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
    /// Calls the joints of a person by these sides.
    ///
    /// * `joint_mirror`: the joint on the other side for every joint, see
    ///   [`SkeletonTable::joint_mirror`](crate::SkeletonTable::joint_mirror).
    ///
    /// # Panics
    ///
    /// If `joint_mirror` has not one entry a joint, or names one that is not there.
    #[must_use]
    pub fn of(self, person: Person, joint_mirror: &[usize]) -> Person {
        assert_eq!(
            joint_mirror.len(),
            person.joints.len(),
            "one entry of the mirror a joint"
        );
        if self == Self::Marked || !is_from_behind(&person.joints, joint_mirror) {
            return person;
        }
        let mirror = |it: &usize| (person.joints[*it], person.visible[*it]);
        let (joints, visible) = joint_mirror.iter().map(mirror).unzip();
        Person {
            joints,
            visible,
            ..person
        }
    }
}

/// Whether the right joints lie further right in the picture than the left ones: by the median over all
/// pairs that are known, so that crossed hands or feet decide nothing.
///
/// Of two joints that mirror each other the first one is the right one, as in PARSE and LSP.
fn is_from_behind(joints: &[[f64; 2]], joint_mirror: &[usize]) -> bool {
    let pairs = joint_mirror.iter().enumerate();
    let mut ahead: Vec<f64> = pairs
        .filter(|(right, left)| right < *left)
        .map(|(right, &left)| joints[right][0] - joints[left][0])
        .filter(|it| it.is_finite())
        .collect();
    ahead.sort_unstable_by(f64::total_cmp);
    let n = ahead.len();
    n > 0 && ahead[n / 2] + ahead[(n - 1) / 2] > 0.0
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use proptest::prelude::*;

    use super::*;
    use crate::SkeletonTable;

    /// Somebody who faces the camera, arms and legs apart: right is on the left of the picture.
    fn facing() -> Person {
        let right = [[40, 90], [41, 70], [42, 50], [58, 50], [59, 70], [60, 90]];
        let arms = [[30, 50], [33, 40], [40, 30], [60, 30], [67, 40], [70, 50]];
        let trunk = [[50, 25], [50, 10]];
        let joints = right.iter().chain(&arms).chain(&trunk);
        Person {
            image: PathBuf::from("a.png"),
            row: "person 1".to_owned(),
            joints: joints.map(|it| it.map(f64::from)).collect(),
            visible: (0..14).map(|it| it != 7).collect(),
        }
    }

    fn mirror() -> Vec<usize> {
        SkeletonTable::published().joint_mirror().to_vec()
    }

    /// As the same picture would be marked if it showed the person's back.
    fn from_behind(person: &Person) -> Person {
        let mirror = mirror();
        Person {
            joints: mirror.iter().map(|&it| person.joints[it]).collect(),
            visible: mirror.iter().map(|&it| person.visible[it]).collect(),
            ..person.clone()
        }
    }

    #[test]
    fn who_faces_the_camera_stays_as_marked() {
        assert_eq!(Sides::Seen.of(facing(), &mirror()), facing());
    }

    #[test]
    fn who_is_seen_from_behind_gets_the_sides_of_the_picture() {
        let behind = from_behind(&facing());
        assert_eq!(Sides::Seen.of(behind.clone(), &mirror()), facing());
        assert_eq!(Sides::Marked.of(behind.clone(), &mirror()), behind);
    }

    #[test]
    fn crossed_hands_and_unknown_joints_decide_nothing() {
        let mut crossed = facing();
        crossed.joints.swap(6, 11);
        crossed.joints[0] = [f64::NAN; 2];
        let same = |a: &Person, b: &Person| format!("{a:?}") == format!("{b:?}");
        assert!(same(&Sides::Seen.of(crossed.clone(), &mirror()), &crossed));
        let behind = from_behind(&crossed);
        assert!(same(&Sides::Seen.of(behind, &mirror()), &crossed));
    }

    #[test]
    fn without_pairs_there_are_no_sides() {
        let own: Vec<usize> = (0..14).collect();
        assert_eq!(
            Sides::Seen.of(from_behind(&facing()), &own),
            from_behind(&facing())
        );
    }

    proptest! {
        #[test]
        fn twice_is_as_once(xs in prop::collection::vec(-100.0..100.0_f64, 14)) {
            let mut person = facing();
            for (joint, x) in person.joints.iter_mut().zip(xs) {
                joint[0] = x;
            }
            let once = Sides::Seen.of(person, &mirror());
            prop_assert_eq!(Sides::Seen.of(once.clone(), &mirror()), once);
        }
    }
}
