//! Solves for people whose joints were found by other programs: from the rays of the keypoints, and from the motion of the joints in the
//! earlier frames (`people::Solver`). Unlike a network's maps, keypoints have one position in each view, or none.

use ::people::{Person, Solved, Solver, State, View};
use nalgebra::Vector3;

use crate::person_step::{FrameViews, Shown};
use crate::placed::N;
use crate::who::view;

/// Returns the joints of the people of a frame, in their order.
///
/// * `time_s`: time of the frame, in seconds.
/// * `shown`: every person in the views that show the person, at the instant of the frame.
pub(crate) fn solve(
    solver: &mut Solver,
    time_s: f64,
    frame: &FrameViews<'_, '_>,
    shown: &[Vec<Shown<'_>>],
) -> Vec<Solved> {
    let known = &frame.people.people;
    let mut views: Vec<View> = frame.answers.iter().map(|seen| view(seen.as_ref())).collect();
    for (person, shown) in known.iter().zip(shown) {
        for shown in shown {
            let Some(candidate) = person.candidates[shown.view] else {
                continue;
            };
            let joints = &mut views[shown.view].detections[candidate].joints;
            for (joint, keypoint) in joints.iter_mut().enumerate() {
                let by = shown.evidence.since_instant(joint);
                if let Some(keypoint) = keypoint {
                    keypoint.at_px = [keypoint.at_px[0] - by.x, keypoint.at_px[1] - by.y];
                }
            }
        }
    }
    let people = known.iter().map(|person| Person {
        id: person.id,
        state: State::Tracked,
        detections: person.candidates.clone(),
        is_exchanged: vec![false; views.len()],
        joints: [None; N],
        covariances: [None; N],
        velocity: Vector3::zeros(),
    });
    solver.step(time_s, &people.collect::<Vec<Person>>(), &views)
}
