//! The training of the network that finds joints: its people, and what comes out.
//!
//! Two sources of people: photographs with marked joints, which a teacher, another network, helps with, and scenes that do not
//! exist, whose joints and directions are exact.

mod crop;
mod photographs;
mod rendered;
mod train;

use std::io::{BufReader, Read as _, Write as _};
use std::path::Path;

use posenetwork::PoseNetwork;
use training::networks::pose::{Person, SIDE};

use crate::person::Chosen;
use crate::scenes::Scenes;
use failure::{Console, ExitKind, Failure, Stop};

pub use train::{Earlier, Job, Pass, train};

/// Who is learned from.
#[derive(Debug)]
pub struct People {
    /// Photographs of marked people. Left and right are those of the people themselves; where the choice asks for sides as
    /// seen, the marks say nothing of the direction in which somebody faces.
    pub photographs: Chosen,
    /// Another network, that helps with joints without a mark and with marks that are wrong: once for every thread that asks it,
    /// or none.
    pub teachers: Vec<PoseNetwork>,
    /// Scenes that do not exist.
    pub scenes: Scenes,
}

/// Of so many blocks of people in a row, and of so many subjects of scenes, one is kept apart.
const KEPT: usize = 12;
/// People in a row of a data set that are kept apart together: neighbours often show the same event.
const BLOCK: usize = 20;

/// The people to learn from, and those who are kept apart.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Prepared {
    /// To learn from.
    pub learnt: Vec<Person>,
    /// Kept apart: the training is watched on them, and the expected error is learned on them.
    pub kept: Vec<Person>,
}

/// What the threads share.
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
        let to = if is_kept {
            &mut prepared.kept
        } else {
            &mut prepared.learnt
        };
        to.push(person);
    }
    for (subject, person) in rendered::people(&people.scenes, &work)? {
        let is_kept = subject % KEPT as u64 == 0;
        let to = if is_kept {
            &mut prepared.kept
        } else {
            &mut prepared.learnt
        };
        to.push(person);
    }
    let [learnt, kept] = [prepared.learnt.len(), prepared.kept.len()];
    console.message(&format!("{learnt} people to learn from, {kept} kept apart"));
    Ok(prepared)
}

/// How the file of prepared people begins.
const KIND: &[u8; 8] = b"PLXPEOPL";
/// How it ends: a file that was cut short lacks it.
const END: &[u8; 8] = b"EVERYONE";

/// Writes prepared people; the file appears when it is whole.
///
/// # Errors
///
/// The file cannot be written.
pub fn write(path: &Path, people: &Prepared) -> Result<(), Failure> {
    let written = files::replace_by(path, |file| {
        file.write_all(KIND)?;
        let config = bincode::config::standard();
        bincode::serde::encode_into_std_write(people, file, config)
            .map_err(std::io::Error::other)?;
        file.write_all(END)
    });
    written.map_err(|error| failure::in_file(path, &error))
}

/// Reads what [`write()`] wrote.
///
/// # Errors
///
/// The file cannot be read, or holds something else.
pub fn read(path: &Path) -> Result<Prepared, Failure> {
    let fail = |error: std::io::Error| failure::in_file(path, &error);
    let is_other = || {
        let message = format!(
            "{}: no file of `parallax-lab train network-people`",
            path.display()
        );
        Failure::new(ExitKind::Input, message)
    };
    let mut file = BufReader::with_capacity(1 << 20, files::open(path).map_err(fail)?);
    let mut mark = [0; 8];
    let n = file.read(&mut mark).map_err(fail)?;
    if n < mark.len() || &mark != KIND {
        return Err(is_other());
    }
    let config = bincode::config::standard();
    let people: Prepared = bincode::serde::decode_from_std_read(&mut file, config)
        .map_err(|error| failure::in_file(path, &error))?;
    file.read_exact(&mut mark).map_err(fail)?;
    let all = people.learnt.iter().chain(&people.kept);
    let is_whole = all.into_iter().all(|it| it.rgb.len() == 3 * SIDE * SIDE);
    if &mark != END || !is_whole {
        return Err(is_other());
    }
    Ok(people)
}

#[cfg(test)]
mod tests;
