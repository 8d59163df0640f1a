//! Count of the bytes that ports have copied.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Counts bytes that ports copied into or out of shared memory. Clones share the count.
///
/// Messages of fixed size are copied when sent and when received. Arrays (pixels, evidence) are written and
/// read in place, so only copies made by [`copy_of`](crate::SliceSubscriber::copy_of) count.
#[derive(Debug, Clone, Default)]
pub struct Copies {
    bytes: Arc<AtomicU64>,
}

impl Copies {
    /// Counts a copy.
    pub(crate) fn add(&self, bytes: usize) {
        self.bytes.fetch_add(bytes as u64, Ordering::Relaxed);
    }

    /// Returns the number of copied bytes.
    pub fn bytes(&self) -> u64 {
        self.bytes.load(Ordering::Relaxed)
    }
}
