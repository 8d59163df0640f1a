//! The names of the keypoints of a file.

use crate::names::{BODY_25, COCO_17, HALPE_26, OPENPOSE_18, SETS, WHOLE_BODIES, joint_rows};

/// Maximum number of keypoints of a person.
const MAX_KEYPOINTS: usize = 256;

/// Distinct names of keypoints, in the order of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NameSet {
    names: Vec<String>,
    /// Number of keypoints of a person in the file. Keypoints after the named ones are not read.
    in_file: usize,
}

/// Reason why texts are not valid names of keypoints.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NamesError {
    /// There is no known set with this name.
    #[error("{name:?} is not a known set of keypoints: expected one of {}", NameSet::known_sets().join(", "))]
    UnknownSet {
        /// Name that is unknown.
        name: String,
    },
    /// There are too few or too many names.
    #[error("there are {n} names of keypoints, expected 1 to {MAX_KEYPOINTS}")]
    Number {
        /// Number of names.
        n: usize,
    },
    /// Two keypoints have the same name.
    #[error("the keypoint {name:?} is listed twice, but each name must occur only once")]
    Twice {
        /// Name that occurs twice.
        name: String,
    },
    /// No joint of the skeleton can be computed from the keypoints.
    #[error(
        "no joint of the skeleton can be derived from the keypoints {names}: expected names such as \"left shoulder\""
    )]
    NoJoint {
        /// Names of the first keypoints.
        names: String,
    },
}

impl NameSet {
    /// Creates a set from names. Both `left_hip` and `Left Hip` become `left hip`.
    ///
    /// # Errors
    ///
    /// Returns a [`NamesError`] on failure.
    pub fn new(names: impl IntoIterator<Item = impl AsRef<str>>) -> Result<Self, NamesError> {
        // One name more than the maximum is taken, to detect that there are too many without taking all of them.
        let names = names.into_iter().take(MAX_KEYPOINTS + 1);
        let plain = |text: &str| text.trim().replace(['_', '-'], " ").to_lowercase();
        let names: Vec<String> = names.map(|name| plain(name.as_ref())).collect();
        if !(1..=MAX_KEYPOINTS).contains(&names.len()) {
            return Err(NamesError::Number { n: names.len() });
        }
        let twice = names.iter().enumerate().find(|(nth, it)| names[..*nth].contains(it));
        if let Some((_, name)) = twice {
            return Err(NamesError::Twice { name: name.clone() });
        }
        if joint_rows(&names).iter().all(Option::is_none) {
            let first: Vec<String> = names.iter().take(4).map(|name| format!("{name:?}")).collect();
            return Err(NamesError::NoJoint {
                names: first.join(", "),
            });
        }
        let in_file = names.len();
        Ok(Self { names, in_file })
    }

    /// Returns the names of all known sets: [`SETS`] and [`WHOLE_BODIES`].
    pub fn known_sets() -> Vec<&'static str> {
        let whole = WHOLE_BODIES.iter().map(|set| set.0);
        SETS.iter().map(|set| set.0).chain(whole).collect()
    }

    /// Returns a known set: one of [`SETS`] or [`WHOLE_BODIES`].
    ///
    /// # Errors
    ///
    /// Returns [`NamesError::UnknownSet`] if there is no such set.
    pub fn of_set(name: &str) -> Result<Self, NamesError> {
        let body = SETS.iter().find(|set| set.0 == name);
        let whole = WHOLE_BODIES.iter().find(|set| set.0 == name);
        body.map(|set| Self::known(set.1, set.1.len()))
            .or_else(|| whole.map(|set| Self::known(set.1, set.2)))
            .ok_or_else(|| NamesError::UnknownSet {
                name: name.chars().take(64).collect(),
            })
    }

    /// Returns the set that programs use if they write this number of keypoints: 17 for `coco-17`, 18 for `openpose-18`, 25 for `body-25`,
    /// 26 for `halpe-26`, and the sets of [`WHOLE_BODIES`].
    pub fn of_number(n: usize) -> Option<Self> {
        let body: &[&str] = match n {
            17 => &COCO_17,
            18 => &OPENPOSE_18,
            25 => &BODY_25,
            26 => &HALPE_26,
            _ => WHOLE_BODIES.iter().find(|set| set.2 == n)?.1,
        };
        Some(Self::known(body, n))
    }

    fn known(names: &[&str], in_file: usize) -> Self {
        let names = names.iter().map(|&name| name.to_owned()).collect();
        Self { names, in_file }
    }

    /// Returns the names, in order.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Returns the number of names.
    pub fn n(&self) -> usize {
        self.names.len()
    }

    /// Returns the number of keypoints of a person in the file: the named keypoints, and the keypoints after them, which are not read.
    pub fn n_in_file(&self) -> usize {
        self.in_file
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_number_of_keypoints_identifies_the_set_of_a_program() {
        for (n, set) in [
            (17, "coco-17"),
            (18, "openpose-18"),
            (25, "body-25"),
            (26, "halpe-26"),
            (133, "coco-wholebody-133"),
            (135, "body-135"),
            (136, "halpe-136"),
        ] {
            let found = NameSet::of_number(n).unwrap();
            assert_eq!(
                (found.n_in_file(), &found),
                (n, &NameSet::of_set(set).unwrap())
            );
        }
        assert_eq!(NameSet::of_number(134), None);
    }

    #[test]
    fn every_known_set_passes_the_checks_of_given_names() {
        for (set, names) in SETS {
            assert_eq!(NameSet::new(names), NameSet::of_set(set), "{set}");
        }
    }

    #[test]
    fn names_in_the_spelling_of_coco_are_accepted() {
        let set = NameSet::new(["nose", "left_hip", "Right Hip"]).unwrap();
        assert_eq!(set.names(), ["nose", "left hip", "right hip"]);
    }

    #[test]
    fn impossible_names_are_refused() {
        let refused = |names: &[&str]| NameSet::new(names).unwrap_err().to_string();
        assert!(refused(&[]).contains("0 names"));
        assert!(refused(&["neck"; 300]).contains("257 names"));
        assert!(refused(&["left_hip", "left hip"]).contains("\"left hip\" is listed twice"));
        assert!(refused(&["kp_0", "kp_1"]).contains("no joint of the skeleton"));
        let unknown = NameSet::of_set("coco17").unwrap_err().to_string();
        assert!(
            unknown.contains("\"coco17\"") && unknown.contains("coco-17"),
            "{unknown}"
        );
    }
}
