//! Allocates shared memory when its size is set.
//!
//! iceoryx2 0.10 creates a segment, sets its size with `ftruncate`, and writes to it. On tmpfs, setting the
//! size allocates nothing: pages are allocated when they are first written. If no memory is left at that time, the kernel
//! kills the process (SIGBUS). This cannot be fixed after the segment has been created, because iceoryx2 has
//! already written to it.
//!
//! This module therefore replaces the C library's `ftruncate` in the program. The replacement sets the size, and then makes the file
//! system allocate the memory at once. If the allocation fails, the call fails, and iceoryx2 reports it like any other failure.
#![expect(
    unsafe_code,
    reason = "it takes the place of a function of the C library"
)]

use core::ffi::c_int;
use core::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::os::fd::{BorrowedFd, RawFd};

use rustix::fs::{FallocateFlags, fallocate, fstatfs};
use rustix::io::Errno;

/// The magic number of tmpfs (statfs(2)).
const TMPFS_MAGIC: u64 = 0x0102_1994;

/// Last size that was rejected, in bytes; 0 if none was rejected.
static REFUSED: AtomicU64 = AtomicU64::new(0);
/// Number of rejected sizes.
static N_REFUSED: AtomicU64 = AtomicU64::new(0);
/// True if a segment exceeded the limit on the size of a file.
static IS_LIMITED: AtomicBool = AtomicBool::new(false);

/// Reason why the size of a segment could not be set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Refused {
    /// The file system is full.
    NoRoom { wanted_bytes: u64 },
    /// The segment exceeds the limit on the size of a file.
    TooLarge { wanted_bytes: u64 },
}

/// Returns the reason for the last refusal; `None` if there was none.
pub(crate) fn refused() -> Option<Refused> {
    let wanted_bytes = REFUSED.load(Ordering::Relaxed);
    if wanted_bytes == 0 {
        None
    } else if IS_LIMITED.load(Ordering::Relaxed) {
        Some(Refused::TooLarge { wanted_bytes })
    } else {
        Some(Refused::NoRoom { wanted_bytes })
    }
}

/// Returns the number of rejected sizes in this process.
pub(crate) fn n_refused() -> u64 {
    N_REFUSED.load(Ordering::Relaxed)
}

/// Implements ftruncate(2), and also allocates the memory of a file on tmpfs.
#[unsafe(no_mangle)]
extern "C" fn ftruncate(fd: RawFd, len: libc::off_t) -> c_int {
    if fd < 0 {
        return failed(Errno::BADF);
    }
    // SAFETY: the caller keeps the descriptor open during the call, as the contract of `ftruncate` requires.
    let fd = unsafe { BorrowedFd::borrow_raw(fd) };
    let Ok(len) = u64::try_from(len) else {
        return failed(Errno::INVAL);
    };
    match rustix::fs::ftruncate(fd, len).and_then(|()| take(fd, len)) {
        Ok(()) => 0,
        Err(error) => {
            if matches!(error, Errno::NOSPC | Errno::FBIG) {
                REFUSED.store(len, Ordering::Relaxed);
                N_REFUSED.fetch_add(1, Ordering::Relaxed);
                IS_LIMITED.store(error == Errno::FBIG, Ordering::Relaxed);
            }
            failed(error)
        }
    }
}

fn take(fd: BorrowedFd<'_>, len: u64) -> Result<(), Errno> {
    let is_memory = fstatfs(fd).is_ok_and(|system| system.f_type as u64 == TMPFS_MAGIC);
    if len == 0 || !is_memory {
        return Ok(());
    }
    match fallocate(fd, FallocateFlags::KEEP_SIZE, 0, len) {
        // Not every kernel supports this. Without support, pages are allocated when first used.
        Err(Errno::OPNOTSUPP | Errno::NOSYS) => Ok(()),
        taken => taken,
    }
}

fn failed(error: Errno) -> c_int {
    // SAFETY: the location belongs to the calling thread and is always valid.
    let location = unsafe { libc::__errno_location() };
    // SAFETY: as above; there is no other reference to it.
    unsafe { location.write(error.raw_os_error()) };
    -1
}

#[cfg(test)]
mod tests {
    use std::os::fd::AsRawFd as _;
    use std::os::unix::fs::MetadataExt as _;

    #[test]
    fn enlarging_a_file_on_tmpfs_with_ftruncate_allocates_the_memory() {
        let file = tempfile::tempfile_in("/dev/shm").unwrap();
        // SAFETY: the file is open.
        let outcome = unsafe { libc::ftruncate(file.as_raw_fd(), 1 << 20) };
        assert_eq!(outcome, 0);
        let metadata = file.metadata().unwrap();
        assert_eq!(
            (metadata.len(), metadata.blocks() * 512),
            (1 << 20, 1 << 20)
        );
    }

    #[test]
    fn an_invalid_descriptor_is_refused() {
        // SAFETY: the descriptor is invalid, so nothing is changed.
        let outcome = unsafe { libc::ftruncate(-1, 5) };
        let error = std::io::Error::last_os_error();
        assert_eq!((outcome, error.raw_os_error()), (-1, Some(libc::EBADF)));
    }
}
