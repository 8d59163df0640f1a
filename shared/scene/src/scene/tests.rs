//! Tests that pictures agree with their ground truth.

use std::collections::BTreeSet;

use super::*;
use crate::Action;
use crate::rigs::RigChoice;

fn scene(rig: &str, action: Action, subject: u64) -> Arc<Scene> {
    Arc::new(
        Scene::new(&Settings {
            rig: RigChoice::parse(rig).unwrap(),
            action,
            subject,
            ..Settings::default()
        })
        .unwrap(),
    )
}

fn picture(view: &mut View, frame: u64) -> (Vec<u8>, ViewTruth) {
    let mut rgb = vec![7; view.size().rgb_bytes()];
    let seen = view.picture(frame, &mut rgb);
    (rgb, seen)
}

#[test]
fn pixels_of_the_ground_truth_are_projections_of_its_joints() {
    for rig in ["humaneva", "umpm"] {
        let scene = scene(rig, Action::Walking, 2);
        for (nth, camera) in scene.rig().cameras().iter().enumerate() {
            let mut view = View::new(&scene, nth).unwrap();
            let seen = view.truth(11);
            assert_eq!(seen.seconds, scene.seconds(11));
            for (pixel, joint) in seen.pixels.iter().zip(scene.joints(seen.seconds)) {
                let projected = camera.project(&joint.into()).unwrap();
                let [x, y] = pixel.unwrap();
                assert!((x - projected.x).hypot(y - projected.y) < 1e-9);
            }
        }
    }
}

#[test]
fn visible_joints_lie_on_the_mask_and_the_box_encloses_the_mask() {
    for (nth, action) in Action::ALL.into_iter().enumerate() {
        let scene = scene("ring:3:4.4:1.6", action, nth as u64);
        let mut view = View::new(&scene, nth % 3).unwrap();
        let (_, seen) = picture(&mut view, 40);
        let (mask, size) = (view.mask(), view.size());
        let [x1, y1, x2, y2] = seen.outline.unwrap();
        let mut inside = [f64::MAX, f64::MAX, f64::MIN, f64::MIN];
        for (index, _) in mask.iter().enumerate().filter(|pixel| *pixel.1 > 0) {
            let [x, y] = [(index % size.width) as f64, (index / size.width) as f64];
            inside = [
                inside[0].min(x),
                inside[1].min(y),
                inside[2].max(x),
                inside[3].max(y),
            ];
        }
        assert_eq!(inside, [x1, y1, x2, y2]);
        let visible = seen.pixels.iter().zip(seen.visible).filter(|point| point.1);
        let mut n_visible = 0;
        for (pixel, _) in visible {
            let [x, y] = pixel.unwrap();
            n_visible += 1;
            assert!(
                (x1 - 3.0..=x2 + 3.0).contains(&x) && (y1 - 3.0..=y2 + 3.0).contains(&y),
                "{action:?}"
            );
            // The joint must be within 3 pixels of the visible person.
            let near =
                (-3..=3).flat_map(|dy| (-3..=3).map(move |dx| (x as i64 + dx, y as i64 + dy)));
            let on = near.filter(|(x, y)| {
                *x >= 0 && *y >= 0 && *x < size.width as i64 && *y < size.height as i64
            });
            let on = on.map(|(x, y)| mask[y as usize * size.width + x as usize]).max();
            assert!(
                on > Some(0),
                "{action:?}: a visible joint beside the person"
            );
        }
        assert!(n_visible >= 4, "{action:?}: {n_visible} joints visible");
    }
}

#[test]
fn joints_behind_the_body_are_not_visible() {
    // With cameras all around, every joint of the limbs is hidden in some view and visible in another.
    let scene = scene("ring:8", Action::Walking, 1);
    let views = (0..8).map(|i| View::new(&scene, i).unwrap().truth(3).visible);
    let views: Vec<_> = views.collect();
    for joint in [1, 4, 6, 7, 10, 11] {
        let seen: BTreeSet<bool> = views.iter().map(|view| view[joint]).collect();
        assert_eq!(seen.len(), 2, "joint {joint} is the same from everywhere");
    }
}

