//! The training of the network that finds joints: its people, and what comes out.
//!
//! Two sources of people: photographs with marked joints, which a teacher, another network, helps with, and scenes that do not
//! exist, whose joints and directions are exact.

mod crop;
mod photographs;
mod rendered;
mod train;

use posenetwork::PoseNetwork;
use training::networks::pose::{Person, SIDE};

use crate::person::Chosen;
use crate::prepared::Example;
use crate::scenes::Scenes;
use failure::{Console, ExitKind, Failure, Stop};

pub use crate::prepared::{read, write};
pub use crate::trained::{Earlier, Job};
pub use train::{Pass, train};

/// Who is learned from.
#[derive(Debug)]
pub struct People {
    /// Photographs of marked people. Left and right are those of the people themselves; where the choice asks for sides as
    /// seen, the marks say nothing of the direction in which a person faces.
    pub photographs: Chosen,
    /// For every thread that asks them, other networks that help. The first helps with joints without a mark and with marks that
    /// are wrong; the others with the keypoints that those before them do not know.
    pub teachers: Vec<Vec<PoseNetwork>>,
    /// Scenes that do not exist.
    pub scenes: Scenes,
}

/// One in this many blocks of people in a row, and of subjects of scenes, is kept apart.
const KEPT: usize = 12;
/// People in a row of a data set that are kept apart together: neighbours often show the same event.
const BLOCK: usize = 20;

/// The people to learn from, and those who are kept apart: the expected error is learned on these.
pub type Prepared = crate::prepared::Prepared<Person>;

impl Example for Person {
    const KIND: &[u8; 8] = b"PLXPEOPL";
    const MADE_BY: &str = "network-people";

    fn is_whole(&self) -> bool {
        self.rgb.len() == 3 * SIDE * SIDE
    }
}

/// State that the threads share.
struct Work<'a> {
    stop: Stop,
    console: &'a dyn Console,
}

impl Work<'_> {
    /// Stops where that was asked for.
    fn go_on(&self) -> Result<(), Failure> {
        if self.stop.is_requested() {
            return Err(Failure::new(ExitKind::Interrupted, "stopped"));
        }
        Ok(())
    }
}

/// Prepares people on rayon's current pool; the result does not depend on the number of threads.
///
/// # Errors
///
/// A data set, a picture or a scene cannot be used; it was stopped ([`ExitKind::Interrupted`]).
pub fn prepare(
    people: &People,
    (stop, console): (Stop, &dyn Console),
) -> Result<Prepared, Failure> {
    let work = Work { stop, console };
    let mut prepared = Prepared::default();
    let marked = photographs::people(people, &work)?;
    for (nth, person) in marked {
        let is_kept = nth / BLOCK % KEPT == KEPT - 1;
        prepared.add(person, is_kept);
    }
    for (subject, person) in rendered::people(&people.scenes, &work)? {
        let is_kept = subject % KEPT as u64 == 0;
        prepared.add(person, is_kept);
    }
    let [learnt, kept] = [prepared.learnt.len(), prepared.kept.len()];
    console.message(&format!("{learnt} people to learn from, {kept} kept apart"));
    Ok(prepared)
}

#[cfg(test)]
mod tests;
