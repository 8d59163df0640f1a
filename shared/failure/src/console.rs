//! Where a run shows its progress.

use core::fmt::Debug;

use crate::Failure;
use serde_json::Value;

/// Where a run shows its progress: messages for people, events for programs, and a progress bar if there is one.
///
/// Called from several threads. An implementation decides what is shown: without a bar, for example, its methods do
/// nothing.
pub trait Console: Debug + Send + Sync {
    /// Shows a message for people.
    fn message(&self, text: &str);

    /// Writes an event for programs, if events were asked for.
    ///
    /// # Errors
    ///
    /// The output cannot be written.
    fn event(&self, event: &Value) -> Result<(), Failure>;

    /// Writes a result for people.
    ///
    /// # Errors
    ///
    /// The output cannot be written.
    fn result(&self, text: &str) -> Result<(), Failure>;

    /// Returns true if the progress bar shows the steps, so that no messages about them are needed.
    fn shows_bar(&self) -> bool;

    /// Begins the bar again, at 0.
    fn begin(&self, label: &str, details: &str);

    /// Shows details beside the bar.
    fn details(&self, text: &str);

    /// Moves the bar.
    fn set(&self, done: usize, of: usize);

    /// Moves the bar by `n`.
    fn advance(&self, n: usize);

    /// Removes the bar.
    fn finish(&self);
}

/// Shows nothing.
#[derive(Debug)]
pub struct Silent;

impl Console for Silent {
    fn message(&self, _text: &str) {}

    fn event(&self, _event: &Value) -> Result<(), Failure> {
        Ok(())
    }

    fn result(&self, _text: &str) -> Result<(), Failure> {
        Ok(())
    }

    fn shows_bar(&self) -> bool {
        false
    }

    fn begin(&self, _label: &str, _details: &str) {}

    fn details(&self, _text: &str) {}

    fn set(&self, _done: usize, _of: usize) {}

    fn advance(&self, _n: usize) {}

    fn finish(&self) {}
}
