//! Data that a process writes to a file beside the deployment's sockets (its notes), so that they survive the process.

use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt as _;
use std::path::PathBuf;

use formats::checksum::fnv1a;

use crate::Bus;

/// Size of the space for one note. The file has space for two notes, which are written alternately. If a process is killed while it writes
/// one note, the other note is still complete.
const SLOT_BYTES: u64 = 1 << 18;
/// Size of the header before each note: its number, its length and its checksum.
const HEADER_BYTES: usize = 3 * size_of::<u64>();

/// Notes of a process, which it reads back after a restart.
#[derive(Debug)]
pub struct Place {
    path: PathBuf,
    file: Option<File>,
    n_noted: u64,
}

impl Place {
    /// Creates notes in a file. The file is created when the first note is written.
    pub fn new(path: PathBuf) -> Self {
        Self {
            path,
            file: None,
            n_noted: 0,
        }
    }

    /// Returns the notes of the process that a bus belongs to.
    pub fn of(bus: &Bus) -> Self {
        let file = format!("{}.place", bus.process());
        Self::new(bus.namespace().root().join(file))
    }

    /// Returns the bytes of the last note, possibly from before a restart; `None` if there is no note. The next note gets the number after
    /// that of this note.
    pub fn last(&mut self) -> Option<Vec<u8>> {
        let file = File::open(&self.path).ok()?;
        let notes = [0, 1].into_iter().filter_map(|slot| read(&file, slot));
        let (number, bytes) = notes.max_by_key(|(number, _)| *number)?;
        self.n_noted = number;
        Some(bytes)
    }

    /// Returns the numbers of the last note; `None` if there is no note, or if it has a different number of values.
    pub fn noted<const N: usize>(&mut self) -> Option<[u64; N]> {
        let bytes = self.last()?;
        let (numbers, []) = bytes.as_chunks() else {
            return None;
        };
        let numbers: Vec<u64> = numbers.iter().map(|number| u64::from_le_bytes(*number)).collect();
        numbers.try_into().ok()
    }

    /// Replaces the last note by other bytes.
    ///
    /// # Errors
    ///
    /// Fails if the file cannot be written, or if there are more than 262 120 bytes. After a restart, the previous note is then read.
    pub fn note_bytes(&mut self, bytes: &[u8]) -> io::Result<()> {
        if bytes.len() > SLOT_BYTES as usize - HEADER_BYTES {
            return Err(io::ErrorKind::FileTooLarge.into());
        }
        let number = self.n_noted + 1;
        let header = [number, bytes.len() as u64, fnv1a(bytes)];
        let note = [header.map(u64::to_le_bytes).as_flattened(), bytes].concat();
        let file = match self.file.take() {
            Some(file) => file,
            None => File::options()
                .create(true)
                .truncate(self.n_noted == 0)
                .write(true)
                .open(&self.path)?,
        };
        let file = self.file.insert(file);
        file.write_all_at(&note, number % 2 * SLOT_BYTES)?;
        self.n_noted = number;
        Ok(())
    }

    /// Replaces the last note by other numbers.
    ///
    /// # Errors
    ///
    /// Fails in the same cases as [`note_bytes`](Self::note_bytes).
    pub fn note<const N: usize>(&mut self, numbers: [u64; N]) -> io::Result<()> {
        self.note_bytes(numbers.map(u64::to_le_bytes).as_flattened())
    }
}

/// Returns the number and the bytes of a note; `None` if there is no note, or if it is not complete.
fn read(file: &File, slot: u64) -> Option<(u64, Vec<u8>)> {
    let begin = slot * SLOT_BYTES;
    let mut header = [[0; size_of::<u64>()]; 3];
    file.read_exact_at(header.as_flattened_mut(), begin).ok()?;
    let [number, len, checksum] = header.map(u64::from_le_bytes);
    if number == 0 || number % 2 != slot || len > SLOT_BYTES - HEADER_BYTES as u64 {
        return None;
    }
    let mut bytes = vec![0; len as usize];
    file.read_exact_at(&mut bytes, begin + HEADER_BYTES as u64).ok()?;
    (fnv1a(&bytes) == checksum).then_some((number, bytes))
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
        assert_eq!(next.noted(), Some([3, 4]));
        next.note([5, 6]).unwrap();
        assert_eq!(place.noted(), Some([5, 6]));
        assert_eq!(place.noted::<3>(), None, "another number of numbers");
    }

    #[test]
    fn an_incompletely_saved_note_leaves_the_previous_one() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.place");
        let mut place = Place::new(path.clone());
        place.note_bytes(&[1; 9000]).unwrap();
        place.note_bytes(&[2; 9000]).unwrap();
        assert_eq!(place.last(), Some(vec![2; 9000]));
        let file = File::options().write(true).open(&path).unwrap();
        file.write_all_at(&[3; 500], 5000).unwrap();
        assert_eq!(place.last(), Some(vec![1; 9000]));
        file.write_all_at(&[3; 500], SLOT_BYTES + 5000).unwrap();
        assert_eq!(place.last(), None);
        place.note_bytes(&vec![0; SLOT_BYTES as usize]).unwrap_err();
    }

    #[test]
    fn nothing_is_saved_if_the_file_cannot_be_written() {
        let folder = tempfile::tempdir().unwrap();
        let mut place = Place::new(folder.path().join("nowhere").join("a"));
        place.note([1]).unwrap_err();
        assert_eq!(place.noted::<1>(), None);
    }
}
