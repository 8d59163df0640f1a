//! Training of the network that finds people in whole pictures.
//!
//! The pictures come from three sources: photographs of annotated people, photographs without people, and synthetic scenes. In the
//! photographs of annotated people, a teacher (another detector) finds the people who are not marked.

mod judge;
mod photographs;
mod reduced;
mod rendered;
mod train;

use std::path::PathBuf;

use failure::{Console, Failure, Stop};
use posenetwork::Detector;
pub use training::networks::finder::Picture;

use crate::person::Chosen;
use crate::prepared::Example;
use crate::scenes::Scenes;

pub use crate::prepared::{is_file, read, write};
pub use crate::trained::{Earlier, Job};
pub use judge::judge;
pub use train::{Pass, train};

/// Sources of the training pictures.
#[derive(Debug)]
pub struct Sources {
    /// Photographs of annotated people.
    pub photographs: Chosen,
    /// The teacher, one copy for each thread; empty if there is no teacher.
    pub teachers: Vec<Detector>,
    /// Folder of photographs without people.
    pub empty: Option<PathBuf>,
    /// Synthetic scenes.
    pub scenes: Scenes,
}

/// Margin for hands, feet and hair on each side of the box around the joints, as a fraction of the box's longer side.
const BEYOND: f64 = 0.05;

/// Training pictures and held-out pictures.
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
/// Fails if a data set, a picture or a scene cannot be used, or on a stop request ([`failure::ExitKind::Interrupted`]).
pub fn prepare(
    sources: &Sources,
    (stop, console): (&Stop, &dyn Console),
) -> Result<Prepared, Failure> {
    let photographs = photographs::pictures(sources, (stop, console))?;
    let photographs = photographs.into_iter().flat_map(|set| set.into_iter().enumerate());
    let scenes = rendered::pictures(&sources.scenes, (stop, console))?;
    Ok(Prepared::divided(
        photographs,
        scenes,
        ("pictures", console),
    ))
}

/// Returns the box around joints with a margin; `None` if fewer than two are known.
fn around_joints(joints: impl IntoIterator<Item = [f64; 2]>) -> Option<[f64; 4]> {
    let known = joints.into_iter().filter(|at| at.iter().all(|side| side.is_finite()));
    let [left, top, right, bottom] = posenetwork::outline_of(known)?;
    let beyond = BEYOND * (right - left).max(bottom - top);
    (beyond > 0.0).then_some([left - beyond, top - beyond, right + beyond, bottom + beyond])
}
