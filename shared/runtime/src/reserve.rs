//! Shared memory is reserved when it is given its size.
//!
//! iceoryx2 0.10 makes a segment, gives it its size with `ftruncate`, and writes to it. In a file system of memory a file's
//! size takes nothing: memory is taken when a page is first written, and where there is none left the kernel ends
//! the process (SIGBUS). That cannot be mended after the segment has been made, for by then iceoryx2 has
//! written to it. So this takes the place of the C library's `ftruncate` in the program: it does the same, and then has the file
//! system take the memory at once; where that fails, so does the call, and iceoryx2 tells it as any other
//! failure.
#![expect(
    unsafe_code,
    reason = "it takes the place of a function of the C library"
)]

use core::ffi::c_int;
use core::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::os::fd::{BorrowedFd, RawFd};

use rustix::fs::{FallocateFlags, fallocate, fstatfs};
use rustix::io::Errno;

/// File systems in memory (statfs(2)).
const TMPFS_MAGIC: u64 = 0x0102_1994;

/// The size that was refused last, bytes; 0 if none was.
static REFUSED: AtomicU64 = AtomicU64::new(0);
/// Whether that was more than any file may have.
static IS_LIMITED: AtomicBool = AtomicBool::new(false);

/// Why a segment could not be given its size.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Refused {
    /// Its file system is full.
    NoRoom { wanted_bytes: u64 },
    /// No file of this process may be as large.
    TooLarge { wanted_bytes: u64 },
}

/// Why the last segment was refused that was; none if none was.
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

/// ftruncate(2), which also takes the memory of a file in memory.
#[unsafe(no_mangle)]
extern "C" fn ftruncate(fd: RawFd, len: libc::off_t) -> c_int {
    if fd < 0 {
        return failed(Errno::BADF);
    }
    // SAFETY: the caller owns the descriptor for as long as the call takes, as the function asks of him.
    let fd = unsafe { BorrowedFd::borrow_raw(fd) };
    let Ok(len) = u64::try_from(len) else {
        return failed(Errno::INVAL);
    };
    match rustix::fs::ftruncate(fd, len).and_then(|()| take(fd, len)) {
        Ok(()) => 0,
        Err(error) => {
            if matches!(error, Errno::NOSPC | Errno::FBIG) {
                REFUSED.store(len, Ordering::Relaxed);
                IS_LIMITED.store(error == Errno::FBIG, Ordering::Relaxed);
            }
            failed(error)
        }
    }
}

fn take(fd: BorrowedFd<'_>, len: u64) -> Result<(), Errno> {
    let is_memory = fstatfs(fd).is_ok_and(|it| it.f_type as u64 == TMPFS_MAGIC);
    if len == 0 || !is_memory {
        return Ok(());
    }
    match fallocate(fd, FallocateFlags::KEEP_SIZE, 0, len) {
        // Not every kernel can; then there is the memory that is free when it is used.
        Err(Errno::OPNOTSUPP | Errno::NOSYS) => Ok(()),
        taken => taken,
    }
}

fn failed(error: Errno) -> c_int {
    // SAFETY: the location is that of the calling thread, and always there.
    let location = unsafe { libc::__errno_location() };
    // SAFETY: as above; nothing else refers to it meanwhile.
    unsafe { location.write(error.raw_os_error()) };
    -1
}

#[cfg(test)]
mod tests {
    use std::os::fd::AsRawFd as _;
    use std::os::unix::fs::MetadataExt as _;

    #[test]
    fn what_is_given_a_size_in_memory_has_its_memory() {
        let file = tempfile::tempfile_in("/dev/shm").unwrap();
        // SAFETY: the file is open.
        let outcome = unsafe { libc::ftruncate(file.as_raw_fd(), 1 << 20) };
        assert_eq!(outcome, 0);
        let found = file.metadata().unwrap();
        assert_eq!((found.len(), found.blocks() * 512), (1 << 20, 1 << 20));
    }

    #[test]
    fn a_descriptor_that_is_none_is_refused() {
        // SAFETY: there is nothing that could be changed.
        let outcome = unsafe { libc::ftruncate(-1, 5) };
        let error = std::io::Error::last_os_error();
        assert_eq!((outcome, error.raw_os_error()), (-1, Some(libc::EBADF)));
    }
}
