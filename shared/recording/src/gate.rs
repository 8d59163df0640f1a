//! A writer between the recording and its file, which counts the bytes of the file. After a write has failed, it accepts no more data.

use std::io::{self, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// Counts the bytes of the file, and closes the [`Gate`] with which it is shared.
#[derive(Debug, Default, Clone)]
pub(crate) struct Keeper(Arc<State>);

#[derive(Debug, Default)]
struct State {
    n_bytes: AtomicU64,
    is_closed: AtomicBool,
}

impl Keeper {
    /// Returns the number of bytes of the file.
    pub(crate) fn n_bytes(&self) -> u64 {
        self.0.n_bytes.load(Ordering::Relaxed)
    }

    /// Returns true if no more data is written.
    pub(crate) fn is_closed(&self) -> bool {
        self.0.is_closed.load(Ordering::Relaxed)
    }

    /// Stops all further writes, because their data would be at wrong positions in the file.
    pub(crate) fn close(&self) {
        self.0.is_closed.store(true, Ordering::Relaxed);
    }
}

/// Passes bytes on to the file until it is closed.
pub(crate) struct Gate<W> {
    out: W,
    keeper: Keeper,
}

impl<W> Gate<W> {
    pub(crate) fn new(out: W, keeper: Keeper) -> Self {
        Self { out, keeper }
    }
}

impl<W: Write> Write for Gate<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.keeper.is_closed() {
            return Err(io::Error::other("an earlier write failed"));
        }
        let n = self.out.write(bytes)?;
        self.keeper.0.n_bytes.fetch_add(n as u64, Ordering::Relaxed);
        Ok(n)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}
