//! The deployments that are there: those that run, and what dead ones left behind.

use std::fs::{self, Metadata};
use std::io;
use std::os::unix::fs::MetadataExt as _;
use std::path::Path;

use rustix::fs::{major, minor};
use rustix::io::Errno;

use crate::lock::{LOCK_FILE, SHARED_MEMORY, alive, entries};
use crate::{BusError, LockError, Namespace, beneath, private};

/// A deployment that runs, or that has left something behind.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Remains {
    /// Where it lives.
    pub namespace: Namespace,
    /// Whether its directory says that it is a deployment's. What does not is never removed.
    pub is_marked: bool,
    /// The process that runs it; none if it is dead.
    pub supervisor: Option<u32>,
    /// Names and process ids of its processes.
    pub processes: Vec<String>,
    /// Its files, those in shared memory included.
    pub n_files: u64,
    /// The memory they take, bytes.
    pub bytes: u64,
}

impl Remains {
    /// Removes what a dead deployment left behind.
    ///
    /// # Errors
    ///
    /// [`LockError::AlreadyRunning`] if it is not dead, [`LockError::StillAlive`] if only its
    /// supervisor is.
    pub fn remove(&self) -> Result<(), LockError> {
        self.namespace.acquire().map(drop)
    }
}

/// The deployments below a directory, by name. Nothing is touched.
///
/// * `base`: as given to [`Namespace::below`]; that of [`Namespace::new`] is
///   [`Namespace::usual_base`].
///
/// # Errors
///
/// [`LockError::File`], [`LockError::Bus`].
pub fn deployments(base: &Path) -> Result<Vec<Remains>, LockError> {
    let Some(opened) = private::open_base(base).map_err(BusError::from)? else {
        return Ok(Vec::new());
    };
    let locks = fs::read_to_string("/proc/locks").unwrap_or_default();
    let mut found = Vec::new();
    let unreadable = |error: Errno| LockError::File {
        path: base.to_owned(),
        source: error.into(),
    };
    for name in beneath::names(&opened).map_err(unreadable)? {
        // What has another kind of name is nobody's deployment.
        let namespace = name.to_str().ok();
        let namespace = namespace.and_then(|it| Namespace::below(it, base).ok());
        // Nor is a link to a directory.
        let directory = beneath::directory_in(&opened, name.as_bytes());
        if let Some((namespace, directory)) = namespace.zip(directory.ok()) {
            let is_marked = private::is_marked(&directory, &namespace);
            found.push(look_at(namespace, is_marked, &locks)?);
        }
    }
    found.sort_by(|a, b| a.namespace.name().cmp(b.namespace.name()));
    Ok(found)
}

fn look_at(namespace: Namespace, is_marked: bool, locks: &str) -> Result<Remains, LockError> {
    let config = namespace.config().map_err(BusError::from)?;
    let mut size = (0, 0);
    measure(namespace.root(), &mut size);
    for path in entries(Path::new(SHARED_MEMORY))? {
        let name = path.file_name().and_then(|it| it.to_str());
        if name.is_some_and(|it| it.starts_with(namespace.prefix())) {
            measure(&path, &mut size);
        }
    }
    Ok(Remains {
        supervisor: supervisor(&namespace.root().join(LOCK_FILE), locks),
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

/// Who holds a lock file, from the kernel's list of locks: trying to lock it could be in the way of
/// a deployment that is about to begin.
pub(crate) fn supervisor(file: &Path, locks: &str) -> Option<u32> {
    let metadata = fs::metadata(file).ok()?;
    locks.lines().find_map(|line| holder(line, &metadata))
}

/// `1: FLOCK  ADVISORY  WRITE 1234 00:1a:42 0 EOF`.
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

/// Adds up files and bytes. What vanishes in between is not counted.
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
    fn who_runs_is_told_from_who_is_dead_and_only_the_dead_are_removed() {
        let base = base();
        let lives = Namespace::below("lives", base.path()).unwrap();
        let lock = lives.acquire().unwrap();
        // A killed supervisor leaves its lock file, and whatever else there is.
        let dead = base.path().join("dead");
        let marked = Namespace::below("dead", base.path()).unwrap();
        private::Root::open(&marked).unwrap();
        fs::write(dead.join(LOCK_FILE), "1").unwrap();
        fs::write(dead.join("capture-0.place"), vec![1; 5000]).unwrap();
        fs::write(base.path().join("a file"), "").unwrap();
        let found = deployments(base.path()).unwrap();
        let names: Vec<&str> = found.iter().map(|it| it.namespace.name()).collect();
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
    fn what_says_not_that_it_is_a_deployment_is_named_and_stays() {
        let base = base();
        let photos = base.path().join("photos");
        fs::create_dir(&photos).unwrap();
        fs::write(photos.join("one.jpg"), "x").unwrap();
        // The mark of another is none.
        let other = Namespace::below("other", base.path()).unwrap();
        private::Root::open(&other).unwrap();
        let mark = other.root().join("parallax-deployment");
        fs::copy(mark, photos.join("parallax-deployment")).unwrap();
        let found = deployments(base.path()).unwrap();
        let told = found.iter().map(|it| (it.namespace.name(), it.is_marked));
        let told: Vec<_> = told.collect();
        assert_eq!(told, [("other", true), ("photos", false)]);
        let error = found[1].remove().unwrap_err().to_string();
        assert!(
            error.contains("photos\" is no directory of a deployment"),
            "{error}"
        );
        assert!(photos.join("one.jpg").exists());
        found[0].remove().unwrap();
        assert!(!other.root().exists());
    }

    #[test]
    fn where_nothing_was_ever_run_there_is_nothing() {
        let base = base();
        assert_eq!(deployments(&base.path().join("none")).unwrap(), []);
    }

    #[test]
    fn other_kinds_of_lines_are_passed_over() {
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
