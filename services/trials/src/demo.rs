//! The demo: runs a whole deployment with four synthetic cameras, kills one of them, and writes a report.

mod limits;
mod machine;
mod options;
mod page;
mod report;
mod run;
mod score;

use std::path::Path;

use failure::{ExitKind, Failure, OrFail as _, Stop, now_nanos};
use launch::{Planned, load};
use serde_json::Value;
use terminal::output::{self, Verbosity};

use crate::trial::injection::{Injector, ProcessFault};
use crate::trial::results;
use crate::trial::synthetic::{self, Finder, N_CAMERAS, SyntheticDeployment, SyntheticSetup};
use machine::{FULL_RATE_HZ, Gauge, Machine};
use report::Report;
use run::{Run, VICTIM};

pub use options::{Limits, Options};

/// Minimum time that a stage waits for a late view, in milliseconds; see [`Options::setup`].
const DEADLINE_MS: u64 = 500;

/// Default duration of the run, in seconds.
const DEFAULT_S: f64 = 20.0;
/// Smallest default number of frames.
const MIN_FRAMES: u64 = 30;

impl Options {
    fn n_frames(&self, rate_hz: f64) -> u64 {
        let n_in = |seconds: f64| (seconds * rate_hz).round() as u64;
        match (self.frames, self.seconds) {
            (Some(frames), _) => frames,
            (None, Some(seconds)) => n_in(seconds.into()).max(1),
            (None, None) => n_in(DEFAULT_S).max(MIN_FRAMES),
        }
    }

    /// Returns the settings of the synthetic deployment.
    ///
    /// * `machine`: the measured speed of this machine, if it was measured.
    fn setup(&self, machine: Option<&Machine>) -> SyntheticSetup<'_> {
        let rate_hz = self.rate_hz.or(machine.map(Machine::rate_hz));
        let rate_hz = rate_hz.unwrap_or(FULL_RATE_HZ);
        let needed = machine.map_or(0, |_| (1500.0 / rate_hz) as u64);
        SyntheticSetup {
            subject: self.subject,
            action: self.action,
            passers: self.people.saturating_sub(1),
            seed: self.seed,
            rate_hz,
            n_frames: self.n_frames(rate_hz),
            n_cameras: N_CAMERAS,
            deadline_ms: self.deadline_ms.unwrap_or(DEADLINE_MS.max(needed)),
            finder: Finder::Default,
            name: &self.name,
            command: "demo",
        }
    }
}

/// The files that are written at the end.
const REPORTS: [&str; 2] = ["report.json", "report.html"];

/// Fraction of the frames after which the camera's process is killed.
const KILL_AFTER: f64 = 0.4;

/// Outcome of the demo.
#[derive(Debug)]
pub struct Outcome {
    /// True if all limits were met.
    pub is_held: bool,
    /// The report as JSON, which is the content of `report.json`.
    pub json: Value,
    /// The report as text.
    pub text: String,
}

