//! Location of a deployment's shared memory and files. Different deployments have different locations.

use std::io;
use std::path::{Path, PathBuf};

use iceoryx2::config::Config;
use iceoryx2::prelude::{FileName, Path as IoxPath, SemanticString as _};

use failure::{ExitKind, Fault};

/// Length of the longest file name that iceoryx2 creates in the root directory: `/`, 39 digits, `.event`.
const SOCKET_NAME_LEN: usize = 1 + 39 + 6;
/// Bytes of `sun_path` without the closing NUL (unix(7)).
const SOCKET_PATH_MAX: usize = 107;
/// Characters of a prefix: `px`, eight hexadecimal digits, `_`.
const PREFIX_LEN: usize = 11;
/// Maximum length of the root directory's path, in bytes.
pub(crate) const ROOT_LEN_MAX: usize = SOCKET_PATH_MAX - SOCKET_NAME_LEN - PREFIX_LEN;
const NAME_LEN_MAX: usize = 32;
/// File with the description of a running deployment.
pub(crate) const DESCRIPTION_FILE: &str = "deployment.json";

/// Reason why a deployment name or a directory cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NamespaceError {
    /// The name is not usable as a directory name.
    #[error(
        "deployment name {name:?} must be 1 to 32 characters of a-z, A-Z, 0-9, '-', '_', '.' and not begin with '.'"
    )]
    Name {
        /// The requested name.
        name: String,
    },
    /// The path is too long for Unix sockets.
    #[error("working directory {root:?} has {len} bytes, but sockets below it allow only {max}")]
    RootTooLong {
        /// The directory.
        root: PathBuf,
        /// Length of its path, in bytes.
        len: usize,
        /// Maximum length, in bytes.
        max: usize,
    },
    /// The path is not absolute, or contains characters that iceoryx2 does not accept in a path.
    #[error("working directory {root:?} must be an absolute path of plain characters")]
    Root {
        /// The directory.
        root: PathBuf,
    },
}

impl Fault for NamespaceError {
    fn kind(&self) -> ExitKind {
        ExitKind::Config
    }
}

/// The name of a deployment, with the directory and the prefix that separate it from other deployments.
///
/// Files are in `root`, and shared memory is under `/dev/shm/<prefix>*`. Both depend only on the user, the name and the directory. Every
/// process of a deployment therefore computes the same locations, and the next run finds the files that a killed run left behind. Creating
/// a `Namespace` creates no file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Namespace {
    name: String,
    prefix: String,
    root: PathBuf,
    base: PathBuf,
}

impl Namespace {
    /// Returns the namespace of `deployment` in `/dev/shm/px-<user id>`.
    ///
    /// A port creates several small files, which takes 10 ms on a disk and very little time in memory.
    ///
    /// # Errors
    ///
    /// Returns a [`NamespaceError`] on failure.
    pub fn new(deployment: &str) -> Result<Self, NamespaceError> {
        Self::below(deployment, &Self::usual_base())
    }

    /// Returns the directory below which [`Self::new`] puts the deployments of this user.
    pub fn usual_base() -> PathBuf {
        let user = rustix::process::getuid().as_raw();
        Path::new("/dev/shm").join(format!("px-{user}"))
    }

    /// Returns the namespace of `deployment` below a directory of the caller's choice.
    ///
    /// * `base`: an absolute and short path. The root is `base/deployment` and has at most 50 bytes.
    ///
    /// # Errors
    ///
    /// Returns a [`NamespaceError`] on failure.
    pub fn below(deployment: &str, base: &Path) -> Result<Self, NamespaceError> {
        let fits = (1..=NAME_LEN_MAX).contains(&deployment.len())
            && !deployment.starts_with('.')
            && deployment
                .bytes()
                .all(|byte| byte.is_ascii_alphanumeric() || b"-_.".contains(&byte));
        if !fits {
            return Err(NamespaceError::Name {
                name: deployment.to_owned(),
            });
        }
        let root = base.join(deployment);
        let len = root.as_os_str().len();
        if len > ROOT_LEN_MAX {
            return Err(NamespaceError::RootTooLong {
                root,
                len,
                max: ROOT_LEN_MAX,
            });
        }
        let Some(text) = root.to_str().filter(|_| root.is_absolute()) else {
            return Err(NamespaceError::Root { root });
        };
        let plain =
            text.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"-_./".contains(&byte));
        if !plain {
            return Err(NamespaceError::Root { root });
        }
        let user = rustix::process::getuid().as_raw();
        Ok(Self {
            name: deployment.to_owned(),
            prefix: format!("px{:08x}_", fingerprint(user, text)),
            root,
            base: base.to_owned(),
        })
    }

    /// Returns the name of the deployment.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the prefix of all files of the deployment in `/dev/shm`.
    pub fn prefix(&self) -> &str {
        &self.prefix
    }

    /// Returns the directory of the deployment's sockets, service descriptions and lock.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// Returns the parent directory of the root.
    pub fn base(&self) -> &Path {
        &self.base
    }

    /// Returns the configuration file for iceoryx2, which its command line tools also use when run in the root.
    pub fn config_file(&self) -> PathBuf {
        self.root.join("config").join("iceoryx2.toml")
    }

    /// Returns the description that the deployment publishes while it runs ([`crate::DeploymentLock::describe`]). If the deployment is
    /// starting, use [`wait_for_description`](crate::wait_for_description).
    ///
    /// # Errors
    ///
    /// Fails if the deployment does not run, or if the file cannot be read.
    pub fn description(&self) -> io::Result<String> {
        std::fs::read_to_string(self.root.join(DESCRIPTION_FILE))
    }

    /// Returns the content of [`config_file`](Self::config_file).
    pub(crate) fn config_text(&self) -> String {
        format!(
            "[global]\nroot-path = \"{}\"\nprefix = \"{}\"\n",
            self.root.display(),
            self.prefix
        )
    }

    /// Returns the configuration of iceoryx2.
    ///
    /// # Errors
    ///
    /// Returns [`NamespaceError::Root`] if iceoryx2 rejects the path.
    pub(crate) fn config(&self) -> Result<Config, NamespaceError> {
        let refused = || NamespaceError::Root {
            root: self.root.clone(),
        };
        let mut config = Config::default();
        config.global.prefix = FileName::new(self.prefix.as_bytes()).ok().ok_or_else(refused)?;
        let root = IoxPath::new(self.root.as_os_str().as_encoded_bytes())
            .ok()
            .ok_or_else(refused)?;
        config.global.set_root_path(&root);
        // Only the supervisor cleans up after dead processes ([`crate::Cleaner`]).
        config.global.service.cleanup_dead_nodes_on_open = false;
        config.global.node.cleanup_dead_nodes_on_creation = false;
        config.global.node.cleanup_dead_nodes_on_destruction = false;
        Ok(config)
    }
}

/// Returns the FNV-1a hash of the user and the root, folded to 32 bits.
fn fingerprint(user: u32, root: &str) -> u32 {
    let hash = formats::checksum::fnv1a_of(user.to_le_bytes().into_iter().chain(root.bytes()));
    (hash ^ (hash >> 32)) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn starting_or_ending_processes_do_not_clean_up_dead_ones() {
        let config = Namespace::new("alone").unwrap().config().unwrap();
        let (node, service) = (&config.global.node, &config.global.service);
        assert!(!node.cleanup_dead_nodes_on_creation);
        assert!(!node.cleanup_dead_nodes_on_destruction);
        assert!(!service.cleanup_dead_nodes_on_open);
    }
}
