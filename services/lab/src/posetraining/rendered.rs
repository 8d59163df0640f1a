//! Synthetic people.

use failure::Failure;
use training::networks::pose::{
    EXTRAS, N_JOINTS, N_KEYPOINTS, Person, Source, Target, exchange_sides,
};

use super::Work;
use super::crop::Crop;
use crate::orientation::front_in_view;
use crate::scenes::{Scenes, Shown, of_pictures};

/// Smallest number of visible joints for a person to be used.
const FEWEST: usize = 10;

/// Returns the people of all scenes, with the numbers of the subjects.
pub(super) fn people(scenes: &Scenes, work: &Work<'_>) -> Result<Vec<(u64, Person)>, Failure> {
    let console = work.console;
    if scenes.n == 0 {
        return Ok(Vec::new());
    }
    console.begin("scenes", "pictures");
    let found = of_pictures(
        scenes,
        |shown| {
            work.go_on()?;
            Ok(person(shown))
        },
        |n, _| console.advance(n),
    );
    console.finish();
    let found = found?;
    console.message(&format!("scenes: {} pictures of people", found.len()));
    Ok(found)
}

fn person(shown: &Shown<'_>) -> Option<(u64, Person)> {
    let subject = shown.group.rsplit(' ').next()?.parse().ok()?;
    let joints: [[f64; 2]; N_JOINTS] = shown.joints.as_slice().try_into().ok()?;
    let n_seen = joints.iter().filter(|joint| joint[0].is_finite()).count();
    if n_seen < FEWEST {
        return None;
    }
    let crop = Crop::around(&joints, 0.0)?;
    let [right, towards] = front_in_view(shown)?;
    let keypoints: [[f64; 2]; N_KEYPOINTS] = core::array::from_fn(|keypoint| {
        let extra = keypoint.checked_sub(N_JOINTS);
        extra.map_or_else(|| joints[keypoint], |extra| shown.extras[extra])
    });
    let targets = keypoints.map(|at| {
        if !at[0].is_finite() {
            return Target::UNKNOWN;
        }
        Target {
            at: crop.inside(at).map(|value| value as f32),
            or: None,
            weight: 1.0,
            is_marked: true,
        }
    });
    let is_from_behind = towards < 0.0;
    let person = Person {
        source: Source::Scene,
        name: shown.source.clone(),
        rgb: crop.rgb(shown.picture),
        targets: if is_from_behind {
            exchange_sides(&targets)
        } else {
            targets
        },
        front: [right, 0.0, towards],
    };
    Some((subject, person))
}

/// Scenes and the network have the same extra keypoints.
const _: () = assert!(EXTRAS.len() == scene::N_EXTRAS);