/// Runs the demo, checks its limits, and writes its reports. Returns `None` if the demo was interrupted; no report is written in this case.
///
/// # Errors
///
/// Fails if the folder cannot be written to, or the run fails.
pub fn run(options: &Options, verbosity: Verbosity) -> Result<Option<Outcome>, Failure> {
    let folder = synthetic::absolute(&options.out)?;
    let mut gauge = gauge(options, &folder, verbosity)?;
    let before = gauge.as_mut().map(Gauge::measure).transpose()?;
    let setup = options.setup(before.as_ref());
    let synthetic = SyntheticDeployment::new(&setup, folder)?;
    remove_reports(&synthetic)?;
    let loaded = load::read(&synthetic.write(&setup)?, &[])?;
    let planned = Planned::new(&loaded.deployment, verbosity.level)?;
    let processes: Vec<String> = planned.processes().map(str::to_owned).collect();
    announce(
        &setup,
        before.as_ref(),
        verbosity,
        &synthetic,
        processes.len(),
    );
    let mut injector = options.kills.then(|| {
        let camera = &synthetic.rig.cameras()[VICTIM].name;
        let at_frame = KILL_AFTER * setup.n_frames as f64;
        Injector::new(ProcessFault::Kill, &format!("capture-{VICTIM}"), at_frame)
            .with_camera_name(camera)
    });
    let stop = Stop::on_signals().or_fail(ExitKind::Run)?;
    let report = planned.run(verbosity.quiet, &stop, &mut |event| {
        injector
            .as_mut()
            .and_then(|injector| injector.handle(event, now_nanos(), ProcessFault::inject))
    })?;
    if report.kind() == Some(ExitKind::Interrupted) {
        return Ok(None);
    }
    let after = gauge.as_mut().map(Gauge::measure).transpose()?;
    let cameras = synthetic.rig.cameras().iter();
    let cameras: Vec<String> = cameras.map(|camera| camera.name.clone()).collect();
    let results = results::read(&loaded.deployment.output, &cameras)?;
    let run = Run {
        cameras: &cameras,
        n_frames: setup.n_frames,
        rate_hz: setup.rate_hz,
        deadline_ms: setup.deadline_ms as f64,
        machine: before.zip(after).map(|(before, after)| before.slower(after)),
        processes: &processes,
        report: &report,
        truth: &synthetic.truth(results.iter().map(|result| result.frame))?,
        results: &results,
        killed: injector.as_ref().map(Injector::times),
        session: planned.session(),
    };
    conclude(options, &synthetic, (&run, &loaded.deployment.output)).map(Some)
}

/// Prepares the measurement of this machine's speed. Returns `None` if the frame rate is given, because no measurement is needed.
fn gauge(options: &Options, folder: &Path, verbosity: Verbosity) -> Result<Option<Gauge>, Failure> {
    if options.rate_hz.is_some() {
        return Ok(None);
    }
    if !verbosity.quiet {
        output::message("measuring this machine for about two seconds");
    }
    let setup = options.setup(None);
    let synthetic = SyntheticDeployment::new(&setup, folder.to_path_buf())?;
    let loaded = load::read(&synthetic.write(&setup)?, &[])?;
    let planned = Planned::new(&loaded.deployment, verbosity.level)?;
    Gauge::new(&synthetic, planned.resolved()).map(Some)
}

/// Checks the limits of a completed run, and writes the reports.
fn conclude(
    options: &Options,
    synthetic: &SyntheticDeployment,
    (run, output): (&Run<'_>, &Path),
) -> Result<Outcome, Failure> {
    let report = Report::new(run, &options.limits);
    let json = report.json(run);
    let page = page::page(run, &report, synthetic, output);
    write_reports(
        synthetic,
        [format!("{json:#}\n"), exports::report::run::html(&page)],
    )?;
    let mut text = [run.report.text(), report.text(&synthetic.folder)].join("\n");
    if let Some(machine) = run.machine {
        text.extend(["\n".to_owned(), machine.text()]);
    }
    Ok(Outcome {
        is_held: report.is_held(),
        json,
        text,
    })
}

/// Removes the reports of an earlier demo, so that they cannot be mistaken for new ones.
fn remove_reports(synthetic: &SyntheticDeployment) -> Result<(), Failure> {
    for name in REPORTS {
        let file = synthetic.folder.join(name);
        if file.exists() {
            std::fs::remove_file(&file).map_err(|error| failure::in_file(&file, &error))?;
        }
    }
    Ok(())
}

fn write_reports(synthetic: &SyntheticDeployment, texts: [String; 2]) -> Result<(), Failure> {
    for (name, text) in REPORTS.into_iter().zip(texts) {
        let file = synthetic.folder.join(name);
        files::replace(&file, text.as_bytes()).map_err(|error| failure::in_file(&file, &error))?;
    }
    Ok(())
}

fn announce(
    setup: &SyntheticSetup<'_>,
    machine: Option<&Machine>,
    verbosity: Verbosity,
    synthetic: &SyntheticDeployment,
    n_processes: usize,
) {
    if verbosity.quiet {
        return;
    }
    if let Some(machine) = machine {
        output::message(machine.text());
    }
    let (frames, rate) = (setup.n_frames, setup.rate_hz);
    output::message(format_args!(
        "{n_processes} processes and their supervisor; {frames} frames at {rate} per second; results in {}",
        synthetic.folder.display()
    ));
}
