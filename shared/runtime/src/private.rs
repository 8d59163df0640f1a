//! One user owns a deployment: its directory is nobody else's, shut, and says what it is.

use std::ffi::CString;
use std::fs::{self, DirBuilder};
use std::io;
use std::os::fd::{AsFd, OwnedFd};
use std::os::unix::fs::{DirBuilderExt as _, FileExt as _};
use std::path::{Path, PathBuf};

use rustix::fs::{AtFlags, FileType, Mode, Stat, chmodat, fchmod, fstat, mkdirat, unlinkat};
use rustix::io::Errno;
use rustix::process::getuid;

use crate::lock::{LOCK_FILE, SHARED_MEMORY};
use crate::{Namespace, beneath};

/// A directory that its owner may enter, and nobody else.
const DIRECTORY: Mode = Mode::RWXU;
/// A file that its owner may read and write, and nobody else.
const FILE: Mode = Mode::RUSR.union(Mode::WUSR);
/// What nobody else may do.
const OTHERS: u32 = 0o077;
/// Others may write.
const OTHERS_WRITE: u32 = 0o022;
/// What is in a directory only its owner may remove.
const STICKY: u32 = 0o1000;
/// The file that says whose a directory is.
const MARK_FILE: &str = "parallax-deployment";

/// What a deployment uses is another user's, or cannot be shut.
#[derive(Debug, thiserror::Error)]
pub enum PrivacyError {
    /// It is another user's.
    #[error("{path:?} belongs to {owner}, this process runs as {user}")]
    Foreign {
        /// The file or directory.
        path: PathBuf,
        /// Whose it is, with the number.
        owner: String,
        /// Who would use it.
        user: String,
    },
    /// It is a symbolic link, which is never followed.
    #[error("{path:?} is a symbolic link of {owner} to {target:?}, and not a directory")]
    Link {
        /// What is there.
        path: PathBuf,
        /// Whose it is, with the number.
        owner: String,
        /// Where it leads.
        target: PathBuf,
    },
    /// It is not a directory.
    #[error("{path:?} is not a directory")]
    NoDirectory {
        /// What is there.
        path: PathBuf,
    },
    /// Others may put something else in the place of what is in it.
    #[error("{path:?} of {owner} may be written by anybody (mode {mode:o})")]
    Open {
        /// The directory.
        path: PathBuf,
        /// Whose it is, with the number.
        owner: String,
        /// Its mode.
        mode: u32,
    },
    /// It holds files, and none that says that they are a deployment's.
    #[error(
        "{path:?} is no directory of a deployment (files in it: {n_files}; none is its {MARK_FILE:?})"
    )]
    Unmarked {
        /// The directory.
        path: PathBuf,
        /// Files and directories in it.
        n_files: usize,
    },
    /// It cannot be looked at, made, or shut.
    #[error("cannot make {path:?} one's own")]
    File {
        /// The file or directory.
        path: PathBuf,
        /// Why.
        #[source]
        source: io::Error,
    },
}

impl PrivacyError {
    /// What the user may try.
    pub(crate) fn hint(&self) -> Option<String> {
        match self {
            Self::Foreign { path, owner, .. } => Some(format!(
                "run as {owner}, or have it removed: `sudo rm -r {}`; a deployment and its processes are one user's",
                path.display()
            )),
            Self::Link { path, .. } | Self::NoDirectory { path } => {
                Some(format!("remove it: `rm {}`", path.display()))
            }
            Self::Open { path, .. } => Some(format!(
                "have it shut: `sudo chmod go-w {}`",
                path.display()
            )),
            Self::Unmarked { path, .. } => Some(format!(
                "nothing in it was touched: see what it is, and move or remove {} yourself",
                path.display()
            )),
            Self::File { .. } => None,
        }
    }
}

/// The directory of a deployment, open: this user's, shut to others, and marked as what it is. Whatever becomes of
/// its path, what is removed lies in it.
#[derive(Debug)]
pub(crate) struct Root {
    base: OwnedFd,
    root: OwnedFd,
}

impl AsFd for Root {
    fn as_fd(&self) -> std::os::fd::BorrowedFd<'_> {
        self.root.as_fd()
    }
}

impl Root {
    /// Makes the directory of a deployment if it is not there, and checks that it is this user's and nobody
    /// else may enter it. Whatever the umask is, its mode is 0700 afterwards.
    ///
    /// The directory above it must be this user's or the system's, and others must not be able to replace what
    /// is in it.
    pub(crate) fn open(namespace: &Namespace) -> Result<Self, PrivacyError> {
        let path = namespace.root();
        loop {
            let base = make_base(namespace.base())?;
            let root = match open_or_make(&base, namespace.name()) {
                // Another run has ended in between.
                Err(Errno::NOENT) => continue,
                opened => opened.map_err(|error| unopened(path, error))?,
            };
            let found = fstat(&root).map_err(failed(path))?;
            if found.st_uid != getuid().as_raw() {
                return Err(foreign(path, found.st_uid));
            }
            let it = Self { base, root };
            match it.claim(namespace) {
                Err(PrivacyError::File { source, .. })
                    if source.kind() == io::ErrorKind::NotFound => {}
                claimed => {
                    claimed?;
                    shut(&it.root, &found, path)?;
                    return Ok(it);
                }
            }
        }
    }

