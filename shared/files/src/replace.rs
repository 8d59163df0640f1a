//! Files that are whole or not there: written beside their place and renamed into it.

use std::ffi::OsStr;
use std::fs::File;
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};

use crate::Folder;

/// Writes a file in one step, on the disk when this returns: who reads `path` sees the old content or the new one,
/// also after a loss of power.
///
/// It is written beside its place as `.name.<process id>.part`, flushed to the disk, and renamed. A killed process
/// leaves that file at most. Permissions are those of a new file, whatever the old one had. No link is followed but in
/// the path of the folder.
///
/// # Errors
///
/// Those of the operating system; the old content stays, and nothing is left beside it.
pub fn replace(path: &Path, bytes: &[u8]) -> io::Result<()> {
    replace_by(path, |out| io::Write::write_all(out, bytes))
}

/// As [`replace`], but the operating system writes to the disk when it likes: for files of which there are many, and
/// that can be made again.
///
/// # Errors
///
/// Those of [`replace`].
pub fn replace_unsynced(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let (folder, name) = split(path)?;
    folder.replace(name, |_| Ok(()), |out| io::Write::write_all(out, bytes))
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
    let (folder, name) = split(path)?;
    folder.replace(name, File::sync_all, write)
}

/// Where a file or folder is written before it is renamed into its place: `.name.<process id>.part` beside it.
pub fn beside(path: &Path) -> PathBuf {
    path.with_file_name(crate::folder::beside(path.file_name().unwrap_or_default()))
}

/// The open folder of a file, and the name of the file in it.
fn split(path: &Path) -> io::Result<(Folder, &OsStr)> {
    let name = path.file_name().ok_or_else(|| {
        let text = "does not end with the name of a file";
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

    #[test]
    fn a_link_under_the_name_of_the_file_or_of_what_lies_beside_it_is_not_followed() {
        let folder = tempfile::tempdir().unwrap();
        let secret = folder.path().join("secret");
        fs::write(&secret, "kept").unwrap();
        let path = folder.path().join("report.html");
        std::os::unix::fs::symlink(&secret, &path).unwrap();
        std::os::unix::fs::symlink(&secret, beside(&path)).unwrap();
        let error = replace(&path, b"x").unwrap_err().to_string();
        assert!(error.contains("a symbolic link of user "), "{error}");
        fs::remove_file(beside(&path)).unwrap();
        replace(&path, b"x").unwrap();
        assert_eq!(fs::read_to_string(&secret).unwrap(), "kept");
        assert!(fs::symlink_metadata(&path).unwrap().is_file());
    }
}
