//! Compares the poses found in every single view with the 3D pose of the followed person.

use geometry::Camera;
use messages::{Joint3d, SkeletonMessage};

use crate::overlay::joints_of;
use crate::pose3d::is_placed;
use crate::{FrameRecord, Scene};

/// Median distance of a view's joints from the result up to which the view counts as showing the same person, in metres.
const SAME_PERSON_M: f64 = 0.25;
/// Maximum distance of a joint that is counted, in metres. Larger distances count as this value.
const MOST_M: f64 = 0.3;

/// Returns the parts of a view's best candidate in pixels of the frame, once with left and right as named by the network or filters, and
/// once with left and right swapped. Returns `None` if the view has no candidate, or if its candidate is too uncertain.
pub(crate) fn readings(
    scene: &Scene,
    record: &FrameRecord,
    view: usize,
) -> Option<[Vec<[f64; 2]>; 2]> {
    let best = record.own(scene, view).filter(|own| own.is_clear)?;
    let named = best.centres_px;
    let mirror = scene.model.spec().mirror.as_deref();
    let exchanged = mirror.map(|mirror| mirror.iter().map(|part| named[*part]).collect());
    Some([named.clone(), exchanged.unwrap_or(named)])
}

/// Returns true if the parts of a view fit the solution better if left and right are swapped.
pub(crate) fn is_exchanged(
    scene: &Scene,
    record: &FrameRecord,
    view: usize,
    readings: &[Vec<[f64; 2]>; 2],
) -> bool {
    let sum = |parts: &[[f64; 2]]| -> f64 {
        let distances = distances(scene, record, view, parts);
        distances.iter().map(|distance| distance[0]).sum()
    };
    sum(&readings[1]) < sum(&readings[0])
}

/// Returns the distances of the views' joints from the joints of the solution, converted from pixels to metres at the depth of the joint
/// and limited to 0.3 each. Only views that show the same person are used or, if there are fewer than two of these, all views.
pub(crate) fn distances_m(scene: &Scene, record: &FrameRecord) -> Vec<f64> {
    let of_view = |view: usize| {
        let readings = readings(scene, record, view)?;
        let is_exchanged = is_exchanged(scene, record, view, &readings);
        let distances = distances(scene, record, view, &readings[usize::from(is_exchanged)]);
        let mut metres: Vec<f64> = distances.iter().map(|distance| distance[1]).collect();
        metres.sort_by(f64::total_cmp);
        Some(metres).filter(|metres| !metres.is_empty())
    };
    let views: Vec<Vec<f64>> = (0..scene.views.len()).filter_map(of_view).collect();
    let is_same = |metres: &Vec<f64>| metres[metres.len() / 2] < SAME_PERSON_M;
    let are_agreed = views.iter().filter(|view| is_same(view)).count() >= 2;
    let counted = views.iter().filter(|view| is_same(view) || !are_agreed);
    counted.flatten().map(|counted| counted.min(MOST_M)).collect()
}

/// Returns the distances of a view's joints from those of the solution, in pixels of the frame and in metres. Only joints for which both
/// distances are known are returned.
fn distances(
    scene: &Scene,
    record: &FrameRecord,
    view: usize,
    parts: &[[f64; 2]],
) -> Vec<[f64; 2]> {
    let camera = scene.views[view].framing.camera();
    let joints = record.followed().map_or(&[][..], SkeletonMessage::listed_joints);
    let seen = joints_of(scene, parts).unwrap_or_default();
    let both = joints.iter().zip(&seen);
    both.filter_map(|(joint, seen)| distance(camera, joint, *seen)).collect()
}

