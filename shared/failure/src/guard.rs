//! Set-up of every process.
//!
//! Files are private to the user. Exceeding the limit on the size of a file is an error instead of a signal. If shared memory is
//! missing, the process ends with a message.
#![expect(
    unsafe_code,
    reason = "signal handlers for memory faults have no safe binding"
)]

use core::ffi::c_int;
use core::mem::MaybeUninit;
use std::io;
use std::os::fd::BorrowedFd;

use libc::{SA_ONSTACK, SA_SIGINFO, SIG_IGN, SIGBUS, SIGSEGV, SIGXFSZ, sigaction};
use rustix::fs::Mode;
use rustix::process::umask;

use crate::ExitKind;

/// The umask of the process: no access for group and others.
const OTHERS: Mode = Mode::RWXG.union(Mode::RWXO);
const NO_MEMORY: &[u8] = b"error: shared memory of the deployment is missing or damaged (SIGBUS)\n  hint: another program has filled \
                           /dev/shm, or has truncated or changed files there while they were in use; `parallax clean` removes the \
                           remaining files\n";
const WRONG_MEMORY: &[u8] = b"error: a process has accessed invalid memory (SIGSEGV)\n  hint: another program has changed the files of the \
                              deployment in /dev/shm while they were in use, or this is a defect of Parallax: please report it; `parallax \
                              clean` removes the remaining files\n";

/// Prepares the process. Call this function first, from the main thread.
///
/// * New files are private to the user (umask 077), because results show people.
/// * Exceeding the limit on the size of files (`ulimit -f`) makes writing fail with `EFBIG`, instead of a
///   signal that ends the process (SIGXFSZ).
/// * SIGBUS and SIGSEGV end the process with a message and exit status 1. The queues of the transport are in files
///   that the same user may truncate or corrupt, and not every such change can be detected before use.
///
/// # Errors
///
/// Fails if a signal handler cannot be installed.
pub fn guard_process() -> io::Result<()> {
    umask(umask(OTHERS) | OTHERS);
    // SAFETY: ignoring a signal has no precondition.
    let before = unsafe { libc::signal(SIGXFSZ, SIG_IGN) };
    if before == libc::SIG_ERR {
        return Err(io::Error::last_os_error());
    }
    for signal in [SIGBUS, SIGSEGV] {
        handle(signal)?;
    }
    Ok(())
}

fn handle(signal: c_int) -> io::Result<()> {
    // SAFETY: all zeros is a value of this structure of numbers, flags and an address.
    let mut action: sigaction = unsafe { MaybeUninit::zeroed().assume_init() };
    action.sa_sigaction = end as *const () as usize;
    // The stack may have overflowed. The standard library gives every thread an alternative stack for
    // handlers.
    action.sa_flags = SA_SIGINFO | SA_ONSTACK;
    // SAFETY: the structure is initialised, and the handler is async-signal-safe.
    let outcome = unsafe { sigaction(signal, &raw const action, core::ptr::null_mut()) };
    if outcome == 0 {
        Ok(())
    } else {
        Err(io::Error::last_os_error())
    }
}

/// Ends the process from any thread, without waiting for the other threads and without dropping any value.
///
/// * `text`: written to standard error.
pub fn end_process(text: &str) {
    write_and_exit(text.as_bytes());
}

/// Writes a text to standard error and ends the process, with two system calls.
fn write_and_exit(text: &[u8]) {
    // SAFETY: standard error stays open for the life of the process.
    let stderr = unsafe { BorrowedFd::borrow_raw(libc::STDERR_FILENO) };
    // If this write fails, the failure cannot be reported.
    rustix::io::write(stderr, text).ok();
    signal_hook::low_level::exit(c_int::from(ExitKind::Run.status()));
}

/// Signal handler: writes the message and ends the process.
extern "C" fn end(signal: c_int, _info: *mut libc::siginfo_t, _context: *mut libc::c_void) {
    let text = if signal == SIGBUS {
        NO_MEMORY
    } else {
        WRONG_MEMORY
    };
    write_and_exit(text);
}
