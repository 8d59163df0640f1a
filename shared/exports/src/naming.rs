//! Names of points in the files.

/// A landmark of the body, and the joints of the sets that represent it. The first joint that a set has is used.
pub(crate) const LANDMARKS: [(&str, &[&str]); 15] = [
    ("pelvis", &["pelvis", "torsoDistal"]),
    ("neck", &["neck", "thorax", "torsoProximal"]),
    ("head", &["head", "headDistal"]),
    ("left shoulder", &["left shoulder", "upperLArmProximal"]),
    ("left elbow", &["left elbow", "upperLArmDistal"]),
    ("left wrist", &["left wrist", "lowerLArmDistal"]),
    ("right shoulder", &["right shoulder", "upperRArmProximal"]),
    ("right elbow", &["right elbow", "upperRArmDistal"]),
    ("right wrist", &["right wrist", "lowerRArmDistal"]),
    ("left hip", &["left hip", "upperLLegProximal"]),
    ("left knee", &["left knee", "upperLLegDistal"]),
    ("left ankle", &["left ankle", "lowerLLegDistal"]),
    ("right hip", &["right hip", "upperRLegProximal"]),
    ("right knee", &["right knee", "upperRLegDistal"]),
    ("right ankle", &["right ankle", "lowerRLegDistal"]),
];

/// Returns the landmark of a joint of HumanEva-I's set, or any other name unchanged.
fn plain_name(joint: &str) -> &str {
    let is_humaneva = joint.contains(|letter: char| letter.is_ascii_uppercase());
    let found = LANDMARKS
        .iter()
        .filter(|_| is_humaneva)
        .find(|landmark| landmark.1.contains(&joint));
    found.map_or(joint, |landmark| landmark.0)
}

/// Names of the points in the files.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Naming {
    /// Names of the run, such as `right ankle`.
    #[default]
    Own,
    /// Names of OpenSim models with markers for keypoints (Pose2Sim's `HALPE_26`), such as `RAnkle`, `LBigToe`, `Hip`.
    OpenSim,
}

impl Naming {
    /// Returns the name in the files of a point that the run calls `name`.
    pub(crate) fn apply(self, name: &str) -> String {
        match self {
            Self::Own => name.to_owned(),
            Self::OpenSim => opensim(plain_name(name)),
        }
    }
}

/// Returns the side as a letter, then every word with a capital.
fn opensim(name: &str) -> String {
    if name == "pelvis" {
        return "Hip".to_owned();
    }
    let mut words: Vec<&str> = name.split([' ', '_']).filter(|part| !part.is_empty()).collect();
    if let [side @ ("left" | "right"), _, ..] = &mut words[..] {
        *side = if *side == "left" { "l" } else { "r" };
    }
    let capital = |word: &str| {
        let mut rest = word.chars();
        let first = rest.next().map(|letter| letter.to_uppercase().to_string());
        first.unwrap_or_default() + rest.as_str()
    };
    words.into_iter().map(capital).collect()
}

#[cfg(test)]
mod tests {
    use keypoints::HALPE_26;
    use skeleton::JointSet;

    use super::*;

    #[test]
    fn opensim_names_equal_those_of_the_marker_set() {
        // These are the names of Markers_Halpe26.xml of Pose2Sim 0.10, which does not have eyes and ears.
        let due = [
            "Nose",
            "LEye",
            "REye",
            "LEar",
            "REar",
            "LShoulder",
            "RShoulder",
            "LElbow",
            "RElbow",
            "LWrist",
            "RWrist",
            "LHip",
            "RHip",
            "LKnee",
            "RKnee",
            "LAnkle",
            "RAnkle",
            "Head",
            "Neck",
            "Hip",
            "LBigToe",
            "RBigToe",
            "LSmallToe",
            "RSmallToe",
            "LHeel",
            "RHeel",
        ];
        let own = HALPE_26.map(|name| if name == "head top" { "head" } else { name });
        assert_eq!(own.map(|name| Naming::OpenSim.apply(name)), due);
    }

    #[test]
    fn joints_of_every_set_have_different_opensim_names() {
        for set in JointSet::ALL {
            let names = set.joints.iter().map(|joint| Naming::OpenSim.apply(joint.name));
            let names: Vec<String> = names.collect();
            for (nth, name) in names.iter().enumerate() {
                assert!(!names[..nth].contains(name), "{}: {name} twice", set.name);
                assert!(!name.contains(' '), "{name}");
            }
            for due in ["RAnkle", "LKnee", "RShoulder", "LWrist", "Head"] {
                assert!(
                    names.iter().any(|name| name == due),
                    "{}: {names:?}",
                    set.name
                );
            }
        }
    }
}