#[test]
fn left_joints_are_on_the_right_of_the_picture_if_seen_from_the_front() {
    let scene = scene("ring:8", Action::Walking, 1);
    let (mut n_front, mut n_behind) = (0, 0);
    for camera in 0..8 {
        let seen = View::new(&scene, camera).unwrap().truth(0);
        let x = |joint: usize| seen.pixels[joint].unwrap()[0];
        let width = (x(9) - x(8)) + (x(3) - x(2));
        if width.abs() > 20.0 {
            assert_eq!(width < 0.0, seen.from_behind, "camera {camera}");
            n_front += usize::from(!seen.from_behind);
            n_behind += usize::from(seen.from_behind);
        }
    }
    assert!(n_front >= 2 && n_behind >= 2);
}

#[test]
fn the_same_settings_give_the_same_bits_in_any_order() {
    let first = scene("ring:2", Action::Boxing, 4);
    let second = scene("ring:2", Action::Boxing, 4);
    let mut a = View::new(&first, 1).unwrap();
    let mut b = View::new(&second, 1).unwrap();
    let forward: Vec<_> = (0..3).map(|i| picture(&mut a, i)).collect();
    let mut copy = b.clone();
    drop(picture(&mut copy, 9));
    for frame in [2, 0, 1] {
        assert_eq!(picture(&mut b, frame), forward[frame as usize]);
        assert_eq!(picture(&mut copy, frame), forward[frame as usize]);
    }
    let other = scene("ring:2", Action::Boxing, 5);
    assert_ne!(picture(&mut View::new(&other, 1).unwrap(), 0), forward[0]);
}

#[test]
fn a_person_is_visible_and_casts_a_shadow() {
    let scene = scene("ring:2", Action::Gestures, 3);
    let mut view = View::new(&scene, 0).unwrap();
    let (rgb, _) = picture(&mut view, 5);
    let mask = view.mask();
    let (mut covered, mut darker) = (0, 0);
    for (index, share) in mask.iter().enumerate() {
        let grey =
            |image: &[u8]| image[3 * index..][..3].iter().map(|byte| i32::from(*byte)).sum::<i32>();
        let difference = grey(&rgb) - grey(&view.backdrop.bytes);
        match share {
            0 => darker += i32::from(difference < -20),
            _ => covered += 1,
        }
        assert!(
            *share > 0 || difference <= 6,
            "nothing beside the person gets lighter"
        );
    }
    assert!(covered > 3000, "{covered} pixels of the person");
    assert!(darker > 300, "{darker} pixels of shadow");
}

#[test]
fn clock_offsets_and_dropped_frames_are_in_the_ground_truth() {
    let mut settings = Settings {
        rig: RigChoice::parse("ring:2").unwrap(),
        ..Settings::default()
    };
    settings.flaws.desync_s = 0.2;
    settings.flaws.drop = 0.5;
    let scene = Arc::new(Scene::new(&settings).unwrap());
    let mut views = [0, 1].map(|i| View::new(&scene, i).unwrap());
    assert_eq!(
        views[0].truth(0).seconds,
        0.0,
        "the first camera's clock is right"
    );
    assert!(views[1].truth(0).seconds != 0.0);
    let mut before = None;
    let mut n_repeated = 0;
    for frame in 0..12 {
        let (rgb, seen) = picture(&mut views[0], frame);
        if seen.repeated {
            n_repeated += 1;
            assert_eq!(
                before.as_ref(),
                Some(&(rgb.clone(), seen.seconds)),
                "the previous picture is repeated"
            );
        } else {
            assert_eq!(seen.seconds, scene.seconds(frame));
        }
        before = Some((rgb, seen.seconds));
    }
    assert!(n_repeated > 1);
}

#[test]
fn a_camera_is_found_by_name_and_by_number() {
    let scene = scene("humaneva", Action::Walking, 1);
    assert_eq!(scene.camera("C2").unwrap(), 1);
    assert_eq!(scene.camera("2").unwrap(), 2);
    let error = scene.camera("3").unwrap_err().to_string();
    assert!(error.contains("C1, C2, C3"), "{error}");
}

