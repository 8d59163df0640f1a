//! The output folder. Files are written under a temporary name, and renamed when they are complete.

use std::fs::{self, File};
use std::io::{self, Read as _, Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};

use runfiles::{FrameLine, RunSummary, SmoothReport};

/// End of the temporary name of a file.
const PART: &str = ".part";
/// File that marks a folder of pictures as written by a run.
const MARK: &str = ".parallax";

/// Error for an output folder that cannot be used.
#[derive(Debug, thiserror::Error)]
#[error("cannot {doing} {}", path.display())]
pub struct FolderError {
    /// The attempted action.
    pub doing: &'static str,
    /// Path of the file or folder.
    pub path: PathBuf,
    /// Error of the operating system.
    pub source: io::Error,
}

/// A folder whose files are replaced as a whole.
///
/// A file `x` is written as `x.part`, and renamed at the end. Therefore, the result of an earlier run is kept until the new result is
/// complete, and the name of an unfinished file shows its state.
#[derive(Debug)]
pub struct Folder {
    dir: files::Folder,
    parts: Vec<String>,
    resume: bool,
}

impl Folder {
    /// Opens a folder, and creates it if it does not exist.
    ///
    /// * `resume`: true to continue where a killed process stopped, instead of starting over.
    ///
    /// # Errors
    ///
    /// Fails with [`FolderError`] if the folder cannot be used.
    pub fn open(dir: &Path, resume: bool) -> Result<Self, FolderError> {
        let dir = files::Folder::create(dir).map_err(|source| FolderError {
            doing: "create the folder",
            path: dir.to_owned(),
            source,
        })?;
        Ok(Self {
            dir,
            parts: Vec::new(),
            resume,
        })
    }

    /// Renames the remaining files of a killed process that had written all its files. Returns true if all files of the run now have their
    /// final names.
    pub fn finish_killed(dir: &Path, session: u64) -> bool {
        let read = |name: &str| {
            let text = files::read_text(&dir.join(name), files::SETTINGS).unwrap_or_default();
            RunSummary::parse(&text).ok().filter(|summary| summary.session == session)
        };
        if read(RunSummary::FILE).is_some() {
            return true;
        }
        // Files that lack lines keep their temporary names, so a run with such files starts to write again.
        let is_written =
            read(&part(RunSummary::FILE)).is_some_and(|whole| whole.summary.writes_failed == 0);
        let Some(mut folder) = Self::open(dir, true).ok().filter(|_| is_written) else {
            return false;
        };
        let entries = fs::read_dir(dir).into_iter().flatten().flatten();
        let names = entries.filter_map(|entry| entry.file_name().into_string().ok());
        folder.parts = names.filter_map(|name| Some(name.strip_suffix(PART)?.to_owned())).collect();
        folder.finish().is_empty()
    }

    /// Starts a file.
    ///
    /// # Errors
    ///
    /// Fails with [`FolderError`] if the file cannot be created.
    pub fn file(&mut self, name: &str) -> Result<File, FolderError> {
        let part = part(name);
        let file = if self.resume {
            self.dir.resume(&part).and_then(|mut file| {
                cut_half_line(&mut file)?;
                Ok(file)
            })
        } else {
            self.dir.begin(&part)
        };
        let file = file.map_err(|source| self.failed("write", name, source))?;
        self.parts.push(name.to_owned());
        Ok(file)
    }

    /// Reserves space for a file that is written at the end of the run, because the disk may be full by then.
    ///
    /// # Errors
    ///
    /// Fails with [`FolderError`] if there is not enough space.
    pub fn reserve(&mut self, name: &str, bytes: usize) -> Result<(), FolderError> {
        let part = part(name);
        let is_there = || Ok(self.dir.resume(&part)?.metadata()?.len() == bytes as u64);
        let taken = if self.resume { is_there() } else { Ok(false) };
        let taken = taken.and_then(|is_there| {
            if is_there {
                return Ok(());
            }
            self.dir.begin(&part)?.write_all(&vec![b' '; bytes])
        });
        taken.map_err(|source| self.failed("reserve space for", name, source))?;
        self.parts.push(name.to_owned());
        Ok(())
    }

