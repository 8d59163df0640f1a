//! Room in the shared memory: what a process needs besides its topics, and what to try where there is none.

use rustix::process::{Resource, getrlimit};

use crate::memory::free_shared_memory;
use crate::reserve::{Refused, refused};

/// Queues and management of one process, bytes: ten times the measured size.
pub(crate) const OVERHEAD_BYTES: u64 = 1 << 20;

/// What to try where there is no room.
pub(crate) const ROOM: &str =
    "make room in /dev/shm: end what else uses it, or give it more (in Docker --shm-size)";

/// If there was no room for a segment: the wanted size, the free size, and what to try.
pub(crate) fn no_room() -> Option<String> {
    let kilobytes = |bytes: u64| bytes.div_ceil(1000);
    Some(match refused()? {
        Refused::NoRoom { wanted_bytes } => format!(
            "{} KB of shared memory were wanted, {} KB are free in /dev/shm: {ROOM}",
            kilobytes(wanted_bytes),
            free_shared_memory().unwrap_or(0) / 1000
        ),
        Refused::TooLarge { wanted_bytes } => format!(
            "{} KB of shared memory were wanted in one piece, and no file may have more than {} KB: \
             allow more (`ulimit -f unlimited`)",
            kilobytes(wanted_bytes),
            getrlimit(Resource::Fsize).current.unwrap_or(0) / 1000
        ),
    })
}
