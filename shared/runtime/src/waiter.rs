//! Sleeping until there is something to do.
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

use crate::bus::Bus;
use crate::service::{self, PortError};
use crate::{Progress, Stop};

/// Longest sleep. A sender may die between sending and waking, so receivers must look for
/// themselves; and a process that sleeps for long would look as if it hung.
const LONGEST_SLEEP: Duration = Duration::from_millis(100);

/// Turns after which one that does not sleep lets others have its core, if any want it: rarely enough to cost
/// a message less than a tenth of a microsecond in the mean.
const TURNS_BETWEEN_YIELDS: u32 = 64;

/// Why [`Waiter::wait`] came back.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Woken {
    /// Somebody sent something.
    Message,
    /// Time passed. There may be messages all the same.
    Time,
    /// The process is to end.
    Stop,
}

/// Sleeping failed.
#[derive(Debug, thiserror::Error)]
#[error("cannot wait for messages")]
pub struct WaitError(#[source] io::Error);

/// Wakes a process when one of its subscribers has a message.
#[derive(Debug)]
pub struct Waiter {
    listeners: Vec<Listener<ipc::Service>>,
    stop: Stop,
    progress: Progress,
    /// Whether it never sleeps while there is somebody to hear.
    spins: bool,
    /// Whether there is.
    has_ports: bool,
    n_turns: Cell<u32>,
}

impl Bus {
    /// A waiter, which subscribers are given when they are made.
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
            .map_err(|source| PortError::Listener {
                topic: name.to_owned(),
                source,
            })
    }
}

impl Waiter {
    /// Sleeps until a message comes, `timeout` or 100 ms pass, or the process is to stop.
    ///
    /// Whatever the answer, receive from every subscriber until nothing is left before waiting
    /// again: several messages may wake only once.
    ///
    /// Of a bus that [spins](Bus::with_spin), and with subscribers, it does not sleep but comes back at once.
    ///
    /// # Errors
    ///
    /// [`WaitError`].
    pub fn wait(&self, timeout: Duration) -> Result<Woken, WaitError> {
        if self.spins && self.has_ports {
            return Ok(self.turn());
        }
        self.sleep(timeout)
    }

    /// Lets the caller look for itself, without a pause.
    fn turn(&self) -> Woken {
        self.progress.tick();
        if self.stop.is_requested() {
            return Woken::Stop;
        }
        let n_turns = self.n_turns.get().wrapping_add(1);
        self.n_turns.set(n_turns);
        if n_turns.is_multiple_of(TURNS_BETWEEN_YIELDS) {
            std::thread::yield_now();
        } else {
            core::hint::spin_loop();
        }
        Woken::Time
    }

    /// Sleeps until a message comes, even if it spins otherwise.
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
            let drained = self.listeners.get(index).map(|it| it.try_wait(|_| {}));
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

    /// Sleeps until the process is to stop, and calls `again` for every receiver that comes anew: one
    /// that had to be restarted has not heard the last message.
    ///
    /// * `n_connected`: how many receivers there are.
    ///
    /// # Errors
    ///
    /// [`WaitError`], and what `again` fails with.
    pub fn linger<E: From<WaitError>>(
        &self,
        n_connected: impl Fn() -> usize,
        mut again: impl FnMut() -> Result<(), E>,
    ) -> Result<(), E> {
        let mut known = n_connected();
        while self.sleep(Duration::from_millis(20))? != Woken::Stop {
            let now = n_connected();
            if now > known {
                again()?;
            }
            known = now;
        }
        Ok(())
    }

    pub(crate) fn spins(&self) -> bool {
        self.spins
    }

    /// Notes that there is somebody to hear who wakes nobody.
    pub(crate) fn look_without_pause(&mut self) {
        self.has_ports = true;
    }

    pub(crate) fn watch(&mut self, listener: Listener<ipc::Service>) {
        self.listeners.push(listener);
    }

    /// The listeners that have something.
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
    // SAFETY: the number is not kept beyond this function, as `native_handle` asks.
    let fd = unsafe { listener.file_descriptor().native_handle() };
    // SAFETY: the listener owns the descriptor and keeps it open while it is borrowed.
    unsafe { BorrowedFd::borrow_raw(fd) }
}
