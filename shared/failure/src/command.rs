//! Runs a command, from start to exit status.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process::ExitCode;

use crate::{ExitKind, Failure};

/// The hint that is shown after a panic.
pub const DEFECT: &str = "this is a defect of Parallax, unless another program has changed its files in /dev/shm: please report it";

/// Runs a command in this process and returns its exit status. A panic is reported like any other error.
///
/// * `body`: the command, which returns its exit status on success.
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

/// Logs the panics of all threads, each in one line.
pub fn log_panics() {
    std::panic::set_hook(Box::new(|info| {
        let at = info.location().map(ToString::to_string).unwrap_or_default();
        tracing::error!(at, "panic: {}", panic_text(info.payload()));
    }));
}

/// Returns the message of a panic.
pub fn panic_text(panic: &(dyn Any + Send)) -> String {
    let text = panic
        .downcast_ref::<&str>()
        .map(ToString::to_string)
        .or_else(|| panic.downcast_ref::<String>().cloned());
    text.unwrap_or_else(|| "panic without a message".to_owned())
}
