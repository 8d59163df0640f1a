//! Runs work that a signal can end in time, even if the work rarely checks the stop flag.

use core::time::Duration;
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::thread;
use std::time::Instant;

use crate::{ExitKind, Failure, OrFail as _, Stop};

/// Time within which the work should notice the flag.
const PATIENCE: Duration = Duration::from_secs(1);

/// Pause between two checks of the flag.
const PERIOD: Duration = Duration::from_millis(50);

/// Runs `work` on a separate thread and waits for it. If the work does not end within a second after the flag is raised,
/// it is abandoned and ends with the process.
///
/// Returns the result of the work; `None` if it was abandoned.
///
/// # Errors
///
/// Fails if the operating system refuses a thread.
///
/// # Panics
///
/// Panics if `work` panics.
pub fn unless_stopped<T: Send + 'static>(
    stop: &Stop,
    work: impl FnOnce() -> T + Send + 'static,
) -> Result<Option<T>, Failure> {
    let (sender, receiver) = sync_channel(1);
    let worker = thread::Builder::new().name("train".to_owned());
    let worker = worker
        .spawn(move || {
            // If sending fails, the caller no longer waits for the result.
            drop(sender.send(work()));
        })
        .or_fail(ExitKind::Run)?;
    let mut raised: Option<Instant> = None;
    loop {
        match receiver.recv_timeout(PERIOD) {
            Ok(done) => return Ok(Some(done)),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => {
                if let Err(panic) = worker.join() {
                    std::panic::resume_unwind(panic);
                }
                return Ok(None);
            }
        }
        if stop.is_requested() && raised.get_or_insert_with(Instant::now).elapsed() >= PATIENCE {
            return Ok(None);
        }
    }
}

/// Runs `work` as [`unless_stopped`] does.
///
/// # Errors
///
/// Fails with [`ExitKind::Interrupted`] if stop was requested, or if the operating system refuses a thread.
///
/// # Panics
///
/// Panics if `work` panics.
pub fn uninterrupted<T: Send + 'static>(
    stop: &Stop,
    work: impl FnOnce() -> T + Send + 'static,
) -> Result<T, Failure> {
    let outcome = unless_stopped(stop, work)?;
    stop.check("interrupted")?;
    outcome.ok_or_else(|| Failure::new(ExitKind::Interrupted, "interrupted"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_that_ends_is_waited_for() {
        let stop = Stop::new().unwrap();
        let done = unless_stopped(&stop, || {
            thread::sleep(PERIOD * 2);
            7
        });
        assert_eq!(done.unwrap(), Some(7));
    }

    #[test]
    fn work_that_ignores_an_interrupt_is_abandoned() {
        let stop = Stop::new().unwrap();
        stop.request();
        let (_held, never) = sync_channel::<()>(1);
        assert!(unless_stopped(&stop, move || never.recv()).unwrap().is_none());
    }

    #[test]
    #[should_panic(expected = "a bug")]
    fn a_panic_of_the_work_is_passed_on() {
        let stop = Stop::new().unwrap();
        drop(unless_stopped(&stop, || panic!("a bug")));
    }
}
