//! A folder that files are written to. All files in it are opened relative to the folder's descriptor, and no link in the folder is
//! followed. Other users with write access therefore cannot redirect a file.

use std::ffi::{OsStr, OsString};
use std::fs::{self, File};
use std::io::{self, BufWriter, ErrorKind, Write as _};
use std::os::fd::OwnedFd;
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};
use std::process;

use rustix::fs::{AtFlags, CWD, Mode, OFlags, mkdirat, openat, renameat, statat, unlinkat};
use rustix::io::Errno;
use rustix::process::geteuid;

use crate::user;

/// Mode bit: every user may write.
const OTHERS: u32 = 0o002;
/// Mode bit: only the owner of a file may remove it.
const STICKY: u32 = 0o1000;

/// An open folder.
#[derive(Debug)]
pub struct Folder {
    descriptor: OwnedFd,
    path: PathBuf,
}

impl Folder {
    /// Opens a folder. Links in `path` are followed, because the user named it.
    ///
    /// # Errors
    ///
    /// Returns errors of the operating system.
    pub fn open(path: &Path) -> io::Result<Self> {
        let flags = OFlags::RDONLY | OFlags::DIRECTORY | OFlags::CLOEXEC;
        let descriptor = openat(CWD, path, flags, Mode::empty())?;
        let path = path.to_owned();
        Ok(Self { descriptor, path })
    }

    /// Opens a folder, and creates it if it does not exist.
    ///
    /// # Errors
    ///
    /// Returns errors of the operating system.
    pub fn create(path: &Path) -> io::Result<Self> {
        fs::create_dir_all(path)?;
        Self::open(path)
    }

    /// Opens a folder inside this one, and creates it if it does not exist.
    ///
    /// # Errors
    ///
    /// Returns errors of the operating system, and fails if the name belongs to something other than a folder, including a link.
    pub fn inner(&self, name: &str) -> io::Result<Self> {
        let mode = Mode::RWXU | Mode::RWXG | Mode::RWXO;
        match mkdirat(&self.descriptor, name, mode) {
            Ok(()) | Err(Errno::EXIST) => {}
            Err(error) => return Err(error.into()),
        }
        let flags = OFlags::RDONLY | OFlags::DIRECTORY | OFlags::NOFOLLOW | OFlags::CLOEXEC;
        match openat(&self.descriptor, name, flags, Mode::empty()) {
            Ok(descriptor) => Ok(Self {
                descriptor,
                path: self.path.join(name),
            }),
            Err(Errno::LOOP | Errno::NOTDIR) => Err(self.in_the_way(OsStr::new(name))),
            Err(error) => Err(error.into()),
        }
    }

    /// Returns the path by which the folder was opened.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the reason why another user may change the folder's files, if there is one: `belongs to user mallory (4001)`, or
    /// `may be written to by every user`.
    ///
    /// # Errors
    ///
    /// Returns errors of the operating system.
    pub fn risk(&self) -> io::Result<Option<String>> {
        let found = rustix::fs::fstat(&self.descriptor)?;
        let own = geteuid().as_raw();
        if found.st_uid != own && found.st_uid != 0 {
            return Ok(Some(format!("belongs to {}", user(found.st_uid))));
        }
        let is_open = found.st_mode & OTHERS != 0 && found.st_mode & STICKY == 0;
        Ok(is_open.then(|| "may be written to by every user".to_owned()))
    }

    /// Creates a file. An existing file of the same name, left by a killed process, is removed.
    ///
    /// # Errors
    ///
    /// Returns errors of the operating system, and fails if the name belongs to something other than a file, including a link.
    pub fn begin(&self, name: &str) -> io::Result<File> {
        self.begin_named(OsStr::new(name))
    }

    /// Opens a file of this user for appending and reading, and creates it if it does not exist.
    ///
    /// # Errors
    ///
    /// Returns errors of the operating system, and fails if the name belongs to something other than a file of this user, including a link.
    pub fn resume(&self, name: &str) -> io::Result<File> {
        self.own(name, OFlags::CREATE | OFlags::APPEND)
    }

    /// Opens a file of this user for writing and reading from its start, and creates it if it does not exist.
    ///
    /// # Errors
    ///
    /// Fails like [`resume`](Self::resume).
    pub fn reopen(&self, name: &str) -> io::Result<File> {
        self.own(name, OFlags::CREATE)
    }

