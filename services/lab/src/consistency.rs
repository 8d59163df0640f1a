//! Common structure of several views of a person, learned from sequences with truth.

mod report;
mod split;
mod work;

use std::path::PathBuf;

use failure::Failure;
use training::datasets::sequences::Sequence;

use crate::failures::sequence_failure;
pub use work::{Done, Job, Learning};

/// Sequences that were read.
#[derive(Debug)]
pub struct Sequences {
    /// Those that are learned from.
    pub train: Vec<Sequence>,
    /// Those of the subjects that the weights are chosen on.
    pub held_out: Vec<Sequence>,
}

impl Sequences {
    /// Reads sequences.
    ///
    /// * `hold_out`: subjects to hold out; without any the last fourth of them.
    /// * `every`, `frames`: takes the first frame and every `every`-th frame after it, at most `frames` of each sequence.
    /// * `rig`: what the cameras are called by, if all sequences are of one rig.
    ///
    /// # Errors
    ///
    /// A sequence cannot be read; no subject is left to learn from; the sequences are not of one rig.
    pub fn read(
        paths: &[PathBuf],
        hold_out: &[String],
        (every, frames): (usize, Option<usize>),
        rig: Option<&str>,
    ) -> Result<Self, Failure> {
        let mut all: Vec<Sequence> = Vec::new();
        for path in paths {
            let read = training::datasets::sequences::read(
                path,
                &training::datasets::sequences::Options::default(),
            );
            for mut sequence in read.map_err(sequence_failure)? {
                sequence.thin_out(every, frames);
                all.push(sequence);
            }
        }
        let (train, held_out) = split::split(all, hold_out)?;
        if let Some(rig) = rig {
            split::one_rig(&train.iter().chain(&held_out).collect::<Vec<_>>(), rig)?;
        }
        Ok(Self { train, held_out })
    }
}
