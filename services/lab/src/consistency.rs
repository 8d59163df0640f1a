//! The relations between several views of a person, learned from sequences with ground truth.

mod report;
mod split;
mod work;

use std::path::PathBuf;

use failure::Failure;
use training::datasets::sequences::Sequence;

use crate::failures::sequence_failure;
pub use work::{Done, Job, Learning};

/// Sequences, split into those for training and those held out.
#[derive(Debug)]
pub struct Sequences {
    /// Sequences for training.
    pub train: Vec<Sequence>,
    /// Sequences of the held-out subjects, on which the weights are chosen.
    pub held_out: Vec<Sequence>,
}

impl Sequences {
    /// Reads sequences.
    ///
    /// * `hold_out`: subjects to hold out; if empty, the last quarter of the subjects.
    /// * `every`, `frames`: the first frame and every `every`-th frame after it are used, but at most `frames` frames of each sequence.
    /// * `rig`: name of the rig, if all sequences were recorded with one rig.
    ///
    /// # Errors
    ///
    /// Fails if a sequence cannot be read, if no subject is left for training, or if `rig` is given and the sequences have different rigs.
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
