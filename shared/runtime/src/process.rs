//! The life of a service process, from its first line to its exit status.

use core::time::Duration;
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process::ExitCode;

use rustix::process::{
    Pid, Resource, Rlimit, Signal, getppid, getrlimit, set_parent_process_death_signal, setrlimit,
};

use crate::{Bus, Delivery, ExitKind, Failure, Health, Launch, Progress, Stop, init_logging};

/// What a service is given: its ports' source, its stop signal and its counters.
#[derive(Debug)]
pub struct Service {
    bus: Bus,
    health: Health,
    launch: Launch,
}

impl Service {
    /// Makes ports.
    pub fn bus(&self) -> &Bus {
        &self.bus
    }

    /// Tells when to end.
    pub fn stop(&self) -> &Stop {
        self.bus.stop()
    }

    /// Takes note of what the service has done.
    pub fn health(&self) -> &Health {
        &self.health
    }

    /// To be moved during computations that may take seconds.
    pub fn progress(&self) -> &Progress {
        self.bus.progress()
    }

    /// The run; goes into the stamp of every message.
    pub fn session(&self) -> u64 {
        self.launch.session
    }

    /// How often this process has been restarted; goes into the stamp of every message.
    pub fn epoch(&self) -> u32 {
        self.launch.epoch
    }

    /// The unique name of the process in the deployment.
    pub fn name(&self) -> &str {
        &self.launch.process
    }

    /// What happens when a receiver is slower than its sender.
    pub fn delivery(&self) -> Delivery {
        self.launch.delivery
    }

    /// How long to wait for receivers before the first message. All processes of a deployment begin
    /// at the same time and take as long as they take; one that was restarted finds the others there. Where nothing
    /// may be lost, who comes later misses what was said before: receivers are waited for as long as for room.
    ///
    /// * `deadline`: how long anybody is waited for later on.
    pub fn patience_at_start(&self, deadline: Duration) -> Duration {
        match (self.launch.epoch, self.launch.delivery) {
            (0, Delivery::Lossless) => deadline.max(self.bus.patience()),
            (0, Delivery::Realtime) => deadline.max(BEGINNING),
            _ => deadline,
        }
    }
}

/// How long the processes of a deployment may take to find each other when it begins.
const BEGINNING: Duration = Duration::from_secs(10);

const DEFECT: &str = "this is a defect of the program, unless something else has changed its files in /dev/shm: \
    please report it";

/// Runs a service in this process and answers with its exit status.
///
/// The process ends with its supervisor, and a panic ends it with a logged line instead of going
/// any further. Call it from the main thread, once.
///
/// How a service ends well: when it has passed on the end of the footage it calls
/// [`Health::finished`], and then, several times a second, sends the end again until it is told to
/// stop. So a receiver that had to be restarted hears of the end as well; the supervisor stops all
/// once all have finished.
///
/// * `body`: the service. It returns soon after [`Service::stop`] is requested, and gives a
///   [`Failure`] whose kind tells the supervisor whether to try again ([`ExitKind::is_permanent`]).
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
        Err(panic) => Failure::new(ExitKind::Run, panic_text(panic.as_ref()))
            .with_hint(DEFECT)
            .exit(),
    }
}

/// Runs a command in this process and answers with its exit status. A panic ends it with an error like any other.
///
/// * `body`: the command, and its exit status if it did what was asked.
pub fn run_command(body: impl FnOnce() -> Result<ExitCode, Failure>) -> ExitCode {
    match catch_unwind(AssertUnwindSafe(body)) {
        Ok(Ok(code)) => code,
        Ok(Err(failure)) => failure.exit(),
        Err(panic) => {
            let text = format!("the program panicked: {}", panic_text(panic.as_ref()));
            Failure::new(ExitKind::Run, text).with_hint(DEFECT).exit()
        }
    }
}

fn run(launch: Launch, body: impl FnOnce(&Service) -> Result<(), Failure>) -> Result<(), Failure> {
    if let Some(supervisor) = launch.supervisor {
        end_with(supervisor)?;
    }
    raise_file_limit();
    // Before there are other threads, which begin as this one then is.
    for denied in launch.scheduling.apply() {
        tracing::warn!(hint = denied.hint(), "{denied}; going on without");
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

/// Has the kernel end this process when its supervisor dies.
fn end_with(supervisor: u32) -> Result<(), Failure> {
    let set = set_parent_process_death_signal(Some(Signal::KILL));
    set.map_err(|error| Failure::new(ExitKind::Run, error))?;
    // It may have died before the line above.
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

/// Allows as many files as the system lets it: a topic takes up to 16 (spec of iceoryx2 0.10).
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

/// Logs a panic in one line, wherever it happens.
fn log_panics() {
    std::panic::set_hook(Box::new(|info| {
        let at = info.location().map(ToString::to_string).unwrap_or_default();
        tracing::error!(at, "panic: {}", panic_text(info.payload()));
    }));
}

fn panic_text(panic: &(dyn Any + Send)) -> String {
    let text = panic
        .downcast_ref::<&str>()
        .map(ToString::to_string)
        .or_else(|| panic.downcast_ref::<String>().cloned());
    text.unwrap_or_else(|| "panic without a message".to_owned())
}
