//! Single keys from a terminal, and its size.

use core::time::Duration;
use std::io::{self, IsTerminal as _};
use std::os::fd::AsFd as _;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use rustix::termios::{
    LocalModes, OptionalActions, SpecialCodeIndex, Termios, tcgetattr, tcgetwinsize, tcsetattr,
};

use crate::Stop;

/// Reads single keys from the terminal on standard input, without echo; dropping it restores the terminal.
/// Ctrl-C still sends a signal.
#[derive(Debug)]
pub struct Keys {
    /// None if standard input is not a terminal.
    before: Option<Termios>,
}

impl Keys {
    /// Starts to read keys. There are none if standard input is not a terminal.
    ///
    /// # Errors
    ///
    /// The terminal cannot be configured.
    pub fn new() -> io::Result<Self> {
        let stdin = io::stdin();
        if !stdin.is_terminal() {
            return Ok(Self { before: None });
        }
        let before = tcgetattr(&stdin)?;
        let mut single = before.clone();
        single
            .local_modes
            .remove(LocalModes::ICANON | LocalModes::ECHO);
        single.special_codes[SpecialCodeIndex::VMIN] = 1;
        single.special_codes[SpecialCodeIndex::VTIME] = 0;
        tcsetattr(&stdin, OptionalActions::Now, &single)?;
        Ok(Self {
            before: Some(before),
        })
    }

    /// Waits for a key, `timeout` or a stop request.
    ///
    /// # Errors
    ///
    /// The terminal is gone.
    pub fn next(&mut self, timeout: Duration, stop: &Stop) -> io::Result<Option<u8>> {
        let stdin = io::stdin();
        let mut fds = vec![PollFd::from_borrowed_fd(stop.as_fd(), PollFlags::IN)];
        if self.before.is_some() {
            fds.push(PollFd::new(&stdin, PollFlags::IN));
        }
        let timeout = Timespec {
            tv_sec: timeout.as_secs() as i64,
            tv_nsec: i64::from(timeout.subsec_nanos()),
        };
        match poll(&mut fds, Some(&timeout)) {
            Ok(_) => {}
            Err(Errno::INTR) => return Ok(None),
            Err(error) => return Err(error.into()),
        }
        if fds.get(1).is_none_or(|fd| fd.revents().is_empty()) {
            return Ok(None);
        }
        let mut key = [0];
        // Unbuffered: the buffer of standard input would hide further keys from `poll`.
        match rustix::io::read(&stdin, &mut key)? {
            0 => Err(io::ErrorKind::UnexpectedEof.into()),
            _ => Ok(Some(key[0])),
        }
    }

    /// Columns and rows of the terminal on standard output, if it is one.
    pub fn size() -> Option<[usize; 2]> {
        let size = tcgetwinsize(io::stdout()).ok()?;
        (size.ws_col > 0).then(|| [size.ws_col, size.ws_row].map(usize::from))
    }
}

impl Drop for Keys {
    fn drop(&mut self) {
        if let Some(before) = &self.before
            && let Err(error) = tcsetattr(io::stdin(), OptionalActions::Now, before)
        {
            tracing::debug!(%error, "cannot restore the terminal");
        }
    }
}
