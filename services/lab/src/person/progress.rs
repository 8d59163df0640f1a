//! Progress display of a training.

use std::error::Error;
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use failure::{Console, ExitKind, Failure, Stop};
use serde_json::{Map, Value, json};
use training::datasets::Problem;
use training::{Event, Gap, Step, Watch};

/// Shows the current step and the remaining time on a console.
#[derive(Debug)]
pub struct Progress {
    console: Box<dyn Console>,
    stop: Stop,
    state: Mutex<State>,
}

/// The current step, and the durations of finished steps.
#[derive(Debug)]
struct State {
    step: Step,
    /// Index of the current step.
    at: usize,
    all: Vec<Step>,
    begin: Instant,
    /// Steps that this process finished, with their durations.
    seconds: Vec<(Step, f64)>,
    gap: Option<Gap>,
    /// Number of examples in memory, and their bytes.
    held: Option<(usize, usize)>,
    /// Number of images of people in which the model found a position, number of other images, and the mean score.
    placed: Option<(usize, usize, f64)>,
}

impl Progress {
    /// Creates the display before the first step.
    ///
    /// * `stop`: stop request that ends the training.
    pub fn new(stop: Stop, console: Box<dyn Console>) -> Self {
        Self {
            console,
            stop,
            state: Mutex::new(State {
                step: Step::Filters,
                at: 0,
                all: Vec::new(),
                begin: Instant::now(),
                seconds: Vec::new(),
                gap: None,
                held: None,
                placed: None,
            }),
        }
    }

    /// Reports a person who was left out.
    pub(super) fn left_out(&self, problem: &Problem) -> Result<(), Failure> {
        self.console.message(&format!(
            "left out: {}",
            failure::wording::in_one_line(problem)
        ));
        self.console.event(&json!({
            "event": "left-out",
            "file": problem.file,
            "row": problem.row,
            "kind": problem.fault.kind().name(),
            "message": failure::wording::in_one_line(&problem.fault),
        }))
    }

