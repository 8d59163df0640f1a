//! Free space in shared memory: the memory that a process needs in addition to its topics, and what to do if there is not enough.

use core::sync::atomic::{AtomicU64, Ordering};

use iceoryx2::port::{DegradationAction, DegradationCause, DegradationInfo};
use rustix::process::{Resource, getrlimit};

use crate::memory::free_shared_memory;
use crate::reserve::{Refused, n_refused, refused};

/// Memory for queues and management of one process, in bytes: ten times the measured size.
pub(crate) const OVERHEAD_BYTES: u64 = 1 << 20;

/// Advice for the user if there is not enough space.
pub(crate) const ROOM: &str = "make room in /dev/shm: end other programs that use it, or make it larger (in Docker --shm-size)";

/// If there was no room for a segment, returns a text with the requested size, the free size, and what to do.
pub(crate) fn no_room() -> Option<String> {
    let kilobytes = |bytes: u64| bytes.div_ceil(1000);
    Some(match refused()? {
        Refused::NoRoom { wanted_bytes } => format!(
            "{} KB of shared memory were needed, but only {} KB are free in /dev/shm: {ROOM}",
            kilobytes(wanted_bytes),
            free_shared_memory().unwrap_or(0) / 1000
        ),
        Refused::TooLarge { wanted_bytes } => format!(
            "{} KB of shared memory were needed in one piece, and no file may have more than {} KB: \
             allow more (`ulimit -f unlimited`)",
            kilobytes(wanted_bytes),
            getrlimit(Resource::Fsize).current.unwrap_or(0) / 1000
        ),
    })
}

/// Free memory at the last failure of the transport, in bytes; the maximum value if nothing has failed.
static FREE_AT_FAILURE: AtomicU64 = AtomicU64::new(u64::MAX);

/// Records how much memory is free when the transport fails, because the failure may not state its reason. Call this at once: the failed
/// operation releases its memory, so that a moment later there may be room again.
pub(crate) fn note_room<E>(_: &E) {
    let free_bytes = free_shared_memory().unwrap_or(u64::MAX);
    FREE_AT_FAILURE.store(free_bytes, Ordering::Relaxed);
}

/// Returns the text of [`no_room`], or a text saying that hardly any room was left at the last failure, or is left now.
pub(crate) fn short_of_room() -> Option<String> {
    let short = |words: &str, free_bytes: u64| {
        let is_short = free_bytes < OVERHEAD_BYTES;
        is_short.then(|| format!("{} KB {words} free in /dev/shm: {ROOM}", free_bytes / 1000))
    };
    no_room()
        .or_else(|| short("were", FREE_AT_FAILURE.load(Ordering::Relaxed)))
        .or_else(|| short("are", free_shared_memory().ok()?))
}

/// Returns what a port does if it cannot connect to another port.
///
/// iceoryx2 tries to connect only once. If the reason is a lack of memory, the port fails, because sender and receiver would otherwise wait
/// for each other forever. Any other reason means that the other port has just ended.
pub(crate) fn connections()
-> impl Fn(DegradationCause, &DegradationInfo) -> DegradationAction + Send + 'static {
    let known = AtomicU64::new(n_refused());
    move |cause, _| {
        let n = n_refused();
        let is_refused = known.swap(n, Ordering::Relaxed) < n;
        let is_full = || {
            free_shared_memory().is_ok_and(|free_shared_memory| free_shared_memory < OVERHEAD_BYTES)
        };
        match cause {
            DegradationCause::FailedToEstablishConnection if is_refused || is_full() => {
                DegradationAction::DegradeAndFail
            }
            _ => DegradationAction::Warn,
        }
    }
}
