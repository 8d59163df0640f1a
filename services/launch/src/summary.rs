//! The progress of a run, and the report at its end.

mod cameras;
mod everybody;
mod page;
mod people;
mod recorded;
mod slow;
mod trust;
mod watcher;

use core::fmt::Write as _;
use core::time::Duration;
use std::collections::BTreeMap;
use std::path::PathBuf;

use exports::report::run::Verdict;
use failure::{ExitKind, Failure};
use messages::Refusal;
use runfiles::{CameraFit, LatencyReport, Summary};
use runtime::metrics::Reading;
use serde_json::{Value, json};
use supervise::Outcome;

use crate::budget::{self, Budget};
use crate::live;
use crate::no_results;
use crate::resolved::Resolved;
use crate::search_size::SearchSize;
use crate::views::{self, ViewReport};

use people::Outside;

pub use page::FILE as PAGE;
pub use recorded::Recorded;
pub use watcher::Watcher;

/// The report on a run.
#[derive(Debug)]
pub struct Report {
    name: String,
    folder: String,
    n_frames: u64,
    seconds: f64,
    interrupted: bool,
    given_up: Vec<String>,
    restarts: Vec<(String, u32)>,
    /// Peak memory of every process, including shared memory, in bytes.
    peaks: Vec<(String, u64)>,
    n_dropped: u64,
    /// Processor time of every process since its last start, in seconds.
    processor_s: BTreeMap<String, f64>,
    /// Messages that each process refused, by cause.
    refused: Vec<(String, [u64; Refusal::N])>,
    /// Number of frames that the processor computed because the GPU was lost, by process.
    without_gpu: BTreeMap<String, u64>,
    is_lossless: bool,
    views: Vec<ViewReport>,
    budget: Option<Budget>,
    /// The sizes of the frames, if the deployment sets none.
    search_size: Option<SearchSize>,
    /// Views in which people were too small or too large for the search.
    outside: Option<Outside>,
    /// The last metrics of every process.
    measured: BTreeMap<String, Value>,
    /// Summary that the process `results` wrote to `summary.json`.
    recorded: Recorded,
    /// Counts of the pictures of live cameras, one line per camera.
    live: String,
    /// True if another host fuses the views and has the results.
    is_far: bool,
}

impl Report {
    /// Combines the outcome of the supervisor with the summary of the process `results`.
    ///
    /// * `session`: the session of the run. The summary of another session is ignored.
    /// * `elapsed`: the duration of the run.
    pub fn new(resolved: &Resolved, session: u64, outcome: &Outcome, elapsed: Duration) -> Self {
        let folder = &resolved.deployment.output;
        let cameras = resolved.deployment.cameras.iter();
        let cameras: Vec<&str> = cameras.map(|camera| camera.name.as_str()).collect();
        let recorded = Recorded::read(folder, session, &cameras);
        let processes = &outcome.processes;
        let given_up =
            processes.iter().filter(|process| process.state == supervise::State::GivenUp);
        let restarted = processes.iter().filter(|process| process.restarts > 0);
        Self {
            name: resolved.deployment.name.clone(),
            folder: folder.display().to_string(),
            n_frames: views::n_reached(resolved, outcome),
            seconds: elapsed.as_secs_f64(),
            interrupted: outcome.interrupted,
            given_up: given_up.map(|given_up| given_up.name.clone()).collect(),
            restarts: restarted
                .map(|restarted| (restarted.name.clone(), restarted.restarts))
                .collect(),
            peaks: processes
                .iter()
                .map(|process| (process.name.clone(), process.counts.peak_memory_bytes))
                .collect(),
            processor_s: processes
                .iter()
                .filter_map(|process| {
                    let last = process.last.as_ref()?;
                    Some((process.name.clone(), f64::from(last.cpu_millis) * 1e-3))
                })
                .collect(),
            n_dropped: processes.iter().map(|process| process.counts.n_dropped).sum(),
            refused: processes
                .iter()
                .filter(|process| process.counts.refused.iter().any(|n| *n > 0))
                .map(|process| (process.name.clone(), process.counts.refused))
                .collect(),
            without_gpu: processes
                .iter()
                .filter(|process| process.counts.n_without_gpu > 0)
                .map(|process| (process.name.clone(), process.counts.n_without_gpu))
                .collect(),
            is_lossless: resolved.deployment.capture.mode.is_lossless(),
            views: ViewReport::all(resolved, outcome, recorded.summary()),
            budget: resolved
                .deployment
                .supervise
                .latency_budget_ms
                .map(|latency_budget_ms| Budget::new(latency_budget_ms, recorded.latency())),
            search_size: resolved.search_size.clone(),
            // A network sees every person in a window of its own size, so the size in the picture does not matter.
            outside: recorded
                .outside(resolved.deployment.capture.size.is_some())
                .filter(|_| !resolved.deployment.has_maps()),
            measured: measured(outcome),
            live: cameras::live(outcome),
            is_far: resolved.is_far(),
            recorded,
        }
    }