/// Returns a scene with the given number of other people.
fn crowd(others: u64) -> Arc<Scene> {
    let settings = Settings {
        rig: RigChoice::parse("ring:3:6:1.6").unwrap(),
        others,
        ..Settings::default()
    };
    Arc::new(Scene::new(&settings).unwrap())
}

#[test]
fn the_ground_truth_and_the_mask_contain_only_the_subject() {
    let (alone, among) = (crowd(0), crowd(4));
    let mut n_hidden = 0;
    for (camera, frame) in (0..3).flat_map(|camera| [0, 40, 80].map(|frame| (camera, frame))) {
        let view = |scene| View::new(scene, camera).unwrap();
        let (mut alone, mut among) = (view(&alone), view(&among));
        let ((first, seen), (second, among_others)) =
            (picture(&mut alone, frame), picture(&mut among, frame));
        assert_eq!(seen.pixels, among_others.pixels);
        let changed = first.iter().zip(&second);
        let changed = changed.filter(|(a, b)| a.abs_diff(**b) > 20).count();
        assert!(changed > 3000, "camera {camera} sees the others: {changed}");
        // Other people may hide the subject, but are not part of its mask.
        let (mask, mask_among) = (alone.mask(), among.mask());
        let less = mask_among.iter().zip(&mask);
        assert!(less.clone().all(|(among, alone)| among <= alone));
        n_hidden += less.filter(|(among, alone)| among < alone).count();
        let visible = among_others.visible.iter().zip(seen.visible);
        assert!(visible.into_iter().all(|(among, alone)| !among || alone));
    }
    assert!(n_hidden > 0, "somebody stands before the subject");
}

#[test]
fn bystanders_are_drawn_and_are_not_the_subject() {
    let scene = crowd(4);
    let places: Vec<Vector3<f64>> = scene
        .others
        .iter()
        .map(|other| other.frames(1.0)[PELVIS].translation.vector)
        .collect();
    assert_eq!(places.len(), 4);
    for (nth, place) in places.iter().enumerate() {
        assert!((1.4..2.4).contains(&place.xy().norm()), "{place}");
        assert!(place.z > 0.5, "{place}");
        let far = |other: &Vector3<f64>| (other - place).norm() > 0.8;
        assert!(places[..nth].iter().all(far), "{places:?}");
    }
}

#[test]
fn people_who_pass_walk_about_and_keep_a_distance() {
    let settings = Settings {
        rig: RigChoice::parse("ring:3:6:1.6").unwrap(),
        passers: 3,
        ..Settings::default()
    };
    let scene = Scene::new(&settings).unwrap();
    let hips =
        |joints: &[[f64; 3]; N_JOINTS]| Vector3::from(joints[2]).lerp(&joints[3].into(), 0.5);
    let (mut nearest, mut closest) = (f64::INFINITY, f64::INFINITY);
    let mut paths = vec![Vec::new(); 3];
    for nth in 0..150 {
        let seconds = 0.1 * f64::from(nth);
        let others: Vec<Vector3<f64>> = scene.other_joints(seconds).iter().map(hips).collect();
        let all: Vec<Vector3<f64>> = core::iter::once(hips(&scene.joints(seconds)))
            .chain(others.iter().copied())
            .collect();
        for (a, place) in all.iter().enumerate() {
            let apart = all[..a].iter().map(|other| (other - place).norm());
            nearest = apart.fold(nearest, f64::min);
        }
        for (path, place) in paths.iter_mut().zip(&others) {
            path.push(*place);
        }
    }
    for path in &paths {
        let from = path[0];
        let farthest = path.iter().map(|place| (place - from).norm());
        assert!(farthest.fold(0.0, f64::max) > 1.0, "somebody does not walk");
        closest = path.iter().map(|place| place.xy().norm()).fold(closest, f64::min);
    }
    assert!(nearest > 0.35, "two are {nearest} m apart");
    assert!(closest < 0.8, "nobody comes near the middle: {closest}");
}
