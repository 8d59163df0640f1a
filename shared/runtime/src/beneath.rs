//! Access to files and directories relative to the descriptor of their parent directory.
//!
//! Between two uses of a path, another process may replace the file, but a descriptor always refers to the same file. No function of this
//! module follows a symbolic link.

use std::ffi::{CStr, CString};
use std::fs::File;
use std::io::{self, Read as _};
use std::os::fd::{AsFd, OwnedFd};
use std::os::unix::ffi::OsStrExt as _;
use std::path::Path;

use rustix::fs::{AtFlags, CWD, Dir, FileType, Mode, OFlags, Stat, openat, statat, unlinkat};
use rustix::io::Errno;

/// Maximum depth to which directories are removed; iceoryx2 nests directories two levels deep.
const DEEPEST: usize = 8;

/// Opens a directory by its path, whose last component must not be a symbolic link.
pub(crate) fn open_directory(path: &Path) -> Result<OwnedFd, Errno> {
    directory_in(CWD, path.as_os_str().as_bytes())
}

/// Opens a directory in a directory.
pub(crate) fn directory_in(directory: impl AsFd, name: &[u8]) -> Result<OwnedFd, Errno> {
    let flags = OFlags::RDONLY | OFlags::DIRECTORY | OFlags::NOFOLLOW | OFlags::CLOEXEC;
    openat(directory, name, flags, Mode::empty())
}

/// Opens a file in a directory for reading and writing. Creates it, for its owner only, if it does not exist.
pub(crate) fn file_in(directory: impl AsFd, name: &str) -> Result<File, Errno> {
    let flags = OFlags::RDWR | OFlags::CREATE | OFlags::NOFOLLOW | OFlags::CLOEXEC;
    openat(directory, name, flags, Mode::RUSR | Mode::WUSR).map(File::from)
}

/// Reads a file in a directory, at most `most` bytes.
pub(crate) fn read_in(directory: impl AsFd, name: &str, most: u64) -> io::Result<Vec<u8>> {
    // Opening a pipe or a device must not block.
    let flags = OFlags::RDONLY | OFlags::NOFOLLOW | OFlags::NONBLOCK | OFlags::CLOEXEC;
    let file = openat(directory, name, flags, Mode::empty())?;
    let mut bytes = Vec::new();
    File::from(file).take(most).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Returns the metadata of a name in a directory. For a symbolic link, this is the metadata of the link.
pub(crate) fn stat_in(directory: impl AsFd, name: &CStr) -> Result<Stat, Errno> {
    statat(directory, name, AtFlags::SYMLINK_NOFOLLOW)
}

/// Returns the names in a directory.
pub(crate) fn names(directory: impl AsFd) -> Result<Vec<CString>, Errno> {
    let mut names = Vec::new();
    for entry in Dir::read_from(directory)? {
        let name = entry?.file_name().to_owned();
        if !matches!(name.as_bytes(), b"." | b"..") {
            names.push(name);
        }
    }
    Ok(names)
}

/// Removes a name from a directory, recursively if it is a directory. A missing name is not an error.
pub(crate) fn remove(directory: impl AsFd, name: &CStr) -> Result<(), Errno> {
    remove_below(directory, name, DEEPEST)
}

fn remove_below(directory: impl AsFd, name: &CStr, deep: usize) -> Result<(), Errno> {
    let is_directory = match stat_in(&directory, name) {
        Err(Errno::NOENT) => return Ok(()),
        found => FileType::from_raw_mode(found?.st_mode) == FileType::Directory,
    };
    let flags = if is_directory {
        let deeper = deep.checked_sub(1).ok_or(Errno::LOOP)?;
        let below = directory_in(&directory, name.to_bytes())?;
        for inner in names(&below)? {
            remove_below(&below, &inner, deeper)?;
        }
        AtFlags::REMOVEDIR
    } else {
        AtFlags::empty()
    };
    match unlinkat(&directory, name, flags) {
        Err(Errno::NOENT) => Ok(()),
        removed => removed,
    }
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::os::unix::fs::symlink;

    use super::*;

    #[test]
    fn links_are_removed_and_their_targets_kept() {
        let base = tempfile::tempdir().unwrap();
        let (home, ours) = (base.path().join("home"), base.path().join("ours"));
        fs::create_dir_all(home.join("photos")).unwrap();
        fs::create_dir_all(ours.join("a/b")).unwrap();
        symlink(&home, ours.join("a/link")).unwrap();
        symlink(home.join("photos"), ours.join("a/b/link")).unwrap();
        let opened = open_directory(base.path()).unwrap();
        remove(&opened, c"ours").unwrap();
        assert!(!ours.exists());
        assert!(home.join("photos").exists());
        remove(&opened, c"ours").unwrap();
    }

    #[test]
    fn a_link_is_not_opened_as_a_directory() {
        let base = tempfile::tempdir().unwrap();
        symlink("/tmp", base.path().join("link")).unwrap();
        let opened = open_directory(&base.path().join("link"));
        assert_eq!(opened.unwrap_err(), Errno::NOTDIR);
    }
}
