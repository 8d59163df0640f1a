//! Dummy processes that are not services: a supervisor that is killed, and a process that fills shared memory.

use std::io::Write as _;
use std::path::Path;
use std::process::ExitCode;

use failure::{Failure, Stop};
use messages::FrameHeader;
use runtime::{Bus, Delivery, Limits, Namespace, Scheduling, TopicPlan, preflight, process_topics};
use supervise::{Event, Plan, Policy, ProcessSpec, Role};
use tracing::Level;

/// Supervises two idle processes, and prints their process ids once they have started.
pub(crate) fn supervise(base: &Path) -> ExitCode {
    match try_supervise(base) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.exit(),
    }
}

fn try_supervise(base: &Path) -> Result<(), Failure> {
    let names = ["one", "two"];
    let processes = names.map(|name| ProcessSpec {
        name: name.to_owned(),
        service: "dummy".to_owned(),
        args: vec!["hang-once".into()],
        role: Role::Essential,
        senders: Vec::new(),
        scheduling: Scheduling::default(),
        most_work: None,
        completes_files: false,
    });
    let plan = Plan {
        executable: "/proc/self/exe".into(),
        given: Vec::new(),
        description: Vec::new(),
        namespace: Namespace::below("t", base)?,
        session: 1,
        delivery: Delivery::Realtime,
        topics: names.into_iter().flat_map(process_topics).collect(),
        processes: processes.to_vec(),
        policy: Policy::default(),
        log: Level::WARN,
    };
    let mut started: Vec<String> = Vec::new();
    supervise::run(&plan, &endless(), &mut |event| {
        if let Event::Health { process, health } = event
            && !started.iter().any(|name| name == process)
        {
            started.push(process.to_owned());
            print_line(&health.pid.to_string());
        }
    })?;
    Ok(())
}

#[expect(clippy::expect_used, reason = "a test fails by panicking")]
fn endless() -> Stop {
    Stop::new().expect("two file descriptors")
}

/// Requests 50 megabytes where 8 are free: first with the preflight check, then without.
pub(crate) fn fill(base: &Path) -> ExitCode {
    let plan = TopicPlan::slices::<u8, FrameHeader>(
        "data".to_owned(),
        Delivery::Realtime,
        Limits::new(3, 1, 1),
        7_000_000,
    );
    let preflight = preflight(core::slice::from_ref(&plan));
    print_line(&preflight.map_or_else(
        |error| failure::wording::in_one_line(&error),
        |()| "it fits".to_owned(),
    ));
    match without_preflight(base, &plan) {
        Ok(text) => {
            print_line(&text);
            ExitCode::SUCCESS
        }
        Err(failure) => failure.exit(),
    }
}

fn without_preflight(base: &Path, plan: &TopicPlan) -> Result<String, Failure> {
    let lock = Namespace::below("t", base)?.acquire()?;
    let bus = Bus::open(lock.namespace(), "greedy", &endless())?;
    let topics = bus.create_topics(core::slice::from_ref(plan))?;
    let text = match bus.slice_publisher::<u8, FrameHeader>(plan.topic()) {
        Ok(_) => "it fits".to_owned(),
        Err(error) => failure::wording::in_one_line(&error),
    };
    drop(topics);
    Ok(text)
}

#[expect(clippy::expect_used, reason = "a test fails by panicking")]
fn print_line(text: &str) {
    writeln!(std::io::stdout().lock(), "{text}").expect("standard output is read");
}
