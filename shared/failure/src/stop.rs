//! The stop request, raised by a signal handler or by the program, with a file descriptor to wait for.
#![expect(
    unsafe_code,
    reason = "signal handlers must be async-signal-safe, which the compiler cannot check, and alarm has no safe binding"
)]

use core::time::Duration;
use std::io;
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::net::UnixStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::time::Instant;

use libc::siginfo_t;
use signal_hook::consts::{SIGALRM, SIGHUP, SIGINT, SIGTERM};
use signal_hook::low_level::{emulate_default_handler, exit};
use signal_hook_registry::register_sigaction;

use crate::{ExitKind, Failure, now_nanos};

/// The signals that request a stop.
const SIGNALS: [i32; 3] = [SIGINT, SIGTERM, SIGHUP];
/// Signals within this time after the first count as one request, because `timeout` sends two signals, and so does a closing terminal.
const SAME_WISH: Duration = Duration::from_millis(500);
/// Time for which a process continues after a signal that is not from its supervisor, in seconds. For example, systemd signals all
/// processes at once, including the supervisor, which then ends the other processes in order.
const UNASKED_SECONDS: u32 = 2;
/// The exit status of a process that is ended by a second signal.
const ENDED_AT_ONCE: i32 = 130;

/// A stop request: a flag that is never cleared. Clones share the flag.
#[derive(Debug, Clone)]
pub struct Stop {
    inner: Arc<Inner>,
}

#[derive(Debug)]
struct Inner {
    requested: AtomicBool,
    /// Number of the last signal; 0 if there was none.
    signal: AtomicUsize,
    /// Time of the first signal, from [`now_nanos`]; 0 if there was none.
    first_at_nanos: AtomicU64,
    /// Number of the last signal that was not sent by the supervisor; 0 if there was none.
    unasked: AtomicUsize,
    /// Becomes readable when stop is requested, and is never read.
    reader: UnixStream,
    writer: UnixStream,
}

impl Stop {
    /// Creates a stop request that only [`request`](Self::request) raises.
    ///
    /// # Errors
    ///
    /// Fails if the operating system has no file descriptors left.
    pub fn new() -> io::Result<Self> {
        let (reader, writer) = UnixStream::pair()?;
        writer.set_nonblocking(true)?;
        Ok(Self {
            inner: Arc::new(Inner {
                requested: AtomicBool::new(false),
                signal: AtomicUsize::new(0),
                first_at_nanos: AtomicU64::new(0),
                unasked: AtomicUsize::new(0),
                reader,
                writer,
            }),
        })
    }

    /// Creates a stop request that SIGINT, SIGTERM and SIGHUP also raise.
    ///
    /// A second SIGINT or SIGTERM, half a second or more after the first signal, ends the process at once with exit status 130.
    /// A second SIGHUP does not end it, because a closing terminal sends two.
    ///
    /// Call this function once in a process, before threads are started.
    ///
    /// # Errors
    ///
    /// Fails if the operating system refuses a file descriptor or a signal handler.
    pub fn on_signals() -> io::Result<Self> {
        let stop = Self::new()?;
        for signal in SIGNALS {
            let inner = Arc::clone(&stop.inner);
            on_signal(signal, move |_| {
                if inner.is_repeated() && signal != SIGHUP {
                    exit(ENDED_AT_ONCE);
                }
                inner.raise(signal);
            })?;
        }
        Ok(stop)
    }