    /// Renames a file or a folder in this folder. An existing file with the new name is replaced.
    ///
    /// # Errors
    ///
    /// Returns errors of the operating system.
    pub fn rename(&self, from: &str, to: &str) -> io::Result<()> {
        Ok(renameat(&self.descriptor, from, &self.descriptor, to)?)
    }

    /// Removes a file, or a link of that name.
    ///
    /// # Errors
    ///
    /// Returns errors of the operating system.
    pub fn remove(&self, name: &str) -> io::Result<()> {
        self.remove_named(OsStr::new(name))
    }

    /// Writes a temporary file in the same folder, then renames it to the final name.
    pub(crate) fn replace<T>(
        &self,
        name: &OsStr,
        sync: impl FnOnce(&File) -> io::Result<()>,
        write: impl FnOnce(&mut BufWriter<File>) -> io::Result<T>,
    ) -> io::Result<T> {
        let beside = beside(name);
        let file = self.begin_named(&beside)?;
        let written = || {
            let mut out = BufWriter::new(file);
            let made = write(&mut out)?;
            out.flush()?;
            sync(out.get_ref())?;
            renameat(&self.descriptor, &beside, &self.descriptor, name)?;
            Ok(made)
        };
        let placed = written();
        if placed.is_err() {
            // Only the first error is reported, because an error of the removal would add no information.
            drop(self.remove_named(&beside));
        }
        placed
    }

    fn remove_named(&self, name: &OsStr) -> io::Result<()> {
        Ok(unlinkat(&self.descriptor, name, AtFlags::empty())?)
    }

    fn begin_named(&self, name: &OsStr) -> io::Result<File> {
        let flags =
            OFlags::RDWR | OFlags::CREATE | OFlags::EXCL | OFlags::NOFOLLOW | OFlags::CLOEXEC;
        let make = || openat(&self.descriptor, name, flags, Mode::from_raw_mode(0o666));
        let made = match make() {
            Err(Errno::EXIST) if self.kind(name)?.is_file() => {
                self.remove_named(name)?;
                make()
            }
            made => made,
        };
        match made {
            Err(Errno::EXIST) => Err(self.in_the_way(name)),
            made => Ok(made?.into()),
        }
    }

    fn own(&self, name: &str, flags: OFlags) -> io::Result<File> {
        let name = OsStr::new(name);
        let flags = flags | OFlags::RDWR | OFlags::NOFOLLOW | OFlags::NONBLOCK | OFlags::CLOEXEC;
        let opened = openat(&self.descriptor, name, flags, Mode::from_raw_mode(0o666));
        let file = match opened {
            Err(Errno::LOOP | Errno::NXIO | Errno::ISDIR) => return Err(self.in_the_way(name)),
            opened => File::from(opened?),
        };
        let found = file.metadata()?;
        // A file with a second name (hard link) may be the file of another program.
        if !found.is_file() || found.uid() != geteuid().as_raw() || found.nlink() > 1 {
            return Err(self.in_the_way(name));
        }
        Ok(file)
    }

    fn kind(&self, name: &OsStr) -> io::Result<Kind> {
        let found = statat(&self.descriptor, name, AtFlags::SYMLINK_NOFOLLOW)?;
        Ok(Kind {
            mode: found.st_mode,
            owner: found.st_uid,
            has_second_name: found.st_nlink > 1,
        })
    }

    /// Returns the error for a name that belongs to something to which this crate must not write.
    fn in_the_way(&self, name: &OsStr) -> io::Error {
        let text = match self.kind(name) {
            Ok(kind) => format!(
                "{} that belongs to {} already exists and is not overwritten: remove it, or choose another folder",
                kind.name(),
                user(kind.owner)
            ),
            Err(error) => return error,
        };
        io::Error::new(ErrorKind::AlreadyExists, text)
    }
}

/// The kind of file that currently has a given name.
struct Kind {
    mode: u32,
    owner: u32,
    has_second_name: bool,
}

impl Kind {
    fn is_file(&self) -> bool {
        rustix::fs::FileType::from_raw_mode(self.mode) == rustix::fs::FileType::RegularFile
    }

    fn name(&self) -> &'static str {
        use rustix::fs::FileType;
        match FileType::from_raw_mode(self.mode) {
            FileType::RegularFile if self.has_second_name => {
                "a file with several names (hard links)"
            }
            FileType::RegularFile => "a file",
            FileType::Directory => "a folder",
            FileType::Symlink => "a symbolic link",
            FileType::Fifo => "a named pipe",
            FileType::Socket => "a socket",
            _ => "a device",
        }
    }
}

