//! `parallax chaos`: a deployment with a fault made on purpose, once for every fault, and what held.

mod barrage;
mod camera;
mod census;
mod ground;
mod judge;
mod moved;
mod orphans;
mod random;
mod scenario;
mod series;
mod stall;
mod verdict;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use fastrand::Rng;
use launch::{Planned, inputs, output};
use runtime::{Delivery, ExitKind, Failure, now_nanos};
use serde_json::{Value, json};

use crate::globals::Globals;
use crate::trial::cost::{Cost, Trace};
use crate::trial::strike::{Blow, Strike};
use ground::Ground;
use judge::{Asked, Orphaned};
use scenario::{Scenario, service_of};
use verdict::Verdict;

const HELP: &str = "\
Every scenario is a run of its own, with real processes and a real fault; --list names them. Without a DEPLOYMENT the \
cameras are those of `parallax demo`: four that do not exist, so nothing is needed. With one, what it says about mode, \
pace, deadline and hang limit holds; its results stay where they are, for those of every scenario go to \
OUT/<scenario>; it may run at the same time, for its name becomes <name>-chaos.

What must hold when a process is killed: its death is noticed within a second; it is back within --max-return-ms; \
where others can go on without it, no pause between two results is longer than --max-pause-ms; what became of every \
frame of every view is known, but for two that a killed process may have held; no other process failed; the run ends by \
itself; nothing is left in shared memory. A process that is stopped (hang-...) is noticed by its missing signs of life \
within three of them (450 ms, or supervise.missed_beats of the deployment) and a second, and may be away longer by that limit; \
one that computes for ever (spin-...) gives signs of life but none of work, and is noticed as soon when it has used so much \
processor time, and three times that of any frame before for one; where nothing may be lost, when its main loop has stood \
still for three seconds, which the scenario sets (supervise.hang_limit_s). With \
kill-random everything killed comes back (--max-return-ms for 99 in 100), and if the run is long enough (nine moments \
a second apart at which all processes worked) memory, descriptors and files at last exceed those at first by no more than \
a tenth, 32 MB and 8 files; a run of more than --part-seconds is also reported part by part. With kill-supervisor its \
processes end by themselves within a second, and the next start of the same deployment removes what was left, and works.

With camera-... a camera fails for a fifth of the footage (its source does what `fault` says in a deployment): frames \
are called what is wrong with them, the others' results go on (--max-pause-ms), and the camera has a part in results again within \
--max-return-ms. With camera-moved one camera of the rig is turned by two degrees: it must be named, and no other, which \
takes four cameras and some seconds of results. With stall-results the results process stands still for three seconds and is left alone: where the latest frame \
wins, results are made at no less than half the rate meanwhile; where nothing may be lost, nothing is.

`back` is when the process sent what the first result of its new life is made of; of fuse, quality and results, which no \
result names, when it gave a sign of having worked. Restarts are not limited here (supervise.max_restarts), and no \
pictures are drawn.

It leaves OUT/chaos.json, which --json prints too.

Exit codes: 0 all held; 6 something did not (the table names it); 1 it could not be tried; 2 the command line is \
wrong; 130 stopped by Ctrl-C.

Examples:
    parallax chaos
    parallax chaos --scenario kill-pose,kill-supervisor
    parallax chaos my.toml --scenario kill-random --seconds 600 --seed 7 --json
    parallax chaos --scenario kill-random --seconds 7200 --part-seconds 600      # endurance";

/// What to try.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub(crate) struct Arguments {
    /// The deployment file; four cameras that do not exist if not given.
    deployment: Option<PathBuf>,
    /// What is to happen, separated by commas; everything that the deployment has processes for if not given.
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = Scenario::by_name)]
    scenario: Vec<Scenario>,
    /// Name the scenarios, and do nothing.
    #[arg(long)]
    list: bool,
    /// Chooses the victims, and the performance of the person who does not exist.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Footage of every run, seconds; a busy machine needs some of them to start.
    #[arg(long, value_name = "S", default_value_t = 30, value_parser = clap::value_parser!(u32).range(4..=36_000))]
    seconds: u32,
    /// Seconds of a run in which one process after the other is killed that are reported together, for each such part by itself.
    #[arg(long, value_name = "S", default_value_t = 600, value_parser = clap::value_parser!(u32).range(1..))]
    part_seconds: u32,
    /// Folder for the report and the results.
    #[arg(long, value_name = "DIR", default_value = "out/chaos")]
    out: PathBuf,
    /// Name of the deployment while it is tried: two that run at once need two.
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
    /// Limits that can be asked for.
    #[command(flatten)]
    limits: Asked,
    /// Print the report as JSON.
    #[arg(long)]
    json: bool,
}

