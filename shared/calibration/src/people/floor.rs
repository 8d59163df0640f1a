//! Position of the floor in the world of a rig, from people who stood on the floor.

use nalgebra::{Point3, UnitVector3, Vector3};
use statistics::Sorted;

use super::frame::{ANKLE, LEAST, Skeletons, Vertical, standing, stature_of, vertical};

/// The floor that people stood on.
#[derive(Debug, Clone, PartialEq)]
pub struct Floor {
    /// Up direction, opposite to gravity.
    pub up: UnitVector3<f64>,
    /// Point on the floor at the centre of the positions where people stood.
    pub middle: Point3<f64>,
    /// Source of the vertical.
    pub vertical: Vertical,
    /// Number of standing feet that were used.
    pub n: usize,
    /// Median deviation of the ankles from a common height, in metres.
    pub spread_m: f64,
}

/// Returns the floor, below the ankles of people who stand; `None` if too few people stand.
///
/// * `times_s`: time of every instant, ascending.
/// * `skeletons`: the 14 joints at each instant, in metres in the world of the rig.
pub fn floor(times_s: &[f64], skeletons: &Skeletons) -> Option<Floor> {
    let (up, vertical) = vertical(times_s, skeletons)?;
    let feet = standing(times_s, skeletons, &up);
    if feet.len() < LEAST {
        return None;
    }
    let median = |value: &dyn Fn(&Point3<f64>) -> f64| {
        Sorted::new(feet.iter().map(value).collect::<Vec<_>>()).upper_median()
    };
    let height = median(&|foot| foot.coords.dot(&up))?;
    let spread_m = median(&|foot| (foot.coords.dot(&up) - height).abs())?;
    let middle = Vector3::new(
        median(&|foot| foot.x)?,
        median(&|foot| foot.y)?,
        median(&|foot| foot.z)?,
    );
    let ankle = ANKLE * stature_of(skeletons).map_or(1.7, |stature| stature.0);
    let above = middle.dot(&up) - (height - ankle);
    Some(Floor {
        middle: Point3::from(middle - up.scale(above)),
        up,
        vertical,
        n: feet.len(),
        spread_m,
    })
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Translation3, UnitQuaternion};

    use super::super::testing::walker;
    use super::*;

    /// Returns a person who walks on the floor z = 0, in a transformed world, with errors of the joints.
    fn walk(size: f64, noise: f64) -> (Vec<f64>, Skeletons, Isometry3<f64>) {
        let rotation = UnitQuaternion::from_scaled_axis(Vector3::new(0.7, -0.4, 1.1));
        let moved = Isometry3::from_parts(Translation3::new(2.0, -1.0, 0.5), rotation);
        let mut random = fastrand::Rng::with_seed(3);
        let times_s: Vec<f64> = (0..600).map(|i| f64::from(i) / 30.0).collect();
        let mut error = || noise * ((0..12).map(|_| random.f64()).sum::<f64>() - 6.0);
        let skeletons = times_s.iter().map(|time_s| {
            let joints = walker(*time_s, size).into_iter();
            let joints = joints.map(|joint| {
                let at = Point3::from(joint) + Vector3::new(error(), error(), error());
                Some(moved * at)
            });
            joints.collect()
        });
        (times_s.clone(), skeletons.collect(), moved)
    }

    #[test]
    fn the_floor_is_estimated_at_the_feet_of_people() {
        for noise in [0.0, 0.004] {
            let (times_s, skeletons, moved) = walk(1.0, noise);
            let found = floor(&times_s, &skeletons).unwrap();
            assert_eq!(found.vertical, Vertical::Feet);
            let degrees = (moved * Vector3::z()).angle(&found.up).to_degrees();
            let below = moved.inverse() * found.middle;
            assert!(degrees < 0.6, "{degrees} degrees, joints off by {noise}");
            assert!(below.z.abs() < 0.02, "{below}, joints off by {noise}");
            assert!(below.x.abs() < 1.0 && below.y.abs() < 1.0, "{below}");
            assert!(found.n > 50 && found.spread_m < 0.02, "{found:?}");
        }
    }

    #[test]
    fn a_person_on_one_spot_gives_the_vertical_by_the_body_and_an_empty_room_gives_none() {
        let (times_s, skeletons, _) = walk(0.0, 0.002);
        let found = floor(&times_s, &skeletons).unwrap();
        assert_ne!(found.vertical, Vertical::Feet);
        let nobody: Skeletons = vec![vec![None; 14]; times_s.len()];
        assert_eq!(floor(&times_s, &nobody), None);
        // The feet of this person never stand still.
        let mut carried = walk(0.0, 0.0).1;
        for (skeleton, time_s) in carried.iter_mut().zip(&times_s) {
            for joint in skeleton.iter_mut().flatten() {
                joint.x += 2.0 * time_s;
            }
        }
        assert_eq!(floor(&times_s, &carried), None);
    }
}