fn distance(camera: &Camera, joint: &Joint3d, seen: [f64; 2]) -> Option<[f64; 2]> {
    let joint = is_placed(joint).then_some(joint)?;
    let in_world = joint.in_world.into();
    let pixel = camera.project(&in_world)?;
    let [width, height] = camera.intrinsics.size.map(f64::from);
    let is_inside = (0.0..width).contains(&pixel.x) && (0.0..height).contains(&pixel.y);
    let px = (pixel.x - seen[0]).hypot(pixel.y - seen[1]);
    let metres = px * (camera.camera_from_world * in_world).z / camera.intrinsics.fx;
    (is_inside && metres.is_finite()).then_some([px, metres])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{record, scene};

    #[test]
    fn a_view_without_a_candidate_has_no_offset() {
        let scene = scene();
        let mut record = record(0);
        assert!(readings(&scene, &record, 0).is_some());
        record.views[0].pose = None;
        assert!(readings(&scene, &record, 0).is_none());
        // The parts of this model are not joints.
        assert_eq!(distances_m(&scene, &record), [0.0; 0]);
    }

    #[test]
    fn a_distance_is_in_pixels_and_in_metres_at_the_depth_of_the_joint() {
        let scene = scene();
        let camera = scene.views[0].framing.camera();
        let joint = Joint3d {
            in_world: [0.1, -0.2, 2.0],
            ..crate::testing::skeletons(0).people[0].joints[0]
        };
        let pixel = camera.project(&joint.in_world.into()).unwrap();
        let [px, metres] = distance(camera, &joint, [pixel.x + 3.0, pixel.y - 4.0]).unwrap();
        assert!((px - 5.0).abs() < 1e-9);
        // The camera is three metres in front of the world's origin.
        assert!((metres - 5.0 * 5.0 / camera.intrinsics.fx).abs() < 1e-9);
        let outside = Joint3d {
            in_world: [9.0, 0.0, 2.0],
            ..joint
        };
        assert!(distance(camera, &outside, [0.0, 0.0]).is_none());
        let unplaced = Joint3d {
            status: messages::Status::NO_DETECTION,
            ..joint
        };
        assert!(distance(camera, &unplaced, [0.0, 0.0]).is_none());
    }

    /// A joint set with one joint, which is the only part of the model.
    static ONE: skeleton::JointSet = skeleton::JointSet {
        name: "one",
        joints: &[skeleton::Joint {
            name: "all",
            parts: &[0],
        }],
        limbs: &[],
    };

    #[test]
    fn views_of_another_person_count_only_if_no_two_views_agree() {
        let mut scene = scene();
        scene.joints = &ONE;
        scene.views.push(scene.views[1].clone());
        let mut record = record(0);
        record.views.push(record.views[1].clone());
        record.skeletons.people[0].n_joints = 1;
        // The joint is where every view saw its part, six metres in front of the cameras.
        let [parts, _] = readings(&scene, &record, 0).unwrap();
        let lens = scene.views[0].framing.camera().intrinsics;
        let right = [
            6.0 * (parts[0][0] - lens.cx) / lens.fx,
            6.0 * (parts[0][1] - lens.cy) / lens.fy,
            3.0,
        ];
        record.skeletons.people[0].joints[0].in_world = right;
        let all = distances_m(&scene, &record);
        assert!(
            all.len() == 3 && all.iter().all(|value| *value < 1e-6),
            "{all:?}"
        );
        // A view that saw a person one metre to the side is left out.
        let aside = Camera {
            camera_from_world: nalgebra::Isometry3::translation(0.5, 0.0, 3.0),
            ..scene.views[2].framing.camera().clone()
        };
        let whole = geometry::OutSize::Exact([80, 60]);
        let framing = geometry::Framing::new(&aside, [80, 60], None, whole, 0.0).unwrap();
        scene.views[2].framing = framing;
        assert_eq!(distances_m(&scene, &record).len(), 2);
        // If two views disagree, it is not known which view is right. Both count, and their errors are limited.
        record.views[0].pose = None;
        let both = distances_m(&scene, &record);
        assert!(
            both.len() == 2 && (both[1] - MOST_M).abs() < 1e-9,
            "{both:?}"
        );
    }
}
