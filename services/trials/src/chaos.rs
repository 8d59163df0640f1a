//! A deployment with a fault made on purpose, once for every fault, and what held.

mod aim;
mod barrage;
mod camera;
mod census;
mod fault;
mod ground;
mod judge;
mod moved;
mod options;
mod orphans;
mod random;
mod scenario;
mod series;
mod stall;
mod verdict;

use fastrand::Rng;
use launch::Planned;
use launch::output::{self, Verbosity};
use runtime::{Delivery, ExitKind, Failure, now_nanos};
use serde_json::{Value, json};

use crate::trial::cost::Cost;
use crate::trial::strike::Strike;
use aim::{STRIKE_AFTER, frame_at, trace_of};
use ground::Ground;
use judge::Orphaned;
use scenario::service_of;
use verdict::Verdict;

pub use crate::trial::strike::Blow;
pub use fault::CameraFault;
pub use options::{Limits, Options};
pub use scenario::Scenario;

/// How long the main loop of a process may stand still where one computes for ever and nothing may be lost: a sign of
/// work is due each second, and three may be missed. Where the latest wins its work alone is to tell.
const SPIN_LIMIT: &str = "supervise.hang_limit_s=3";

/// What held.
#[derive(Debug)]
pub struct Outcome {
    /// Whether no limit was missed.
    pub is_held: bool,
    /// For programs; `chaos.json`.
    pub json: Value,
    /// For people: a table of the scenarios, and below each what did not hold.
    pub table: String,
}

/// Tries everything that is asked for, judges it, and writes `chaos.json`. `None` if it was stopped: then nothing is
/// judged or written.
///
/// # Errors
///
/// The deployment cannot be read or used, or has no process for a scenario that was asked for; the report cannot be
/// written. A run that fails is no error but a limit that is missed.
pub fn run(options: &Options, verbosity: Verbosity) -> Result<Option<Outcome>, Failure> {
    let ground = Ground::new(options, verbosity)?;
    let processes = ground.plan("", &[])?;
    let processes: Vec<String> = processes.processes().map(str::to_owned).collect();
    let mut verdicts = Vec::new();
    for scenario in chosen(&options.scenarios, &processes)? {
        if !verbosity.quiet {
            let (name, says) = (scenario.name(), scenario.says());
            output::message(format_args!("{name}: {says}"));
        }
        verdicts.push(attempt(&ground, options, scenario)?);
        if ground.stop.is_requested() {
            return Ok(None);
        }
    }
    let is_held = verdicts.iter().all(Verdict::is_held);
    let scenarios: Vec<Value> = verdicts.iter().map(Verdict::json).collect();
    let json = json!({ "schema_version": 1, "held": is_held, "scenarios": scenarios });
    let file = ground.folder.join("chaos.json");
    std::fs::write(&file, format!("{json:#}\n"))
        .map_err(|error| runtime::in_file(&file, &error))?;
    Ok(Some(Outcome {
        is_held,
        json,
        table: verdict::table(&verdicts),
    }))
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

fn attempt(ground: &Ground, options: &Options, it: Scenario) -> Result<Verdict, Failure> {
    match it {
        Scenario::Once(blow, service) => once(ground, options, blow, service),
        Scenario::Random => random::attempt(ground, options),
        Scenario::Supervisor => supervisor(ground, options),
        Scenario::Camera(fault) => camera::attempt(ground, options, fault),
        Scenario::Moved => moved::attempt(ground, options),
        Scenario::Stall => stall::attempt(ground, options),
    }
}

fn once(
    ground: &Ground,
    options: &Options,
    blow: Blow,
    service: &'static str,
) -> Result<Verdict, Failure> {
    let scenario = Scenario::Once(blow, service).name();
    let planned = ground.plan(&scenario, &[])?;
    let victims: Vec<&str> = planned.processes().collect();
    let victims = victims.into_iter().filter(|it| service_of(it) == service);
    let process = Rng::with_seed(options.seed).choice(victims.collect::<Vec<_>>());
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
        limits: judge::once(&options.limits, blow, &process, hang_ms, (&cost, &after)),
        run: ran.json(),
    })
}

fn supervisor(ground: &Ground, options: &Options) -> Result<Verdict, Failure> {
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
        limits: judge::supervisor(&options.limits, &it, &after),
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

#[cfg(test)]
mod tests {
    use super::*;

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
