//! Synthetic people.

use failure::{Console, Failure, Stop};
use training::networks::pose::{EXTRAS, N_KEYPOINTS, Person, Source, Target, exchange_sides};

use super::crop::Crop;
use crate::orientation::front_in_view;
use crate::scenes::{Body, Scenes, Shown, of_pictures_shown};

/// Smallest number of joints in front of the camera for a person to be used.
const FEWEST: usize = 10;
/// A person is not used if less than this fraction of the pixels in the box show the person. Without occlusion, it is about a third.
const HIDDEN: f64 = 0.1;

/// Returns everybody in all scenes, with the numbers of the scenes' subjects.
pub(super) fn people(
    scenes: &Scenes,
    (stop, console): (&Stop, &dyn Console),
) -> Result<Vec<(u64, Person)>, Failure> {
    let found = of_pictures_shown(scenes, (stop, console), |shown| Some(in_picture(shown)));
    let found: Vec<_> = found?.into_iter().flatten().collect();
    if scenes.n > 0 {
        console.message(&format!("scenes: {} pictures of people", found.len()));
    }
    Ok(found)
}

/// Returns the people in a picture.
fn in_picture(shown: &Shown<'_>) -> Vec<(u64, Person)> {
    let subject = shown.subject();
    let people = shown.everybody.iter().filter_map(|body| Some((subject?, person(shown, body)?)));
    people.collect()
}

fn person(shown: &Shown<'_>, body: &Body) -> Option<Person> {
    let joints = body.joints;
    let n_seen = joints.iter().filter(|joint| joint[0].is_finite()).count();
    if n_seen < FEWEST || !is_seen(shown, body) {
        return None;
    }
    let crop = Crop::around(&joints, 0.0)?;
    let [right, towards] = front_in_view(shown.camera, &body.in_world)?;
    let keypoints = joints.into_iter().chain(body.extras);
    let mut targets = [Target::UNKNOWN; N_KEYPOINTS];
    for (target, at) in targets.iter_mut().zip(keypoints) {
        if at[0].is_finite() {
            *target = Target {
                at: crop.inside(at).map(|value| value as f32),
                or: None,
                weight: 1.0,
                is_marked: true,
            };
        }
    }
    let is_from_behind = towards < 0.0;
    Some(Person {
        source: Source::Scene,
        name: shown.source.clone(),
        rgb: crop.rgb(shown.picture),
        targets: if is_from_behind {
            exchange_sides(&targets)
        } else {
            targets
        },
        front: [right, 0.0, towards],
    })
}

/// Returns true if enough of a person is visible.
fn is_seen(shown: &Shown<'_>, body: &Body) -> bool {
    let known = body.joints.into_iter().filter(|at| at.iter().all(|side| side.is_finite()));
    let Some([left, top, right, bottom]) = posenetwork::outline_of(known) else {
        return false;
    };
    let size = [shown.picture.width(), shown.picture.height()].map(|side| side as f64);
    let inside = [
        right.min(size[0]) - left.max(0.0),
        bottom.min(size[1]) - top.max(0.0),
    ];
    inside.iter().all(|side| *side > 0.0) && body.seen_px > HIDDEN * inside[0] * inside[1]
}

/// Scenes and the network have the same extra keypoints.
const _: () = assert!(EXTRAS.len() == scene::N_EXTRAS);