    /// Creates a stop request that the same signals raise if the supervisor sends them.
    ///
    /// Signals of other processes concern only this process, not the run. They end this process after two seconds, unless the supervisor
    /// has requested a stop by then. The supervisor then restarts it, as after any other unexpected end.
    ///
    /// * `supervisor`: process id of the supervisor.
    ///
    /// # Errors
    ///
    /// Fails if a signal handler cannot be installed.
    pub fn on_signals_of(supervisor: u32) -> io::Result<Self> {
        let stop = Self::new()?;
        for signal in SIGNALS {
            let inner = Arc::clone(&stop.inner);
            on_signal(signal, move |info| {
                if sender(info) == Some(supervisor) {
                    inner.raise(signal);
                } else if inner.unasked.swap(signal as usize, Ordering::AcqRel) == 0 {
                    // SAFETY: `alarm` has no precondition and is async-signal-safe.
                    unsafe { libc::alarm(UNASKED_SECONDS) };
                }
            })?;
        }
        let inner = Arc::clone(&stop.inner);
        on_signal(SIGALRM, move |_| {
            let unasked = inner.unasked.load(Ordering::Acquire);
            // On failure the process continues; nothing else can be done here.
            if unasked != 0 && !inner.requested.load(Ordering::Acquire) {
                emulate_default_handler(unasked as i32).ok();
            }
        })?;
        Ok(stop)
    }

    /// Requests the stop.
    pub fn request(&self) {
        self.inner.wake();
    }

    /// Returns true if stop was requested.
    pub fn is_requested(&self) -> bool {
        self.inner.requested.load(Ordering::Acquire)
    }

    /// Fails with [`ExitKind::Interrupted`] and a message if stop was requested.
    ///
    /// # Errors
    ///
    /// See above.
    pub fn check(&self, message: &str) -> Result<(), Failure> {
        if self.is_requested() {
            return Err(Failure::new(ExitKind::Interrupted, message));
        }
        Ok(())
    }

    /// Waits until a signal that is not from the supervisor ends the process, or until stop is requested. Such a
    /// signal interrupts a wait inside iceoryx2, which then reports an error without a cause.
    pub fn wait_for_unasked_end(&self) {
        let limit = Duration::from_secs(u64::from(UNASKED_SECONDS) + 1);
        let begin = Instant::now();
        while self.inner.unasked.load(Ordering::Acquire) != 0
            && !self.is_requested()
            && begin.elapsed() < limit
        {
            std::thread::sleep(Duration::from_millis(10));
        }
    }

    /// Returns the number of the last signal, if there was one.
    pub fn signal(&self) -> Option<i32> {
        match self.inner.signal.load(Ordering::Acquire) {
            0 => None,
            number => Some(number as i32),
        }
    }
}

impl AsFd for Stop {
    /// Returns a descriptor that becomes readable when stop is requested. Do not read from it.
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.inner.reader.as_fd()
    }
}

/// The work of the signal handlers: only atomic operations, reading the clock, and one system call. This code neither allocates nor locks.
impl Inner {
    fn raise(&self, signal: i32) {
        self.signal.store(signal as usize, Ordering::Release);
        self.wake();
    }

    fn wake(&self) {
        self.requested.store(true, Ordering::Release);
        // If the socket is full, it is already readable.
        rustix::io::write(&self.writer, &[1]).ok();
    }

    /// Returns true if an earlier signal is old enough for this one to be a separate request.
    fn is_repeated(&self) -> bool {
        let now = now_nanos();
        let first = &self.first_at_nanos;
        match first.compare_exchange(0, now, Ordering::AcqRel, Ordering::Acquire) {
            Ok(_) => false,
            Err(at) => u128::from(now.saturating_sub(at)) > SAME_WISH.as_nanos(),
        }
    }
}

/// Installs a signal handler for the life of the process.
fn on_signal(signal: i32, handler: impl Fn(&siginfo_t) + Send + Sync + 'static) -> io::Result<()> {
    // SAFETY: the handlers of this file are async-signal-safe (see [`Inner`]): they neither allocate nor
    // lock.
    unsafe { register_sigaction(signal, handler) }.map(drop)
}

/// Returns the process that sent a signal; `None` if the kernel sent it.
fn sender(info: &siginfo_t) -> Option<u32> {
    if info.si_code > 0 {
        return None;
    }
    // SAFETY: a signal sent by a process has the sender's id (sigaction(2): codes that are not positive).
    let pid = unsafe { info.si_pid() };
    u32::try_from(pid).ok()
}
