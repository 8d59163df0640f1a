//! Training of the network that finds joints.
//!
//! The people come from two sources: photographs with marked joints, improved by a teacher (another network), and synthetic scenes with
//! exact joints and directions.

mod crop;
mod photographs;
mod rendered;
mod train;

use posenetwork::PoseNetwork;
use training::networks::pose::{Person, SIDE};

use crate::person::Chosen;
use crate::prepared::Example;
use crate::scenes::Scenes;
use failure::{Console, Failure, Stop};

pub use crate::prepared::{read, write};
pub use crate::trained::{Earlier, Job};
pub use train::{Pass, train};

/// Sources of the people for training.
#[derive(Debug)]
pub struct People {
    /// Photographs of annotated people. Left and right are sides of the body. If they are swapped for people seen from behind
    /// (`Sides::Seen`), the marks do not determine the direction in which a person faces.
    pub photographs: Chosen,
    /// For each thread, the networks that act as teachers. The first adds missing joints and corrects wrong marks. The other networks add
    /// the keypoints that earlier networks do not have.
    pub teachers: Vec<Vec<PoseNetwork>>,
    /// Synthetic scenes.
    pub scenes: Scenes,
}

/// People for training, and held-out people, on whom the expected error is learned.
pub type Prepared = crate::prepared::Prepared<Person>;

impl Example for Person {
    const KIND: &[u8; 8] = b"PLXPEOPL";
    const MADE_BY: &str = "network-people";

    fn is_whole(&self) -> bool {
        self.rgb.len() == 3 * SIDE * SIDE
    }
}

/// Prepares people on rayon's current pool; the result does not depend on the number of threads.
///
/// # Errors
///
/// Fails if a data set, a picture or a scene cannot be used, or on a stop request ([`failure::ExitKind::Interrupted`]).
pub fn prepare(
    people: &People,
    (stop, console): (&Stop, &dyn Console),
) -> Result<Prepared, Failure> {
    let photographs = photographs::people(people, (stop, console))?;
    let scenes = rendered::people(&people.scenes, (stop, console))?;
    Ok(Prepared::divided(photographs, scenes, ("people", console)))
}

#[cfg(test)]
mod tests;