    /// Reports an image without people that cannot be read.
    pub(super) fn unreadable(
        &self,
        image: &Path,
        error: &(dyn Error + 'static),
    ) -> Result<(), Failure> {
        let message = failure::wording::in_one_line(error);
        self.console.message(&format!("left out: {message}"));
        self.console
            .event(&json!({ "event": "unreadable", "file": image, "message": message }))
    }

    /// Reports the data of the training.
    pub(super) fn data(&self, text: &str, mut event: Value) -> Result<(), Failure> {
        self.console.message(text);
        event["event"] = "data".into();
        self.console.event(&event)
    }

    /// Starts to read the features of a checkpoint's examples again.
    pub(super) fn resuming(&self, n_done: usize) {
        self.console.begin(&format!("continuing after step {n_done}"), "");
    }

    /// Reports that a training continues.
    pub(super) fn resumed(&self, n_done: usize, n_steps: usize) -> Result<(), Failure> {
        self.console.message(&format!("continuing after step {n_done} of {n_steps}"));
        self.console
            .event(&json!({ "event": "resumed", "done": n_done, "steps": n_steps }))
    }

    /// Starts a step.
    pub(super) fn begin(&self, step: Step, at: usize, all: &[Step]) {
        let mut state = self.lock();
        state.step = step;
        state.at = at;
        all.clone_into(&mut state.all);
        state.begin = Instant::now();
        (state.gap, state.placed) = (None, None);
        self.console.begin(&state.label(), &state.left_text());
    }

    /// Ends the step.
    pub(super) fn done(&self) -> Result<(), Failure> {
        let (text, event) = {
            let mut state = self.lock();
            let (step, seconds) = (state.step, state.begin.elapsed().as_secs_f64());
            state.seconds.push((step, seconds));
            state.at += 1;
            (state.text(seconds), state.json(seconds))
        };
        if !self.console.shows_bar() {
            self.console.message(&text);
        }
        self.console.event(&event)
    }

    /// Starts to look for false alarms.
    pub(super) fn begin_alarms(&self, n_images: usize) {
        self.console.begin("false alarms", "");
        self.console.set(0, n_images);
    }

    /// Counts an image that was searched.
    pub(super) fn looked_at_one(&self) {
        self.console.advance(1);
    }

    /// Fails if the user stopped the training.
    pub(super) fn go_on_or_stop(&self) -> Result<(), Failure> {
        if self.go_on() {
            Ok(())
        } else {
            Err(Failure::new(ExitKind::Interrupted, "stopped"))
        }
    }

    /// Returns the number of images of people in which the final model found no position.
    pub(super) fn n_lost(&self) -> Option<usize> {
        self.lock().placed.map(|placed| placed.1)
    }

    /// Removes the progress bar.
    pub fn finish(&self) {
        self.console.finish();
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Watch for Progress {
    fn tell(&self, event: Event) {
        let mut state = self.lock();
        match event {
            Event::Images { done, of } => {
                self.console.set(done, of);
                return;
            }
            Event::Placed {
                n,
                n_lost,
                mean_score,
            } => state.placed = Some((n, n_lost, mean_score)),
            Event::Collected { held, bytes, .. } => state.held = Some((held, bytes)),
            Event::Gap(gap) => state.gap = Some(gap),
        }
        self.console.details(&(state.details() + &state.left_text()));
    }

    fn go_on(&self) -> bool {
        !self.stop.is_requested()
    }
}

impl State {
    fn label(&self) -> String {
        let (nth, n) = (self.at + 1, self.all.len());
        format!("step {nth:>2} of {n}, {}", what(self.step))
    }

    fn text(&self, seconds: f64) -> String {
        let nth = self.at;
        let (n, what, details) = (self.all.len(), what(self.step), self.details());
        let left = self.left_text();
        format!("step {nth:>2} of {n}, {what}{details}, {seconds:.1} s{left}")
    }

    fn details(&self) -> String {
        let placed = self
            .placed
            .map(|(n, n_lost, mean)| format!(", {n} placed, {n_lost} lost, mean score {mean:.3}"));
        let gap = self.gap.map(|gap| {
            let (objective, n, share) = (gap.primal, gap.n_support, 100.0 * gap.relative());
            format!(", objective {objective:.4}, gap {share:.1} %, {n} support vectors")
        });
        let learns = matches!(self.step, Step::Learn { .. });
        let held = self.held.filter(|_| learns);
        let held = held.map(|(n, bytes)| format!(", {n} examples, {:.0} MiB", mib(bytes)));
        [placed, gap, held].into_iter().flatten().collect()
    }

    /// Estimates the seconds until all steps are done: each step takes as long as earlier steps of its kind, or as the average step.
    fn seconds_left(&self) -> Option<f64> {
        let mean = |of: &dyn Fn(Step) -> bool| {
            let taken = self.seconds.iter().filter(|second| of(second.0)).map(|second| second.1);
            let n = taken.clone().count();
            (n > 0).then(|| taken.sum::<f64>() / n as f64)
        };
        let any = mean(&|_| true)?;
        let left = self.all.get(self.at..).filter(|left| !left.is_empty())?.iter();
        let of_step = |step: &Step| mean(&|other| kind(other) == kind(*step)).unwrap_or(any);
        Some(left.map(of_step).sum())
    }

    fn left_text(&self) -> String {
        let Some(seconds) = self.seconds_left() else {
            return String::new();
        };
        let minutes = (seconds / 60.0).ceil();
        if seconds < 90.0 {
            format!(", {seconds:.0} s left")
        } else {
            format!(", {minutes:.0} min left")
        }
    }

    fn json(&self, seconds: f64) -> Value {
        let mut event = Map::new();
        let mut put = |key: &str, value: Value| {
            event.insert(key.to_owned(), value);
        };
        put("event", "step".into());
        put("step", self.at.into());
        put("steps", self.all.len().into());
        put("what", kind(self.step).into());
        match self.step {
            Step::Place { round } => put("round", (round + 1).into()),
            Step::Learn { round, pass, batch } => {
                put("round", (round + 1).into());
                put("pass", (pass + 1).into());
                put("batch", (batch + 1).into());
            }
            Step::Filters | Step::Judge => {}
        }
        put("seconds", seconds.into());
        put("seconds_left", json!(self.seconds_left()));
        if let Some((n, n_lost, mean)) = self.placed {
            put("placed", n.into());
            put("lost", n_lost.into());
            put("mean_score", mean.into());
        }
        if let Some(gap) = self.gap {
            put("objective", gap.primal.into());
            put("dual_objective", gap.dual.into());
            put("gap", gap.relative().into());
            put("support_vectors", gap.n_support.into());
        }
        if let (Some((n, bytes)), Step::Learn { .. }) = (self.held, self.step) {
            put("examples", n.into());
            put("mib", mib(bytes).into());
        }
        Value::Object(event)
    }
}

fn what(step: Step) -> String {
    match step {
        Step::Filters => "first filters".to_owned(),
        Step::Place { round } => format!("round {}, people placed", round + 1),
        Step::Learn { round, pass, batch } => {
            let [round, pass, batch] = [round, pass, batch].map(|value| value + 1);
            format!("round {round}, pass {pass}, batch {batch}")
        }
        Step::Judge => "threshold".to_owned(),
    }
}

fn kind(step: Step) -> &'static str {
    match step {
        Step::Filters => "filters",
        Step::Place { .. } => "place",
        Step::Learn { .. } => "learn",
        Step::Judge => "judge",
    }
}

fn mib(bytes: usize) -> f64 {
    bytes as f64 / f64::from(1 << 20)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn remaining_steps_are_assumed_to_take_as_long_as_earlier_steps_of_their_kind() {
        let learn = |batch| Step::Learn {
            round: 0,
            pass: 0,
            batch,
        };
        let place = Step::Place { round: 0 };
        let mut state = State {
            step: Step::Filters,
            at: 0,
            all: vec![Step::Filters, place, learn(0), learn(1), Step::Judge],
            begin: Instant::now(),
            seconds: Vec::new(),
            gap: None,
            held: None,
            placed: None,
        };
        assert_eq!(state.seconds_left(), None);
        state.seconds = vec![(Step::Filters, 2.0), (place, 4.0), (learn(0), 9.0)];
        state.at = 3;
        assert_eq!(
            state.seconds_left(),
            Some(9.0 + 5.0),
            "5 is the mean of all"
        );
        state.at = 5;
        assert_eq!(state.seconds_left(), None, "all are done");
    }
}
