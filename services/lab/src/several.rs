//! Evaluation with several people: computes identities and positions from given detections, and compares them with the ground truth.

mod as_run;
mod everybody;
mod judge;
mod report;
mod shelf;

use std::time::{Duration, Instant};

use people::{Person, Settings, Solver, Tracker};

pub use as_run::as_run;
pub use everybody::{Everybody, everybody};
pub use judge::{Put, Score};
pub use report::{ActorReport, Measured, Report};
pub use shelf::{Shelf, ShelfError, TruePerson, is_one};

/// Frame rate of the set.
const RATE_HZ: f64 = 25.0;
/// Smallest number of views that determines a person's position.
const LEAST_VIEWS: usize = 2;

/// Result of a run over a set.
#[derive(Debug, Clone, Default)]
pub struct Run {
    /// The score.
    pub score: Score,
    /// Duration of the association alone, for each frame.
    pub association: Vec<Duration>,
}

/// Follows the people of a set and computes their joints, frame by frame, without using later frames. It uses all keypoints of the detector,
/// as the programs to which it is compared.
pub fn run(set: &Shelf) -> Run {
    let settings = Settings {
        max: 8,
        ..Settings::default()
    };
    let mut tracker = Tracker::new(set.cameras.clone(), settings);
    let mut solver = Solver::new(set.cameras.clone());
    let mut run = Run::default();
    for (nth, (frame, truth)) in set.frames.iter().zip(&set.truth).enumerate() {
        let time_s = nth as f64 / RATE_HZ;
        let start = Instant::now();
        let mut people = tracker.step(time_s, frame);
        run.association.push(start.elapsed());
        let n_views = |person: &Person| person.detections.iter().flatten().count();
        people.retain(|person| n_views(person) >= LEAST_VIEWS);
        let solved = solver.step(time_s, &people, frame);
        let put = solved.iter().map(|person| {
            let refined = skeleton::body::refine(&person.joints, &person.covariances, None);
            Put::new(person.id, &refined.joints)
        });
        run.score.add(truth, &put.collect::<Vec<Put>>());
    }
    run
}