/// The fault comes after this share of the frames.
const STRIKE_AFTER: f64 = 0.4;

/// How long the main loop of a process may stand still where one computes for ever and nothing may be lost: a sign of
/// work is due each second, and three may be missed. Where the latest wins its work alone is to tell.
const SPIN_LIMIT: &str = "supervise.hang_limit_s=3";

/// Tries everything that is asked for, and judges it.
pub(crate) fn run(arguments: &Arguments, globals: Globals) -> Result<ExitCode, Failure> {
    if arguments.list {
        for it in Scenario::all() {
            output::line(format_args!("{:<17} {}", it.name(), it.says()))?;
        }
        return Ok(ExitCode::SUCCESS);
    }
    let ground = Ground::new(arguments, globals)?;
    let processes = ground.plan("", &[])?;
    let processes: Vec<String> = processes.processes().map(str::to_owned).collect();
    let mut verdicts = Vec::new();
    for scenario in chosen(&arguments.scenario, &processes)? {
        if !globals.quiet {
            let (name, says) = (scenario.name(), scenario.says());
            output::message(format_args!("{name}: {says}"));
        }
        verdicts.push(attempt(&ground, arguments, scenario)?);
        if ground.stop.is_requested() {
            output::message("stopped: nothing is judged, and no report written");
            return Ok(ExitCode::from(ExitKind::Interrupted.status()));
        }
    }
    let held = verdicts.iter().all(Verdict::is_held);
    let scenarios: Vec<Value> = verdicts.iter().map(Verdict::json).collect();
    let json = json!({ "schema_version": 1, "held": held, "scenarios": scenarios });
    let file = ground.folder.join("chaos.json");
    std::fs::write(&file, format!("{json:#}\n")).map_err(|error| inputs::in_file(&file, &error))?;
    if arguments.json {
        output::json(&json)?;
    } else if !globals.quiet {
        output::line(verdict::table(&verdicts))?;
    }
    let status = if held { 0 } else { ExitKind::Limit.status() };
    Ok(ExitCode::from(status))
}

/// What was asked for, or all that the deployment has processes for.
fn chosen(asked: &[Scenario], processes: &[String]) -> Result<Vec<Scenario>, Failure> {
    if asked.is_empty() {
        let mut all = Scenario::all();
        all.retain(|it| it.is_possible(processes));
        return Ok(all);
    }
    match asked.iter().find(|it| !it.is_possible(processes)) {
        None => Ok(asked.to_vec()),
        Some(it) => {
            let message = format!("{}: the deployment has no such process", it.name());
            Err(Failure::new(ExitKind::Usage, message))
        }
    }
}

fn attempt(ground: &Ground, arguments: &Arguments, it: Scenario) -> Result<Verdict, Failure> {
    match it {
        Scenario::Once(blow, service) => once(ground, arguments, blow, service),
        Scenario::Random => random::attempt(ground, arguments),
        Scenario::Supervisor => supervisor(ground, arguments),
        Scenario::Camera(fault) => camera::attempt(ground, arguments, fault),
        Scenario::Moved => moved::attempt(ground, arguments),
        Scenario::Stall => stall::attempt(ground, arguments),
    }
}

