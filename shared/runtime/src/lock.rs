//! The lock of a deployment. It ensures that only one run is possible at a time, and that each run starts and ends without leftover files.

use core::time::Duration;
use std::fs::{self, File};
use std::io::{self, Read as _, Seek as _, Write as _};
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};
use std::thread::sleep;
use std::time::Instant;

use iceoryx2::config::Config;
use iceoryx2::node::NodeView as _;
use iceoryx2::prelude::{CallbackProgression, Node, NodeState, ipc};
use rustix::fs::{FlockOperation, flock, renameat};
use rustix::io::Errno;

use crate::bus::prepare;
use crate::namespace::DESCRIPTION_FILE;
use crate::private::{self, LOCK_FILE, Root};
use crate::{BusError, Namespace, beneath};
use failure::{ExitKind, Fault};

/// Name of the process that holds the lock of a deployment. The process opens its [`Bus`](crate::Bus) with this name.
pub const SUPERVISOR: &str = "supervisor";
/// Name of the file that tells observers that the deployment is ending.
pub(crate) const ENDING_FILE: &str = "ending";
/// Name of the description while it is being written.
const UNFINISHED_FILE: &str = "deployment.json.new";
/// Time within which observers have to disconnect.
const OBSERVER_LIMIT: Duration = Duration::from_secs(1);
/// Time within which the processes of a killed supervisor have to end.
const DYING_LIMIT: Duration = Duration::from_secs(3);
const DYING_PAUSE: Duration = Duration::from_millis(20);

/// Reason why the deployment cannot be locked.
#[derive(Debug, thiserror::Error)]
pub enum LockError {
    /// Another supervisor runs the deployment.
    #[error("deployment {name:?} is already running (process {pid})")]
    AlreadyRunning {
        /// Name of the deployment.
        name: String,
        /// Process id of the supervisor.
        pid: String,
    },
    /// The supervisor of the deployment is dead, but some of its processes are still alive.
    #[error("processes of an earlier run of deployment {name:?} still exist: {processes}")]
    StillAlive {
        /// Name of the deployment.
        name: String,
        /// Names and process ids of the living processes.
        processes: String,
    },
    /// A file cannot be created, locked or removed.
    #[error("cannot use {path:?}")]
    File {
        /// The file or directory.
        path: PathBuf,
        /// Cause of the error.
        #[source]
        source: io::Error,
    },
    /// The directory cannot be prepared for iceoryx2.
    #[error(transparent)]
    Bus(#[from] BusError),
}

impl Fault for LockError {
    fn kind(&self) -> ExitKind {
        ExitKind::Run
    }

    fn hint(&self) -> Option<String> {
        match self {
            Self::AlreadyRunning { .. } => {
                Some("stop it, or run this one under another name with `--set name=...`".to_owned())
            }
            Self::StillAlive { .. } => Some("end them with kill -9".to_owned()),
            Self::Bus(error) => error.hint(),
            Self::File { .. } => None,
        }
    }
}

/// The lock of a deployment. Dropping it removes all files of the deployment from its directory and from
/// `/dev/shm`, unless one of its processes is still alive.
#[derive(Debug)]
pub struct DeploymentLock {
    namespace: Namespace,
    config: Config,
    root: Root,
    _file: Locked,
}

impl Namespace {
    /// Locks this deployment, and removes the files that a killed run left behind.
    ///
    /// # Errors
    ///
    /// Returns a [`LockError`] on failure.
    pub fn acquire(&self) -> Result<DeploymentLock, LockError> {
        let (root, file) = lock_file(self)?;
        // The previous run may have removed its marker file in the meantime.
        root.mark(self).map_err(BusError::from)?;
        private::shared_memory(self).map_err(BusError::from)?;
        let config = self.config().map_err(BusError::from)?;
        let begin = Instant::now();
        loop {
            let alive = alive(&config);
            if alive.is_empty() {
                break;
            }
            if begin.elapsed() > DYING_LIMIT {
                return Err(LockError::StillAlive {
                    name: self.name().to_owned(),
                    processes: alive.join(", "),
                });
            }
            sleep(DYING_PAUSE);
        }
        wipe(self, &root)?;
        prepare(self)?;
        Ok(DeploymentLock {
            namespace: self.clone(),
            config,
            root,
            _file: file,
        })
    }
}

impl DeploymentLock {
    /// Returns the namespace of the deployment.
    pub fn namespace(&self) -> &Namespace {
        &self.namespace
    }

    /// Writes the description of the deployment, which other programs of this user can read while it runs
    /// ([`Namespace::description`]). A reader always finds the complete description, and all topics if they were created before it.
    ///
    /// # Errors
    ///
    /// Returns [`LockError::File`] on failure.
    pub fn describe(&self, text: &[u8]) -> Result<(), LockError> {
        let failed = |source: io::Error| LockError::File {
            path: self.namespace.root().join(DESCRIPTION_FILE),
            source,
        };
        let file = beneath::file_in(&self.root, UNFINISHED_FILE);
        let mut file = file.map_err(|error| failed(error.into()))?;
        file.set_len(0).map_err(failed)?;
        file.write_all(text).map_err(failed)?;
        renameat(&self.root, UNFINISHED_FILE, &self.root, DESCRIPTION_FILE)
            .map_err(|error| failed(error.into()))
    }