    /// Returns the frame counts of every view.
    pub fn views(&self) -> &[ViewReport] {
        &self.views
    }

    /// Returns the processes that were restarted more often than faults were injected into them, and the processes that were given up. The
    /// list is sorted.
    ///
    /// * `n_faults`: returns the number of faults injected into a process.
    pub fn unexpected_failures(&self, n_faults: impl Fn(&str) -> u32) -> Vec<String> {
        let restarted = self.restarts.iter();
        let unexpected =
            restarted.filter(|(name, n)| *n > n_faults(name)).map(|restarted| &restarted.0);
        let mut failed: Vec<String> = unexpected.chain(&self.given_up).cloned().collect();
        failed.sort();
        failed.dedup();
        failed
    }

    /// Returns the verdict on the latency budget, if the deployment has a budget.
    pub fn budget(&self) -> Option<&Budget> {
        self.budget.as_ref()
    }

    /// Returns the cameras whose calibration is probably wrong.
    pub fn misplaced(&self) -> Vec<String> {
        let suspected = self.suspected();
        suspected.map(|(camera, _)| camera.clone()).collect()
    }

    /// Returns the cameras whose pictures were not taken at their stated times.
    pub fn out_of_step(&self) -> impl Iterator<Item = (&String, &CameraFit)> {
        let summary = self.recorded.summary().into_iter();
        let fits = summary.flat_map(|summary| &summary.calibration);
        fits.filter(|(_, fit)| fit.out_of_step)
    }

    fn suspected(&self) -> impl Iterator<Item = (&String, &CameraFit)> {
        let summary = self.recorded.summary().into_iter();
        let fits = summary.flat_map(|summary| &summary.calibration);
        fits.filter(|(_, fit)| fit.suspected)
    }

    /// Returns the summary that the process `results` wrote.
    pub fn recorded(&self) -> &Recorded {
        &self.recorded
    }

    /// Returns the exit status of the run, if it did not succeed.
    pub fn kind(&self) -> Option<ExitKind> {
        let budget = self.budget.as_ref();
        if budget.is_some_and(Budget::is_exceeded) {
            // The budget also applies to an interrupted run, because runs with live cameras always end by being interrupted.
            Some(ExitKind::Limit)
        } else if self.interrupted {
            Some(ExitKind::Interrupted)
        } else if budget.is_some_and(|budget| !budget.is_held()) {
            Some(ExitKind::Limit)
        } else {
            self.is_degraded().then_some(ExitKind::Degraded)
        }
    }

    /// Returns true if views, frames or processes were lost, or the losses are unknown. Returns false for an interrupted run.
    fn is_degraded(&self) -> bool {
        if self.is_far {
            return !self.given_up.is_empty() || !self.restarts.is_empty();
        }
        !self.interrupted
            && (self.no_results_reason().is_some()
                || !self.given_up.is_empty()
                || !self.restarts.is_empty()
                || self.recorded.summary().is_none_or(|summary| self.is_lossy(summary))
                || !self.doubts().is_empty()
                || self.views.iter().any(|view| view.is_lost(self.is_lossless)))
    }

    fn doubts(&self) -> Vec<String> {
        self.recorded.summary().map_or_else(Vec::new, trust::doubts)
    }

    /// Returns true if frames were lost, or if the cameras contradict each other.
    fn is_lossy(&self, summary: &Summary) -> bool {
        let is_incomplete = summary.frames_missed > 0 || summary.frames < self.n_frames;
        trust::are_cameras_doubtful(summary)
            || (self.is_lossless && is_incomplete)
            || summary.frames_not_recorded > 0
            || summary.writes_failed > 0
    }

    /// Returns the reason why the run has no 3D joints; `None` for an interrupted run.
    fn no_results_reason(&self) -> Option<String> {
        let summary = self.recorded.summary().filter(|_| !self.interrupted)?;
        no_results::reason(summary, &self.views)
    }

    /// Writes `report.html` to the folder of the run, and returns its path. Returns `None` if the results are on another host.
    ///
    /// # Errors
    ///
    /// Fails if the results cannot be read, or the page cannot be written.
    pub fn write_page(&self, resolved: &Resolved) -> Result<Option<PathBuf>, Failure> {
        let (Some(summary), false) = (self.recorded.summary(), self.is_far) else {
            return Ok(None);
        };
        let rig = inputs::rig_of(&resolved.deployment)?;
        let cameras = resolved.deployment.cameras.iter();
        let cameras: Vec<String> = cameras.map(|camera| camera.name.clone()).collect();
        let content = page::Content {
            name: &self.name,
            verdict: self.verdict(summary),
            text: &self.text(),
            latency: self.recorded.latency(),
            cameras: &cameras,
            rig: &rig,
            joints: &skeleton::PARSE14,
        };
        page::write(&resolved.deployment.output, &content).map(Some)
    }

