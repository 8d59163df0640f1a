//! Fault injection: runs a deployment once per fault, and checks limits on its behaviour.

mod camera;
mod fault;
mod host;
mod host_fault;
mod judge;
mod moved;
mod options;
mod orphans;
mod random;
mod random_kills;
mod relay;
mod resources;
mod scenario;
mod series;
mod stall;
mod target;
mod testbed;
mod verdict;

use failure::{ExitKind, Failure, now_nanos};
use fastrand::Rng;
use launch::Planned;
use runtime::Delivery;
use serde_json::{Value, json};
use terminal::output::{self, Verbosity};

use crate::trial::cost::Cost;
use crate::trial::injection::Injector;
use judge::SupervisorKillOutcome;
use scenario::service_of;
use target::{INJECT_AFTER, epoch_source_of, frame_at};
use testbed::Testbed;
use verdict::Verdict;

pub use crate::trial::injection::ProcessFault;
pub use fault::CameraFault;
pub use host_fault::HostFault;
pub use options::{Limits, Options};
pub use scenario::Scenario;

/// The hang limit of the `spin-...` scenarios with lossless delivery. A main loop reports progress every second, and the limit allows for
/// three missing reports. With realtime delivery, the processor time of an iteration is limited instead.
const SPIN_LIMIT: &str = "supervise.hang_limit_s=3";

/// Outcome of the scenarios.
#[derive(Debug)]
pub struct Outcome {
    /// True if all limits were met.
    pub is_held: bool,
    /// The report as JSON, which is the content of `chaos.json`.
    pub json: Value,
    /// The report as text: a table of the scenarios, with the missed limits of each.
    pub table: String,
}

/// Runs the scenarios, checks their limits, and writes `chaos.json`. Returns `None` if the trial was interrupted; no file is written in
/// this case.
///
/// # Errors
///
/// Fails if the deployment cannot be read or used, if it lacks the process of a requested scenario, or if the report cannot be written. A
/// failed run is reported as a missed limit, not as an error.
pub fn run(options: &Options, verbosity: Verbosity) -> Result<Option<Outcome>, Failure> {
    let testbed = Testbed::new(options, verbosity)?;
    let processes = testbed.plan("", &[])?;
    let processes: Vec<String> = processes.processes().map(str::to_owned).collect();
    let mut verdicts = Vec::new();
    for scenario in chosen(&options.scenarios, &processes)? {
        if !verbosity.quiet {
            let (name, summary) = (scenario.name(), scenario.summary());
            output::message(format_args!("{name}: {summary}"));
        }
        verdicts.push(attempt(&testbed, options, scenario)?);
        if testbed.stop.is_requested() {
            return Ok(None);
        }
    }
    let is_held = verdicts.iter().all(Verdict::is_held);
    let scenarios: Vec<Value> = verdicts.iter().map(Verdict::json).collect();
    let json = json!({ "schema_version": 1, "held": is_held, "scenarios": scenarios });
    let file = testbed.folder.join("chaos.json");
    files::replace(&file, format!("{json:#}\n").as_bytes())
        .map_err(|error| failure::in_file(&file, &error))?;
    Ok(Some(Outcome {
        is_held,
        json,
        table: verdict::table(&verdicts),
    }))
}

/// Returns the requested scenarios. If none are requested, returns all scenarios that are possible with the processes of the deployment.
fn chosen(requested: &[Scenario], processes: &[String]) -> Result<Vec<Scenario>, Failure> {
    if requested.is_empty() {
        let mut all = Scenario::all();
        all.retain(|scenario| scenario.is_possible(processes));
        return Ok(all);
    }
    match requested.iter().find(|scenario| !scenario.is_possible(processes)) {
        None => Ok(requested.to_vec()),
        Some(it) => {
            let why = match it {
                Scenario::Host(_) if !bridge::HAS_LINK => {
                    "this build does not support hosts: build with `--features hosts`"
                }
                Scenario::Host(_) => "the deployment has fewer than four cameras",
                _ => "the deployment has no such process",
            };
            let message = format!("{}: {why}", it.name());
            Err(Failure::new(ExitKind::Usage, message))
        }
    }
}

fn attempt(testbed: &Testbed, options: &Options, scenario: Scenario) -> Result<Verdict, Failure> {
    match scenario {
        Scenario::Once(fault, service) => once(testbed, options, fault, service),
        Scenario::Random => random::attempt(testbed, options),
        Scenario::Supervisor => supervisor(testbed, options),
        Scenario::Camera(fault) => camera::attempt(testbed, options, fault),
        Scenario::Moved => moved::attempt(testbed, options),
        Scenario::Stall => stall::attempt(testbed, options),
        Scenario::Host(fault) => host::attempt(testbed, options, fault),
    }
}

