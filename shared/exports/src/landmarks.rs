//! Landmarks of the body, found by the names of the joints. All sets of joints use the same landmarks.

use nalgebra::Point3;

use crate::Trial;

/// A landmark of the body, and the joints of the sets that represent it. The first joint that a set has is used.
const LANDMARKS: [(&str, &[&str]); 15] = [
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
pub(crate) fn plain_name(joint: &str) -> &str {
    let is_humaneva = joint.contains(|letter: char| letter.is_ascii_uppercase());
    let found = LANDMARKS
        .iter()
        .filter(|_| is_humaneva)
        .find(|landmark| landmark.1.contains(&joint));
    found.map_or(joint, |landmark| landmark.0)
}

/// Points of a trial that are landmarks.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Landmarks {
    points: Vec<(&'static str, Vec<usize>)>,
}

impl Landmarks {
    pub(crate) fn of(trial: &Trial) -> Self {
        let at = |name: &str| trial.names().position(|known| known == name);
        let points = LANDMARKS.map(|(landmark, names)| {
            let one = names.iter().find_map(|name| at(name));
            (landmark, one.into_iter().collect())
        });
        let mut all = Self {
            points: points.into(),
        };
        // If a set has no pelvis, the pelvis is the middle of the hips.
        let hips = ["left hip", "right hip"].map(|name| all.points_of(name).to_vec());
        if all.points_of("pelvis").is_empty() && hips.iter().all(|hip| hip.len() == 1) {
            all.points[0].1 = hips.concat();
        }
        all
    }

    /// Returns the points whose mean is the landmark; empty if the set does not have the landmark.
    pub(crate) fn points_of(&self, landmark: &str) -> &[usize] {
        let found = self.points.iter().find(|point| point.0 == landmark);
        found.map_or(&[], |entry| &entry.1)
    }

    /// Returns the position of the landmark in the world; `None` in a gap.
    pub(crate) fn at(&self, trial: &Trial, slot: usize, landmark: &str) -> Option<Point3<f64>> {
        let points = self.points_of(landmark);
        let mut sum = nalgebra::Vector3::zeros();
        for &point in points {
            sum += trial.point(slot, point)?.in_world.coords;
        }
        (!points.is_empty()).then(|| Point3::from(sum / points.len() as f64))
    }
}
