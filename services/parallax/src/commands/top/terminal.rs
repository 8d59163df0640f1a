//! A terminal in raw mode with an alternate screen. Keys arrive one by one. Dropping the value restores the terminal.

use core::time::Duration;
use std::fs::File;
use std::io::{self, IsTerminal as _, Write as _};
use std::os::fd::{AsFd as _, BorrowedFd};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use rustix::termios::{OptionalActions, Termios, tcgetattr, tcgetwinsize, tcsetattr};

/// Switches to the alternate screen, hides the cursor, and turns off line wrapping.
const ENTER: &[u8] = b"\x1b[?1049h\x1b[?25l\x1b[?7l";
/// Undoes [`ENTER`].
const LEAVE: &[u8] = b"\x1b[?7h\x1b[?25h\x1b[?1049l";
/// Time within which the rest of an escape sequence must arrive. Slow connections may split a sequence after the escape character.
const REST_OF_SEQUENCE: Duration = Duration::from_millis(50);

/// A key with a function.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Key {
    NextPage,
    PreviousPage,
    NextLine,
    PreviousLine,
    Quit,
}

/// Columns and rows of a terminal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Size {
    pub(super) columns: usize,
    pub(super) rows: usize,
}

/// Standard output in raw mode, and the keys that are pressed.
#[derive(Debug)]
pub(super) struct Terminal {
    /// The terminal device, opened if standard input is not a terminal.
    keyboard: Option<File>,
    /// Settings of the terminal before raw mode.
    before: Termios,
}

impl Terminal {
    /// Switches the terminal to raw mode and the alternate screen.
    pub(super) fn open() -> io::Result<Self> {
        let keyboard = if io::stdin().is_terminal() {
            None
        } else {
            Some(File::open("/dev/tty")?)
        };
        let mut raw = tcgetattr(input(keyboard.as_ref()))?;
        let before = raw.clone();
        raw.make_raw();
        tcsetattr(input(keyboard.as_ref()), OptionalActions::Now, &raw)?;
        let terminal = Self { keyboard, before };
        Self::write(ENTER)?;
        Ok(terminal)
    }

    /// Returns the size of the terminal, or a usual size if it is unknown.
    pub(super) fn size() -> Size {
        let size = tcgetwinsize(io::stdout()).ok();
        let [columns, rows] =
            size.map_or([0; 2], |size| [size.ws_col, size.ws_row].map(usize::from));
        let or = |number: usize, usual| if number == 0 { usual } else { number };
        Size {
            columns: or(columns, 80),
            rows: or(rows, 24),
        }
    }

    /// Writes text and escape sequences.
    pub(super) fn write(bytes: &[u8]) -> io::Result<()> {
        let mut out = io::stdout().lock();
        out.write_all(bytes)?;
        out.flush()
    }

    /// Returns true if the terminal has been closed.
    pub(super) fn is_gone(&self) -> bool {
        let out = io::stdout();
        [out.as_fd(), input(self.keyboard.as_ref())].into_iter().any(|side| {
            events(side, PollFlags::empty(), Duration::ZERO)
                .is_ok_and(|found| found.intersects(PollFlags::HUP | PollFlags::ERR))
        })
    }

    /// Waits for keys and returns them.
    pub(super) fn keys(&self, wait: Duration) -> io::Result<Vec<Key>> {
        let mut bytes = self.read(wait)?;
        if bytes.last() == Some(&ESCAPE) {
            bytes.extend(self.read(REST_OF_SEQUENCE)?);
        }
        Ok(keys_in(&bytes))
    }

    /// Waits for bytes, and returns the available bytes. Returns no bytes after a signal.
    fn read(&self, wait: Duration) -> io::Result<Vec<u8>> {
        let input = input(self.keyboard.as_ref());
        if !events(input, PollFlags::IN, wait)?.contains(PollFlags::IN) {
            return Ok(Vec::new());
        }
        let mut bytes = [0; 64];
        match rustix::io::read(input, &mut bytes) {
            Ok(n) => Ok(bytes[..n].to_vec()),
            Err(Errno::INTR | Errno::AGAIN) => Ok(Vec::new()),
            Err(error) => Err(error.into()),
        }
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        let written = Self::write(LEAVE);
        let input = input(self.keyboard.as_ref());
        let set = tcsetattr(input, OptionalActions::Now, &self.before);
        if let Err(error) = written.and(set.map_err(io::Error::from)) {
            tracing::debug!(%error, "cannot restore the terminal");
        }
    }
}

