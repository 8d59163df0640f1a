//! Console output of offline work: progress on standard error, events and results on standard output.

use core::time::Duration;

use failure::{Console, Failure};
use indicatif::ProgressBar;
use serde_json::Value;

use crate::output;

/// Shows progress as a bar on a terminal, and messages unless quiet; writes events as JSON if requested.
#[derive(Debug)]
pub struct Terminal {
    bar: ProgressBar,
    quiet: bool,
    json: bool,
}

impl Terminal {
    /// Without a progress bar.
    pub fn without_bar(quiet: bool, json: bool) -> Self {
        let bar = ProgressBar::hidden();
        Self { bar, quiet, json }
    }

    /// With a progress bar, if standard error is a terminal.
    ///
    /// * `template`: as for [`output::bar_style`].
    pub fn with_bar(quiet: bool, json: bool, template: &str) -> Self {
        let bar = if quiet || !output::is_terminal() {
            ProgressBar::hidden()
        } else {
            ProgressBar::new(0)
        };
        if let Some(style) = output::bar_style(template) {
            bar.set_style(style);
        }
        Self { bar, quiet, json }
    }

    /// Redraws the bar twice a second, also without progress.
    #[must_use]
    pub fn ticking(self) -> Self {
        self.bar.enable_steady_tick(Duration::from_millis(500));
        self
    }
}

impl Console for Terminal {
    fn message(&self, text: &str) {
        if !self.quiet {
            self.bar.suspend(|| output::message(text));
        }
    }

    fn event(&self, event: &Value) -> Result<(), Failure> {
        if self.json {
            self.bar.suspend(|| output::json(event))
        } else {
            Ok(())
        }
    }

    fn result(&self, text: &str) -> Result<(), Failure> {
        if self.quiet {
            Ok(())
        } else {
            self.bar.suspend(|| output::line(text))
        }
    }

    fn shows_bar(&self) -> bool {
        output::is_terminal()
    }

    fn begin(&self, label: &str, details: &str) {
        self.bar.set_prefix(label.to_owned());
        self.bar.set_position(0);
        self.bar.set_message(details.to_owned());
    }

    fn details(&self, text: &str) {
        self.bar.set_message(text.to_owned());
    }

    fn set(&self, done: usize, of: usize) {
        self.bar.set_length(of as u64);
        self.bar.set_position(done as u64);
    }

    fn advance(&self, n: usize) {
        self.bar.inc(n as u64);
    }

    fn finish(&self) {
        self.bar.finish_and_clear();
    }
}
