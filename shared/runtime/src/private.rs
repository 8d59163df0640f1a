//! A deployment belongs to one user: its directory is owned by this user, is not accessible to others, and contains a marker file.

use std::ffi::CString;
use std::fs::{self, DirBuilder};
use std::io;
use std::os::fd::{AsFd, OwnedFd};
use std::os::unix::fs::{DirBuilderExt as _, FileExt as _};
use std::path::{Path, PathBuf};

use rustix::fs::{AtFlags, FileType, Mode, Stat, chmodat, fchmod, fstat, mkdirat, unlinkat};
use rustix::io::Errno;
use rustix::process::getuid;

use crate::memory::SHARED_MEMORY;
use crate::{Namespace, beneath};

/// Mode of a directory that only its owner may enter.
const DIRECTORY: Mode = Mode::RWXU;
/// Mode of a file that only its owner may read and write.
const FILE: Mode = Mode::RUSR.union(Mode::WUSR);
/// The permission bits of group and others.
const OTHERS: u32 = 0o077;
/// The write bits of group and others.
const OTHERS_WRITE: u32 = 0o022;
/// The sticky bit: only the owner of a file may remove it from the directory.
const STICKY: u32 = 0o1000;
/// The file that the supervisor of a deployment locks.
pub(crate) const LOCK_FILE: &str = "lock";
/// The marker file, which names the deployment that a directory belongs to.
const MARK_FILE: &str = "parallax-deployment";

/// Reason why the files of a deployment are not private: they belong to another user, or others cannot be denied access.
#[derive(Debug, thiserror::Error)]
pub enum PrivacyError {
    /// The file or directory belongs to another user.
    #[error("{path:?} belongs to {owner}, but this process runs as {user}")]
    Foreign {
        /// The file or directory.
        path: PathBuf,
        /// Name and number of the owner.
        owner: String,
        /// User that this process runs as.
        user: String,
    },
    /// The path is a symbolic link, which is never followed.
    #[error("{path:?} is a symbolic link of {owner} to {target:?}, and not a directory")]
    Link {
        /// Path of the link.
        path: PathBuf,
        /// Name and number of the owner.
        owner: String,
        /// Target of the link.
        target: PathBuf,
    },
    /// The path is not a directory.
    #[error("{path:?} is not a directory")]
    NoDirectory {
        /// Path that is not a directory.
        path: PathBuf,
    },
    /// Other users may replace the entries of the directory.
    #[error("{path:?} of {owner} can be written to by any user (mode {mode:o})")]
    Open {
        /// The directory.
        path: PathBuf,
        /// Name and number of the owner.
        owner: String,
        /// Mode of the directory.
        mode: u32,
    },
    /// The directory contains files, but not the marker file of a deployment.
    #[error(
        "{path:?} is not the directory of a deployment (files in it: {n_files}; none is named {MARK_FILE:?})"
    )]
    Unmarked {
        /// The directory.
        path: PathBuf,
        /// Number of files and directories in the directory.
        n_files: usize,
    },
    /// The file or directory cannot be read, created, or closed to others.
    #[error("cannot open or create {path:?}, or cannot deny other users access to it")]
    File {
        /// The file or directory.
        path: PathBuf,
        /// Cause of the error.
        #[source]
        source: io::Error,
    },
}

impl PrivacyError {
    /// Returns a remedy that the user may try, if one is known.
    pub(crate) fn hint(&self) -> Option<String> {
        match self {
            Self::Foreign { path, owner, .. } => Some(format!(
                "run as {owner}, or have it removed: `sudo rm -r {}`; a deployment and its processes must belong to one user",
                failure::wording::shell(path.display())
            )),
            Self::Link { path, .. } | Self::NoDirectory { path } => Some(format!(
                "remove it: `rm {}`",
                failure::wording::shell(path.display())
            )),
            Self::Open { path, .. } => Some(format!(
                "remove the write permission of other users: `sudo chmod go-w {}`",
                failure::wording::shell(path.display())
            )),
            Self::Unmarked { path, .. } => Some(format!(
                "nothing in it was changed: check its content, and move or remove {} yourself",
                path.display()
            )),
            Self::File { .. } => None,
        }
    }
}

