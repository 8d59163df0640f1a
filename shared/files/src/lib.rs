//! Files that are whole or not there: written beside their place and renamed into it.
#![forbid(unsafe_code)]

use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write as _};
use std::path::{Path, PathBuf};
use std::process;

/// Writes a file in one step, on the disk when this returns: who reads `path` sees the old content or the new one,
/// also after a loss of power.
///
/// It is written beside its place as `.name.<process id>.part`, flushed to the disk, and renamed. A killed process
/// leaves that file at most. Two threads of one process must not write the same path at once. Permissions are those
/// of a new file, whatever the old one had.
///
/// # Errors
///
/// Those of the operating system; the old content stays, and nothing is left beside it.
pub fn replace(path: &Path, bytes: &[u8]) -> io::Result<()> {
    place(path, bytes, File::sync_all)
}

/// As [`replace`], but the operating system writes to the disk when it likes: for files of which there are many, and
/// that can be made again.
///
/// # Errors
///
/// Those of [`replace`].
pub fn replace_unsynced(path: &Path, bytes: &[u8]) -> io::Result<()> {
    place(path, bytes, |_| Ok(()))
}

/// As [`replace`], for what is written bit by bit: the writer's own result is handed on.
///
/// # Errors
///
/// Those of [`replace`] and of `write`.
pub fn replace_by<T>(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> io::Result<T>,
) -> io::Result<T> {
    let beside = beside(path);
    let written = File::create(&beside).and_then(|file| {
        let mut out = BufWriter::new(file);
        let made = write(&mut out)?;
        out.flush()?;
        out.get_ref().sync_all()?;
        Ok(made)
    });
    let placed = written.and_then(|made| fs::rename(&beside, path).map(|()| made));
    if placed.is_err() {
        // The error that is reported came first; one of the removal could add nothing to it.
        drop(fs::remove_file(&beside));
    }
    placed
}

fn place(path: &Path, bytes: &[u8], sync: fn(&File) -> io::Result<()>) -> io::Result<()> {
    let beside = beside(path);
    let written = File::create(&beside)
        .and_then(|mut file| {
            file.write_all(bytes)?;
            sync(&file)
        })
        .and_then(|()| fs::rename(&beside, path));
    if written.is_err() {
        // The error that is reported came first; one of the removal could add nothing to it.
        drop(fs::remove_file(&beside));
    }
    written
}

/// Where a file or folder is written before it is renamed into its place: `.name.<process id>.part` beside it.
pub fn beside(path: &Path) -> PathBuf {
    let mut name = OsString::from(".");
    name.push(path.file_name().unwrap_or_default());
    name.push(format!(".{}.part", process::id()));
    path.with_file_name(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<OsString> {
        let entries = fs::read_dir(folder).unwrap();
        entries.map(|entry| entry.unwrap().file_name()).collect()
    }

    #[test]
    fn a_file_is_made_and_replaced_with_nothing_left_beside_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("model.plx");
        for (write, text) in [
            (replace as fn(&Path, &[u8]) -> _, "old"),
            (replace, "new"),
            (replace_unsynced, "newer"),
        ] {
            write(&path, text.as_bytes()).unwrap();
            assert_eq!(fs::read_to_string(&path).unwrap(), text);
            assert_eq!(names(folder.path()), ["model.plx"]);
        }
    }

    #[test]
    fn what_is_written_bit_by_bit_is_whole_or_not_there() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("long.csv");
        let failed = replace_by(&path, |out| {
            out.write_all(b"half")?;
            Err::<(), _>(io::Error::other("full"))
        });
        assert_eq!(failed.unwrap_err().to_string(), "full");
        assert!(names(folder.path()).is_empty());
        let made = replace_by(&path, |out| out.write_all(b"whole").map(|()| 7));
        assert_eq!(made.unwrap(), 7);
        assert_eq!(fs::read(&path).unwrap(), b"whole");
        assert_eq!(names(folder.path()), ["long.csv"]);
    }

    #[test]
    fn where_it_cannot_be_put_into_its_place_nothing_is_left() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("taken");
        fs::create_dir_all(path.join("by a folder")).unwrap();
        replace(&path, b"x").unwrap_err();
        assert_eq!(names(folder.path()), ["taken"]);
        assert!(path.join("by a folder").is_dir());
    }

    #[test]
    fn a_folder_that_is_missing_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let error = replace(&folder.path().join("missing/file"), b"x").unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::NotFound);
    }
}
