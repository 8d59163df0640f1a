//! The progress of a training on standard error, its events on standard output.

use core::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};
use offline::Console;
use runtime::Failure;
use serde_json::Value;

use crate::output;

/// Shows progress: a bar on a terminal, messages if not quiet; JSON on standard output if asked for.
#[derive(Debug)]
pub(super) struct Terminal {
    bar: ProgressBar,
    quiet: bool,
    json: bool,
}

impl Terminal {
    /// Messages and events only.
    pub(super) fn without_bar(quiet: bool, json: bool) -> Self {
        let bar = ProgressBar::hidden();
        Self { bar, quiet, json }
    }

    /// With a bar, where standard error is a terminal.
    pub(super) fn with_bar(quiet: bool, json: bool) -> Self {
        let bar = if quiet || !output::is_lively() {
            ProgressBar::hidden()
        } else {
            ProgressBar::new(0)
        };
        if let Ok(style) = ProgressStyle::with_template(
            "{elapsed_precise} {prefix} {bar:20} {pos}/{len} images{msg}",
        ) {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_millis(500));
        Self { bar, quiet, json }
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
        output::is_lively()
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

    fn advance(&self) {
        self.bar.inc(1);
    }

    fn finish(&self) {
        self.bar.finish_and_clear();
    }
}
