//! The training of the network that finds people in whole pictures: its pictures, and what comes out.
//!
//! Three sources of pictures: photographs with marked people, in which a teacher (another detector) finds everybody else;
//! photographs without people; and synthetic scenes, with boxes around everybody.

mod judge;
mod photographs;
mod reduced;
mod rendered;
mod train;

use std::path::PathBuf;

use failure::{Console, ExitKind, Failure, Stop};
use posenetwork::Detector;
pub use training::networks::finder::Picture;

use crate::person::Chosen;
use crate::prepared::Example;
use crate::scenes::Scenes;

pub use crate::prepared::{is_file, read, write};
pub use crate::trained::{Earlier, Job};
pub use judge::judge;
pub use train::{Pass, train};

/// Which pictures are learned from.
#[derive(Debug)]
pub struct Sources {
    /// Photographs of marked people.
    pub photographs: Chosen,
    /// The teacher, once for every thread that asks it, or none.
    pub teachers: Vec<Detector>,
    /// A folder of photographs without people.
    pub empty: Option<PathBuf>,
    /// Scenes that do not exist.
    pub scenes: Scenes,
}

/// One of this many blocks of photographs in a row, and of this many subjects of scenes, is kept apart.
const KEPT: usize = 12;
/// Photographs in a row that are kept apart together: neighbours often show the same event.
const BLOCK: usize = 20;
/// Amount by which hands, feet and hair reach beyond the joints: share of the longer side, on each side.
const BEYOND: f64 = 0.05;

/// The pictures to learn from, and those that are kept apart.
pub type Prepared = crate::prepared::Prepared<Picture>;

impl Example for Picture {
    const KIND: &[u8; 8] = b"PLXBOXES";
    const MADE_BY: &str = "finder-pictures";

    fn is_whole(&self) -> bool {
        Self::is_whole(self)
    }
}

/// Prepares pictures on rayon's current pool; the result does not depend on the number of threads.
///
/// # Errors
///
/// A data set, a picture or a scene cannot be used; it was stopped ([`ExitKind::Interrupted`]).
pub fn prepare(
    sources: &Sources,
    (stop, console): (&Stop, &dyn Console),
) -> Result<Prepared, Failure> {
    let go_on = || {
        if stop.is_requested() {
            return Err(Failure::new(ExitKind::Interrupted, "stopped"));
        }
        Ok(())
    };
    let mut prepared = Prepared::default();
    for pictures in photographs::pictures(sources, &go_on, console)? {
        for (nth, picture) in pictures.into_iter().enumerate() {
            prepared.add(picture, nth / BLOCK % KEPT == KEPT - 1);
        }
    }
    for (subject, picture) in rendered::pictures(&sources.scenes, &go_on, console)? {
        prepared.add(picture, subject.is_multiple_of(KEPT as u64));
    }
    let [learnt, kept] = [prepared.learnt.len(), prepared.kept.len()];
    console.message(&format!(
        "{learnt} pictures to learn from, {kept} kept apart"
    ));
    Ok(prepared)
}

/// The box around joints, and what reaches beyond them; nothing where fewer than two are known.
fn around_joints(joints: impl Iterator<Item = [f64; 2]>) -> Option<[f64; 4]> {
    let known = joints.filter(|at| at.iter().all(|side| side.is_finite()));
    let [left, top, right, bottom] = posenetwork::outline_of(known)?;
    let beyond = BEYOND * (right - left).max(bottom - top);
    (beyond > 0.0).then_some([left - beyond, top - beyond, right + beyond, bottom + beyond])
}
