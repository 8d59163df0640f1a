//! Lists deployments: running deployments, and dead deployments that have left files behind.

use std::fs::{self, Metadata};
use std::io;
use std::os::unix::fs::MetadataExt as _;
use std::path::Path;

use rustix::fs::{major, minor};
use rustix::io::Errno;

use crate::lock::{SUPERVISOR, alive, entries, living};
use crate::memory::SHARED_MEMORY;
use crate::private::LOCK_FILE;
use crate::{BusError, LockError, Namespace, beneath, private};

/// A deployment that runs, or that has left files behind.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Remains {
    /// Location of the deployment.
    pub namespace: Namespace,
    /// True if the deployment's directory has the marker file. Other directories are never removed.
    pub is_marked: bool,
    /// Process id of the supervisor; `None` if the deployment is not running.
    pub supervisor: Option<u32>,
    /// Names and process ids of the deployment's processes.
    pub processes: Vec<String>,
    /// Number of files of the deployment, including shared memory.
    pub n_files: u64,
    /// Memory that the files take, in bytes.
    pub bytes: u64,
}

impl Remains {
    /// Removes the files that a dead deployment left behind.
    ///
    /// # Errors
    ///
    /// Returns [`LockError::AlreadyRunning`] if the deployment runs, or [`LockError::StillAlive`] if only its supervisor is dead.
    pub fn remove(&self) -> Result<(), LockError> {
        self.namespace.acquire().map(drop)
    }
}

/// Returns the deployments below a directory, sorted by name. Changes nothing.
///
/// * `base`: the directory, as for [`Namespace::below`]. [`Namespace::new`] uses [`Namespace::usual_base`].
///
/// # Errors
///
/// Returns [`LockError::File`] or [`LockError::Bus`].
pub fn deployments(base: &Path) -> Result<Vec<Remains>, LockError> {
    let Some(opened) = private::open_base(base).map_err(BusError::from)? else {
        return Ok(Vec::new());
    };
    let locks = all_locks();
    let mut found = Vec::new();
    let unreadable = |error: Errno| LockError::File {
        path: base.to_owned(),
        source: error.into(),
    };
    for name in beneath::names(&opened).map_err(unreadable)? {
        // Entries with names that are not valid for deployments are skipped.
        let namespace = name.to_str().ok();
        let namespace = namespace.and_then(|name| Namespace::below(name, base).ok());
        // A link to a directory is not a deployment either.
        let directory = beneath::directory_in(&opened, name.as_bytes());
        if let Some((namespace, directory)) = namespace.zip(directory.ok()) {
            let is_marked = private::is_marked(&directory, &namespace);
            found.push(inspect(namespace, is_marked, &locks)?);
        }
    }
    found.sort_by(|a, b| a.namespace.name().cmp(b.namespace.name()));
    Ok(found)
}

fn inspect(namespace: Namespace, is_marked: bool, locks: &str) -> Result<Remains, LockError> {
    let config = namespace.config().map_err(BusError::from)?;
    let mut size = (0, 0);
    measure(namespace.root(), &mut size);
    for path in entries(Path::new(SHARED_MEMORY))? {
        let name = path.file_name().and_then(|name| name.to_str());
        if name.is_some_and(|name| name.starts_with(namespace.prefix())) {
            measure(&path, &mut size);
        }
    }
    Ok(Remains {
        supervisor: supervisor(&namespace, locks),
        processes: if is_marked {
            alive(&config)
        } else {
            Vec::new()
        },
        is_marked,
        n_files: size.0,
        bytes: size.1,
        namespace,
    })
}

/// Returns three consecutive readings of the kernel's list of locks. The kernel delivers the list page by page. If other processes
/// lock and unlock files in the meantime, a reading may omit a line.
pub(crate) fn all_locks() -> String {
    let reading = |_| fs::read_to_string("/proc/locks").unwrap_or_default();
    (0..3).map(reading).collect()
}

/// Returns the process that runs a deployment: the holder of its lock file, according to the kernel's list of locks. Trying to lock
/// the file instead could disturb a deployment that is starting.
///
/// The list omits holders in other pid namespaces (containers). There, the function returns the living process with the
/// supervisor's name, with the process id that it has in its own namespace.
pub(crate) fn supervisor(namespace: &Namespace, locks: &str) -> Option<u32> {
    let metadata = fs::metadata(namespace.root().join(LOCK_FILE)).ok()?;
    let holder = locks.lines().find_map(|line| holder(line, &metadata));
    holder.or_else(|| elsewhere(namespace))
}