    /// Writes a file for which space was reserved.
    ///
    /// # Errors
    ///
    /// Fails with the error of the operating system.
    pub fn fill(&self, name: &str, text: &str) -> io::Result<()> {
        // The file is overwritten in place: if it were truncated first, other programs could take the space.
        let mut file = self.dir.reopen(&part(name))?;
        file.write_all(text.as_bytes())?;
        file.set_len(text.len() as u64)
    }

    /// Removes the files that a smoother created from an earlier run, because they do not belong to this run.
    pub(crate) fn remove_smoothed(&self) {
        if !self.dir.path().join(SmoothReport::FILE).exists() {
            return;
        }
        for name in [FrameLine::SMOOTHED_FILE, SmoothReport::FILE, "angles.csv"] {
            if let Err(error) = self.dir.remove(name) {
                tracing::debug!(%error, name, "a file of an earlier run cannot be removed");
            }
        }
    }

    /// Leaves a file under its temporary name.
    pub fn leave(&mut self, name: &str) {
        self.parts.retain(|part| part != name);
    }

    /// Creates a subfolder. It is empty, unless the run is resumed.
    ///
    /// # Errors
    ///
    /// Fails with [`FolderError`] if the subfolder cannot be created.
    pub fn folder(&mut self, name: &str) -> Result<PathBuf, FolderError> {
        let path = self.part(name);
        if !self.resume {
            remove_pictures(&path)?;
        }
        let made = self.dir.inner(&part(name));
        let marked = made.and_then(|inner| {
            let mut mark = inner.begin(MARK)?;
            mark.write_all(b"pictures of a run of parallax\n")
        });
        marked.map_err(|source| self.failed("create the folder", name, source))?;
        self.parts.push(name.to_owned());
        Ok(path)
    }

    /// Returns the path of a file while it is written.
    pub fn part(&self, name: &str) -> PathBuf {
        self.dir.path().join(part(name))
    }

    /// Rewrites an unfinished file as a whole.
    ///
    /// # Errors
    ///
    /// Fails with the error of the operating system. The old content is then kept.
    pub(crate) fn rewrite(&self, name: &str, text: &str) -> io::Result<()> {
        let beside = format!("{name}.head.part");
        let written = self.dir.begin(&beside);
        let written = written.and_then(|mut file| file.write_all(text.as_bytes()));
        if let Err(error) = written {
            self.dir.remove(&beside)?;
            return Err(error);
        }
        self.dir.rename(&beside, &part(name))
    }

    fn failed(&self, doing: &'static str, name: &str, source: io::Error) -> FolderError {
        FolderError {
            doing,
            path: self.part(name),
            source,
        }
    }

    /// Gives every file its final name; `summary.json` comes last, after the files that it mentions.
    ///
    /// Returns the errors. All other files still get their final names.
    pub fn finish(&self) -> Vec<FolderError> {
        let mut names = self.parts.clone();
        names.sort_by_key(|name| (name == RunSummary::FILE, name.clone()));
        let outcomes = names.iter().map(|name| {
            let (from, to) = (self.part(name), self.dir.path().join(name));
            // Renaming a folder does not replace another folder, so the other folder is removed first.
            if from.is_dir() {
                remove_pictures(&to)?;
            }
            let renamed = self.dir.rename(&part(name), name);
            renamed.map_err(|source| self.failed("rename the finished output", name, source))
        });
        outcomes.filter_map(Result::err).collect()
    }
}

/// Returns the temporary name of a file.
fn part(name: &str) -> String {
    format!("{name}{PART}")
}

