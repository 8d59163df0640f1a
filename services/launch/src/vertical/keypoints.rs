//! Finds the vertical from keypoints in files: the heads of people are above their ankles.
//!
//! In a picture, the head and the ankles of a person define a plane with the camera, and the vertical is in this plane. People who lean do
//! so in different directions, so the errors cancel over many pictures. People need not be recognised from one picture to the next.

use ::keypoints::Keypoint;
use deployment::Deployment;
use failure::{ExitKind, Failure, OrFail as _};
use geometry::Camera;
use nalgebra::{Point2, UnitVector3, Vector3};

use super::{Vertical, common_normal, snapped, text};
use crate::keypoints as keypoint_files;

/// Maximum number of frames per camera that are read, spread evenly over its keypoints.
const MOST_FRAMES: u64 = 60;
/// Minimum score of a keypoint.
const LEAST_SCORE: f64 = 0.2;
/// Minimum number of detections of people, over all frames and cameras.
const LEAST_PEOPLE: usize = 5;
/// Minimum fraction of people whose heads are above their ankles.
const LEAST_AGREEING: f64 = 0.7;
/// Limit on the median angle between people and the vertical, in degrees.
const MOST_LEAN: f64 = 25.0;

/// Direction of one person in one picture.
struct Standing {
    /// Normal of the plane through the camera, the head and the ankles, in the world.
    normal: Vector3<f64>,
    /// Direction from the ankles to the head, in this plane and perpendicular to the ray to the ankles.
    upward: Vector3<f64>,
}

/// Finds the vertical. Returns `None` if the head and ankles of too few people were found, or if the people do not agree on the direction.
///
/// * `cameras`: the cameras of the deployment that are in its rig.
pub(super) fn find(
    deployment: &Deployment,
    cameras: &[Camera],
) -> Result<Option<Vertical>, Failure> {
    let mut all = Vec::new();
    for entry in &deployment.cameras {
        let camera = cameras.iter().find(|camera| camera.name == entry.name);
        let (Some(camera), Some(source)) = (camera, keypoint_files::of_camera(entry)?) else {
            continue;
        };
        let ways = ::keypoints::joint_ways(source.names().names());
        let offset = entry.source_offset_px.unwrap_or([0, 0]).map(f64::from);
        let step = source.n_frames().div_ceil(MOST_FRAMES).max(1);
        let mut people = Vec::new();
        for frame in (0..source.n_frames()).step_by(step as usize) {
            source.of_frame(frame, &mut people).or_fail(ExitKind::Input)?;
            let standing = people.iter().filter_map(|person| {
                let joint = |nth: usize| {
                    let found = |at: usize| person.keypoints.get(at).copied().flatten();
                    ways[nth].iter().find_map(|way| weighted(&way.row, found))
                };
                let at = |pixel: [f64; 2]| {
                    let pixel = Point2::new(pixel[0] + offset[0], pixel[1] + offset[1]);
                    Some(camera.ray(&pixel)?.direction)
                };
                let ankles = [joint(0), joint(5)].into_iter().flatten();
                let ankles: Vec<[f64; 2]> = ankles.collect();
                let head = joint(13).or_else(|| joint(12))?;
                Standing::from_rays(at(head)?, at(middle(&ankles)?)?)
            });
            all.extend(standing);
        }
    }
    Ok(vertical(&all))
}

impl Standing {
    /// Computes the direction of a person from rays.
    ///
    /// * `head`, `ankles`: directions of the rays in the world.
    fn from_rays(head: UnitVector3<f64>, ankles: UnitVector3<f64>) -> Option<Self> {
        let normal = head.cross(&ankles).try_normalize(1e-3)?;
        let upward = ankles.cross(&normal);
        Some(Self { normal, upward })
    }
}

