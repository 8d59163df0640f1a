//! A deployment belongs to one user, regardless of the umask and of files that other users have left.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]
#![expect(clippy::print_stderr, reason = "a test reports what it skips")]

mod common;

use std::fs::{self, Permissions};
use std::os::unix::fs::{MetadataExt as _, PermissionsExt as _, chown, lchown, symlink};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use common::{Deployment, namespace};
use failure::{Fault as _, Stop};
use messages::{FrameHeader, Sightings};
use runtime::{Bus, BusError, Delivery, Limits, LockError, Namespace, PrivacyError, TopicPlan};
use rustix::fs::Mode;
use rustix::process::{getuid, umask};

/// A user that is neither root nor the user who runs the tests.
const OTHER: u32 = 65_534;

fn is_root() -> bool {
    getuid().is_root()
}

/// Finds a path, and all files and directories below it.
fn below(path: &Path, found: &mut Vec<PathBuf>) {
    found.push(path.to_owned());
    for entry in fs::read_dir(path).into_iter().flatten() {
        below(&entry.unwrap().path(), found);
    }
}

/// Returns the files of a running deployment, including shared memory.
fn all_files(deployment: &Deployment) -> Vec<PathBuf> {
    let mut files = Vec::new();
    below(deployment.namespace().root(), &mut files);
    let memory = common::shared_memory(deployment.namespace()).into_iter();
    files.extend(memory.map(|memory| Path::new("/dev/shm").join(memory)));
    files
}

/// Creates a deployment with ports open on a topic of each kind, and calls `use_it` with it.
fn with_ports(use_it: impl FnOnce(&Deployment)) {
    let limits = Limits::new(1, 1, 1);
    let deployment = Deployment::new(&[
        TopicPlan::messages::<Sightings>("pose".to_owned(), Delivery::Lossless, limits),
        TopicPlan::slices::<u8, FrameHeader>("frame".to_owned(), Delivery::Realtime, limits, 99),
    ]);
    let bus = deployment.bus("one");
    let mut waiter = bus.waiter();
    let poses = bus.subscriber::<Sightings>("pose", &mut waiter).unwrap();
    let frames = bus.slice_subscriber::<u8, FrameHeader>("frame", &mut waiter);
    let to_poses = bus.publisher::<Sightings>("pose").unwrap();
    let to_frames = bus.slice_publisher::<u8, FrameHeader>("frame").unwrap();
    to_poses.send(&Sightings::default()).unwrap();
    to_frames.loan(9).unwrap().send().unwrap();
    use_it(&deployment);
    drop((poses, frames, to_poses, to_frames));
}

#[test]
fn files_are_private_for_every_umask() {
    umask(Mode::empty());
    with_ports(|deployment| {
        let root = deployment.namespace().root();
        assert_eq!(fs::metadata(root).unwrap().mode() & 0o7777, 0o700);
        let lock = fs::metadata(root.join("lock")).unwrap();
        assert_eq!(lock.mode() & 0o7777, 0o600);
        let memory = common::shared_memory(deployment.namespace());
        assert!(memory.len() > 4, "{memory:?}");
        for name in memory {
            let file = fs::metadata(Path::new("/dev/shm").join(&name)).unwrap();
            assert_eq!(file.mode() & 0o077, 0, "{name} is open to others");
            assert_eq!(file.uid(), getuid().as_raw(), "{name}");
        }
    });
}

#[test]
fn another_user_cannot_open_any_file() {
    umask(Mode::empty());
    if !is_root() {
        eprintln!("not root: access by another user is checked by modes only, in the test above");
        return;
    }
    with_ports(|deployment| {
        let files = all_files(deployment);
        assert!(files.len() > 10, "{files:?}");
        for file in files {
            let opened = Command::new("setpriv")
                .args(["--reuid=65534", "--regid=65534", "--clear-groups"])
                .args(["head", "-c1"])
                .arg(&file)
                .stdout(Stdio::null())
                .stderr(Stdio::null())
                .status();
            assert!(!opened.unwrap().success(), "{} is open", file.display());
        }
    });
}

#[test]
fn an_open_directory_is_closed_to_others() {
    let base = tempfile::tempdir_in("/dev/shm").unwrap();
    let namespace = namespace(base.path());
    fs::create_dir(namespace.root()).unwrap();
    fs::set_permissions(namespace.root(), Permissions::from_mode(0o777)).unwrap();
    let lock = namespace.acquire().unwrap();
    let mode = fs::metadata(namespace.root()).unwrap().mode();
    assert_eq!(mode & 0o7777, 0o700);
    drop(lock);
}

/// Checks that the error names the path and its owner.
fn assert_foreign(error: &BusError, path: &Path, owner: u32) {
    let text = error.to_string();
    let named = match error {
        BusError::Privacy(PrivacyError::Foreign { path, .. }) => Some(path.as_path()),
        _ => None,
    };
    assert_eq!(named, Some(path), "{error}");
    assert!(text.contains(&owner.to_string()), "{text}");
    let hint = error.hint().unwrap();
    assert!(
        hint.contains(&format!("rm -r {}", path.display())),
        "{hint}"
    );
}

#[test]
fn the_directory_of_another_user_is_refused_with_the_owner() {
    let base = tempfile::tempdir_in("/dev/shm").unwrap();
    let (namespace, owner) = if is_root() {
        let namespace = namespace(base.path());
        fs::create_dir(namespace.root()).unwrap();
        chown(namespace.root(), Some(OTHER), None).unwrap();
        (namespace, OTHER)
    } else {
        (Namespace::below("usr", Path::new("/")).unwrap(), 0)
    };
    let Err(LockError::Bus(error)) = namespace.acquire() else {
        panic!("it is another user's");
    };
    assert_foreign(&error, namespace.root(), owner);
    let error = Bus::open(&namespace, "one", &Stop::new().unwrap()).unwrap_err();
    assert_foreign(&error, namespace.root(), owner);
}

