//! Exports a finished run to the file formats of other tools: reads the run, writes the files, and describes them.
//!
//! The crate `exports` writes the content of each format. This module handles files, cameras and pictures.

mod origin;
mod per_view;
mod pictures;

use std::io;
use std::path::{Path, PathBuf};

pub use exports::Trial;
use exports::{FILES, FileFormat, Notes, ViewCamera};
use failure::{Console, ExitKind, Failure, OrFail as _, Stop};
use serde_json::{Value, json};

pub use origin::{Given, Lines, Origin};
use pictures::Pictures;

/// A format that the user can choose.
#[derive(Debug, Clone, Copy)]
pub enum Format {
    /// A format with one file for all views.
    File(&'static FileFormat),
    /// Points, markers and settings for `OpenSim`: a folder with several files for every person.
    OpenSim,
    /// Keypoints of the reprojected pose, with a file for every view and frame.
    OpenPose,
    /// A video of every view, with the pose drawn on it.
    Mp4,
}

impl Format {
    /// Returns all formats.
    pub fn all() -> Vec<Self> {
        let files = FILES.iter().map(Self::File);
        files.chain([Self::OpenSim, Self::OpenPose, Self::Mp4]).collect()
    }

    /// Returns the name of the format.
    pub fn name(self) -> &'static str {
        match self {
            Self::File(format) => format.name,
            Self::OpenSim => "opensim",
            Self::OpenPose => "openpose",
            Self::Mp4 => "mp4",
        }
    }

    fn needs_rate(self) -> bool {
        match self {
            Self::File(format) => format.needs.rate,
            Self::OpenPose => false,
            Self::OpenSim | Self::Mp4 => true,
        }
    }

    fn needs_up(self) -> bool {
        match self {
            Self::File(format) => format.needs.up,
            Self::OpenSim => true,
            Self::OpenPose | Self::Mp4 => false,
        }
    }

    fn needs_cameras(self) -> bool {
        matches!(self, Self::OpenPose | Self::Mp4)
    }
}

/// An export job: formats, folder and name.
#[derive(Debug, Clone)]
pub struct Job {
    /// Formats to write.
    pub formats: Vec<Format>,
    /// Folder for the files, created if it does not exist.
    pub out: PathBuf,
    /// Base name of the files, without the endings of the formats.
    pub name: String,
    /// True if existing files are replaced.
    pub force: bool,
}