/// The open directory of a deployment. It is owned by this user, closed to others, and contains a marker file. Files
/// are removed through its descriptor, so that replacing its path has no effect.
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
    /// Creates the directory of a deployment if it does not exist, and checks that it belongs to this user.
    /// Its mode is 0700 afterwards, regardless of the umask.
    ///
    /// The parent directory must belong to this user or to root, and other users must not be able to replace its entries.
    pub(crate) fn open(namespace: &Namespace) -> Result<Self, PrivacyError> {
        let path = namespace.root();
        loop {
            let base = make_base(namespace.base())?;
            let root = match open_or_make(&base, namespace.name()) {
                // Another run has ended in the meantime.
                Err(Errno::NOENT) => continue,
                opened => opened.map_err(|error| unopened(path, error))?,
            };
            let found = fstat(&root).map_err(failed(path))?;
            if found.st_uid != getuid().as_raw() {
                return Err(foreign(path, found.st_uid));
            }
            let directory = Self { base, root };
            match directory.claim(namespace) {
                Err(PrivacyError::File { source, .. })
                    if source.kind() == io::ErrorKind::NotFound => {}
                claimed => {
                    claimed?;
                    shut(&directory.root, &found, path)?;
                    return Ok(directory);
                }
            }
        }
    }

    /// Writes the marker file if the directory is empty or already has one.
    fn claim(&self, namespace: &Namespace) -> Result<(), PrivacyError> {
        if is_marked(&self.root, namespace) {
            return Ok(());
        }
        let names = beneath::names(&self.root).map_err(failed(namespace.root()))?;
        let is_known =
            |name: &&CString| [LOCK_FILE, MARK_FILE].map(str::as_bytes).contains(&name.as_bytes());
        let n_files = names.len() - names.iter().filter(is_known).count();
        // Another run may have written the marker file in the meantime, because a run writes it first.
        if n_files > 0 && !is_marked(&self.root, namespace) {
            return Err(PrivacyError::Unmarked {
                path: namespace.root().to_owned(),
                n_files,
            });
        }
        self.mark(namespace)
    }

    /// Writes the marker file.
    pub(crate) fn mark(&self, namespace: &Namespace) -> Result<(), PrivacyError> {
        let path = namespace.root().join(MARK_FILE);
        let text = mark_of(namespace);
        let file = beneath::file_in(&self.root, MARK_FILE).map_err(failed(&path))?;
        let written = file.write_all_at(text.as_bytes(), 0);
        let written = written.and_then(|()| file.set_len(text.len() as u64));
        written.map_err(|source| PrivacyError::File { path, source })
    }

    /// Removes everything in the directory except the lock file and the marker file.
    pub(crate) fn empty(&self) -> io::Result<()> {
        for name in beneath::names(&self.root)? {
            if ![LOCK_FILE, MARK_FILE].map(str::as_bytes).contains(&name.as_bytes()) {
                beneath::remove(&self.root, &name)?;
            }
        }
        Ok(())
    }

    /// Removes the marker file, the lock file (which is locked by this process) and the directory, unless the next run has started in it.
    ///
    /// The lock file is removed last, so that no other run can start earlier.
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

/// Opens a directory of the base. Creates it if it does not exist.
fn open_or_make(base: &OwnedFd, name: &str) -> Result<OwnedFd, Errno> {
    let opened = beneath::directory_in(base, name.as_bytes());
    if opened.as_ref().err() != Some(&Errno::NOENT) {
        return opened;
    }
    match mkdirat(base, name, DIRECTORY) {
        // The umask may have removed owner permissions that the next step needs.
        Ok(()) => chmodat(base, name, DIRECTORY, AtFlags::empty())?,
        Err(Errno::EXIST) => {}
        Err(error) => return Err(error),
    }
    beneath::directory_in(base, name.as_bytes())
}