    /// Marks the directory, if it is marked already or holds nothing of anybody's.
    fn claim(&self, namespace: &Namespace) -> Result<(), PrivacyError> {
        if is_marked(&self.root, namespace) {
            return Ok(());
        }
        let names = beneath::names(&self.root).map_err(failed(namespace.root()))?;
        let is_known = |it: &&CString| {
            [LOCK_FILE, MARK_FILE]
                .map(str::as_bytes)
                .contains(&it.as_bytes())
        };
        let n_files = names.len() - names.iter().filter(is_known).count();
        // Another run may have marked it in between, which it does before all else.
        if n_files > 0 && !is_marked(&self.root, namespace) {
            return Err(PrivacyError::Unmarked {
                path: namespace.root().to_owned(),
                n_files,
            });
        }
        self.mark(namespace)
    }

    /// Says in the directory what it is.
    pub(crate) fn mark(&self, namespace: &Namespace) -> Result<(), PrivacyError> {
        let path = namespace.root().join(MARK_FILE);
        let text = mark_of(namespace);
        let file = beneath::file_in(&self.root, MARK_FILE).map_err(failed(&path))?;
        let written = file.write_all_at(text.as_bytes(), 0);
        let written = written.and_then(|()| file.set_len(text.len() as u64));
        written.map_err(|source| PrivacyError::File { path, source })
    }

    /// Removes all that is in the directory but for the lock and the mark.
    pub(crate) fn empty(&self) -> io::Result<()> {
        for name in beneath::names(&self.root)? {
            if ![LOCK_FILE, MARK_FILE]
                .map(str::as_bytes)
                .contains(&name.as_bytes())
            {
                beneath::remove(&self.root, &name)?;
            }
        }
        Ok(())
    }

    /// Removes the mark, the lock, which is held, and the directory, unless the next run has begun in it.
    ///
    /// The lock goes after all else, so that nobody else can have begun below it.
    pub(crate) fn remove(&self, namespace: &Namespace) -> io::Result<()> {
        for name in [MARK_FILE, LOCK_FILE] {
            match unlinkat(&self.root, name, AtFlags::empty()) {
                Ok(()) | Err(Errno::NOENT) => {}
                Err(error) => return Err(error.into()),
            }
        }
        match unlinkat(&self.base, namespace.name(), AtFlags::REMOVEDIR) {
            Ok(()) | Err(Errno::NOENT | Errno::NOTEMPTY) => Ok(()),
            Err(error) => Err(error.into()),
        }
    }
}

/// Opens a directory of the base.
fn open_or_make(base: &OwnedFd, name: &str) -> Result<OwnedFd, Errno> {
    let opened = beneath::directory_in(base, name.as_bytes());
    if opened.as_ref().err() != Some(&Errno::NOENT) {
        return opened;
    }
    match mkdirat(base, name, DIRECTORY) {
        // The umask may have taken from the owner what he needs in the next step.
        Ok(()) => chmodat(base, name, DIRECTORY, AtFlags::empty())?,
        Err(Errno::EXIST) => {}
        Err(error) => return Err(error),
    }
    beneath::directory_in(base, name.as_bytes())
}

/// Whether a directory says that it is that of a deployment.
pub(crate) fn is_marked(directory: impl AsFd, namespace: &Namespace) -> bool {
    let expected = mark_of(namespace);
    let most = expected.len() as u64 + 1;
    beneath::read_in(directory, MARK_FILE, most).is_ok_and(|it| it == expected.as_bytes())
}

fn mark_of(namespace: &Namespace) -> String {
    let name = namespace.name();
    format!("This directory is that of the deployment {name} of parallax, which removes it.\n")
}

/// Opens the directory that those of deployments lie in; none if there is none.
pub(crate) fn open_base(path: &Path) -> Result<Option<OwnedFd>, PrivacyError> {
    let base = match beneath::open_directory(path) {
        Err(Errno::NOENT) => return Ok(None),
        opened => opened.map_err(|error| unopened(path, error))?,
    };
    let found = fstat(&base).map_err(failed(path))?;
    let is_ours = found.st_uid == getuid().as_raw();
    if !is_ours && found.st_uid != 0 {
        return Err(foreign(path, found.st_uid));
    }
    let is_open = found.st_mode & OTHERS_WRITE != 0 && found.st_mode & STICKY == 0;
    if is_ours && path == Namespace::usual_base() {
        shut(&base, &found, path)?;
    } else if is_ours && is_open {
        let kept = Mode::from_raw_mode(found.st_mode & 0o7777 & !OTHERS_WRITE);
        fchmod(&base, kept).map_err(failed(path))?;
    } else if is_open {
        return Err(PrivacyError::Open {
            path: path.to_owned(),
            owner: user(found.st_uid),
            mode: found.st_mode & 0o7777,
        });
    }
    Ok(Some(base))
}

