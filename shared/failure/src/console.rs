//! Display of the progress of a run.

use core::fmt::Debug;

use crate::Failure;
use serde_json::Value;

/// Display of a run: messages for users, events for programs, and a progress bar if there is one.
///
/// The methods are called from several threads. An implementation decides what it shows. Without a progress bar, for example,
/// the methods for the bar do nothing.
pub trait Console: Debug + Send + Sync {
    /// Shows a message to the user.
    fn message(&self, text: &str);

    /// Writes an event for programs, if events were requested.
    ///
    /// # Errors
    ///
    /// Fails if the output cannot be written.
    fn event(&self, event: &Value) -> Result<(), Failure>;

    /// Writes a result for the user.
    ///
    /// # Errors
    ///
    /// Fails if the output cannot be written.
    fn result(&self, text: &str) -> Result<(), Failure>;

    /// Returns true if the progress bar shows the steps, so that no messages about them are needed.
    fn shows_bar(&self) -> bool;

    /// Restarts the bar at 0.
    fn begin(&self, label: &str, details: &str);

    /// Shows details beside the bar.
    fn details(&self, text: &str);

    /// Sets the bar to `done` of `of` steps.
    fn set(&self, done: usize, of: usize);

    /// Moves the bar forward by `n` steps.
    fn advance(&self, n: usize);

    /// Removes the bar.
    fn finish(&self);
}

/// A console that shows nothing.
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