fn once(
    ground: &Ground,
    arguments: &Arguments,
    blow: Blow,
    service: &'static str,
) -> Result<Verdict, Failure> {
    let scenario = Scenario::Once(blow, service).name();
    let planned = ground.plan(&scenario, &[])?;
    let victims: Vec<&str> = planned.processes().collect();
    let victims = victims.into_iter().filter(|it| service_of(it) == service);
    let process = Rng::with_seed(arguments.seed).choice(victims.collect::<Vec<_>>());
    let process = process.unwrap_or(service).to_owned();
    let at_frame = frame_at(&planned, STRIKE_AFTER);
    let planned = match blow {
        Blow::Kill | Blow::Stop => planned,
        Blow::Spin => spinning(ground, &scenario, &process, at_frame as u64)?,
    };
    let mut strike = Strike::new(blow, &process, at_frame);
    let ran = ground.watch(&planned, &mut |event| {
        strike.note(event, now_nanos(), Blow::deal)
    });
    let times = strike.times();
    let cost = Cost::new(trace_of(&process), times, planned.session(), &ran.moments);
    let struck = |it: &str| u32::from(it == process && times.killed.is_some());
    let after = ran.aftermath(struck);
    let policy = planned.plan().policy;
    let hang = match blow {
        Blow::Spin if planned.plan().delivery == Delivery::Lossless => policy.hang_limit,
        Blow::Kill | Blow::Stop | Blow::Spin => policy.stopped_limit,
    };
    let hang_ms = hang.as_millis() as f64;
    Ok(Verdict {
        scenario,
        measured: verdict::of_cost(&process, &cost, after.n_results),
        more: Vec::new(),
        numbers: json!({ "process": process, "cost": cost }),
        limits: judge::once(&arguments.limits, blow, &process, hang_ms, (&cost, &after)),
        run: ran.json(),
    })
}

fn supervisor(ground: &Ground, arguments: &Arguments) -> Result<Verdict, Failure> {
    let scenario = Scenario::Supervisor.name();
    let killed = orphans::kill(ground, &scenario, &ground.plan(&scenario, &[])?);
    let (mut it, failure) = match killed {
        Ok(it) => (it, None),
        Err(failure) => (Orphaned::default(), Some(failure.to_string())),
    };
    let planned = ground.plan(&scenario, &[])?;
    let ran = ground.watch(&planned, &mut |_| None);
    let sent = ran.moments.iter().map(|it| it.sent_ms);
    it.result_ms = sent.reduce(f64::min);
    let mut after = ran.aftermath(|_| 0);
    after.failure = failure.or(after.failure);
    Ok(Verdict {
        scenario,
        measured: verdict::of_orphans(&it, after.n_results),
        more: Vec::new(),
        numbers: json!({ "children_ended_ms": it.ended_ms, "files_left": it.files, "next_result_ms": it.result_ms }),
        limits: judge::supervisor(&arguments.limits, &it, &after),
        run: ran.json(),
    })
}

/// Plans a run one process of which never finishes what it does after it has sent something of a later frame.
fn spinning(
    ground: &Ground,
    scenario: &str,
    process: &str,
    after_frame: u64,
) -> Result<Planned, Failure> {
    let mut planned = ground.plan(scenario, &[])?;
    if planned.plan().delivery == Delivery::Lossless {
        planned = ground.plan(scenario, &[SPIN_LIMIT])?;
    }
    planned.spin(process, after_frame);
    Ok(planned)
}

/// The frame after a share of all of them.
fn frame_at(planned: &Planned, share: f64) -> f64 {
    let capture = &planned.resolved().deployment.capture;
    let nth = share * planned.resolved().n_frames() as f64;
    capture.start_frame as f64 + nth.floor() * capture.frame_step as f64
}

/// Where the results name the lives of a process.
fn trace_of(process: &str) -> Trace {
    let view = |it: &str| process.strip_prefix(it)?.parse().ok();
    match (view("capture-"), view("pose-"), process) {
        (Some(view), _, _) => Trace::Camera(view),
        (_, Some(view), _) => Trace::Pose(view),
        (_, _, "triangulate") => Trace::Result,
        _ => Trace::Nowhere,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_name_the_lives_of_those_they_are_made_of() {
        assert_eq!(trace_of("capture-2"), Trace::Camera(2));
        assert_eq!(trace_of("pose-11"), Trace::Pose(11));
        assert_eq!(trace_of("triangulate"), Trace::Result);
        for process in ["fuse-0", "quality-1", "results"] {
            assert_eq!(trace_of(process), Trace::Nowhere, "{process}");
        }
    }

    #[test]
    fn what_cannot_be_tried_is_refused_if_it_was_asked_for_and_else_left_out() {
        let processes = ["capture-0", "pose-0", "triangulate", "results"].map(str::to_owned);
        let all = chosen(&[], &processes).unwrap();
        assert_eq!(all.len(), 20);
        let quality = Scenario::Once(Blow::Kill, "quality");
        assert!(!all.contains(&quality));
        let refused = chosen(&[all[0], quality], &processes).unwrap_err();
        assert!(refused.to_string().contains("kill-quality"), "{refused}");
        assert_eq!(chosen(&[all[1]], &processes).unwrap(), [all[1]]);
    }
}
