//! Runs a service process, from start-up to its exit status.

use core::time::Duration;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process::ExitCode;

use rustix::process::{
    Pid, Resource, Rlimit, Signal, getppid, getrlimit, set_parent_process_death_signal, setrlimit,
};

use failure::{DEFECT, ExitKind, Failure, Stop, init_logging, log_panics, panic_text};

use crate::{Bus, Delivery, Health, Launch, Patience, Progress};

/// Everything that a service can use: the bus for its ports, its stop request and its counters.
#[derive(Debug)]
pub struct Service {
    bus: Bus,
    health: Health,
    launch: Launch,
}

impl Service {
    /// Returns the bus, which creates ports.
    pub fn bus(&self) -> &Bus {
        &self.bus
    }

    /// Returns the stop request.
    pub fn stop(&self) -> &Stop {
        self.bus.stop()
    }

    /// Returns the counters and times that the heartbeats report.
    pub fn health(&self) -> &Health {
        &self.health
    }

    /// Returns the counter to advance during computations that may take seconds.
    pub fn progress(&self) -> &Progress {
        self.bus.progress()
    }

    /// Returns the session, which goes into the stamp of every message.
    pub fn session(&self) -> u64 {
        self.launch.session
    }

    /// Returns the number of restarts of this process, which goes into the stamp of every message.
    pub fn epoch(&self) -> u32 {
        self.launch.epoch
    }

    /// Returns the unique name of the process in the deployment.
    pub fn name(&self) -> &str {
        &self.launch.process
    }

    /// Returns the behaviour when a receiver is slower than its sender.
    pub fn delivery(&self) -> Delivery {
        self.launch.delivery
    }

    /// Returns the time to wait for receivers before the first message.
    ///
    /// All processes of a deployment are started at the same time, but some take longer than others to start. When a process is restarted,
    /// the others are already running. With lossless delivery, a late receiver would miss earlier messages. A sender therefore waits for
    /// receivers to start for as long as it would wait for room.
    ///
    /// * `deadline`: how long to wait after the start-up phase, and for receivers that were given up.
    pub fn patience_at_start(&self, deadline: Duration) -> Patience {
        let limit = match (self.launch.epoch, self.launch.delivery) {
            (0, Delivery::Lossless) => deadline.max(self.bus.patience()),
            (0, Delivery::Realtime) => deadline.max(BEGINNING),
            _ => deadline,
        };
        Patience {
            limit,
            after_losses: deadline,
        }
    }
}

/// Time within which the processes of a deployment should find each other at start-up.
const BEGINNING: Duration = Duration::from_secs(10);

/// Runs a service in this process and returns its exit status.
///
/// The process ends when its supervisor ends. A panic is logged and ends the process. Call this function once, from the main
/// thread.
///
/// A service ends in three steps. After it has sent the end of stream, it calls [`Health::finished`]. Then it sends the end of stream again
/// for every new receiver, so that a restarted receiver gets it as well. Once all processes have finished, the supervisor asks them to
/// stop.
///
/// * `body`: the service. It returns soon after [`Service::stop`] is requested. The kind of its [`Failure`]
///   tells the supervisor whether to try again ([`ExitKind::is_permanent`]).
pub fn run_service(launch: Launch, body: impl FnOnce(&Service) -> Result<(), Failure>) -> ExitCode {
    init_logging(&launch.process, launch.log);
    log_panics();
    let outcome = catch_unwind(AssertUnwindSafe(|| run(launch, body)));
    match outcome {
        Ok(Ok(())) => ExitCode::SUCCESS,
        Ok(Err(failure)) if failure.kind() == ExitKind::Interrupted => {
            tracing::info!(reason = %failure, "stopped");
            ExitCode::SUCCESS
        }
        Ok(Err(failure)) => failure.exit(),
        Err(panic) => {
            Failure::new(ExitKind::Run, panic_text(panic.as_ref())).with_hint(DEFECT).exit()
        }
    }
}

fn run(launch: Launch, body: impl FnOnce(&Service) -> Result<(), Failure>) -> Result<(), Failure> {
    if let Some(supervisor) = launch.supervisor {
        end_with(supervisor)?;
    }
    raise_file_limit();
    // Called before other threads start, because they inherit the scheduling of this one.
    for denied in launch.scheduling.apply() {
        tracing::warn!(
            hint = denied.hint(),
            "{denied}; continuing without this setting"
        );
    }
    let stop = launch
        .supervisor
        .map_or_else(Stop::on_signals, Stop::on_signals_of)
        .map_err(|error| Failure::new(ExitKind::Run, error).with_hint("signals are needed"))?;
    let bus = Bus::open(&launch.namespace, &launch.process, &stop)?;
    let bus = bus.with_spin(launch.scheduling.spin);
    let health = Health::start(&bus, &launch)?;
    let service = Service {
        bus,
        health,
        launch,
    };
    let result = body(&service);
    let copied_bytes = service.bus.copies().bytes();
    tracing::info!(copied_bytes, "ports have done their work");
    result
}

/// Makes the kernel kill this process when its supervisor dies.
fn end_with(supervisor: u32) -> Result<(), Failure> {
    let set = set_parent_process_death_signal(Some(Signal::KILL));
    set.map_err(|error| Failure::new(ExitKind::Run, error))?;
    // The supervisor may have died before the previous call.
    let parent = getppid().map_or(0, |pid| Pid::as_raw(Some(pid)));
    if parent == supervisor as i32 {
        Ok(())
    } else {
        Err(Failure::new(
            ExitKind::Run,
            format!("started by process {parent}, but supervised by {supervisor}"),
        ))
    }
}

/// Raises the limit on open files to the maximum that the system allows. A topic takes up to 16 files (iceoryx2 0.10).
pub fn raise_file_limit() {
    let limit = getrlimit(Resource::Nofile);
    let raised = Rlimit {
        current: limit.maximum,
        maximum: limit.maximum,
    };
    if let Err(error) = setrlimit(Resource::Nofile, raised) {
        tracing::warn!(%error, "cannot raise the limit on open files");
    }
}
