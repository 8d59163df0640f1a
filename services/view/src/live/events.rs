//! Events in a deployment, as text lines for the user. They are derived from changes between two checks of the deployment.

use core::time::Duration;
use std::collections::BTreeMap;
use std::time::Instant;

use launch::live::{Snapshot, State};
use messages::{Cause, Status};

use crate::board::{Board, Weight};
use crate::moment::Moment;
use crate::scene::Scene;

/// Number of consecutive results without a skeleton after which this is reported.
const IN_A_ROW: u32 = 3;
/// Shortest time between two reports of the losses of one process.
const LOSSES: Duration = Duration::from_secs(10);

/// State at the last check.
#[derive(Debug)]
pub(crate) struct Events {
    /// Status of the last frame of every view.
    frames: Vec<Status>,
    processes: BTreeMap<String, Seen>,
    /// Number of consecutive results without a skeleton.
    n_without: u32,
    /// True if a message was refused.
    has_refused: bool,
}

/// State of a process at the last check.
#[derive(Debug, Clone, Copy)]
struct Seen {
    state: State,
    restarts: u32,
    /// Time at which losses were last reported. The next field has the counts at that time.
    told: Option<Instant>,
    dropped: [u64; Cause::ALL.len()],
}

impl Events {
    /// Creates the state before the first check.
    pub(crate) fn new(scene: &Scene) -> Self {
        Self {
            frames: vec![Status::OK; scene.views.len()],
            processes: BTreeMap::new(),
            n_without: 0,
            has_refused: false,
        }
    }

    /// Reports once that a message about a frame cannot be used.
    pub(crate) fn refused(&mut self, board: &Board, why: &str) {
        if !self.has_refused {
            board.event(Weight::Error, &format!("cannot show a result: {why}"));
        }
        self.has_refused = true;
    }

    /// Processes a result. Reports when skeletons start to be missing, and when they are found again.
    pub(crate) fn result(&mut self, board: &Board, moment: &Moment) {
        let Some(why) = &moment.why else {
            if self.n_without >= IN_A_ROW {
                board.event(
                    Weight::Note,
                    &format!("frame {}: the skeleton is back", moment.frame),
                );
            }
            self.n_without = 0;
            return;
        };
        self.n_without = self.n_without.saturating_add(1);
        if self.n_without == IN_A_ROW {
            board.event(
                Weight::Warning,
                &format!("frame {}: no skeleton: {why}", moment.frame),
            );
        }
    }

    /// Processes a frame of a view. Reports when its camera fails, and when it works again.
    pub(crate) fn frame(&mut self, board: &Board, scene: &Scene, view: usize, status: Status) {
        let Some(last) = self.frames.get_mut(view).filter(|frame| **frame != status) else {
            return;
        };
        *last = status;
        let name = scene.views.get(view).map_or("", |view| &view.name);
        match status {
            Status::OK => board.event(Weight::Note, &format!("{name}: the pictures are back")),
            Status::END => board.event(Weight::Note, &format!("{name}: the footage has ended")),
            other => board.event(Weight::Error, &format!("{name}: {}", other.reason())),
        }
    }

    /// Compares the state of all processes with the last check. Reports lost messages, and processes that have died, were restarted or are
    /// silent.
    pub(crate) fn processes(&mut self, board: &Board, snapshot: &Snapshot) {
        for process in &snapshot.processes {
            let name = &process.name;
            let reading = process.reading.as_ref();
            let known = self.processes.get(name).copied();
            let mut seen = Seen {
                state: process.state,
                restarts: reading.map_or(0, |reading| reading.restarts),
                told: known.and_then(|seen| seen.told),
                dropped: known.map_or([0; Cause::ALL.len()], |seen| seen.dropped),
            };
            if let Some(reading) = reading {
                lost(
                    board,
                    name,
                    &mut seen,
                    &Cause::ALL.map(|cause| reading.n_dropped_by(cause)),
                );
            }
            if let Some(known) = known {
                tell(board, name, known, seen);
            }
            self.processes.insert(name.clone(), seen);
        }
    }
}

fn tell(board: &Board, name: &str, known: Seen, seen: Seen) {
    let is_new = |state: State| seen.state == state && known.state != state;
    if is_new(State::Dead) {
        let weight = if known.state == State::Done {
            Weight::Note
        } else {
            Weight::Error
        };
        board.event(weight, &format!("{name} has ended"));
    }
    if seen.restarts > known.restarts {
        board.event(
            Weight::Warning,
            &format!("{name} was restarted, {} times so far", seen.restarts),
        );
        return;
    }
    if is_new(State::Silent) {
        board.event(Weight::Error, &format!("{name} is silent"));
    }
    if is_new(State::Done) {
        board.event(Weight::Note, &format!("{name} is done"));
    }
}

/// Reports losses, at most once every few seconds.
fn lost(board: &Board, name: &str, seen: &mut Seen, now: &[u64; Cause::ALL.len()]) {
    // The counts of a restarted process begin at 0.
    let is_less = now.iter().zip(&seen.dropped).any(|counts| counts.0 < counts.1);
    if is_less {
        seen.dropped = [0; Cause::ALL.len()];
    }
    if seen.told.is_some_and(|at| at.elapsed() < LOSSES) {
        return;
    }
    let counts = now.iter().zip(&seen.dropped).zip(Cause::ALL);
    let new = counts.filter(|count| count.0.0 > count.0.1);
    let new: Vec<String> = new
        .map(|((now, then), cause)| format!("{} {}", now - then, cause.name()))
        .collect();
    if !new.is_empty() {
        let what = format!("{name} lost messages or frames: {}", new.join(", "));
        board.event(Weight::Warning, &what);
        (seen.told, seen.dropped) = (Some(Instant::now()), *now);
    }
}