    /// Waits until the observers have disconnected. Returns at once if there is no observer.
    fn wait_for_observers_to_leave(&self) {
        if alive(&self.config).is_empty() {
            return;
        }
        if let Err(error) = fs::write(self.namespace.root().join(ENDING_FILE), "") {
            tracing::debug!(%error, "cannot ask observers to leave");
        }
        let begin = Instant::now();
        while !alive(&self.config).is_empty() && begin.elapsed() < OBSERVER_LIMIT {
            sleep(DYING_PAUSE);
        }
    }
}

impl Drop for DeploymentLock {
    fn drop(&mut self) {
        self.wait_for_observers_to_leave();
        let alive = alive(&self.config);
        if !alive.is_empty() {
            tracing::warn!(?alive, "processes are still alive, so their files are kept");
            return;
        }
        let root = &self.root;
        let removed = wipe(&self.namespace, root)
            .and_then(|()| root.remove(&self.namespace).map_err(unusable(&self.namespace)));
        if let Err(error) = removed {
            tracing::warn!(%error, "cannot remove the files of the deployment");
        }
    }
}

/// A locked file, which is unlocked when this value is dropped. Closing the file is not enough: a child process that another thread
/// has just forked holds the same lock until it runs its program.
#[derive(Debug)]
struct Locked(File);

impl Drop for Locked {
    fn drop(&mut self) {
        if let Err(error) = flock(&self.0, FlockOperation::Unlock) {
            tracing::debug!(%error, "cannot unlock the lock file");
        }
    }
}

/// Opens and locks the lock file, which another run may remove at the same time.
fn lock_file(namespace: &Namespace) -> Result<(Root, Locked), LockError> {
    let path = namespace.root().join(LOCK_FILE);
    let failed = |source: io::Error| LockError::File {
        path: path.clone(),
        source,
    };
    loop {
        let root = Root::open(namespace).map_err(BusError::from)?;
        let mut file = match beneath::file_in(&root, LOCK_FILE) {
            Err(Errno::NOENT) => continue,
            opened => opened.map_err(|error| failed(error.into()))?,
        };
        let mut locked = match flock(&file, FlockOperation::NonBlockingLockExclusive) {
            Ok(()) => Locked(file),
            Err(Errno::WOULDBLOCK) => {
                let mut pid = String::new();
                file.read_to_string(&mut pid).map_err(failed)?;
                return Err(LockError::AlreadyRunning {
                    name: namespace.name().to_owned(),
                    pid,
                });
            }
            Err(error) => return Err(failed(error.into())),
        };
        let file = &mut locked.0;
        let own = file.metadata().map_err(failed)?.ino();
        if beneath::stat_in(&root, c"lock").is_ok_and(|stat| stat.st_ino == own) {
            file.set_len(0).map_err(failed)?;
            file.rewind().map_err(failed)?;
            write!(file, "{}", std::process::id()).map_err(failed)?;
            return Ok((root, locked));
        }
    }
}

/// Returns the names and process ids of the processes that are registered and alive.
pub(crate) fn alive(config: &Config) -> Vec<String> {
    let text = |node: Option<(String, u32)>| match node {
        Some((name, pid)) => format!("{name} ({pid})"),
        None => "a process that is starting".to_owned(),
    };
    living(config).into_iter().map(text).collect()
}

/// Returns the name and process id of each living process; `None` for a process that has not written its name yet.
pub(crate) fn living(config: &Config) -> Vec<Option<(String, u32)>> {
    let mut living = Vec::new();
    let listed = Node::<ipc::Service>::list(config, |state| {
        if let NodeState::Alive(node) = state {
            living.push(node.details().as_ref().map(|details| {
                (
                    details.name().to_string(),
                    details.process_id().value() as u32,
                )
            }));
        }
        CallbackProgression::Continue
    });
    if let Err(error) = listed {
        tracing::debug!(?error, "cannot list the processes of the deployment");
    }
    living
}

/// Removes everything except the lock file and the marker file. No process of the deployment may be alive.
fn wipe(namespace: &Namespace, root: &Root) -> Result<(), LockError> {
    root.empty().map_err(unusable(namespace))?;
    private::remove_shared_memory(namespace).map_err(BusError::from)?;
    Ok(())
}

fn unusable(namespace: &Namespace) -> impl FnOnce(io::Error) -> LockError {
    let path = namespace.root().to_owned();
    move |source| LockError::File { path, source }
}

pub(crate) fn entries(directory: &Path) -> Result<Vec<PathBuf>, LockError> {
    let failed = |source| LockError::File {
        path: directory.to_owned(),
        source,
    };
    let mut paths = Vec::new();
    for entry in fs::read_dir(directory).map_err(failed)? {
        paths.push(entry.map_err(failed)?.path());
    }
    Ok(paths)
}