/// The same, which is made if there is none.
fn make_base(path: &Path) -> Result<OwnedFd, PrivacyError> {
    loop {
        if let Some(base) = open_base(path)? {
            return Ok(base);
        }
        let mut builder = DirBuilder::new();
        let made = builder.recursive(true).mode(DIRECTORY.bits()).create(path);
        made.map_err(|source| PrivacyError::File {
            path: path.to_owned(),
            source,
        })?;
        // As above.
        chmodat(rustix::fs::CWD, path, DIRECTORY, AtFlags::empty()).map_err(failed(path))?;
    }
}

/// Why a directory could not be opened: what is there instead, or whose it is.
fn unopened(path: &Path, error: Errno) -> PrivacyError {
    let owner = fs::symlink_metadata(path).map(|it| std::os::unix::fs::MetadataExt::uid(&it));
    match (owner, error) {
        (Ok(owner), Errno::NOTDIR | Errno::LOOP) => match fs::read_link(path) {
            Ok(target) => PrivacyError::Link {
                path: path.to_owned(),
                owner: user(owner),
                target,
            },
            Err(_) => PrivacyError::NoDirectory {
                path: path.to_owned(),
            },
        },
        (Ok(owner), _) if owner != getuid().as_raw() => foreign(path, owner),
        _ => failed(path)(error),
    }
}

/// Checks that nothing in shared memory that carries the name of a deployment is another user's, and
/// takes from others what the transport leaves them: its management file, which anybody may write.
pub(crate) fn shared_memory(namespace: &Namespace) -> Result<(), PrivacyError> {
    each_segment(namespace, |memory, name, found| {
        let is_file = FileType::from_raw_mode(found.st_mode) == FileType::RegularFile;
        if is_file && found.st_mode & OTHERS != 0 {
            // It is a file of this user's in a directory where only he may replace it.
            return chmodat(memory, name, FILE, AtFlags::empty());
        }
        Ok(())
    })
}

/// Removes what carries the name of a deployment from shared memory; what is no file stays.
pub(crate) fn remove_shared_memory(namespace: &Namespace) -> Result<(), PrivacyError> {
    each_segment(namespace, |memory, name, found| {
        if FileType::from_raw_mode(found.st_mode) == FileType::RegularFile {
            return unlinkat(memory, name, AtFlags::empty());
        }
        Ok(())
    })
}

/// Does something with all that carries the name of a deployment in shared memory, all of which must be this
/// user's.
fn each_segment(
    namespace: &Namespace,
    act: impl Fn(&OwnedFd, &std::ffi::CStr, &Stat) -> Result<(), Errno>,
) -> Result<(), PrivacyError> {
    let directory = Path::new(SHARED_MEMORY);
    // The system's own, wherever it lies.
    let memory = OwnedFd::from(
        fs::File::open(directory).map_err(|source| PrivacyError::File {
            path: directory.to_owned(),
            source,
        })?,
    );
    for name in beneath::names(&memory).map_err(failed(directory))? {
        if !name.as_bytes().starts_with(namespace.prefix().as_bytes()) {
            continue;
        }
        let path = directory.join(name.to_string_lossy().as_ref());
        let done = match beneath::look(&memory, &name) {
            Ok(it) if it.st_uid != getuid().as_raw() => return Err(foreign(&path, it.st_uid)),
            Ok(it) => act(&memory, &name, &it),
            Err(error) => Err(error),
        };
        match done {
            // It was another process's, which has ended.
            Ok(()) | Err(Errno::NOENT) => {}
            Err(error) => return Err(failed(&path)(error)),
        }
    }
    Ok(())
}

/// Takes from others what they may do with a directory.
fn shut(directory: &OwnedFd, found: &Stat, path: &Path) -> Result<(), PrivacyError> {
    if found.st_mode & 0o7777 == DIRECTORY.bits() {
        return Ok(());
    }
    fchmod(directory, DIRECTORY).map_err(failed(path))
}

fn failed(path: &Path) -> impl FnOnce(Errno) -> PrivacyError {
    move |error| PrivacyError::File {
        path: path.to_owned(),
        source: error.into(),
    }
}

fn foreign(path: &Path, owner: u32) -> PrivacyError {
    PrivacyError::Foreign {
        path: path.to_owned(),
        owner: user(owner),
        user: user(getuid().as_raw()),
    }
}

/// `user nobody (65534)`, or the number alone where it has no name here.
fn user(uid: u32) -> String {
    let users = fs::read_to_string("/etc/passwd").unwrap_or_default();
    let name = users.lines().find_map(|line| {
        let mut cells = line.split(':');
        let name = cells.next()?;
        (cells.nth(1)?.parse() == Ok(uid)).then_some(name)
    });
    name.map_or_else(
        || format!("user {uid}"),
        |name| format!("user {name} ({uid})"),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn users_have_names_where_the_system_knows_them() {
        assert_eq!(user(0), "user root (0)");
        assert_eq!(user(4_000_000_000), "user 4000000000");
    }
}