fn elsewhere(namespace: &Namespace) -> Option<u32> {
    let config = namespace.config().ok()?;
    let mut living = living(&config).into_iter().flatten();
    living.find_map(|(name, pid)| (name == SUPERVISOR).then_some(pid))
}

/// Parses a line such as `1: FLOCK  ADVISORY  WRITE 1234 00:1a:42 0 EOF`.
fn holder(line: &str, file: &Metadata) -> Option<u32> {
    let mut words = line.split_ascii_whitespace().skip(1);
    let kind = words.next()?;
    let pid = words.nth(2)?;
    let mut place = words.next()?.split(':');
    let mut hexadecimal = || u32::from_str_radix(place.next()?, 16).ok();
    let device = [hexadecimal()?, hexadecimal()?];
    let is_this = kind == "FLOCK"
        && device == [major(file.dev()), minor(file.dev())]
        && place.next()? == file.ino().to_string();
    is_this.then(|| pid.parse().ok())?
}

/// Adds up the number and the bytes of files. Files that vanish in the meantime are not counted.
fn measure(path: &Path, size: &mut (u64, u64)) {
    let metadata: io::Result<Metadata> = fs::symlink_metadata(path);
    let Ok(metadata) = metadata else { return };
    if !metadata.is_dir() {
        size.0 += 1;
        size.1 += metadata.blocks() * 512;
        return;
    }
    for entry in fs::read_dir(path).into_iter().flatten().flatten() {
        measure(&entry.path(), size);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn base() -> tempfile::TempDir {
        tempfile::Builder::new().prefix("px").tempdir().unwrap()
    }

    #[test]
    fn only_dead_deployments_are_removed() {
        let base = base();
        let lives = Namespace::below("lives", base.path()).unwrap();
        let lock = lives.acquire().unwrap();
        // A killed supervisor leaves its lock file and other files behind.
        let dead = base.path().join("dead");
        let marked = Namespace::below("dead", base.path()).unwrap();
        private::Root::open(&marked).unwrap();
        fs::write(dead.join(LOCK_FILE), "1").unwrap();
        fs::write(dead.join("capture-0.place"), vec![1; 5000]).unwrap();
        fs::write(base.path().join("a file"), "").unwrap();
        let found = deployments(base.path()).unwrap();
        let names: Vec<&str> = found.iter().map(|deployment| deployment.namespace.name()).collect();
        assert_eq!(names, ["dead", "lives"]);
        assert_eq!(found[0].supervisor, None);
        assert_eq!(found[0].n_files, 3);
        assert!(found[0].bytes >= 5000, "{}", found[0].bytes);
        assert_eq!(found[1].supervisor, Some(std::process::id()));
        found[0].remove().unwrap();
        assert!(!dead.exists());
        let refused = found[1].remove().unwrap_err();
        assert!(
            matches!(refused, LockError::AlreadyRunning { .. }),
            "{refused}"
        );
        drop(lock);
        assert_eq!(deployments(base.path()).unwrap(), []);
    }

    #[test]
    fn a_directory_without_a_marker_file_is_reported_and_kept() {
        let base = base();
        let photos = base.path().join("photos");
        fs::create_dir(&photos).unwrap();
        fs::write(photos.join("one.jpg"), "x").unwrap();
        // The marker of another deployment does not count.
        let other = Namespace::below("other", base.path()).unwrap();
        private::Root::open(&other).unwrap();
        let mark = other.root().join("parallax-deployment");
        fs::copy(mark, photos.join("parallax-deployment")).unwrap();
        let found = deployments(base.path()).unwrap();
        let names = found
            .iter()
            .map(|deployment| (deployment.namespace.name(), deployment.is_marked));
        let names: Vec<_> = names.collect();
        assert_eq!(names, [("other", true), ("photos", false)]);
        let error = found[1].remove().unwrap_err().to_string();
        assert!(
            error.contains("photos\" is not the directory of a deployment"),
            "{error}"
        );
        assert!(photos.join("one.jpg").exists());
        found[0].remove().unwrap();
        assert!(!other.root().exists());
    }

    #[test]
    fn a_missing_directory_has_no_deployments() {
        let base = base();
        assert_eq!(deployments(&base.path().join("none")).unwrap(), []);
    }

    #[test]
    fn malformed_lines_and_locks_of_other_files_are_ignored() {
        let file = fs::metadata("/proc/self/maps").unwrap();
        for line in [
            "",
            "1:",
            "1: FLOCK ADVISORY WRITE 7",
            "1: POSIX ADVISORY WRITE 7 zz:1:2 0 EOF",
        ] {
            assert_eq!(holder(line, &file), None, "{line}");
        }
    }
}
