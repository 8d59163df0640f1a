//! One user owns a deployment: its directory is nobody else's, and shut.

use std::fs::{self, DirBuilder, Permissions};
use std::io;
use std::os::unix::fs::{DirBuilderExt as _, MetadataExt as _, PermissionsExt as _};
use std::path::{Path, PathBuf};

use rustix::process::getuid;

use crate::Namespace;
use crate::lock::SHARED_MEMORY;

/// A directory that its owner may enter, and nobody else.
const DIRECTORY: u32 = 0o700;
/// A file that its owner may read and write, and nobody else.
const FILE: u32 = 0o600;
/// What nobody else may do.
const OTHERS: u32 = 0o077;

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
    /// It is not a directory.
    #[error("{path:?} is not a directory")]
    NoDirectory {
        /// What is there.
        path: PathBuf,
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
            Self::NoDirectory { path } => Some(format!("remove it: `rm {}`", path.display())),
            Self::File { .. } => None,
        }
    }
}

/// Makes the directory of a deployment if it is not there, and checks that it is this user's and nobody
/// else may enter it. Whatever the umask is, its mode is 0700 afterwards.
///
/// The directory above it must be this user's or the system's.
pub(crate) fn directory(namespace: &Namespace) -> Result<(), PrivacyError> {
    let (base, root) = (namespace.base(), namespace.root());
    for path in [base, root] {
        let mut builder = DirBuilder::new();
        builder.recursive(path == base).mode(DIRECTORY);
        if !path.exists() {
            match builder.create(path) {
                // The umask may have taken from the owner what he needs in the next step.
                Ok(()) => shut(path, DIRECTORY)?,
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                // Another user's directory refuses that too, and is a better reason.
                Err(source) => {
                    owned(base, true)?;
                    return Err(failed(path)(source));
                }
            }
        }
        owned(path, path == base)?;
    }
    shut(root, DIRECTORY)
}

/// Checks that nothing in shared memory that carries the name of a deployment is another user's, and
/// takes from others what the transport leaves them: its management file, which anybody may write.
pub(crate) fn shared_memory(namespace: &Namespace) -> Result<(), PrivacyError> {
    let directory = Path::new(SHARED_MEMORY);
    for entry in fs::read_dir(directory).map_err(failed(directory))? {
        let entry = entry.map_err(failed(directory))?;
        let name = entry.file_name();
        let is_ours = name
            .to_str()
            .is_some_and(|it| it.starts_with(namespace.prefix()));
        if !is_ours {
            continue;
        }
        let path = entry.path();
        match fs::symlink_metadata(&path) {
            Ok(it) if it.uid() != getuid().as_raw() => return Err(foreign(&path, it.uid())),
            Ok(it) if it.is_file() && it.mode() & OTHERS != 0 => shut(&path, FILE)?,
            Ok(_) => {}
            // It was another process's, which has ended.
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            Err(source) => return Err(failed(&path)(source)),
        }
    }
    Ok(())
}

/// * `or_the_system`: whether it may be root's.
fn owned(path: &Path, or_the_system: bool) -> Result<(), PrivacyError> {
    let metadata = if or_the_system {
        fs::metadata(path)
    } else {
        fs::symlink_metadata(path)
    };
    let metadata = match metadata {
        // Another run has ended in between; whoever opens a file in it will notice.
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        metadata => metadata.map_err(failed(path))?,
    };
    let uid = metadata.uid();
    if uid != getuid().as_raw() && !(or_the_system && uid == 0) {
        return Err(foreign(path, uid));
    }
    if !metadata.is_dir() {
        return Err(PrivacyError::NoDirectory {
            path: path.to_owned(),
        });
    }
    Ok(())
}

fn shut(path: &Path, mode: u32) -> Result<(), PrivacyError> {
    match fs::set_permissions(path, Permissions::from_mode(mode)) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        result => result.map_err(failed(path)),
    }
}

fn failed(path: &Path) -> impl FnOnce(io::Error) -> PrivacyError {
    move |source| PrivacyError::File {
        path: path.to_owned(),
        source,
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
