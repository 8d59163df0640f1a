//! Writing of files that are always complete or absent: they are written under a temporary name, then renamed.

use std::ffi::OsStr;
use std::fs::File;
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};

use crate::Folder;

/// Writes a file in one step. The data is on the disk when this function returns. A reader of `path` sees either the old content or the new
/// content, even after a loss of power.
///
/// The data is written to `.name.<process id>.part` in the same folder, flushed to the disk, and renamed. If the process is killed, at most
/// this temporary file remains. The file gets the permissions of a new file, whatever permissions the old file had. Links are followed only
/// in the path of the file's folder.
///
/// # Errors
///
/// Returns errors of the operating system. The old content is then kept, and the temporary file is removed.
pub fn replace(path: &Path, bytes: &[u8]) -> io::Result<()> {
    replace_by(path, |out| io::Write::write_all(out, bytes))
}

/// Works like [`replace`], but does not wait for the data to reach the disk. It is for large numbers of files that can be created again.
///
/// # Errors
///
/// Fails like [`replace`].
pub fn replace_unsynced(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let (folder, name) = split(path)?;
    folder.replace(name, |_| Ok(()), |out| io::Write::write_all(out, bytes))
}

/// Works like [`replace`], for data that is written piece by piece. Returns the result of `write`.
///
/// # Errors
///
/// Fails like [`replace`], or if `write` fails.
pub fn replace_by<T>(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> io::Result<T>,
) -> io::Result<T> {
    let (folder, name) = split(path)?;
    folder.replace(name, File::sync_all, write)
}

/// Returns the temporary path `.name.<process id>.part` in the same folder, under which a file or folder is written before it is renamed.
pub fn beside(path: &Path) -> PathBuf {
    path.with_file_name(crate::folder::beside(path.file_name().unwrap_or_default()))
}

/// Opens the folder of a file, and returns it with the name of the file in it.
fn split(path: &Path) -> io::Result<(Folder, &OsStr)> {
    let name = path.file_name().ok_or_else(|| {
        let text = "does not end with a file name";
        io::Error::new(io::ErrorKind::InvalidInput, text)
    })?;
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    Ok((Folder::open(folder.unwrap_or(Path::new(".")))?, name))
}

#[cfg(test)]
mod tests {
    use std::ffi::OsString;
    use std::fs;
    use std::io::Write as _;

    use super::*;

    fn names(folder: &Path) -> Vec<OsString> {
        let entries = fs::read_dir(folder).unwrap();
        entries.map(|entry| entry.unwrap().file_name()).collect()
    }

    #[test]
    fn a_file_is_created_and_replaced_without_leftovers() {
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
    fn a_file_written_in_steps_is_complete_or_absent() {
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
    fn a_failed_replacement_leaves_no_file() {
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

    #[test]
    fn links_at_the_path_of_the_file_or_its_temporary_file_are_not_followed() {
        let folder = tempfile::tempdir().unwrap();
        let secret = folder.path().join("secret");
        fs::write(&secret, "kept").unwrap();
        let path = folder.path().join("report.html");
        std::os::unix::fs::symlink(&secret, &path).unwrap();
        std::os::unix::fs::symlink(&secret, beside(&path)).unwrap();
        let error = replace(&path, b"x").unwrap_err().to_string();
        assert!(
            error.contains("a symbolic link that belongs to user "),
            "{error}"
        );
        fs::remove_file(beside(&path)).unwrap();
        replace(&path, b"x").unwrap();
        assert_eq!(fs::read_to_string(&secret).unwrap(), "kept");
        assert!(fs::symlink_metadata(&path).unwrap().is_file());
    }
}