/// Returns true if a directory has the marker file of a deployment.
pub(crate) fn is_marked(directory: impl AsFd, namespace: &Namespace) -> bool {
    let expected = mark_of(namespace);
    let most = expected.len() as u64 + 1;
    beneath::read_in(directory, MARK_FILE, most).is_ok_and(|content| content == expected.as_bytes())
}

fn mark_of(namespace: &Namespace) -> String {
    let name = namespace.name();
    format!("This directory is that of the deployment {name} of parallax, which removes it.\n")
}

/// Opens the parent directory of all deployments; `None` if it does not exist.
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
            owner: files::user(found.st_uid),
            mode: found.st_mode & 0o7777,
        });
    }
    Ok(Some(base))
}

/// Opens the parent directory of all deployments. Creates it if it does not exist.
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
        // As above, the umask may have removed owner permissions.
        chmodat(rustix::fs::CWD, path, DIRECTORY, AtFlags::empty()).map_err(failed(path))?;
    }
}

/// Returns the error for a directory that could not be opened. It names what the path is instead, or the owner.
fn unopened(path: &Path, error: Errno) -> PrivacyError {
    let owner = fs::symlink_metadata(path).map(|data| std::os::unix::fs::MetadataExt::uid(&data));
    match (owner, error) {
        (Ok(owner), Errno::NOTDIR | Errno::LOOP) => match fs::read_link(path) {
            Ok(target) => PrivacyError::Link {
                path: path.to_owned(),
                owner: files::user(owner),
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

/// Checks that no shared memory file with the prefix of a deployment belongs to another user, and denies others access to these files.
/// iceoryx2 leaves its management file writable for all users.
pub(crate) fn shared_memory(namespace: &Namespace) -> Result<(), PrivacyError> {
    each_segment(namespace, |memory, name, found| {
        let is_file = FileType::from_raw_mode(found.st_mode) == FileType::RegularFile;
        if is_file && found.st_mode & OTHERS != 0 {
            // This is safe because the file belongs to this user, and only this user may replace it in `/dev/shm`.
            return chmodat(memory, name, FILE, AtFlags::empty());
        }
        Ok(())
    })
}

/// Removes the shared memory files with the prefix of a deployment. Other kinds of entries are kept.
pub(crate) fn remove_shared_memory(namespace: &Namespace) -> Result<(), PrivacyError> {
    each_segment(namespace, |memory, name, found| {
        if FileType::from_raw_mode(found.st_mode) == FileType::RegularFile {
            return unlinkat(memory, name, AtFlags::empty());
        }
        Ok(())
    })
}

/// Calls `act` for every shared memory file with the prefix of a deployment. All must belong to this user.
fn each_segment(
    namespace: &Namespace,
    act: impl Fn(&OwnedFd, &std::ffi::CStr, &Stat) -> Result<(), Errno>,
) -> Result<(), PrivacyError> {
    let directory = Path::new(SHARED_MEMORY);
    // `/dev/shm` belongs to the system and may be a symbolic link.
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
        let done = match beneath::stat_in(&memory, &name) {
            Ok(stat) if stat.st_uid != getuid().as_raw() => {
                return Err(foreign(&path, stat.st_uid));
            }
            Ok(stat) => act(&memory, &name, &stat),
            Err(error) => Err(error),
        };
        match done {
            // `NOENT` means that another process, which has ended, removed the file.
            Ok(()) | Err(Errno::NOENT) => {}
            Err(error) => return Err(failed(&path)(error)),
        }
    }
    Ok(())
}

/// Denies others access to a directory.
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
        owner: files::user(owner),
        user: files::user(getuid().as_raw()),
    }
}