/// Removes an incomplete last line that a killed process left.
fn cut_half_line(file: &mut File) -> io::Result<()> {
    let mut end = file.metadata()?.len();
    let mut block = [0; 4096];
    while end > 0 {
        let start = end.saturating_sub(block.len() as u64);
        let block = &mut block[..(end - start) as usize];
        file.seek(SeekFrom::Start(start))?;
        file.read_exact(block)?;
        if let Some(at) = block.iter().rposition(|byte| *byte == b'\n') {
            return file.set_len(start + at as u64 + 1);
        }
        end = start;
    }
    file.set_len(0)
}

/// Removes a folder of pictures if a run has created it. This is the case if the folder has the mark of a run, or if it and its subfolders
/// contain only numbered pictures. If the path is a link to a folder, only the link is removed.
///
/// # Errors
///
/// Fails if the folder contains anything else. Nothing is removed then.
pub fn remove_pictures(path: &Path) -> Result<(), FolderError> {
    let failed = |source| FolderError {
        doing: "empty",
        path: path.to_owned(),
        source,
    };
    let found = match fs::symlink_metadata(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        found => found.map_err(failed)?,
    };
    if !found.is_dir() {
        return fs::remove_file(path).map_err(failed);
    }
    if !path.join(MARK).is_file()
        && let Some(other) = other_than_pictures(path, 2).map_err(failed)?
    {
        let text = format!("{} was not written by a run; move it away", other.display());
        return Err(failed(io::Error::other(text)));
    }
    fs::remove_dir_all(path).map_err(failed)
}