#[test]
fn files_of_another_user_at_the_paths_of_a_deployment_are_named() {
    if !is_root() {
        eprintln!("not root: no file can be given to another user");
        return;
    }
    let base = tempfile::tempdir_in("/dev/shm").unwrap();
    // Another user owns the parent directory of this user's deployments.
    chown(base.path(), Some(OTHER), None).unwrap();
    let own = namespace(base.path());
    let Err(LockError::Bus(error)) = own.acquire() else {
        panic!("it is below another user's");
    };
    assert_foreign(&error, base.path(), OTHER);
    // Another user owns a file with the name of the deployment's shared memory.
    chown(base.path(), Some(0), None).unwrap();
    let leftover = PathBuf::from(format!("/dev/shm/{}7.data", own.prefix()));
    fs::write(&leftover, "x").unwrap();
    chown(&leftover, Some(OTHER), None).unwrap();
    let Err(LockError::Bus(error)) = own.acquire() else {
        panic!("it is another user's");
    };
    assert_foreign(&error, &leftover, OTHER);
    assert!(leftover.exists(), "it is not ours to remove");
    fs::remove_file(&leftover).unwrap();
    drop(own.acquire().unwrap());
}

#[test]
fn a_file_instead_of_the_directory_is_named() {
    let base = tempfile::tempdir_in("/dev/shm").unwrap();
    let namespace = namespace(base.path());
    fs::write(namespace.root(), "x").unwrap();
    let error = namespace.acquire().unwrap_err();
    assert!(error.to_string().contains("is not a directory"), "{error}");
    // A symbolic link is not followed either.
    fs::remove_file(namespace.root()).unwrap();
    symlink(base.path(), namespace.root()).unwrap();
    let error = namespace.acquire().unwrap_err();
    assert!(error.to_string().contains("and not a directory"), "{error}");
}

/// Creates a home directory with folders. One of them has the name of a deployment and looks like its leftover files.
fn home(base: &Path, name: &str) -> PathBuf {
    let home = base.join("home");
    for file in ["lock", "nodes/17/node.details", "letters.txt"] {
        let file = home.join(name).join(file);
        fs::create_dir_all(file.parent().unwrap()).unwrap();
        fs::write(file, "x").unwrap();
    }
    fs::create_dir(home.join("photos")).unwrap();
    fs::write(home.join("photos/one.jpg"), "x").unwrap();
    // The mode is set explicitly, because another test may have changed the umask, and a base that others can write to would be rejected.
    fs::set_permissions(&home, Permissions::from_mode(0o755)).unwrap();
    home
}

/// Returns all entries below a path with their modes.
fn census(path: &Path) -> Vec<(PathBuf, u32)> {
    let mut found = Vec::new();
    below(path, &mut found);
    found.sort();
    let mode = |path: &PathBuf| fs::symlink_metadata(path).unwrap().mode();
    found.into_iter().map(|path| (path.clone(), mode(&path))).collect()
}

#[test]
fn a_link_instead_of_the_base_is_never_followed() {
    let base = tempfile::tempdir_in("/dev/shm").unwrap();
    let home = home(base.path(), "t");
    // A link replaces the parent directory of a user's deployments. If this test runs as root, another user creates the link.
    let link = base.path().join("px");
    symlink(&home, &link).unwrap();
    let owner = if is_root() {
        lchown(&link, Some(OTHER), None).unwrap();
        OTHER
    } else {
        getuid().as_raw()
    };
    let before = census(&home);
    let own = Namespace::below("t", &link).unwrap();
    let refused = [
        own.acquire().unwrap_err().to_string(),
        Bus::open(&own, "one", &Stop::new().unwrap()).unwrap_err().to_string(),
        runtime::deployments(&link).unwrap_err().to_string(),
    ];
    for text in refused {
        assert!(text.contains(link.to_str().unwrap()), "{text}");
        let whose = format!("({owner}) to {home:?}");
        assert!(text.contains("is a symbolic link of user"), "{text}");
        assert!(text.contains(&whose) || !is_root(), "{text}");
    }
    assert_eq!(census(&home), before);
}

#[test]
fn a_directory_without_marker_is_named_and_not_changed() {
    let base = tempfile::tempdir_in("/dev/shm").unwrap();
    let home = home(base.path(), "t");
    let before = census(&home);
    let error = Namespace::below("t", &home).unwrap().acquire().unwrap_err();
    let LockError::Bus(BusError::Privacy(PrivacyError::Unmarked { path, n_files: 2 })) = &error
    else {
        panic!("{error}");
    };
    assert_eq!(*path, home.join("t"));
    assert_eq!(census(&home), before);
    assert!(error.hint().unwrap().contains("nothing in it was changed"));
}

#[test]
fn write_permission_of_others_is_removed_from_the_base_directory() {
    let base = tempfile::tempdir_in("/dev/shm").unwrap();
    let mode = || fs::metadata(base.path()).unwrap().mode() & 0o7777;
    fs::set_permissions(base.path(), Permissions::from_mode(0o777)).unwrap();
    let own = namespace(base.path());
    drop(own.acquire().unwrap());
    assert_eq!(mode(), 0o755);
    // With the sticky bit, as in /tmp, the directory is safe.
    fs::set_permissions(base.path(), Permissions::from_mode(0o1777)).unwrap();
    drop(own.acquire().unwrap());
    assert_eq!(mode(), 0o1777);
    assert!(!own.root().exists());
}
