//! Progress display: the number of finished frames, and the remaining time.

use std::time::{Duration, Instant};

use failure::Console;

/// Time between two lines of progress if there is no bar.
const EVERY: Duration = Duration::from_secs(10);

/// Shows progress on a console: with a bar, or otherwise with a message every few seconds.
pub(super) struct Progress<'a> {
    console: &'a dyn Console,
    begin: Instant,
    said: Instant,
    n_frames: usize,
    n_solved: usize,
    n_passed: usize,
}

impl<'a> Progress<'a> {
    pub(super) fn new(console: &'a dyn Console, n_frames: usize) -> Self {
        console.set(0, n_frames);
        Self {
            console,
            begin: Instant::now(),
            said: Instant::now(),
            n_frames,
            n_solved: 0,
            n_passed: 0,
        }
    }

    pub(super) fn passed_over(&mut self, n: usize) {
        self.n_passed += n;
        self.console.advance(n);
    }

    pub(super) fn solved(&mut self, sequence: &str) {
        self.n_solved += 1;
        let each = self.begin.elapsed().as_secs_f64() / self.n_solved as f64;
        let left = self.n_frames - self.n_solved - self.n_passed;
        let minutes = each * left as f64 / 60.0;
        let text = format!("{sequence}: {each:.2} s per frame, {minutes:.1} minutes left");
        self.console.details(&text);
        self.console.advance(1);
        if !self.console.shows_bar() && self.said.elapsed() >= EVERY {
            self.said = Instant::now();
            let n = self.n_solved + self.n_passed;
            let text = format!("{n}/{} frames, {text}", self.n_frames);
            self.console.message(&text);
        }
    }

    pub(super) fn end(&self) {
        self.console.finish();
    }
}
