//! Four cameras that do not exist, every process, one of them killed on purpose, and a report.

mod limits;
mod machine;
mod options;
mod page;
mod report;
mod run;
mod score;

use std::path::Path;

use launch::output::{self, Verbosity};
use launch::{Planned, load};
use runtime::{ExitKind, Failure, OrFail as _, Stop, now_nanos};
use serde_json::Value;

use crate::trial::results;
use crate::trial::stage::{self, Cast, N_CAMERAS, Stage};
use crate::trial::strike::{Blow, Strike};
use machine::{FULL_RATE_HZ, Gauge, Machine};
use report::Report;
use run::{Run, VICTIM};

pub use options::{Limits, Options};

/// How long a stage waits for a late view where the cameras take all frames they can, milliseconds.
const DEADLINE_MS: u64 = 500;

/// How long the cameras run, and how many frames at least, if nobody says.
const USUAL_S: f64 = 20.0;
const LEAST_FRAMES: u64 = 30;

impl Options {
    fn n_frames(&self, rate_hz: f64) -> u64 {
        let of = |seconds: f64| (seconds * rate_hz).round() as u64;
        match (self.frames, self.seconds) {
            (Some(frames), _) => frames,
            (None, Some(seconds)) => of(seconds.into()).max(1),
            (None, None) => of(USUAL_S).max(LEAST_FRAMES),
        }
    }

    /// * `machine`: what was measured, if something was.
    fn cast(&self, machine: Option<&Machine>) -> Cast<'_> {
        let rate_hz = self.rate_hz.or(machine.map(Machine::rate_hz));
        let rate_hz = rate_hz.unwrap_or(FULL_RATE_HZ);
        let needed = machine.map_or(0, |_| (1500.0 / rate_hz) as u64);
        Cast {
            subject: self.subject,
            action: self.action,
            seed: self.seed,
            rate_hz,
            n_frames: self.n_frames(rate_hz),
            n_cameras: N_CAMERAS,
            deadline_ms: self.deadline_ms.unwrap_or(DEADLINE_MS.max(needed)),
            name: &self.name,
            command: "demo",
        }
    }
}

/// What is written at the end: for programs, for people.
const REPORTS: [&str; 2] = ["report.json", "report.html"];

/// The camera is killed after this share of the frames.
const KILL_AFTER: f64 = 0.4;

/// What the demo found out.
#[derive(Debug)]
pub struct Outcome {
    /// Whether no limit was missed.
    pub is_held: bool,
    /// For programs; `report.json`.
    pub json: Value,
    /// For people.
    pub text: String,
}

/// Runs the demo, judges it, and writes its reports. `None` if it was stopped: then nothing is judged, and no report
/// written.
///
/// # Errors
///
/// The folder cannot be written to, or the run fails.
pub fn run(options: &Options, verbosity: Verbosity) -> Result<Option<Outcome>, Failure> {
    let folder = stage::absolute(&options.out)?;
    let mut gauge = gauge(options, &folder, verbosity)?;
    let before = gauge.as_mut().map(Gauge::measure).transpose()?;
    let cast = options.cast(before.as_ref());
    let stage = Stage::new(&cast, folder)?;
    remove_reports(&stage)?;
    let loaded = load::read(&stage.write(&cast)?, &[])?;
    let planned = Planned::new(&loaded.deployment, verbosity.level)?;
    let processes: Vec<String> = planned.processes().map(str::to_owned).collect();
    announce(&cast, before.as_ref(), verbosity, &stage, processes.len());
    let mut strike = options.kills.then(|| {
        let camera = &stage.rig.cameras()[VICTIM].name;
        let at_frame = KILL_AFTER * cast.n_frames as f64;
        Strike::new(Blow::Kill, &format!("capture-{VICTIM}"), at_frame).of_camera(camera)
    });
    let stop = Stop::on_signals().or_fail(ExitKind::Run)?;
    let ran = planned.run(verbosity.quiet, &stop, &mut |event| {
        strike
            .as_mut()
            .and_then(|it| it.note(event, now_nanos(), Blow::deal))
    })?;
    if ran.kind() == Some(ExitKind::Interrupted) {
        return Ok(None);
    }
    let after = gauge.as_mut().map(Gauge::measure).transpose()?;
    let cameras = stage.rig.cameras().iter();
    let cameras: Vec<String> = cameras.map(|it| it.name.clone()).collect();
    let moments = results::read(&loaded.deployment.output, &cameras)?;
    let run = Run {
        cameras: &cameras,
        n_frames: cast.n_frames,
        rate_hz: cast.rate_hz,
        deadline_ms: cast.deadline_ms as f64,
        machine: before
            .zip(after)
            .map(|(before, after)| before.slower(after)),
        processes: &processes,
        ran: &ran,
        truth: &stage.truth(moments.iter().map(|it| it.frame))?,
        moments: &moments,
        killed: strike.as_ref().map(Strike::times),
        session: planned.session(),
    };
    conclude(options, &stage, (&run, &loaded.deployment.output)).map(Some)
}

/// What measures this machine, if nobody says how many frames a second the cameras take.
fn gauge(options: &Options, folder: &Path, verbosity: Verbosity) -> Result<Option<Gauge>, Failure> {
    if options.rate_hz.is_some() {
        return Ok(None);
    }
    if !verbosity.quiet {
        output::message("measuring this machine for about two seconds");
    }
    let cast = options.cast(None);
    let stage = Stage::new(&cast, folder.to_path_buf())?;
    let loaded = load::read(&stage.write(&cast)?, &[])?;
    let planned = Planned::new(&loaded.deployment, verbosity.level)?;
    Gauge::new(&stage, planned.resolved()).map(Some)
}

/// Judges a run that is over, and writes the reports.
fn conclude(
    options: &Options,
    stage: &Stage,
    (run, results): (&Run<'_>, &Path),
) -> Result<Outcome, Failure> {
    let report = Report::new(run, &options.limits);
    let json = report.json(run);
    let page = page::page(run, &report, stage, results);
    write_reports(stage, [format!("{json:#}\n"), ::report::run::html(&page)])?;
    let mut text = [run.ran.text(), report.text(&stage.folder)].join("\n");
    if let Some(machine) = run.machine {
        text.extend(["\n".to_owned(), machine.text()]);
    }
    Ok(Outcome {
        is_held: report.is_held(),
        json,
        text,
    })
}

/// Those of an earlier demo must not be taken for this one's.
fn remove_reports(stage: &Stage) -> Result<(), Failure> {
    for name in REPORTS {
        let file = stage.folder.join(name);
        if file.exists() {
            std::fs::remove_file(&file).map_err(|error| runtime::in_file(&file, &error))?;
        }
    }
    Ok(())
}

fn write_reports(stage: &Stage, texts: [String; 2]) -> Result<(), Failure> {
    for (name, text) in REPORTS.into_iter().zip(texts) {
        let file = stage.folder.join(name);
        std::fs::write(&file, text).map_err(|error| runtime::in_file(&file, &error))?;
    }
    Ok(())
}

fn announce(
    cast: &Cast<'_>,
    machine: Option<&Machine>,
    verbosity: Verbosity,
    stage: &Stage,
    n_processes: usize,
) {
    if verbosity.quiet {
        return;
    }
    if let Some(machine) = machine {
        output::message(machine.text());
    }
    let (frames, rate) = (cast.n_frames, cast.rate_hz);
    output::message(format_args!(
        "{n_processes} processes and their supervisor; {frames} frames at {rate} a second; results in {}",
        stage.folder.display()
    ));
}