/// A file or folder that was written.
#[derive(Debug, Clone)]
pub struct Written {
    /// Name of the format.
    pub format: &'static str,
    /// The file, or the folder of the format.
    pub path: PathBuf,
    /// Descriptions of the file: its unit, its axes, and how it represents gaps and uncertainty.
    pub about: [&'static str; 4],
    /// Properties of the run that the format cannot express.
    pub notes: Notes,
}

impl Written {
    /// Returns the description as JSON.
    fn json(&self) -> Value {
        let [unit, axes, gaps, uncertainty] = self.about;
        json!({
            "format": self.format, "path": self.path, "unit": unit, "axes": axes, "gaps": gaps,
            "uncertainty": uncertainty, "notes": self.notes,
        })
    }
}

/// Ending of the file that describes the exported files, such as `pose3d.export.json`.
const MANIFEST: &str = ".export.json";

/// Writes a run in all formats that a job requests.
///
/// All checks come before anything is written. Each file gets its final name when it is complete.
///
/// # Errors
///
/// Fails if a format needs data that the run lacks, a file exists and must not be replaced, or the disk fails. Fails with `Interrupted` on
/// a stop request. Files that are complete by then are kept.
pub fn export(
    origin: &Origin,
    job: &Job,
    stop: &Stop,
    console: &dyn Console,
) -> Result<Vec<Written>, Failure> {
    let trials = &origin.trials[..];
    check(origin, job)?;
    let cameras = if job.formats.iter().any(|format| format.needs_cameras()) {
        origin.cameras()?
    } else {
        Vec::new()
    };
    let mut pictures = if job.formats.iter().any(|format| matches!(format, Format::Mp4)) {
        Pictures::all(origin)?
    } else {
        Vec::new()
    };
    let plan: Vec<(Format, Vec<PathBuf>)> = job
        .formats
        .iter()
        .map(|format| (*format, paths(*format, job, trials, &pictures)))
        .collect();
    for (format, paths) in &plan {
        for path in paths {
            refuse_existing(*format, path, job.force)?;
        }
    }
    std::fs::create_dir_all(&job.out).map_err(|error| cannot_write(&job.out, &error))?;
    let mut written = Vec::new();
    for (format, paths) in plan {
        stop.check("interrupted")?;
        console.begin(format.name(), "");
        match format {
            Format::File(format) => {
                for (path, trial) in paths.iter().zip(trials) {
                    written.push(file(trial, format, path)?);
                }
            }
            Format::OpenSim => {
                for (path, trial) in paths.iter().zip(trials) {
                    written.push(opensim(trial, path)?);
                }
            }
            Format::OpenPose => {
                written.push(per_view::openpose(
                    trials, &cameras, &paths[0], stop, console,
                )?);
            }
            Format::Mp4 => {
                for (path, pictures) in paths.iter().zip(&mut pictures) {
                    written.push(per_view::video(trials, pictures, path, stop, console)?);
                }
            }
        }
    }
    console.finish();
    let manifest = job.out.join(format!("{}{MANIFEST}", job.name));
    let text = serde_json::to_string_pretty(&as_json(origin, &written)).or_fail(ExitKind::Run)?;
    files::replace(&manifest, (text + "\n").as_bytes())
        .map_err(|error| cannot_write(&manifest, &error))?;
    Ok(written)
}

/// Returns the list of the exported files as JSON, for programs.
pub fn as_json(origin: &Origin, written: &[Written]) -> Value {
    let (trials, trial) = (&origin.trials, &origin.trials[0]);
    let labels = trial.labels();
    let by_label = |runs: &dyn Fn(usize) -> Vec<[u64; 2]>| {
        let all = labels.iter().enumerate();
        let all = all.map(|(nth, label)| (label.clone(), json!(runs(nth))));
        Value::Object(all.collect())
    };
    let person = |trial: &Trial| {
        json!({
            "ids": trial.ids,
            "frames_with_points": trial.n_with_points(),
            "gaps": by_label(&|nth| trial.gaps(nth)),
            "filled": by_label(&|nth| trial.filled(nth)),
        })
    };
    json!({
        "schema_version": 2,
        "source": origin.source,
        "trajectories": origin.lines.file(),
        "frames": trial.slots.len(),
        "first_frame": trial.first_frame,
        "frame_step": trial.frame_step,
        "rate_hz": trial.rate_hz,
        "irregular_times": trial.n_irregular,
        "repeated_frames": trial.n_repeated,
        "up_in_world": trial.up_in_world.map(|up_in_world| [up_in_world.x, up_in_world.y, up_in_world.z]),
        "points": labels,
        "people": trials.iter().map(person).collect::<Vec<Value>>(),
        "flaws": origin.flaws,
        "files": written.iter().map(Written::json).collect::<Vec<_>>(),
    })
}

/// Fails if the run lacks data that a format needs.
fn check(origin: &Origin, job: &Job) -> Result<(), Failure> {
    let lacks = |needs: fn(Format) -> bool| {
        let all = job.formats.iter().copied().filter(|format| needs(*format));
        let names: Vec<&str> = all.map(Format::name).collect();
        (!names.is_empty()).then(|| names.join(", "))
    };
    if origin.trials[0].rate_hz.is_none()
        && let Some(formats) = lacks(Format::needs_rate)
    {
        let message =
            format!("the frame rate of the run is not known, and {formats} must contain it");
        return Err(Failure::new(ExitKind::Usage, message)
            .with_hint("give the frame rate, for example --rate 30"));
    }
    if let (Some(why), Some(formats)) = (&origin.up_unknown, lacks(Format::needs_up)) {
        let message =
            format!("the upward direction is not known, and {formats} must contain it: {why}");
        let failure = Failure::new(ExitKind::Input, message);
        return Err(
            failure.with_hint("give the direction in the world of the rig, for example --up 0,0,1")
        );
    }
    Ok(())
}

/// Returns the paths of a format. If there are several people, a format with one file per person has the person's number in the names.
fn paths(format: Format, job: &Job, trials: &[Trial], pictures: &[Pictures]) -> Vec<PathBuf> {
    let name = |suffix: &str| job.out.join(format!("{}{suffix}", job.name));
    let of_people = |suffix: &str| -> Vec<PathBuf> {
        if trials.len() == 1 {
            return vec![name(suffix)];
        }
        let ids = trials.iter().map(Trial::id);
        ids.map(|id| name(&format!("-person{id}{suffix}"))).collect()
    };
    match format {
        Format::File(format) => of_people(format.suffix),
        Format::OpenSim => of_people("-opensim"),
        Format::OpenPose => vec![name("-openpose")],
        Format::Mp4 => {
            let views = pictures.iter();
            views.map(|view| name(&format!("-{}.mp4", view.view.name))).collect()
        }
    }
}

fn refuse_existing(format: Format, path: &Path, force: bool) -> Result<(), Failure> {
    let Ok(found) = std::fs::symlink_metadata(path) else {
        return Ok(());
    };
    let name = path.display();
    if !force {
        let failure = Failure::new(ExitKind::Usage, format!("{name} exists"));
        return Err(
            failure.with_hint("choose another folder with --out, or pass --force to replace it")
        );
    }
    let is_folder = matches!(format, Format::OpenSim | Format::OpenPose);
    if found.is_dir() != is_folder {
        let kind = if found.is_dir() { "a folder" } else { "a file" };
        let message = format!("{name} is {kind}, and is not replaced");
        return Err(Failure::new(ExitKind::Usage, message));
    }
    Ok(())
}

/// Writes the files for `OpenSim` into a folder. Other files in the folder stay.
fn opensim(trial: &Trial, folder: &Path) -> Result<Written, Failure> {
    std::fs::create_dir_all(folder).map_err(|error| cannot_write(folder, &error))?;
    for (name, text) in exports::opensim::files(trial).or_fail(ExitKind::Run)? {
        let path = folder.join(name);
        files::replace(&path, text.as_bytes()).map_err(|error| cannot_write(&path, &error))?;
    }
    let mut notes = vec![format!(
        "copy a full-body model to {}; then run scaling.xml and kinematics.xml in this folder",
        folder.join(exports::opensim::MODEL).display()
    )];
    if !trial.names().any(|name| name == "left heel") {
        notes.push("without heels and toes, the angles of the ankles are undetermined".to_owned());
    }
    Ok(Written {
        format: "opensim",
        path: folder.to_owned(),
        about: ["m", "y up", "NaN", "none"],
        notes,
    })
}

fn file(trial: &Trial, format: &'static FileFormat, path: &Path) -> Result<Written, Failure> {
    let notes = files::replace_by(path, |out| (format.write)(trial, out));
    Ok(Written {
        format: format.name,
        path: path.to_owned(),
        about: [format.unit, format.axes, format.gaps, format.uncertainty],
        notes: notes.map_err(|error| match error.kind() {
            // This error means that the format cannot represent the data, not that the disk failed.
            io::ErrorKind::InvalidInput => Failure::new(ExitKind::Degraded, error),
            _ => cannot_write(path, &error),
        })?,
    })
}

pub(crate) fn cannot_write(path: &Path, error: &io::Error) -> Failure {
    Failure::new(
        ExitKind::Input,
        format!("cannot write {}: {error}", path.display()),
    )
}

/// Returns a camera, with intrinsics for the pictures of its footage.
pub(crate) fn of_footage(view: &str, framing: &geometry::Framing, size: [u32; 2]) -> ViewCamera {
    ViewCamera {
        name: view.to_owned(),
        camera: framing.camera().clone(),
        picture_from_camera: framing.source_from_output(),
        size,
    }
}

#[cfg(test)]
mod tests;
