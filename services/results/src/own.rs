//! Compares the poses found in every single view with the 3D pose of the followed person.

use geometry::Camera;
use messages::{Joint3d, SkeletonMessage};
use nalgebra::{Point3, Vector3};

use crate::frame::Own;
use crate::pose3d::is_placed;
use crate::{FrameRecord, Scene};

/// A distance in a picture that is larger than any other, in pixels.
const FAR_PX: f64 = 1e9;
/// Minimum distance of a person from all others at which the views' candidates for this person can be told from those for others, in metres.
const APART_M: f64 = 0.8;
/// Median distance of a view's joints from the result up to which the view counts as showing the same person, in metres.
const SAME_PERSON_M: f64 = 0.25;
/// Maximum distance of a joint that is counted, in metres. Larger distances count as this value.
const MOST_M: f64 = 0.3;

/// Returns the candidate of a view that is probably the followed person.
pub(crate) fn followed(scene: &Scene, record: &FrameRecord, view: usize) -> Option<Own> {
    candidate(scene, record, view, record.followed())
}

/// Returns the candidate of a view that is probably a given person. With the filters, this is the best candidate. With a network, it is the
/// candidate closest to the projected person, unless it is closer to another person; or the largest candidate if the person is not in the
/// picture.
fn candidate(
    scene: &Scene,
    record: &FrameRecord,
    view: usize,
    person: Option<&SkeletonMessage>,
) -> Option<Own> {
    let candidates = record.candidates(scene, view);
    if !scene.has_maps {
        return candidates.into_iter().next();
    }
    let key = |own: &Own| {
        let px = person.and_then(|person| distance_px(scene, view, own, person));
        let known = own.centres_px.iter().copied().filter(|at| at[0].is_finite());
        px.unwrap_or_else(|| FAR_PX - geometry::longer_side(known).unwrap_or(0.0))
    };
    let keys = candidates.into_iter().map(|own| (key(&own), own));
    let (own_px, own) = keys.min_by(|a, b| a.0.total_cmp(&b.0))?;
    let id = person.map(|person| person.id);
    let others = record.skeletons.listed().iter().filter(|other| Some(other.id) != id);
    let mut others_px = others.filter_map(|other| distance_px(scene, view, &own, other));
    let is_of_another = others_px.any(|px| px < own_px);
    (!is_of_another).then_some(own)
}

/// Returns the mean distance of a candidate's joints from the projected joints of a person, in pixels of the frame, with left and right as
/// named or swapped. Returns `None` if they share no joint.
fn distance_px(scene: &Scene, view: usize, own: &Own, person: &SkeletonMessage) -> Option<f64> {
    let mirror = scene.model.spec().mirror.as_deref();
    let swapped: Option<Vec<_>> =
        mirror.map(|mirror| mirror.iter().map(|part| own.centres_px[*part]).collect());
    let mean = |parts: &[[f64; 2]]| {
        let distances = distances(scene, person, view, parts);
        let sum: f64 = distances.iter().map(|distance| distance[0]).sum();
        (!distances.is_empty()).then(|| sum / distances.len() as f64)
    };
    let [named, swapped] = [
        mean(&own.centres_px),
        swapped.and_then(|parts| mean(&parts)),
    ];
    named.zip(swapped).map(|(a, b)| a.min(b)).or(named)
}

/// Returns the person who is farthest from all others; `None` if that person is less than [`APART_M`] from another one, or if another person
/// in view has no joints, and so no known position.
pub(crate) fn apart(record: &FrameRecord) -> Option<&SkeletonMessage> {
    let people: Vec<_> = record
        .skeletons
        .listed()
        .iter()
        .filter_map(|person| Some((person, centre(person)?)))
        .collect();
    if people.len() < record.skeletons.n_seen as usize {
        return None;
    }
    let nearest_m = |nth: usize| {
        let others = people.iter().enumerate().filter(|other| other.0 != nth);
        let metres = others.map(|(_, other)| (other.1 - people[nth].1).norm());
        metres.fold(f64::INFINITY, f64::min)
    };
    let each = people.iter().enumerate().map(|(nth, (person, _))| (nearest_m(nth), *person));
    let apart = each.max_by(|a, b| a.0.total_cmp(&b.0));
    apart.filter(|apart| apart.0 >= APART_M).map(|apart| apart.1)
}

/// Returns the mean of a person's joints; `None` if none is known.
fn centre(person: &SkeletonMessage) -> Option<Point3<f64>> {
    let placed = person.listed_joints().iter().filter(|joint| is_placed(joint));
    let (n, sum) = placed.fold((0.0, Vector3::zeros()), |(n, sum), joint| {
        (n + 1.0, sum + Vector3::from(joint.in_world))
    });
    (n > 0.0).then(|| Point3::from(sum / n))
}

