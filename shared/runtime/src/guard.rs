//! What a process does first: its files are its user's alone, a file that may not grow is an error and not a signal,
//! and memory that is taken away ends it with a message.
#![expect(
    unsafe_code,
    reason = "handlers of signals that say where memory was missing have no safe binding"
)]

use core::ffi::c_int;
use core::mem::MaybeUninit;
use std::io;
use std::os::fd::BorrowedFd;

use libc::{SA_ONSTACK, SA_SIGINFO, SIG_IGN, SIGBUS, SIGSEGV, SIGXFSZ, sigaction};
use rustix::fs::Mode;
use rustix::process::umask;

use crate::ExitKind;

/// What nobody else may do with what a process makes, whatever its umask was.
const OTHERS: Mode = Mode::RWXG.union(Mode::RWXO);
const NO_MEMORY: &[u8] = b"error: shared memory of the deployment is gone or damaged (SIGBUS)\n  \
    hint: something else has cut off, filled or changed files in /dev/shm while they were in use; \
    `parallax clean` removes what is left there\n";
const WRONG_MEMORY: &[u8] = b"error: a process has used memory that is not there (SIGSEGV)\n  \
    hint: something else has changed the files of the deployment in /dev/shm while they were in use, \
    or this is a defect of the program: please report it; `parallax clean` removes what is left there\n";

/// Prepares the process. Call it first, from the main thread.
///
/// * What it makes is for its user alone (umask 077): results show people.
/// * A limit on the size of files (`ulimit -f`) makes writing fail with `EFBIG`, in place of a signal that ends the
///   process (SIGXFSZ).
/// * SIGBUS and SIGSEGV end it with a message and exit status 1. The queues of the transport lie in files, and who may
///   write these, the same user, can cut them off or write nonsense to them; not all of that can be found
///   before it is used.
///
/// # Errors
///
/// The system refuses a handler.
pub fn guard_process() -> io::Result<()> {
    umask(umask(OTHERS) | OTHERS);
    // SAFETY: to ignore a signal has no precondition.
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
    // The stack may be what is at its end; the standard library gives every thread another for this.
    action.sa_flags = SA_SIGINFO | SA_ONSTACK;
    // SAFETY: the structure is whole, and the handler does nothing that is not allowed in one.
    let outcome = unsafe { sigaction(signal, &raw const action, core::ptr::null_mut()) };
    if outcome == 0 {
        Ok(())
    } else {
        Err(io::Error::last_os_error())
    }
}

/// Says what happened and ends the process: two system calls.
extern "C" fn end(signal: c_int, _info: *mut libc::siginfo_t, _context: *mut libc::c_void) {
    let text = if signal == SIGBUS {
        NO_MEMORY
    } else {
        WRONG_MEMORY
    };
    // SAFETY: the descriptor is that of standard error for as long as the process lives.
    let stderr = unsafe { BorrowedFd::borrow_raw(libc::STDERR_FILENO) };
    // There is nobody left to tell of a failure.
    rustix::io::write(stderr, text).ok();
    signal_hook::low_level::exit(c_int::from(ExitKind::Run.status()));
}
