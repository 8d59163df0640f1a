//! Landmarks of the body, found by the names of the joints. All sets of joints use the same landmarks.

use nalgebra::Point3;

use crate::Trial;
use crate::naming::LANDMARKS;

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
