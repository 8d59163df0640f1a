//! `parallax demo`: four cameras that do not exist, every process, one of them killed on purpose, and a report.

mod limits;
mod machine;
mod page;
mod report;
mod score;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use launch::{Planned, inputs, load, output};
use runtime::{ExitKind, Failure, OrFail as _, Stop, now_nanos};
use scene::Action;

use crate::globals::Globals;
use crate::trial::Point;
use crate::trial::results::{self, Moment};
use crate::trial::stage::{self, Cast, N_CAMERAS, Stage};
use crate::trial::strike::{Blow, Strike, Times};
use limits::Asked;
use machine::{FULL_RATE_HZ, Gauge, Machine};
use report::Report;

const HELP: &str = "\
Nothing is needed but this program: the pictures are made by the camera processes while they run (a person who does \
not exist, see `parallax synth --help`), the model is the one that ships. Four cameras around the person, 320x240 \
pixels, keep up with the clock. How many frames a second they take is measured first: for about two seconds frames are \
made and solved on all cores, beside whatever else runs, and computing may take half of the time between two frames, up to \
5 frames a second; a machine that is slow or busy is told so with numbers. Every stage and camera is a process of its own, as in `parallax run`. When two fifths \
of the frames have passed, the process of camera c3 is killed (SIGKILL), as a crash would: the other three go on, the \
supervisor starts it again, and it joins in at the frame that the clock is at.

What it leaves in OUT: report.html (open it in a browser: the skeleton in space, which turns, beside the truth; who \
was there when; what the killed camera cost; latency of every stage; every frame accounted for; pictures with \
skeletons), report.json (the same numbers), deployment.toml and rig.toml (`parallax run OUT/deployment.toml` runs \
them again), and run/, the results as any run leaves them. Files of an earlier demo are replaced.

It judges itself, by limits that a broken pipeline would miss: --min-results of the frames have a result, \
--min-skeletons of these a skeleton, and PCP3D of all of them is at least --min-pcp3d; the killed camera is back within \
--max-return-ms; the others gave results without it meanwhile, if it was away for longer than \
results are apart and a stage waits, with no pause longer than --max-pause-ms; what became \
of every frame of every view is known, but for two that a killed process may have held; no other process failed; all \
results were written.
Times are those of a machine that keeps up with 5 frames a second. Where the cameras take fewer, --max-return-ms is as many \
times as long as frames are farther apart (20 at most). Where a frame takes longer than 100 ms of all cores together, before the run \
or after it, --max-pause-ms, which is 20 such frames, is longer by the same factor; and a stage waits 1.5 times as long as two \
frames are apart, 500 ms at least. With --rate nothing is measured or scaled.

Exit codes: 0 all limits held; 6 a limit was missed (the report says which); 1 the run failed; 2 the command line is \
wrong; 130 stopped by Ctrl-C.

Examples:
    parallax demo
    parallax demo --seconds 60 --action boxing --subject 4 --out /tmp/boxing
    parallax demo --no-kill --json";

/// What to show.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub(crate) struct Arguments {
    /// Folder for the report and all that it is made of.
    #[arg(long, value_name = "DIR", default_value = "out/demo")]
    out: PathBuf,
    /// Frames of every camera; those of twenty seconds, but at least 30, if not given.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(10..=1_000_000))]
    frames: Option<u64>,
    /// How long the cameras run, seconds; instead of --frames.
    #[arg(long, value_name = "S", conflicts_with = "frames", value_parser = clap::value_parser!(u32).range(2..=36_000))]
    seconds: Option<u32>,
    /// Frames a second; what this machine is found to be able to, at most 5, if not given.
    #[arg(long, value_name = "HZ", value_parser = super::synth::rate)]
    rate: Option<f64>,
    /// What the person does; `parallax synth --help` names the actions.
    #[arg(long, value_name = "NAME", default_value = "walking", value_parser = stage::action)]
    action: Action,
    /// Number of the person: shape, clothes, manners.
    #[arg(long, value_name = "N", default_value_t = 1)]
    subject: u64,
    /// Seed of the performance, the room and the lamps.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// How long a stage waits for a view that is late, milliseconds; 500, or what this machine needs, if not given.
    #[arg(long, value_name = "MS", value_parser = clap::value_parser!(u64).range(1..=60_000))]
    deadline_ms: Option<u64>,
    /// Kill no process.
    #[arg(long)]
    no_kill: bool,
    /// Limits that can be asked for.
    #[command(flatten)]
    limits: Asked,
    /// Name of the deployment: two that run at once need two.
    #[arg(long, value_name = "NAME", default_value = "demo")]
    name: String,
    /// Print the report as JSON.
    #[arg(long)]
    json: bool,
}

/// How long a stage waits for a late view where the cameras take all frames they can, milliseconds.
const DEADLINE_MS: u64 = 500;

/// How long the cameras run, and how many frames at least, if nobody says.
const USUAL_S: f64 = 20.0;
const LEAST_FRAMES: u64 = 30;

