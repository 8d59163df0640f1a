//! The wish to end, by signal or by word, and a file descriptor that wakes whoever waits.

use std::io::{self, Write as _};
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::net::UnixStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};

/// A flag that once raised stays up; clones share it.
#[derive(Debug, Clone)]
pub struct Stop {
    inner: Arc<Inner>,
}

#[derive(Debug)]
struct Inner {
    requested: Arc<AtomicBool>,
    signal: Arc<AtomicUsize>,
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
                requested: Arc::new(AtomicBool::new(false)),
                signal: Arc::new(AtomicUsize::new(0)),
                reader,
                writer,
            }),
        })
    }

    /// A flag that SIGINT, SIGTERM and SIGHUP raise as well. A second signal ends the process at
    /// once with exit status 130.
    ///
    /// Call it once in a process, before threads are started.
    ///
    /// # Errors
    ///
    /// The operating system refuses a file descriptor or a signal handler.
    pub fn on_signals() -> io::Result<Self> {
        let stop = Self::new()?;
        for (signal, number) in [(SIGINT, 2), (SIGTERM, 15), (SIGHUP, 1)] {
            let flag = || Arc::clone(&stop.inner.requested);
            signal_hook::flag::register_conditional_shutdown(signal, 130, flag())?;
            signal_hook::flag::register_usize(signal, Arc::clone(&stop.inner.signal), number)?;
            signal_hook::flag::register(signal, flag())?;
            signal_hook::low_level::pipe::register(signal, stop.inner.writer.try_clone()?)?;
        }
        Ok(stop)
    }

    /// Raises the flag.
    pub fn request(&self) {
        self.inner.requested.store(true, Ordering::Release);
        if let Err(error) = (&self.inner.writer).write(&[1]) {
            // A full socket is readable, which is all that is wanted of it.
            tracing::trace!(%error, "stop is already signalled");
        }
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