    fn verdict(&self, summary: &Summary) -> Verdict {
        let doubts = self.doubts();
        let mut text = match self.no_results_reason() {
            Some(reason) => reason,
            None => trust::verdict(summary, &doubts).to_owned(),
        };
        text.extend(doubts.first().map(|doubt| format!(": {doubt}")));
        let is_good = self.kind().is_none();
        if !is_good && doubts.is_empty() && !trust::are_cameras_doubtful(summary) {
            text.push_str("; the run is incomplete: see below");
        }
        Verdict { text, is_good }
    }

    /// Returns the report as JSON.
    pub fn json(&self) -> Value {
        json!({
            "schema_version": 1,
            "name": self.name,
            "output": self.folder,
            "frames_in_footage": self.n_frames,
            "seconds": self.seconds,
            "interrupted": self.interrupted,
            "degraded": self.is_degraded(),
            "no_results": self.no_results_reason(),
            "doubts": self.doubts(),
            "given_up": self.given_up,
            "restarts": self.restarts.iter().map(|(name, n)| json!({ "process": name, "restarts": n })).collect::<Vec<_>>(),
            "peak_memory_bytes": self.peaks.iter().cloned().collect::<BTreeMap<_, _>>(),
            "processor_s": self.processor_s,
            "dropped": self.n_dropped,
            "refused": self.refused.iter().map(|(name, counts)| (name.as_str(), by_cause(counts))).collect::<BTreeMap<_, _>>(),
            "without_gpu": self.without_gpu,
            "views": self.views,
            "latency_budget": self.budget.as_ref().map(Budget::json),
            "search_size": { "by_itself": self.search_size, "outside": self.outside },
            "processes": self.measured,
            "recorded": self.recorded.json(),
        })
    }

    /// Returns the report as text.
    pub fn text(&self) -> String {
        let mut text = String::new();
        // Writing to a string cannot fail.
        let _infallible = self.write(&mut text);
        text.trim_end().to_owned()
    }

    fn write(&self, text: &mut String) -> core::fmt::Result {
        let status = match self.kind() {
            Some(ExitKind::Interrupted) => ", stopped",
            Some(ExitKind::Limit) => ", over its latency budget",
            Some(_) => ", degraded",
            None => "",
        };
        writeln!(
            text,
            "{}: {} frames in {:.1} s{status}",
            self.name, self.n_frames, self.seconds
        )?;
        if self.is_far {
            return self.write_far(text);
        }
        writeln!(text, "  results       {}", self.folder)?;
        if let Some(problem) = self.recorded.problem() {
            writeln!(text, "  recorded      {problem}")?;
        }
        if let Some(it) = self.recorded.summary() {
            writeln!(
                text,
                "  3D            {} of {} frames",
                it.frames_with_pose, self.n_frames
            )?;
            self.write_slow(text, it);
            text.push_str(&everybody::text(&it.people));
            text.push_str(&trust::text(it, &self.doubts()));
            self.write_views(text, it)?;
            self.write_misplaced(text, it)?;
        }
        self.write_live(text);
        if let Some(latency) = self.recorded.latency() {
            write_latency(text, latency)?;
        }
        write!(text, "  lost          {} messages dropped", self.n_dropped)?;
        if let Some(it) = self.recorded.summary() {
            write!(
                text,
                ", {} frames missed, {} frames with views missing, {} writes failed",
                it.frames_missed, it.frames_with_views_missing, it.writes_failed
            )?;
        }
        writeln!(text)?;
        if let Some(budget) = &self.budget {
            writeln!(text, "  budget        {}", budget.verdict())?;
        }
        self.write_refused(text)?;
        self.write_memory(text)?;
        let restarts = self.restarts.iter();
        let restarts: Vec<String> = restarts.map(|(name, n)| format!("{name} {n}")).collect();
        let restarts = if restarts.is_empty() {
            "none".to_owned()
        } else {
            restarts.join(", ")
        };
        writeln!(text, "  restarts      {restarts}")?;
        if !self.given_up.is_empty() {
            writeln!(text, "  given up      {}", self.given_up.join(", "))?;
        }
        Ok(())
    }