/// Returns the name of the temporary file that is later renamed to `name`.
pub(crate) fn beside(name: &OsStr) -> OsString {
    let mut hidden = OsString::from(".");
    hidden.push(name);
    hidden.push(format!(".{}.part", process::id()));
    hidden
}

#[cfg(test)]
mod tests {
    use std::fs::Permissions;
    use std::os::unix::fs::{PermissionsExt as _, symlink};

    use super::*;

    /// Returns a folder, and a secret file next to it.
    fn room() -> (tempfile::TempDir, Folder, PathBuf) {
        let base = tempfile::tempdir().unwrap();
        let secret = base.path().join("secret");
        fs::write(&secret, "kept").unwrap();
        let folder = Folder::create(&base.path().join("out/run")).unwrap();
        (base, folder, secret)
    }

    fn text(path: &Path) -> String {
        fs::read_to_string(path).unwrap()
    }

    #[test]
    fn a_link_is_refused_with_its_owner_and_its_target_is_kept() {
        let (_base, folder, secret) = room();
        symlink(&secret, folder.path().join("pose3d.jsonl.part")).unwrap();
        let own = user(geteuid().as_raw());
        for opened in [
            folder.begin("pose3d.jsonl.part"),
            folder.resume("pose3d.jsonl.part"),
            folder.reopen("pose3d.jsonl.part"),
        ] {
            let error = opened.unwrap_err().to_string();
            assert!(
                error.starts_with(&format!(
                    "a symbolic link that belongs to {own} already exists"
                )),
                "{error}"
            );
        }
        let error = folder.inner("pose3d.jsonl.part").unwrap_err().to_string();
        assert!(error.starts_with("a symbolic link"), "{error}");
        assert_eq!(text(&secret), "kept");
    }

    #[test]
    fn a_hard_link_is_replaced_and_its_target_is_never_written() {
        let (_base, folder, secret) = room();
        fs::hard_link(&secret, folder.path().join("a.part")).unwrap();
        let error = folder.resume("a.part").unwrap_err().to_string();
        assert!(error.starts_with("a file with several names"), "{error}");
        folder.begin("a.part").unwrap().write_all(b"new").unwrap();
        assert_eq!(text(&secret), "kept");
        assert_eq!(text(&folder.path().join("a.part")), "new");
    }

    #[test]
    fn a_pipe_is_refused_without_waiting() {
        use rustix::fs::{FileType, mknodat};
        let (_base, folder, _) = room();
        let pipe = folder.path().join("pipe");
        mknodat(CWD, &pipe, FileType::Fifo, Mode::RUSR | Mode::WUSR, 0).unwrap();
        for opened in [folder.begin("pipe"), folder.resume("pipe")] {
            let error = opened.unwrap_err().to_string();
            assert!(error.starts_with("a named pipe"), "{error}");
        }
    }

    #[test]
    fn files_of_a_killed_process_are_restarted_or_continued() {
        let (_base, folder, _) = room();
        let path = folder.path().join("a.part");
        folder.begin("a.part").unwrap().write_all(b"one").unwrap();
        folder.resume("a.part").unwrap().write_all(b"two").unwrap();
        assert_eq!(text(&path), "onetwo");
        folder.begin("a.part").unwrap().write_all(b"new").unwrap();
        assert_eq!(text(&path), "new");
        folder.rename("a.part", "a").unwrap();
        folder.remove("a").unwrap();
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }

    #[test]
    fn a_folder_that_replaces_an_open_one_is_not_written_to() {
        let (base, folder, _) = room();
        let moved = base.path().join("moved");
        fs::rename(folder.path(), &moved).unwrap();
        symlink(base.path(), folder.path()).unwrap();
        folder.begin("secret").unwrap().write_all(b"new").unwrap();
        assert_eq!(text(&moved.join("secret")), "new");
        assert_eq!(text(&base.path().join("secret")), "kept");
    }

    #[test]
    fn a_world_writable_folder_is_a_risk_unless_it_is_sticky() {
        let (_base, folder, _) = room();
        let risk = |mode| {
            fs::set_permissions(folder.path(), Permissions::from_mode(mode)).unwrap();
            folder.risk().unwrap()
        };
        assert_eq!(risk(0o755), None);
        assert_eq!(risk(0o1777), None);
        assert_eq!(risk(0o777).unwrap(), "may be written to by every user");
    }
}
