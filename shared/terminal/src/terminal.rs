//! Console output of offline work: progress on standard error, events and results on standard output.

use core::time::Duration;
use std::sync::Mutex;
use std::time::Instant;

use failure::{Console, Failure};
use indicatif::ProgressBar;
use serde_json::Value;

use crate::output;

/// Interval between lines of progress, if there is no progress bar.
const PERIOD: Duration = Duration::from_secs(5);

/// Console that shows progress as a bar if it is a terminal, and messages unless they are turned off. Writes events as JSON if requested.
#[derive(Debug)]
pub struct Terminal {
    bar: ProgressBar,
    quiet: bool,
    json: bool,
    lines: Option<Lines>,
}

/// State of the progress that is printed as lines.
#[derive(Debug)]
struct Lines {
    /// Name of the things that are counted, such as `pictures`.
    counted: &'static str,
    printed_at: Mutex<Instant>,
}

impl Terminal {
    /// Creates a console without a progress bar.
    pub fn without_bar(quiet: bool, json: bool) -> Self {
        Self {
            bar: ProgressBar::hidden(),
            quiet,
            json,
            lines: None,
        }
    }

    /// Creates a console with a progress bar, if standard error is a terminal.
    ///
    /// * `template`: template of the bar, as for [`output::bar_style`].
    pub fn with_bar(quiet: bool, json: bool, template: &str) -> Self {
        let bar = if quiet || !output::is_terminal() {
            ProgressBar::hidden()
        } else {
            ProgressBar::new(0)
        };
        if let Some(style) = output::bar_style(template) {
            bar.set_style(style);
        }
        Self {
            bar,
            quiet,
            json,
            lines: None,
        }
    }

    /// Redraws the bar twice a second, even without progress.
    #[must_use]
    pub fn ticking(self) -> Self {
        self.bar.enable_steady_tick(Duration::from_millis(500));
        self
    }

    /// Prints a line of progress every few seconds if standard error is not a terminal, for example in a log or in a background job.
    ///
    /// * `counted`: name of the things that are counted, such as `pictures`.
    #[must_use]
    pub fn in_lines_off_terminals(mut self, counted: &'static str) -> Self {
        if !self.quiet && !output::is_terminal() {
            let printed_at = Mutex::new(Instant::now());
            self.lines = Some(Lines {
                counted,
                printed_at,
            });
        }
        self
    }

    fn print_line(&self) {
        let Some(lines) = &self.lines else {
            return;
        };
        let Ok(mut printed_at) = lines.printed_at.lock() else {
            return;
        };
        if printed_at.elapsed() < PERIOD {
            return;
        }
        *printed_at = Instant::now();
        let label = self.bar.prefix();
        let colon = if label.is_empty() { "" } else { ": " };
        let (done, of) = (self.bar.position(), self.bar.length().unwrap_or(0));
        output::message(format_args!(
            "{label}{colon}{done} of {of} {}",
            lines.counted
        ));
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
        if self.lines.is_some() && !details.is_empty() {
            output::message(details);
        }
    }

    fn details(&self, text: &str) {
        self.bar.set_message(text.to_owned());
    }

    fn set(&self, done: usize, of: usize) {
        self.bar.set_length(of as u64);
        self.bar.set_position(done as u64);
        self.print_line();
    }

    fn advance(&self, n: usize) {
        self.bar.inc(n as u64);
        self.print_line();
    }

    fn finish(&self) {
        self.bar.finish_and_clear();
    }
}
