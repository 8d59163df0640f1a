//! What a training tells while it runs.

use crate::dual::Gap;

/// One thing to do; a training is a list of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step {
    /// Train a filter for every part and type by itself.
    Filters,
    /// Find every person's best placement.
    Place {
        /// From 0.
        round: usize,
    },
    /// Search some images for examples, and train on all that there are.
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

/// Something that happened.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Event {
    /// Images of the step that have been looked at.
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
        /// People whom no level shows at the size of the model.
        n_lost: usize,
        /// Their mean score under the model so far.
        mean_score: f64,
    },
    /// Examples were collected.
    Collected {
        /// Places without a person that score above -1.
        backgrounds: usize,
        /// Wrong poses.
        mistakes: usize,
        /// Examples in memory.
        held: usize,
        /// Bytes that they take.
        bytes: usize,
    },
    /// The machine is that far.
    Gap(Gap),
}

/// Whoever looks on; called from several threads.
pub trait Watch: Sync {
    /// Hears what happened.
    fn tell(&self, event: Event);

    /// Whether to go on; asked often.
    fn go_on(&self) -> bool;
}
