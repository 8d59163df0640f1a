//! The wish to end, by signal or by word, and a file descriptor that wakes whoever waits.
#![expect(
    unsafe_code,
    reason = "what a handler of a signal may do is for the caller to promise, and alarm has no safe binding"
)]

use core::time::Duration;
use std::io;
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::net::UnixStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};

use libc::siginfo_t;
use signal_hook::consts::{SIGALRM, SIGHUP, SIGINT, SIGTERM};
use signal_hook::low_level::{emulate_default_handler, exit};
use signal_hook_registry::register_sigaction;

use crate::now_nanos;

/// The signals that ask a process to end.
const SIGNALS: [i32; 3] = [SIGINT, SIGTERM, SIGHUP];
/// Signals that come so soon after the first say the same: `timeout` sends two, and so does a terminal that closes.
const SAME_WISH: Duration = Duration::from_millis(500);
/// How long a process that somebody else than its supervisor has told to end goes on, seconds. Who tells all processes
/// at once, as systemd does, tells the supervisor too, which then ends them in order.
const UNASKED_SECONDS: u32 = 2;
/// The exit status of a process that is ended by a second signal.
const ENDED_AT_ONCE: i32 = 130;

/// A flag that once raised stays up; clones share it.
#[derive(Debug, Clone)]
pub struct Stop {
    inner: Arc<Inner>,
}

#[derive(Debug)]
struct Inner {
    requested: AtomicBool,
    /// The signal that came last; 0 if none did.
    signal: AtomicUsize,
    /// When the first came, [`now_nanos`]; 0 if none did.
    first_at_nanos: AtomicU64,
    /// A signal of somebody else than the supervisor; 0 if none came.
    unasked: AtomicUsize,
    /// Becomes readable when the flag is raised and is never read.
    reader: UnixStream,
    writer: UnixStream,
}

impl Stop {
    /// A flag that only [`request`](Self::request) raises.
    ///
    /// # Errors
    ///
    /// The operating system has no file descriptors left.
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

    /// A flag that SIGINT, SIGTERM and SIGHUP raise as well. A second SIGINT or SIGTERM, half a second or more
    /// after the first signal, ends the process at once with exit status 130. A second SIGHUP does not: a terminal that
    /// closes sends two, and nobody waits any more for the end.
    ///
    /// Call it once in a process, before threads are started.
    ///
    /// # Errors
    ///
    /// The operating system refuses a file descriptor or a signal handler.
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

    /// A flag that the same signals raise if the supervisor sends them.
    ///
    /// Those of anybody else say nothing about the run. They end the process as they would end one that does not
    /// handle them, two seconds later, unless the supervisor has asked it to end by then: what it
    /// leaves unfinished is then as after any other death, and its successor goes on with it.
    ///
    /// * `supervisor`: its process id.
    pub(crate) fn on_signals_of(supervisor: u32) -> io::Result<Self> {
        let stop = Self::new()?;
        for signal in SIGNALS {
            let inner = Arc::clone(&stop.inner);
            on_signal(signal, move |info| {
                if sender(info) == Some(supervisor) {
                    inner.raise(signal);
                } else if inner.unasked.swap(signal as usize, Ordering::AcqRel) == 0 {
                    // SAFETY: it has no precondition, and may be called in a handler.
                    unsafe { libc::alarm(UNASKED_SECONDS) };
                }
            })?;
        }
        let inner = Arc::clone(&stop.inner);
        on_signal(SIGALRM, move |_| {
            let unasked = inner.unasked.load(Ordering::Acquire);
            // Nothing can be done about a failure here, and the process only goes on.
            if unasked != 0 && !inner.requested.load(Ordering::Acquire) {
                emulate_default_handler(unasked as i32).ok();
            }
        })?;
        Ok(stop)
    }

    /// Raises the flag.
    pub fn request(&self) {
        self.inner.wake();
    }

    /// Whether the flag is up.
    pub fn is_requested(&self) -> bool {
        self.inner.requested.load(Ordering::Acquire)
    }

    /// The number of the signal that came last, if one did.
    pub fn signal(&self) -> Option<i32> {
        match self.inner.signal.load(Ordering::Acquire) {
            0 => None,
            number => Some(number as i32),
        }
    }
}

impl AsFd for Stop {
    /// Readable once the flag is up; not to be read from.
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.inner.reader.as_fd()
    }
}

/// All that handlers do: atomic numbers, the clock, and one system call. None allocates or takes a lock.
impl Inner {
    fn raise(&self, signal: i32) {
        self.signal.store(signal as usize, Ordering::Release);
        self.wake();
    }

    fn wake(&self) {
        self.requested.store(true, Ordering::Release);
        // A full socket is readable, which is all that is wanted of it.
        rustix::io::write(&self.writer, &[1]).ok();
    }

    /// Whether a signal has come before, and long enough ago to have been another wish.
    fn is_repeated(&self) -> bool {
        let now = now_nanos();
        let first = &self.first_at_nanos;
        match first.compare_exchange(0, now, Ordering::AcqRel, Ordering::Acquire) {
            Ok(_) => false,
            Err(at) => u128::from(now.saturating_sub(at)) > SAME_WISH.as_nanos(),
        }
    }
}

/// Has a signal handled, for as long as the process lives.
fn on_signal(signal: i32, handler: impl Fn(&siginfo_t) + Send + Sync + 'static) -> io::Result<()> {
    // SAFETY: the handlers of this file do nothing that is not allowed in one (see [`Inner`]): they neither
    // allocate nor take a lock.
    unsafe { register_sigaction(signal, handler) }.map(drop)
}

/// The process that has sent a signal; none if the kernel has.
fn sender(info: &siginfo_t) -> Option<u32> {
    if info.si_code > 0 {
        return None;
    }
    // SAFETY: signals that processes send carry the sender (sigaction(2): codes that are not positive).
    let pid = unsafe { info.si_pid() };
    u32::try_from(pid).ok()
}