/// Returns a path in a folder that is not a numbered picture, if there is one.
///
/// * `deep`: number of levels of subfolders that are searched.
fn other_than_pictures(folder: &Path, deep: usize) -> io::Result<Option<PathBuf>> {
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let path = entry.path();
        if entry.file_type()?.is_dir() && deep > 1 {
            if let Some(other) = other_than_pictures(&path, deep - 1)? {
                return Ok(Some(other));
            }
            continue;
        }
        let name = entry.file_name().into_string().unwrap_or_default();
        let number = name.split_once('.').filter(|parts| matches!(parts.1, "png" | "png.part"));
        if !number.is_some_and(|number| number.0.bytes().all(|digit| digit.is_ascii_digit())) {
            return Ok(Some(path));
        }
    }
    Ok(None)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn write(dir: &Path, resume: bool, text: &str, finish: bool) {
        let mut folder = Folder::open(dir, resume).unwrap();
        let mut file = folder.file("a.txt").unwrap();
        file.write_all(text.as_bytes()).unwrap();
        drop(file);
        let inner = folder.folder("pictures").unwrap();
        fs::write(inner.join(format!("{text}.png")), "").unwrap();
        if finish {
            assert!(folder.finish().is_empty());
        }
    }

    #[test]
    fn a_rerun_replaces_earlier_files() {
        let dir = tempfile::tempdir().unwrap();
        write(dir.path(), false, "one", true);
        write(dir.path(), false, "two", true);
        assert_eq!(fs::read_to_string(dir.path().join("a.txt")).unwrap(), "two");
        assert!(!dir.path().join("pictures/one.png").exists());
        assert!(dir.path().join("pictures/two.png").exists());
    }

    #[test]
    fn a_folder_that_is_not_from_a_run_is_kept() {
        let dir = tempfile::tempdir().unwrap();
        let pictures = dir.path().join("pictures");
        fs::create_dir_all(pictures.join("left")).unwrap();
        fs::write(pictures.join("left/000001.png"), "").unwrap();
        let own = pictures.join("left/holiday.png");
        fs::write(&own, "").unwrap();
        let mut folder = Folder::open(dir.path(), false).unwrap();
        folder.folder("pictures").unwrap();
        let errors = folder.finish();
        let text = format!("{} {}", errors[0], errors[0].source);
        assert!(
            text.contains("holiday.png was not written by a run"),
            "{text}"
        );
        assert!(own.exists() && pictures.join("left/000001.png").exists());
        // Earlier versions did not write the mark.
        fs::remove_file(own).unwrap();
        assert!(folder.finish().is_empty());
        assert!(!pictures.join("left").exists());
    }

    #[test]
    fn an_earlier_result_is_kept_until_the_new_one_is_complete() {
        let dir = tempfile::tempdir().unwrap();
        write(dir.path(), false, "one", true);
        write(dir.path(), false, "two", false);
        assert_eq!(fs::read_to_string(dir.path().join("a.txt")).unwrap(), "one");
        assert!(dir.path().join("pictures/one.png").exists());
        assert!(dir.path().join("a.txt.part").exists());
    }

    #[test]
    fn a_restarted_writer_continues_where_it_was_killed() {
        let dir = tempfile::tempdir().unwrap();
        write(dir.path(), false, "one", false);
        let half = "one\nhalf a li";
        fs::write(dir.path().join("a.txt.part"), half).unwrap();
        write(dir.path(), true, "two", true);
        assert_eq!(
            fs::read_to_string(dir.path().join("a.txt")).unwrap(),
            "one\ntwo"
        );
        assert!(dir.path().join("pictures/one.png").exists());
    }

    #[test]
    fn reserved_space_is_filled_and_the_rest_is_released() {
        let dir = tempfile::tempdir().unwrap();
        let mut folder = Folder::open(dir.path(), false).unwrap();
        folder.reserve("summary.json", 100).unwrap();
        let part = dir.path().join("summary.json.part");
        assert_eq!(fs::metadata(&part).unwrap().len(), 100);
        folder.fill("summary.json", "short\n").unwrap();
        assert!(folder.finish().is_empty());
        let text = fs::read_to_string(dir.path().join("summary.json")).unwrap();
        assert_eq!(text, "short\n");
    }

    #[test]
    fn a_process_killed_while_it_renames_its_files_has_finished() {
        let dir = tempfile::tempdir().unwrap();
        let path = |name: &str| dir.path().join(name);
        let mut summary = RunSummary {
            frame_rate_hz: None,
            joints: String::new(),
            latency: runfiles::LatencyReport::default(),
            schema_version: runfiles::VERSION,
            session: 5,
            summary: runfiles::Summary::default(),
            trc_axes: String::new(),
            views: Vec::new(),
        };
        let write = |summary: &RunSummary| {
            fs::write(path("summary.json.part"), summary.to_text().unwrap()).unwrap();
        };
        fs::write(path("pose3d.jsonl"), "renamed").unwrap();
        fs::write(path("times.jsonl.part"), "not yet").unwrap();
        assert!(!Folder::finish_killed(dir.path(), 5), "no summary");
        summary.summary.writes_failed = 1;
        write(&summary);
        assert!(!Folder::finish_killed(dir.path(), 5), "lines are missing");
        summary.summary.writes_failed = 0;
        write(&summary);
        assert!(!Folder::finish_killed(dir.path(), 6), "another run");
        assert!(Folder::finish_killed(dir.path(), 5));
        for (name, text) in [("pose3d.jsonl", "renamed"), ("times.jsonl", "not yet")] {
            assert_eq!(fs::read_to_string(path(name)).unwrap(), text);
        }
        assert!(Folder::finish_killed(dir.path(), 5), "once more");
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 3);
    }

    #[test]
    fn an_unfinished_file_keeps_the_extension_part() {
        let dir = tempfile::tempdir().unwrap();
        let mut folder = Folder::open(dir.path(), false).unwrap();
        folder.file("a.txt").unwrap();
        folder.leave("a.txt");
        assert!(folder.finish().is_empty());
        assert!(dir.path().join("a.txt.part").exists());
    }

    #[test]
    fn a_folder_that_cannot_be_made_is_named() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("file");
        fs::write(&file, "").unwrap();
        let error = Folder::open(&file.join("below"), false).unwrap_err();
        assert!(error.to_string().contains("below"), "{error}");
    }
}
