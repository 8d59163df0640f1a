//! The pictures in which people fit a rig worst.

use crate::synchronisation::{Film, Person, Shot};
use geometry::Camera;
use nalgebra::Point3;
use statistics::Sorted;

use super::frame::Skeletons;

/// Minimum number of joints of a person for which the fit is evaluated.
const LEAST: usize = 6;
/// Minimum time between two pictures of a camera, in seconds.
const APART_S: f64 = 0.5;

/// A rig and the films of its cameras.
#[derive(Debug, Clone, Copy)]
pub struct Fitted<'a> {
    /// The cameras of the rig.
    pub cameras: &'a [Camera],
    /// Film of each camera.
    pub films: &'a [Film],
    /// Offset to add to the times of each camera to get common times, in seconds.
    pub offsets_s: &'a [f64],
    /// For each joint, the index of the corresponding joint on the other side of the body.
    pub sides: &'a [usize],
    /// Instants in seconds on the common clock, and the skeleton at each.
    pub skeletons: (&'a [f64], &'a Skeletons),
}

/// A picture, and the fit of its person.
#[derive(Debug, Clone, PartialEq)]
pub struct Misfit {
    /// Index of the camera.
    pub camera: usize,
    /// Time of the picture, in seconds by the clock of the camera.
    pub time_s: f64,
    /// Median distance of the joints from the positions that the rig predicts, in pixels.
    pub residual_px: f64,
    /// Seen position and predicted position of each joint, in pixels of the calibrated picture.
    pub joints: Vec<[[f64; 2]; 2]>,
}

impl Fitted<'_> {
    /// Returns the worst pictures of each camera, worst first.
    ///
    /// * `most`: maximum number of pictures per camera.
    pub fn worst(&self, most: usize) -> Vec<Misfit> {
        let mut worst: Vec<Misfit> = Vec::new();
        for camera in 0..self.cameras.len() {
            let mut own = self.of_camera(camera);
            own.sort_by(|a, b| b.residual_px.total_cmp(&a.residual_px));
            let mut chosen: Vec<Misfit> = Vec::new();
            for it in own {
                let is_other = |other: &Misfit| (it.time_s - other.time_s).abs() >= APART_S;
                if chosen.len() < most && chosen.iter().all(is_other) {
                    chosen.push(it);
                }
            }
            worst.extend(chosen);
        }
        worst.sort_by(|a, b| b.residual_px.total_cmp(&a.residual_px));
        worst
    }

    fn of_camera(&self, camera: usize) -> Vec<Misfit> {
        let (film, offset_s) = (&self.films[camera], self.offsets_s[camera]);
        let intervals = film.shots.windows(2).map(|pair| pair[1].time_s - pair[0].time_s);
        let intervals: Vec<f64> = intervals.collect();
        let interval_s = Sorted::new(intervals).upper_median().unwrap_or(0.0);
        let (times_s, skeletons) = self.skeletons;
        let mut found = Vec::new();
        for (time_s, skeleton) in times_s.iter().zip(skeletons) {
            let own_s = time_s - offset_s;
            let away = |shot: &&Shot| (shot.time_s - own_s).abs();
            let shot = film.shots.iter().min_by(|a, b| away(a).total_cmp(&away(b)));
            let Some(shot) = shot.filter(|shot| away(shot) <= 0.51 * interval_s) else {
                continue;
            };
            let people = shot.people.iter();
            let best = people
                .filter_map(|person| self.fit(camera, person, skeleton))
                .min_by(|a, b| a.0.total_cmp(&b.0));
            found.extend(best.map(|(residual_px, joints)| Misfit {
                camera,
                time_s: shot.time_s,
                residual_px,
                joints,
            }));
        }
        found
    }

    /// Returns the fit of a person to a skeleton; left and right are swapped if that fits better.
    fn fit(
        &self,
        camera: usize,
        person: &Person,
        skeleton: &[Option<Point3<f64>>],
    ) -> Option<(f64, Vec<[[f64; 2]; 2]>)> {
        let of_sides = |other: &dyn Fn(usize) -> usize| {
            let each = person.joints.iter().enumerate();
            let joints: Vec<[[f64; 2]; 2]> = each
                .filter_map(|(joint, seen)| {
                    let seen =
                        seen.filter(|joint| joint.at.iter().all(|value| value.is_finite()))?;
                    let at = skeleton.get(other(joint))?.as_ref()?;
                    let expected = self.cameras[camera].project(at)?;
                    Some([seen.at, [expected.x, expected.y]])
                })
                .collect();
            let away = |[seen, expected]: &[[f64; 2]; 2]| {
                (seen[0] - expected[0]).hypot(seen[1] - expected[1])
            };
            let median = Sorted::new(joints.iter().map(away).collect::<Vec<_>>()).upper_median();
            Some((median.filter(|_| joints.len() >= LEAST)?, joints))
        };
        let both = [
            of_sides(&|joint| joint),
            of_sides(&|joint| self.sides.get(joint).copied().unwrap_or(joint)),
        ];
        let each = both.into_iter().flatten();
        each.min_by(|a, b| a.0.total_cmp(&b.0))
    }
}

#[cfg(test)]
mod tests {
    use crate::synchronisation::Joint;

    use super::super::testing::{ring, sides, walker};
    use super::*;

    #[test]
    fn the_picture_with_the_largest_error_is_listed_first() {
        let cameras = ring(3);
        let times_s: Vec<f64> = (0..40).map(|i| f64::from(i) * 0.1).collect();
        let skeletons: Skeletons = times_s
            .iter()
            .map(|times_s| walker(*times_s, 1.0).map(|point| Some(Point3::from(point))).to_vec())
            .collect();
        let offsets_s = [0.0, 0.5, -0.2];
        let mut films: Vec<Film> = Vec::new();
        for (nth, camera) in cameras.iter().enumerate() {
            let shots = times_s.iter().map(|time_s| {
                let joints = walker(*time_s, 1.0).map(|point| {
                    let at = camera.project(&Point3::from(point)).unwrap();
                    Some(Joint {
                        at: [at.x, at.y],
                        score: 1.0,
                    })
                });
                // In one camera, left and right are swapped.
                let other = |joint: usize| if nth == 2 { sides()[joint] } else { joint };
                let joints = (0..14).map(|i| joints[other(i)]).collect();
                Shot {
                    time_s: time_s - offsets_s[nth],
                    people: vec![Person { joints }],
                }
            });
            films.push(Film {
                shots: shots.collect(),
            });
        }
        for joint in films[1].shots[25].people[0].joints.iter_mut().flatten() {
            joint.at[0] += 30.0;
        }
        let fitted = Fitted {
            cameras: &cameras,
            films: &films,
            offsets_s: &offsets_s,
            sides: &sides(),
            skeletons: (&times_s, &skeletons),
        };
        let worst = fitted.worst(2);
        assert_eq!(worst.len(), 6);
        assert_eq!(worst[0].camera, 1);
        assert!((worst[0].time_s - 2.0).abs() < 1e-9, "{}", worst[0].time_s);
        assert!((worst[0].residual_px - 30.0).abs() < 0.01);
        assert!(worst[1..].iter().all(|misfit| misfit.residual_px < 0.01));
    }
}
