//! The progress display of a run.

use core::time::Duration;
use std::time::Instant;

use indicatif::ProgressBar;
use supervise::Event;

use crate::resolved::Resolved;
use terminal::output;

/// Interval of progress messages if no bar can be drawn.
const PERIOD: Duration = Duration::from_secs(5);

/// Shows the progress of a run: with a bar on a terminal, otherwise with a message every few seconds.
#[derive(Debug)]
pub struct Watcher {
    bar: ProgressBar,
    quiet: bool,
    /// Number of frames; `None` if the run continues until it is stopped.
    n_frames: Option<u64>,
    start_frame: u64,
    frame_step: u64,
    n_done: u64,
    printed_at: Instant,
    begin: Instant,
}

impl Watcher {
    /// Starts to show the progress, before any frame is done.
    pub fn new(resolved: &Resolved, quiet: bool) -> Self {
        let n_frames = (!resolved.is_endless()).then(|| resolved.n_frames());
        let bar = if quiet || !output::is_terminal() {
            ProgressBar::hidden()
        } else {
            n_frames.map_or_else(ProgressBar::new_spinner, ProgressBar::new)
        };
        let style = match n_frames {
            Some(_) => "{elapsed_precise} {wide_bar} {pos}/{len} frames, {per_sec}{left}{msg}",
            None => "{elapsed_precise} {spinner} {pos} frames, {per_sec}; Ctrl-C ends the run{msg}",
        };
        if let Some(style) = output::bar_style(style) {
            bar.set_style(style);
        }
        Self {
            bar,
            quiet,
            n_frames,
            start_frame: resolved.deployment.capture.start_frame,
            frame_step: resolved.deployment.capture.frame_step.max(1),
            n_done: 0,
            printed_at: Instant::now(),
            begin: Instant::now(),
        }
    }

    /// Updates the progress, and prints the events that concern the user.
    pub fn handle(&mut self, event: &Event<'_>) {
        match event {
            Event::Health { process, health } if *process == "triangulate" => {
                // Progress is measured by frame numbers, because the counts of a process start at 0 after a restart.
                if health.n_sent > 0 {
                    let nth = health.last_frame.saturating_sub(self.start_frame) / self.frame_step;
                    self.n_done = self.n_done.max(nth + 1);
                }
                self.bar.set_position(self.n_done);
                self.print_progress();
            }
            Event::Line { text, .. } => self.print(text),
            Event::Died { process, death } => self.print(&format!("{process} {death}")),
            Event::Restarting { process, pause } if pause.is_zero() => {
                self.print(&format!("{process} starts again"));
            }
            Event::Restarting { process, pause } => {
                self.print(&format!(
                    "{process} starts again in {} ms",
                    pause.as_millis()
                ));
            }
            Event::GivenUp { process, restarts } => {
                self.print(&format!(
                    "{process} is not restarted any more, after {restarts} restarts"
                ));
            }
            Event::Dismissed { process } => {
                self.print(&format!(
                    "{process} is stopped, because no process sends to it any more"
                ));
            }
            Event::Awaited { process } => {
                self.print(&format!("waiting for {process}, which completes its files"));
            }
            Event::Killed { process, waited } => {
                let waited_s = waited.as_secs_f64();
                self.print(&format!(
                    "{process} did not end within {waited_s:.0} s of the stop request, and was killed"
                ));
            }
            _ => {}
        }
    }

    /// Removes the bar.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }

    /// Prints a line above the bar.
    pub fn print(&self, text: &str) {
        self.bar.suspend(|| output::message(text));
    }

    fn print_progress(&mut self) {
        if self.quiet || output::is_terminal() || self.printed_at.elapsed() < PERIOD {
            return;
        }
        self.printed_at = Instant::now();
        let rate = self.n_done as f64 / self.begin.elapsed().as_secs_f64();
        let of = self.n_frames.map_or_else(String::new, |frame| format!(" of {frame}"));
        output::message(format_args!(
            "{}{of} frames, {rate:.2} per second",
            self.n_done
        ));
    }
}