impl Arguments {
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
        let rate_hz = self.rate.or(machine.map(Machine::rate_hz));
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

/// The camera that is killed, from 0.
const VICTIM: usize = 2;
/// When: after this share of the frames.
const KILL_AFTER: f64 = 0.4;

/// Runs the demo, and judges it.
pub(crate) fn run(arguments: &Arguments, globals: Globals) -> Result<ExitCode, Failure> {
    let folder = stage::absolute(&arguments.out)?;
    let mut gauge = gauge(arguments, &folder, globals)?;
    let before = gauge.as_mut().map(Gauge::measure).transpose()?;
    let cast = arguments.cast(before.as_ref());
    let stage = Stage::new(&cast, folder)?;
    remove_reports(&stage)?;
    let loaded = load::read(&stage.write(&cast)?, &[])?;
    let planned = Planned::new(&loaded.deployment, globals.level())?;
    let processes: Vec<String> = planned.processes().map(str::to_owned).collect();
    announce(&cast, before.as_ref(), globals, &stage, processes.len());
    let mut strike = (!arguments.no_kill).then(|| {
        let camera = &stage.rig.cameras()[VICTIM].name;
        let at_frame = KILL_AFTER * cast.n_frames as f64;
        Strike::new(Blow::Kill, &format!("capture-{VICTIM}"), at_frame).of_camera(camera)
    });
    let stop = Stop::on_signals().or_fail(ExitKind::Run)?;
    let ran = planned.carry_out(globals.quiet, &stop, &mut |event| {
        strike
            .as_mut()
            .and_then(|it| it.note(event, now_nanos(), Blow::deal))
    })?;
    if ran.kind() == Some(ExitKind::Interrupted) {
        output::message("stopped: nothing is judged, and no report written");
        return Ok(ExitCode::from(ExitKind::Interrupted.status()));
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
    conclude(
        arguments,
        globals,
        &stage,
        (&run, &loaded.deployment.output),
    )
}

/// What measures this machine, if nobody says how many frames a second the cameras take.
fn gauge(arguments: &Arguments, folder: &Path, globals: Globals) -> Result<Option<Gauge>, Failure> {
    if arguments.rate.is_some() {
        return Ok(None);
    }
    if !globals.quiet {
        output::message("measuring this machine for about two seconds");
    }
    let cast = arguments.cast(None);
    let stage = Stage::new(&cast, folder.to_path_buf())?;
    let loaded = load::read(&stage.write(&cast)?, &[])?;
    let planned = Planned::new(&loaded.deployment, globals.level())?;
    Gauge::new(&stage, planned.resolved()).map(Some)
}

/// Judges a run that is over, writes the reports and says what they say.
fn conclude(
    arguments: &Arguments,
    globals: Globals,
    stage: &Stage,
    (run, results): (&Run<'_>, &Path),
) -> Result<ExitCode, Failure> {
    let report = Report::new(run, &arguments.limits);
    let json = report.json(run);
    let page = page::page(run, &report, stage, results);
    write_reports(stage, [format!("{json:#}\n"), ::report::run::html(&page)])?;
    if arguments.json {
        output::json(&json)?;
    } else if !globals.quiet {
        output::line(run.ran.text())?;
        output::line(report.text(&stage.folder))?;
        if let Some(machine) = run.machine {
            output::line(format_args!("{}", machine.text()))?;
        }
    }
    let status = if report.is_held() {
        0
    } else {
        ExitKind::Limit.status()
    };
    Ok(ExitCode::from(status))
}

/// Those of an earlier demo must not be taken for this one's.
fn remove_reports(stage: &Stage) -> Result<(), Failure> {
    for name in REPORTS {
        let file = stage.folder.join(name);
        if file.exists() {
            std::fs::remove_file(&file).map_err(|error| inputs::in_file(&file, &error))?;
        }
    }
    Ok(())
}

fn write_reports(stage: &Stage, texts: [String; 2]) -> Result<(), Failure> {
    for (name, text) in REPORTS.into_iter().zip(texts) {
        let file = stage.folder.join(name);
        std::fs::write(&file, text).map_err(|error| inputs::in_file(&file, &error))?;
    }
    Ok(())
}

fn announce(
    cast: &Cast<'_>,
    machine: Option<&Machine>,
    globals: Globals,
    stage: &Stage,
    n_processes: usize,
) {
    if globals.quiet {
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

/// A run that is over, and all that is known of it.
#[derive(Debug, Clone, Copy)]
struct Run<'a> {
    /// Names, in the order of the rig.
    cameras: &'a [String],
    /// Frames of every camera, and how many a second.
    n_frames: u64,
    rate_hz: f64,
    /// How long a stage waits for a view that is late.
    deadline_ms: f64,
    /// What was measured of the machine, before the run or after it, whichever is slower.
    machine: Option<Machine>,
    /// Names of all processes but the supervisor.
    processes: &'a [String],
    /// What `run` says of it.
    ran: &'a launch::Report,
    /// The results, and where the joints were.
    moments: &'a [Moment],
    truth: &'a [Vec<Point>],
    /// What became of the camera that was to be killed, if one was.
    killed: Option<Times>,
    /// When the run was planned.
    session: u64,
}