/// Returns the file from which keys are read.
fn input(keyboard: Option<&File>) -> BorrowedFd<'_> {
    match keyboard {
        Some(file) => file.as_fd(),
        None => rustix::stdio::stdin(),
    }
}

/// Waits for events of a file, and returns them. Returns no events after a signal.
fn events(file: BorrowedFd<'_>, flags: PollFlags, wait: Duration) -> io::Result<PollFlags> {
    let mut watched = [PollFd::new(&file, flags)];
    let wait = Timespec::try_from(wait).map_err(io::Error::other)?;
    match poll(&mut watched, Some(&wait)) {
        Ok(_) => Ok(watched[0].revents()),
        Err(Errno::INTR) => Ok(PollFlags::empty()),
        Err(error) => Err(error.into()),
    }
}

const ESCAPE: u8 = 0x1b;
const CONTROL_C: u8 = 0x03;

/// Returns the keys that the bytes encode. Unknown bytes and sequences are skipped (ECMA-48, 5.4).
fn keys_in(mut bytes: &[u8]) -> Vec<Key> {
    let mut keys = Vec::new();
    while let Some((&first, rest)) = bytes.split_first() {
        bytes = rest;
        let key = match first {
            b'q' | CONTROL_C => Some(Key::Quit),
            b' ' | b'j' => Some(Key::NextPage),
            b'k' => Some(Key::PreviousPage),
            ESCAPE => match rest {
                [b'[' | b'O', rest @ ..] => {
                    let end = rest.iter().position(|byte| (0x40..=0x7e).contains(byte));
                    let n_bytes = end.map_or(rest.len(), |end| end + 1);
                    bytes = &rest[n_bytes..];
                    in_sequence(&rest[..n_bytes])
                }
                // A key that is pressed together with Alt.
                [_, rest @ ..] => {
                    bytes = rest;
                    None
                }
                [] => Some(Key::Quit),
            },
            _ => None,
        };
        keys.extend(key);
    }
    keys
}

/// Returns the key of an escape sequence, given without its introducer.
fn in_sequence(sequence: &[u8]) -> Option<Key> {
    match sequence {
        b"A" => Some(Key::PreviousLine),
        b"B" => Some(Key::NextLine),
        b"5~" => Some(Key::PreviousPage),
        b"6~" => Some(Key::NextPage),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_key_in_the_help_has_its_action() {
        let rows: [(&[u8], &[Key]); 12] = [
            (b" ", &[Key::NextPage]),
            (b"j", &[Key::NextPage]),
            (b"\x1b[6~", &[Key::NextPage]),
            (b"k", &[Key::PreviousPage]),
            (b"\x1b[5~", &[Key::PreviousPage]),
            (b"\x1b[B", &[Key::NextLine]),
            (b"\x1bOA", &[Key::PreviousLine]),
            (b"q", &[Key::Quit]),
            (b"\x1b", &[Key::Quit]),
            (b"\x03", &[Key::Quit]),
            (b"c", &[]),
            (
                b"jk\x1b[Aq",
                &[
                    Key::NextPage,
                    Key::PreviousPage,
                    Key::PreviousLine,
                    Key::Quit,
                ],
            ),
        ];
        for (bytes, keys) in rows {
            assert_eq!(keys_in(bytes), keys, "{bytes:?}");
        }
    }

    #[test]
    fn the_whole_sequence_of_an_unused_key_is_ignored() {
        // The keys Home, F5, Ctrl+Right, Alt+Q, the letter a, an umlaut, and a truncated sequence.
        for bytes in [
            &b"\x1b[H"[..],
            b"\x1b[15~",
            b"\x1b[1;5C",
            b"\x1bq",
            b"a",
            b"\xc3\xa4",
            b"\x1b[1;",
        ] {
            assert_eq!(keys_in(bytes), [], "{bytes:?}");
        }
    }
}
