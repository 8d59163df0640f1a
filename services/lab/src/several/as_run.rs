//! Evaluation of a set of several people with the steps of `parallax run`, from keypoints of another program.

use std::sync::Arc;
use std::time::Instant;

use fmp::Model;
use keypoints::{Keypoint, joint_ways};
use people::View;
use pipeline::{
    EstimatorError, Eyes, NetworkMemory, NetworkSettings, NetworkStep, PersonSkeleton, SpaceStep,
    SpaceStepSettings, ViewSightings, WhoSettings, WhoStep,
};
use skeleton::PARSE14;
use skeleton::body::Joints;

use super::{Put, RATE_HZ, Run, Shelf};

/// Maximum number of people.
const MOST_PEOPLE: usize = 8;

/// Follows the people of a set and computes their joints as `parallax run` does with keypoint files. These have only the joints of the
/// detected people, and not those that the detector assigned to nobody.
///
/// * `model`: the model of parts, from which views are planned.
///
/// # Errors
///
/// Fails if the pictures of a camera are too small for the model.
pub fn as_run(set: &Shelf, model: &Arc<Model>) -> Result<Run, EstimatorError> {
    let names: Vec<String> = PARSE14.joints.iter().map(|joint| joint.name.to_owned()).collect();
    let settings = NetworkSettings {
        n_people: MOST_PEOPLE,
        ..NetworkSettings::default()
    };
    let plans = set.cameras.iter().map(|camera| pipeline::plan(model, camera));
    let plans = plans.collect::<Result<Vec<_>, _>>()?;
    let views = plans.iter().map(|plan| {
        let eyes = Eyes::Keypoints(joint_ways(&names));
        let step = NetworkStep::new(eyes, plan.layout().image_size, settings);
        (step, NetworkMemory::default())
    });
    let mut views: Vec<(NetworkStep, NetworkMemory)> = views.collect();
    let who = WhoSettings {
        n_people: MOST_PEOPLE,
        ..WhoSettings::default()
    };
    let mut who = WhoStep::new(set.cameras.clone(), who);
    let mut space = SpaceStep::new(plans, None, SpaceStepSettings::default().by_keypoints());
    let mut run = Run::default();
    for (nth, (frame, truth)) in set.frames.iter().zip(&set.truth).enumerate() {
        let time_s = nth as f64 / RATE_HZ;
        let sightings = views.iter_mut().zip(frame).map(|((step, memory), view)| {
            step.take(keypoints_of(view), memory);
            let people = step.sightings(memory);
            (!people.is_empty()).then_some(ViewSightings {
                people,
                skew_s: 0.0,
            })
        });
        let sightings: Vec<Option<ViewSightings>> = sightings.collect();
        let start = Instant::now();
        let people = who.run(time_s, &sightings);
        run.association.push(start.elapsed());
        let evidence = views.iter().map(|(step, memory)| step.evidence(memory).collect());
        space.begin(Some(time_s));
        let solved = space.run(&sightings, &evidence.collect::<Vec<_>>(), &people);
        run.score.add(truth, &solved.iter().filter_map(put).collect::<Vec<Put>>());
    }
    Ok(run)
}

/// Returns the keypoints of every person of a view, in the order of `skeleton::PARSE14`.
fn keypoints_of(view: &View) -> impl Iterator<Item = Vec<Option<Keypoint>>> {
    view.detections.iter().map(|person| {
        let joints = person.joints.iter().map(|joint| {
            joint.map(|found| Keypoint {
                at: found.at_px,
                score: found.heat,
            })
        });
        joints.collect()
    })
}

/// Returns the joints of a person; `None` for a person without joints.
fn put(person: &PersonSkeleton) -> Option<Put> {
    let place = |joint: usize| Some(person.skeleton.joints[joint].as_ref().ok()?.in_world);
    let joints: Joints = core::array::from_fn(place);
    joints.iter().any(Option::is_some).then(|| Put::new(person.id, &joints))
}
