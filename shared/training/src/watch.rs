//! Progress of a training run.

use crate::dual::Gap;

/// A step of a training run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step {
    /// Train a separate filter for every part and type.
    Filters,
    /// Find the best pose of every person near the annotated parts.
    Place {
        /// Number of the round, from 0.
        round: usize,
    },
    /// Mine examples on some images, then solve on the whole working set.
    Learn {
        /// Number of the round, from 0.
        round: usize,
        /// Number of the pass over the images without people, from 0.
        pass: usize,
        /// Number of the batch within the pass, from 0.
        batch: usize,
    },
    /// Find the best pose of every person under the final model, and set the detection threshold from the scores.
    Judge,
}

/// An event of a training run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Event {
    /// Progress within the step, in images.
    Images {
        /// Number of images finished.
        done: usize,
        /// Number of images in the step.
        of: usize,
    },
    /// The best poses of the people were found.
    Placed {
        /// Number of people for whom a pose was found.
        n: usize,
        /// Number of people who do not fit the model on any level.
        n_lost: usize,
        /// Mean score of the people under the current model.
        mean_score: f64,
    },
    /// Examples were collected.
    Collected {
        /// Number of negatives that score above -1.
        backgrounds: usize,
        /// Number of wrong poses.
        mistakes: usize,
        /// Number of examples in memory.
        held: usize,
        /// Memory used by the examples, in bytes.
        bytes: usize,
    },
    /// The duality gap of the machine.
    Gap(Gap),
}

/// Receives the progress of a training run; its functions are called from several threads.
pub trait Watch: Sync {
    /// Receives an event.
    fn tell(&self, event: Event);

    /// Returns true if the training may continue; called often.
    fn go_on(&self) -> bool;
}
