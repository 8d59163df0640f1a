//! Progress of a process in a file beside the deployment's sockets, so that it survives the process.

use std::fs::{self, File};
use std::io::{self, Write as _};
use std::os::unix::fs::FileExt as _;
use std::path::PathBuf;

use crate::Bus;

/// Digits of the largest `u64`.
const WIDTH: usize = 20;

/// A few numbers that a process saves, and reads back after a restart.
#[derive(Debug)]
pub struct Place {
    path: PathBuf,
    file: Option<File>,
}

impl Place {
    /// Keeps the numbers in a file, which is created when something is saved.
    pub fn new(path: PathBuf) -> Self {
        Self { path, file: None }
    }

    /// The place of the process that a bus belongs to.
    pub fn of(bus: &Bus) -> Self {
        let file = format!("{}.place", bus.process());
        Self::new(bus.namespace().root().join(file))
    }

    /// The numbers that were saved last, possibly before a restart; `None` if there are none.
    pub fn noted<const N: usize>(&self) -> Option<[u64; N]> {
        let text = fs::read_to_string(&self.path).ok()?;
        let numbers: Result<Vec<u64>, _> = text.split_whitespace().map(str::parse).collect();
        numbers.ok()?.try_into().ok()
    }

    /// Saves numbers; always the same count.
    ///
    /// A single write replaces the old ones, so that a killed process leaves either the old or the new ones.
    ///
    /// # Errors
    ///
    /// The file cannot be written; after a restart the numbers saved before are read.
    pub fn note<const N: usize>(&mut self, numbers: [u64; N]) -> io::Result<()> {
        let mut line = Vec::with_capacity(N * (WIDTH + 1));
        for number in numbers {
            writeln!(line, "{number:WIDTH$}")?;
        }
        let file = match self.file.take() {
            Some(file) => file,
            None => File::options()
                .create(true)
                .truncate(false)
                .write(true)
                .open(&self.path)?,
        };
        self.file.insert(file).write_all_at(&line, 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_saved_numbers_are_read_after_a_restart() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.place");
        let mut place = Place::new(path.clone());
        assert_eq!(place.noted::<2>(), None);
        for numbers in [[0, 7], [u64::MAX, 12], [3, 4]] {
            place.note(numbers).unwrap();
            assert_eq!(Place::new(path.clone()).noted(), Some(numbers));
        }
        let mut next = Place::new(path.clone());
        next.note([5, 6]).unwrap();
        assert_eq!(place.noted(), Some([5, 6]));
        assert_eq!(place.noted::<3>(), None, "another number of numbers");
        fs::write(&path, "5 six").unwrap();
        assert_eq!(place.noted::<2>(), None);
    }

    #[test]
    fn nothing_is_saved_if_the_file_cannot_be_written() {
        let folder = tempfile::tempdir().unwrap();
        let mut place = Place::new(folder.path().join("nowhere").join("a"));
        place.note([1]).unwrap_err();
        assert_eq!(place.noted::<1>(), None);
    }
}