    /// Writes the report of a host with cameras, which does not have the results.
    fn write_far(&self, text: &mut String) -> core::fmt::Result {
        writeln!(text, "  results       on the fusing host")?;
        self.write_live(text);
        self.write_memory(text)
    }

    fn write_slow(&self, text: &mut String, summary: &Summary) {
        let slow = slow::text(summary, self.n_frames, self.seconds, self.is_lossless);
        text.extend(slow);
        text.extend(slow::predicted(summary));
    }

    fn write_live(&self, text: &mut String) {
        text.push_str(&self.live);
    }

    fn write_views(&self, text: &mut String, summary: &Summary) -> core::fmt::Result {
        if let Some(why) = self.no_results_reason() {
            writeln!(text, "  no results    {why}")?;
        }
        if let Some(outside) = &self.outside {
            writeln!(text, "  size          {}", outside.text())?;
        }
        let used = summary.views_used.iter();
        let used: Vec<String> = used.map(|(view, n)| format!("{view} {n}")).collect();
        writeln!(text, "  views used    {}", used.join(", "))?;
        for view in self.views.iter().filter(|view| view.used < view.frames) {
            writeln!(text, "    {view}")?;
        }
        Ok(())
    }

    fn write_misplaced(&self, text: &mut String, summary: &Summary) -> core::fmt::Result {
        if let Some(it) = &summary.exchanged {
            text.push_str(&cameras::exchanged(it));
        }
        if let Some(it) = &summary.contradicted {
            text.push_str(&cameras::contradicted(it));
        }
        for (camera, fit) in self.suspected() {
            let px = |value: Option<f64>| value.unwrap_or(f64::NAN);
            writeln!(
                text,
                "  calibration   {camera} is not where the rig says: the \
                 cameras differ by {:.0} px with this camera, and by {:.0} px without it",
                px(fit.residual_px),
                px(fit.without_px),
            )?;
        }
        for (camera, fit) in self.out_of_step() {
            text.push_str(&cameras::out_of_step(camera, fit));
        }
        Ok(())
    }

    /// Writes the refused messages by process and cause, and the processes that lost a GPU. Writes nothing if there are none.
    fn write_refused(&self, text: &mut String) -> core::fmt::Result {
        for (process, counts) in &self.refused {
            let causes = by_cause(counts);
            let causes: Vec<String> =
                causes.iter().map(|(cause, n)| format!("{cause} {n}")).collect();
            writeln!(text, "  refused       {process}: {}", causes.join(", "))?;
        }
        for (process, n) in &self.without_gpu {
            writeln!(
                text,
                "  GPU           {process} lost the GPU: the processor computed {n} frames"
            )?;
        }
        Ok(())
    }

    /// Writes, for every service, the peak memory of its largest process.
    fn write_memory(&self, text: &mut String) -> core::fmt::Result {
        let mut peaks = BTreeMap::new();
        for (process, bytes) in &self.peaks {
            let service = process.split('-').next().unwrap_or_default();
            let peak = peaks.entry(service).or_insert(0);
            *peak = bytes.div_ceil(1_000_000).max(*peak);
        }
        let peaks: Vec<String> = peaks
            .iter()
            .map(|(service, megabytes)| format!("{service} {megabytes}"))
            .collect();
        writeln!(
            text,
            "  memory        {} MB (peak of one process, including its shared memory)",
            peaks.join(", ")
        )
    }
}

fn write_latency(text: &mut String, latency: &LatencyReport) -> core::fmt::Result {
    text.push_str(&budget::table(latency));
    let percent = |share: f64| format!("{:.2} %", 100.0 * share);
    if let (Some(waiting), Some(transport)) = (latency.share_waiting, latency.share_transport) {
        writeln!(
            text,
            "    of the end-to-end time, {} is waiting for busy processes, and {} is transport",
            percent(waiting),
            percent(transport)
        )?;
    }
    Ok(())
}

/// Returns the last metrics of every process as JSON; null if they are invalid.
fn measured(outcome: &Outcome) -> BTreeMap<String, Value> {
    let measured = outcome.processes.iter().filter_map(|process| {
        let reading = Reading::from_message(process.measured.as_ref()?);
        let reading = reading.inspect_err(|error| {
            tracing::warn!(process = process.name, %error, "unreadable times and counts");
        });
        let value = reading.map_or(Value::Null, |reading| live::measured(&reading));
        Some((process.name.clone(), value))
    });
    measured.collect()
}

/// Returns the counts of refused messages by the name of the cause, without zeros.
fn by_cause(counts: &[u64; Refusal::N]) -> BTreeMap<&'static str, u64> {
    let all = Refusal::ALL.iter().zip(counts);
    let some = all.filter(|entry| *entry.1 > 0);
    some.map(|(cause, n)| (cause.name(), *n)).collect()
}
