//! Several people: who is who and where, judged by the truth.

pub mod judge;
pub mod shelf;

use geometry::Camera;
use nalgebra::Point3;
use people::{Keypoint, Person, Settings, Solver, State, Tracker, View, extra_point};

use judge::{Put, Score};
use shelf::{Found, Shelf};

/// Keypoints of the face, in the order in which they stand in for the ears: nose, right and left ear, right and left eye.
const EARS: [usize; 2] = [17, 18];
const FACE: [usize; 5] = [0, 17, 18, 15, 16];
/// Frames a second.
const RATE_HZ: f64 = 25.0;

/// Follows and solves the people of a set.
pub fn run(set: &Shelf) -> Score {
    let settings = Settings { max: 8, ..Settings::default() };
    let mut tracker = Tracker::new(set.cameras.clone(), settings);
    let mut solver = Solver::new(set.cameras.clone());
    let mut score = Score::default();
    for (nth, (frame, truth)) in set.frames.iter().zip(&set.truth).enumerate() {
        let time_s = nth as f64 / RATE_HZ;
        let views: Vec<View> = frame.iter().map(|found| found.view.clone()).collect();
        let people = tracker.step(time_s, &views);
        let seen: Vec<Person> = people.into_iter().filter(|person| person.state != State::Lost).collect();
        let solved = solver.step(time_s, &seen, &views);
        let put = seen.iter().zip(solved).map(|(person, solved)| {
            Put::new(person.id, &solved.joints, ears(&set.cameras, frame, person))
        });
        let put: Vec<Put> = put.collect();
        score.add(truth, &put);
    }
    score
}

/// The middle of the ears, or what stands in for it.
fn ears(cameras: &[Camera], frame: &[Found], person: &Person) -> Option<Point3<f64>> {
    let point = |keypoint: usize| {
        let views = cameras.iter().zip(frame).zip(&person.detections);
        let seen = views.filter_map(|((camera, found), it)| Some((camera, found.people[(*it)?][keypoint]?)));
        extra_point(&seen.collect::<Vec<(&Camera, Keypoint)>>())
    };
    let [right, left] = EARS.map(point);
    let both = right.zip(left).map(|(right, left)| nalgebra::center(&right, &left));
    both.or_else(|| FACE.into_iter().find_map(point))
}
