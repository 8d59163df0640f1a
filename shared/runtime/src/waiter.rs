//! Waiting for messages or a stop request.
#![expect(
    unsafe_code,
    reason = "iceoryx2 hands out the file descriptor of a listener only as a number"
)]

use core::time::Duration;
use std::cell::Cell;
use std::io;
use std::os::fd::{AsFd as _, BorrowedFd};

use iceoryx2::port::listener::Listener;
use iceoryx2::prelude::{FileDescriptorBased as _, ipc};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;

use crate::Progress;
use crate::bus::Bus;
use crate::room::note_room;
use crate::service::{self, PortError};
use failure::{Fault, Stop};

/// Longest sleep. A sender may die after sending a message and before notifying, so receivers have to check for messages even without a
/// notification. A process that sleeps for longer would also seem to hang.
const LONGEST_SLEEP: Duration = Duration::from_millis(100);

/// Number of iterations after which a waiter that polls continuously yields its core. It is so large that yielding costs less than a tenth
/// of a microsecond per message on average.
const ITERATIONS_BETWEEN_YIELDS: u32 = 64;

/// Reason why [`Waiter::wait`] returned.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Woken {
    /// A message was sent.
    Message,
    /// The time is over. There may still be messages.
    Time,
    /// Stop was requested.
    Stop,
}

/// Waiting failed.
#[derive(Debug, thiserror::Error)]
#[error("cannot wait for messages")]
pub struct WaitError(#[source] io::Error);

impl Fault for WaitError {}

/// Wakes a process when one of its subscribers has a message.
#[derive(Debug)]
pub struct Waiter {
    listeners: Vec<Listener<ipc::Service>>,
    stop: Stop,
    progress: Progress,
    /// True if the waiter polls continuously instead of sleeping while there are subscribers.
    spins: bool,
    /// True if there are subscribers.
    has_ports: bool,
    n_turns: Cell<u32>,
}

impl Bus {
    /// Creates a waiter, which is passed to subscribers when they are created.
    pub fn waiter(&self) -> Waiter {
        Waiter {
            listeners: Vec::new(),
            stop: self.stop().clone(),
            progress: self.progress().clone(),
            spins: self.spins(),
            has_ports: false,
            n_turns: Cell::new(0),
        }
    }

    pub(crate) fn listener(&self, name: &str) -> Result<Listener<ipc::Service>, PortError> {
        service::open_wake_up(self.node(), name)?
            .listener_builder()
            .create()
            .inspect_err(note_room)
            .map_err(|source| PortError::Listener {
                topic: name.to_owned(),
                source,
            })
    }
}

impl Waiter {
    /// Sleeps until a message arrives, `timeout` or 100 ms pass, or stop is requested.
    ///
    /// Before waiting again, receive all messages of every subscriber, whatever the result is:
    /// several messages may cause only one wake-up.
    ///
    /// If the bus [spins](Bus::with_spin) and there are subscribers, the function returns at once instead of sleeping.
    ///
    /// # Errors
    ///
    /// Returns a [`WaitError`] on failure.
    pub fn wait(&self, timeout: Duration) -> Result<Woken, WaitError> {
        if self.spins && self.has_ports {
            return Ok(self.turn());
        }
        self.sleep(timeout)
    }

    /// Returns at once, so that the caller polls continuously.
    fn turn(&self) -> Woken {
        self.progress.tick();
        if self.stop.is_requested() {
            return Woken::Stop;
        }
        let n_turns = self.n_turns.get().wrapping_add(1);
        self.n_turns.set(n_turns);
        if n_turns.is_multiple_of(ITERATIONS_BETWEEN_YIELDS) {
            std::thread::yield_now();
        } else {
            core::hint::spin_loop();
        }
        Woken::Time
    }

    /// Sleeps until a message arrives, even if the bus is set to poll continuously.
    fn sleep(&self, timeout: Duration) -> Result<Woken, WaitError> {
        self.progress.tick();
        if self.stop.is_requested() {
            return Ok(Woken::Stop);
        }
        let awake = self.poll(timeout.min(LONGEST_SLEEP))?;
        self.progress.tick();
        if self.stop.is_requested() {
            return Ok(Woken::Stop);
        }
        for &index in &awake {
            let drained = self.listeners.get(index).map(|listener| listener.try_wait(|_| {}));
            if let Some(Err(error)) = drained {
                tracing::debug!(?error, "cannot drain a wake-up");
            }
        }
        if awake.is_empty() {
            Ok(Woken::Time)
        } else {
            Ok(Woken::Message)
        }
    }

    /// Sleeps until stop is requested, and calls `resend` for every new receiver. A restarted receiver has
    /// not received the last message.
    ///
    /// * `n_connected`: returns the number of receivers.
    ///
    /// # Errors
    ///
    /// Returns a [`WaitError`], or an error of `resend`.
    pub fn linger<E: From<WaitError>>(
        &self,
        n_connected: impl Fn() -> usize,
        mut resend: impl FnMut() -> Result<(), E>,
    ) -> Result<(), E> {
        let mut known = n_connected();
        while self.sleep(Duration::from_millis(20))? != Woken::Stop {
            let now = n_connected();
            if now > known {
                resend()?;
            }
            known = now;
        }
        Ok(())
    }

    pub(crate) fn spins(&self) -> bool {
        self.spins
    }

    /// Records that there is a subscriber without wake-up.
    pub(crate) fn poll_without_pause(&mut self) {
        self.has_ports = true;
    }

    pub(crate) fn watch(&mut self, listener: Listener<ipc::Service>) {
        self.listeners.push(listener);
    }

    /// Returns the indices of the listeners with pending events.
    fn poll(&self, timeout: Duration) -> Result<Vec<usize>, WaitError> {
        let mut fds: Vec<PollFd<'_>> = self
            .listeners
            .iter()
            .map(|listener| PollFd::from_borrowed_fd(fd_of(listener), PollFlags::IN))
            .chain([PollFd::from_borrowed_fd(self.stop.as_fd(), PollFlags::IN)])
            .collect();
        let timeout = Timespec {
            tv_sec: timeout.as_secs() as i64,
            tv_nsec: i64::from(timeout.subsec_nanos()),
        };
        match poll(&mut fds, Some(&timeout)) {
            Ok(_) | Err(Errno::INTR) => {}
            Err(error) => return Err(WaitError(error.into())),
        }
        let awake = fds
            .iter()
            .take(self.listeners.len())
            .enumerate()
            .filter(|(_, fd)| !fd.revents().is_empty())
            .map(|(index, _)| index);
        Ok(awake.collect())
    }
}

fn fd_of(listener: &Listener<ipc::Service>) -> BorrowedFd<'_> {
    // SAFETY: the number is not kept beyond this function, as `native_handle` requires.
    let fd = unsafe { listener.file_descriptor().native_handle() };
    // SAFETY: the listener owns the descriptor and keeps it open while it is borrowed.
    unsafe { BorrowedFd::borrow_raw(fd) }
}
