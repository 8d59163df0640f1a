//! Progress of a training.

use crate::dual::Gap;

/// A step; a training is a list of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step {
    /// Train a separate filter for every part and type.
    Filters,
    /// Find every person's best placement.
    Place {
        /// From 0.
        round: usize,
    },
    /// Mine examples on some images, and solve on the whole working set.
    Learn {
        /// From 0.
        round: usize,
        /// Pass over the images without people, from 0.
        pass: usize,
        /// Batch of the pass, from 0.
        batch: usize,
    },
    /// Find every person's best placement under the final model, for the threshold.
    Judge,
}

/// An event of a training.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Event {
    /// Progress within the step, images.
    Images {
        /// So far.
        done: usize,
        /// In all.
        of: usize,
    },
    /// People were placed.
    Placed {
        /// How many.
        n: usize,
        /// People who fit the model on no level.
        n_lost: usize,
        /// Their mean score under the model so far.
        mean_score: f64,
    },
    /// Examples were collected.
    Collected {
        /// Negatives that score above -1.
        backgrounds: usize,
        /// Wrong poses.
        mistakes: usize,
        /// Examples in memory.
        held: usize,
        /// Bytes that they take.
        bytes: usize,
    },
    /// The duality gap of the machine.
    Gap(Gap),
}

/// Receives the progress of a training; called from several threads.
pub trait Watch: Sync {
    /// Receives an event.
    fn tell(&self, event: Event);

    /// Returns true to continue; called often.
    fn go_on(&self) -> bool;
}