fn once(
    testbed: &Testbed,
    options: &Options,
    fault: ProcessFault,
    service: &'static str,
) -> Result<Verdict, Failure> {
    let scenario = Scenario::Once(fault, service).name();
    let planned = testbed.plan(&scenario, &[])?;
    let processes: Vec<&str> = planned.processes().collect();
    let candidates = processes.into_iter().filter(|process| service_of(process) == service);
    let process = Rng::with_seed(options.seed).choice(candidates.collect::<Vec<_>>());
    let process = process.unwrap_or(service).to_owned();
    let at_frame = frame_at(&planned, INJECT_AFTER);
    let planned = match fault {
        ProcessFault::Kill | ProcessFault::Stop => planned,
        ProcessFault::Spin => spinning(testbed, &scenario, &process, at_frame as u64)?,
    };
    let mut injector = Injector::new(fault, &process, at_frame);
    let run = testbed.run(&planned, &mut |event| {
        injector.handle(event, now_nanos(), ProcessFault::inject)
    });
    let times = injector.times();
    let cost = Cost::new(
        epoch_source_of(&process),
        times,
        planned.session(),
        &run.results,
    );
    let n_faults = |text: &str| u32::from(text == process && times.injected.is_some());
    let outcome = run.outcome(n_faults);
    let policy = planned.plan().policy;
    let hang = match fault {
        ProcessFault::Spin if planned.plan().delivery == Delivery::Lossless => policy.hang_limit,
        ProcessFault::Kill | ProcessFault::Stop | ProcessFault::Spin => policy.stopped_limit,
    };
    let hang_ms = hang.as_millis() as f64;
    Ok(Verdict {
        scenario,
        measured: verdict::of_cost(&process, &cost, outcome.n_results),
        details: Vec::new(),
        numbers: json!({ "process": process, "cost": cost }),
        limits: judge::once(&options.limits, fault, &process, hang_ms, (&cost, &outcome)),
        run: run.json(),
    })
}

fn supervisor(testbed: &Testbed, options: &Options) -> Result<Verdict, Failure> {
    let scenario = Scenario::Supervisor.name();
    let killed = orphans::kill(testbed, &scenario, &testbed.plan(&scenario, &[])?);
    let (mut killed, failure) = match killed {
        Ok(killed) => (killed, None),
        Err(failure) => (SupervisorKillOutcome::default(), Some(failure.to_string())),
    };
    let planned = testbed.plan(&scenario, &[])?;
    let run = testbed.run(&planned, &mut |_| None);
    let sent = run.results.iter().map(|result| result.sent_ms);
    killed.result_ms = sent.reduce(f64::min);
    let mut outcome = run.outcome(|_| 0);
    outcome.failure = failure.or(outcome.failure);
    Ok(Verdict {
        scenario,
        measured: verdict::of_orphans(&killed, outcome.n_results),
        details: Vec::new(),
        numbers: json!({ "children_ended_ms": killed.ended_ms, "files_left": killed.files, "next_result_ms": killed.result_ms }),
        limits: judge::supervisor(&options.limits, &killed, &outcome),
        run: run.json(),
    })
}

/// Plans a run in which a process enters an endless loop after it has sent a message about a frame later than `after_frame`.
fn spinning(
    testbed: &Testbed,
    scenario: &str,
    process: &str,
    after_frame: u64,
) -> Result<Planned, Failure> {
    let mut planned = testbed.plan(scenario, &[])?;
    if planned.plan().delivery == Delivery::Lossless {
        planned = testbed.plan(scenario, &[SPIN_LIMIT])?;
    }
    planned.spin(process, after_frame);
    Ok(planned)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_impossible_scenario_is_refused_if_requested_and_otherwise_left_out() {
        let processes = ["capture-0", "pose-0", "triangulate", "results"].map(str::to_owned);
        let all = chosen(&[], &processes).unwrap();
        assert_eq!(all.len(), 20);
        let quality = Scenario::Once(ProcessFault::Kill, "quality");
        assert!(!all.contains(&quality));
        let refused = chosen(&[all[0], quality], &processes).unwrap_err();
        assert!(refused.to_string().contains("kill-quality"), "{refused}");
        assert_eq!(chosen(&[all[1]], &processes).unwrap(), [all[1]]);
    }
}