fn vertical(all: &[Standing]) -> Option<Vertical> {
    if all.len() < LEAST_PEOPLE {
        return None;
    }
    let normals: Vec<Vector3<f64>> = all.iter().map(|person| person.normal).collect();
    let up = common_normal(&normals, all.iter().map(|person| person.upward).sum())?;
    let n_agreeing = all.iter().filter(|person| person.upward.dot(&up) > 0.0).count();
    let share = n_agreeing as f64 / all.len() as f64;
    let mut leans: Vec<f64> =
        normals.iter().map(|normal| normal.dot(&up).abs().min(1.0).asin()).collect();
    leans.sort_by(f64::total_cmp);
    let lean = leans[leans.len() / 2].to_degrees();
    if share < LEAST_AGREEING || lean > MOST_LEAN {
        return None;
    }
    let up = snapped(up);
    let why = format!(
        "the calibration does not give the upward direction; up = {} is used: with it, {:.0} % of {} people in the keypoints have their heads above \
         their ankles, and half of them lean by less than {lean:.0} degrees; set `up` in the deployment if this is wrong",
        text(&up),
        100.0 * share,
        all.len()
    );
    Some(Vertical {
        up: up.into_inner().into(),
        why,
    })
}

/// Returns a weighted sum of keypoints, if all of them were found.
fn weighted(row: &[(usize, f64)], found: impl Fn(usize) -> Option<Keypoint>) -> Option<[f64; 2]> {
    let mut sum = [0.0; 2];
    for &(nth, weight) in row {
        let keypoint = found(nth).filter(|keypoint| keypoint.score >= LEAST_SCORE)?;
        for (sum, at) in sum.iter_mut().zip(keypoint.at) {
            *sum += weight * at;
        }
    }
    Some(sum)
}

fn middle(points: &[[f64; 2]]) -> Option<[f64; 2]> {
    let n = points.len();
    let mean = |axis: usize| points.iter().map(|point| point[axis]).sum::<f64>() / n as f64;
    (n > 0).then(|| [mean(0), mean(1)])
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point3, Rotation3};

    use super::super::tests::ring;
    use super::*;

    /// Returns the keypoints, in every camera, of people 1.7 m tall who stand at several places and lean by a few degrees.
    fn seen(rolls: &[f64], up: UnitVector3<f64>, lean_degrees: f64) -> Vec<Standing> {
        let world = Rotation3::rotation_between(&Vector3::z(), &up).unwrap();
        let mut all = Vec::new();
        for camera in ring(rolls, up) {
            for nth in 0..8 {
                let around = f64::from(nth) * core::f64::consts::FRAC_PI_4;
                let place = Vector3::new(0.6 * around.cos(), 0.6 * around.sin(), 0.1);
                let lean = lean_degrees.to_radians();
                let body = Vector3::new(
                    lean.sin() * around.sin(),
                    lean.sin() * around.cos(),
                    lean.cos(),
                );
                let ray = |at: Vector3<f64>| {
                    let at = Point3::from(world * at);
                    let pixel = camera.project(&at)?;
                    Some(camera.ray(&pixel)?.direction)
                };
                if let (Some(head), Some(ankles)) = (ray(place + 1.5 * body), ray(place)) {
                    all.extend(Standing::from_rays(head, ankles));
                }
            }
        }
        all
    }

    fn off(all: &[Standing], up: UnitVector3<f64>) -> f64 {
        let found = Vector3::from(vertical(all).unwrap().up);
        found.angle(&up).to_degrees()
    }

    #[test]
    fn heads_above_ankles_determine_the_vertical_for_any_camera_roll() {
        let odd = UnitVector3::new_normalize(Vector3::new(0.5, -0.7, 0.4));
        for up in [Vector3::z_axis(), -Vector3::y_axis(), odd] {
            for rolls in [
                [0.0; 4],
                [25.0, -20.0, 30.0, 22.0],
                [90.0, 90.0, -90.0, 180.0],
            ] {
                let off = [0.0, 10.0].map(|lean| off(&seen(&rolls, up, lean), up));
                assert!(off[0] < 1.0 && off[1] < 5.0, "{rolls:?}: {off:?} degrees");
            }
        }
    }

    #[test]
    fn without_people_or_without_agreement_no_vertical_is_found() {
        assert!(vertical(&[]).is_none());
        let mut lying = seen(&[0.0; 4], Vector3::z_axis(), 0.0);
        for (nth, it) in lying.iter_mut().enumerate() {
            let axis = UnitVector3::new_normalize(it.normal.cross(&it.upward));
            it.normal = Rotation3::from_axis_angle(&axis, nth as f64) * it.normal;
            it.upward = Rotation3::from_axis_angle(&axis, nth as f64) * it.upward;
        }
        assert!(vertical(&lying).is_none());
    }
}
