//! Several people: who is who and where, judged by the truth.

pub mod judge;
pub mod shelf;

use people::{Person, Settings, Solver, Tracker};

use judge::{Put, Score};
use shelf::Shelf;

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
        let people = tracker.step(time_s, frame);
        let seen: Vec<Person> = people.into_iter().filter(|person| person.detections.iter().flatten().count() >= 2).collect();
        let solved = solver.step(time_s, &seen, frame);
        let put: Vec<Put> = solved.iter().map(|person| Put::new(person.id, &person.joints)).collect();
        score.add(truth, &put);
    }
    score
}