/// Returns the parts of a view's candidate for a person in pixels of the frame, once with left and right as named by the network or filters,
/// and once with left and right swapped. Returns `None` if the view has no candidate, or if its candidate is too uncertain or of an earlier
/// frame.
pub(crate) fn readings(
    scene: &Scene,
    record: &FrameRecord,
    view: usize,
    person: Option<&SkeletonMessage>,
) -> Option<[Vec<[f64; 2]>; 2]> {
    let best = candidate(scene, record, view, person).filter(|own| own.is_clear && own.is_fresh)?;
    let named = best.centres_px;
    let mirror = scene.model.spec().mirror.as_deref();
    let exchanged = mirror.map(|mirror| mirror.iter().map(|part| named[*part]).collect());
    Some([named.clone(), exchanged.unwrap_or(named)])
}

/// Returns true if the parts of a view fit a person better if left and right are swapped.
pub(crate) fn is_exchanged(
    scene: &Scene,
    person: &SkeletonMessage,
    view: usize,
    readings: &[Vec<[f64; 2]>; 2],
) -> bool {
    let sum = |parts: &[[f64; 2]]| -> f64 {
        let distances = distances(scene, person, view, parts);
        distances.iter().map(|distance| distance[0]).sum()
    };
    sum(&readings[1]) < sum(&readings[0])
}

/// Returns the distances of the views' joints from the joints of the solution, converted from pixels to metres at the depth of the joint
/// and limited to 0.3 each. Only views that show the same person are used or, if there are fewer than two of these, all views.
pub(crate) fn distances_m(scene: &Scene, record: &FrameRecord) -> Vec<f64> {
    let of_view = |view: usize| {
        let person = record.followed()?;
        let readings = readings(scene, record, view, Some(person))?;
        let is_exchanged = is_exchanged(scene, person, view, &readings);
        let distances = distances(scene, person, view, &readings[usize::from(is_exchanged)]);
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

/// Returns the distances of a view's joints from those of a person, in pixels of the frame and in metres. Only joints for which both
/// distances are known are returned.
fn distances(
    scene: &Scene,
    person: &SkeletonMessage,
    view: usize,
    parts: &[[f64; 2]],
) -> Vec<[f64; 2]> {
    let camera = scene.views[view].framing.camera();
    let seen = scene.joints_of(parts).unwrap_or_default();
    let both = person.listed_joints().iter().zip(&seen);
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
        assert!(readings(&scene, &record, 0, record.followed()).is_some());
        record.views[0].pose = None;
        assert!(readings(&scene, &record, 0, record.followed()).is_none());
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

    #[test]
    fn the_candidate_of_a_person_is_found_among_those_of_others_who_are_apart() {
        let scene = Scene {
            has_maps: true,
            ..scene()
        };
        let mut record = record(0);
        let camera = scene.views[0].framing.camera().clone();
        let seen = |x: f64| {
            let at = camera.project(&[x, 0.0, 0.0].into()).unwrap();
            crate::testing::sighting([[at.x as f32, at.y as f32]; 14])
        };
        let mut set = |xs: [f64; 2], seen_at: &[f64]| {
            record.skeletons.n_people = 2;
            for ((person, id), x) in record.skeletons.people.iter_mut().zip(1..).zip(xs) {
                *person = crate::testing::skeletons(0).people[0];
                person.id = id;
                person.joints.iter_mut().for_each(|joint| joint.in_world = [x, 0.0, 0.0]);
            }
            let seen: Vec<_> = seen_at.iter().copied().map(seen).collect();
            record.views[0].pose = wire::sightings_to_message(&seen, 0, [80, 60]).ok();
            record.clone()
        };
        // The camera was moved: it sees both people 0.2 m to the right.
        let both = set([-0.5, 0.5], &[0.7, -0.3]);
        let people = &both.skeletons.people[..2];
        for (person, x) in people.iter().zip([-0.3, 0.7]) {
            let own = candidate(&scene, &both, 0, Some(person)).unwrap();
            let at = camera.project(&[x, 0.0, 0.0].into()).unwrap();
            assert!((own.centres_px[0][0] - at.x).abs() < 1e-3);
        }
        assert_eq!(apart(&both).unwrap().id, 2);
        // The second person is not seen.
        let one = set([-0.5, 0.5], &[-0.3]);
        assert!(candidate(&scene, &one, 0, Some(&one.skeletons.people[1])).is_none());
        assert!(apart(&set([-0.2, 0.2], &[0.7, -0.3])).is_none());
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
        let [parts, _] = readings(&scene, &record, 0, record.followed()).unwrap();
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
