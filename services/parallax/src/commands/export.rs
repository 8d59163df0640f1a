//! `parallax export`: exports a finished run to the formats of other tools.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, ValueEnum};
use failure::{ExitKind, Failure, OrFail as _, Stop};
use launch::export::{Format, Given, Job, Lines, Origin, Trial, Written, as_json, export};
use nalgebra::UnitVector3;
use terminal::{Globals, Terminal, output};

/// Note for a build without the format.
const NO_PARQUET: &str =
    "this build cannot write parquet: build it with `cargo build --release --features parquet`";
/// The progress bar.
const BAR: &str = "{elapsed_precise} {bar:20} {pos}/{len} {prefix} {msg}";

/// Options of `parallax export`.
#[derive(Debug, Args)]
#[command(after_help = "\
Formats, their use and content:
    c3d        motion capture        points, mm, z up; residual: standard deviation, mm, or -1 in a gap
    trc        motion analysis       points, m, y up; NaN in a gap
    opensim    OpenSim               a folder: points, markers for a full-body model, settings for scaling and inverse kinematics
    glb        viewers, Blender      skinned skeleton and animation, m, y up; in a gap, bones are missing
    bvh        animation             bones of fixed length (medians), cm, y up; in a gap, bones keep their last rotation
    csv        tables                a row for each frame, m, axes of the rig; standard deviations
    csv-long   tables                a row for each joint of each frame: covariance, views, the reason for a gap
    parquet    tables                like csv-long; needs a build with `--features parquet`
    openpose   other pipelines       BODY_25 of the reprojected pose: a JSON file for each view and frame
    mp4        video players         every camera's pictures with the pose and its uncertainty; needs ffmpeg
    all        all of these

With --from raw, nothing is filled or smoothed: a joint that was not found, or was refused, is a gap. BVH cannot represent gaps, so the command \
lists the frames in which a bone keeps its last rotation. Frames are on the grid of the frame rate, and dropped frames are gaps. NAME.export.json describes the \
files and the gaps of every joint. Each file gets its final name when it is complete.

If several people were found, most formats write one file per person, for example NAME-person2.trc for the person with id 2. Keypoints and videos \
contain all people in one file. If no frame has two people, the files contain the followed person, whose ids are listed as `ids`.

With --json, prints one object, the content of NAME.export.json: {\"schema_version\", \"source\", \"trajectories\", \"frames\", \"first_frame\", \
\"frame_step\", \"rate_hz\", \"irregular_times\", \"repeated_frames\", \"up_in_world\", \"points\", \"people\": [{\"ids\", \
\"frames_with_points\", \"gaps\", \"filled\"}], \"flaws\", \"files\": [{\"format\", \"path\", \"unit\", \"axes\", \"gaps\", \"uncertainty\", \"notes\"}]}.

Exit codes: 0 done; 2 the command line is wrong, or a file exists; 4 the run cannot be read, lacks data that a format needs, \
or the folder cannot be written; 5 the calibration does not fit; 7 no frame has a joint, or the run is truncated, \
damaged or still running; 130 stopped by Ctrl-C.

Examples:
    parallax export out/my --to c3d,glb
    parallax export out/my --from smooth --to opensim
    parallax export out/my --to all --out results/walk --name walk
    parallax export run.mcap --to glb,mp4
    parallax export out/photos --to bvh --rate 25 --up 0,0,1")]
pub(crate) struct Arguments {
    /// Folder of a finished run, or a recording (MCAP).
    source: PathBuf,
    /// The formats, separated by commas, or `all`.
    #[arg(long, value_name = "LIST", value_parser = formats)]
    to: Formats,
    /// Trajectories to export: as found, or as smoothed by `parallax smooth`.
    #[arg(long, value_enum, default_value_t = Trajectories::Raw)]
    from: Trajectories,
    /// Folder for the files. If not given, `export` in the folder of the run. For a recording, the default is its name with `-export`
    /// appended.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Base name of the files.
    #[arg(long, default_value = "pose3d", value_parser = name)]
    name: String,
    /// Frames of the footage per second, if the run has no frame rate.
    #[arg(long, value_name = "HZ", value_parser = rate)]
    rate: Option<f64>,
    /// Upward direction in the world of the rig, for example 0,0,1, in place of the direction in the calibration.
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = up)]
    up: Option<UnitVector3<f64>>,
    /// Replace existing files.
    #[arg(long)]
    force: bool,
    /// Print the list of written files as JSON.
    #[arg(long)]
    json: bool,
}

/// Choice of trajectories.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Trajectories {
    /// The trajectories as the run found them.
    Raw,
    /// Smoothed: pose3d-smooth.jsonl.
    Smooth,
}

/// A list of formats. Because of the alias, clap parses the list from a single argument.
type Formats = Vec<Format>;

fn formats(text: &str) -> Result<Formats, String> {
    let all = Format::all();
    let names: Vec<&str> = all.iter().map(|format| format.name()).collect();
    let mut found: Formats = Vec::new();
    for wanted in text.split(',').map(str::trim) {
        let of_name = |format: &Format| wanted == "all" || format.name() == wanted;
        let chosen: Formats = all.iter().copied().filter(of_name).collect();
        if chosen.is_empty() && wanted == "parquet" {
            return Err(NO_PARQUET.to_owned());
        }
        if chosen.is_empty() {
            return Err(format!(
                "{wanted:?} is not one of {}, all",
                names.join(", ")
            ));
        }
        for format in chosen {
            if !found.iter().any(|other| other.name() == format.name()) {
                found.push(format);
            }
        }
    }
    Ok(found)
}

fn name(text: &str) -> Result<String, String> {
    let is_plain = !text.is_empty()
        && !text.starts_with('.')
        && !text.contains(|letter: char| letter == '/' || letter.is_control());
    let expected = "expected a file name without a folder";
    is_plain.then(|| text.to_owned()).ok_or_else(|| expected.to_owned())
}

fn rate(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|value| (0.001..=1e5).contains(value));
    number.ok_or_else(|| format!("expected 0.001 to 100000 frames per second, got {text:?}"))
}

pub(crate) fn up(text: &str) -> Result<UnitVector3<f64>, String> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
    let numbers: Option<[f64; 3]> = numbers.and_then(|number| number.try_into().ok());
    let direction = numbers.and_then(geometry::direction);
    direction.ok_or_else(|| "expected three numbers, not all 0, such as 0,0,1".to_owned())
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments, globals: Globals) -> Result<ExitCode, Failure> {
    let stop = Stop::on_signals().or_fail(ExitKind::Run)?;
    let origin = Origin::read(
        &arguments.source,
        &Given {
            name: arguments.name.clone(),
            lines: match arguments.from {
                Trajectories::Raw => Lines::Raw,
                Trajectories::Smooth => Lines::Smooth,
            },
            rate_hz: arguments.rate,
            up: arguments.up,
        },
    )?;
    let job = Job {
        formats: arguments.to.clone(),
        out: arguments.out.clone().unwrap_or_else(|| beside(&arguments.source)),
        name: arguments.name.clone(),
        force: arguments.force,
    };
    let has_parquet = Format::all().iter().any(|format| format.name() == "parquet");
    if !has_parquet && job.formats.len() == Format::all().len() && !globals.quiet {
        output::message(NO_PARQUET);
    }
    let terminal = Terminal::with_bar(globals.quiet, false, BAR);
    let written = export(&origin, &job, &stop, &terminal)?;
    if arguments.json {
        output::json(&as_json(&origin, &written))?;
    } else if !globals.quiet {
        report(&origin, &written)?;
    }
    for flaw in &origin.flaws {
        output::message(format_args!("warning: {flaw}"));
    }
    let kind = (!origin.flaws.is_empty()).then_some(ExitKind::Degraded);
    Ok(ExitCode::from(kind.map_or(0, ExitKind::status)))
}

/// Returns the folder of the files if `--out` is not given.
fn beside(source: &Path) -> PathBuf {
    if source.is_dir() {
        return source.join("export");
    }
    let name = source.file_stem().unwrap_or_default().to_string_lossy();
    source.with_file_name(format!("{name}-export"))
}

/// Describes the people that have joints, with the number of frames of each.
fn found(trials: &[Trial]) -> String {
    if let [only] = trials {
        let found = format!("{} of them have joints", only.n_with_points());
        return match &only.ids[..] {
            [_] => found,
            ids => format!(
                "{found}, which belong to people followed one after the other, with ids {ids:?}"
            ),
        };
    }
    let one = |trial: &Trial| format!("person {} in {}", trial.id(), trial.n_with_points());
    let people: Vec<String> = trials.iter().map(one).collect();
    format!("{} people have joints: {}", trials.len(), people.join(", "))
}

fn report(origin: &Origin, written: &[Written]) -> Result<(), Failure> {
    let (trials, trial) = (&origin.trials, &origin.trials[0]);
    let rate = trial.rate_hz.map_or_else(
        || "at an unknown rate".to_owned(),
        |rate_hz| format!("at {rate_hz} Hz"),
    );
    output::line(format_args!(
        "{} frames {rate}, starting with frame {}; {}",
        trial.slots.len(),
        trial.first_frame,
        found(trials)
    ))?;
    let turned = written.iter().any(|file| file.about[1].ends_with(" up"));
    if turned && trial.up_in_world.is_none() {
        output::line(
            "the rig does not define the upward direction, so the files have the axes of the rig; use --up 0,0,1 to set the direction",
        )?;
    }
    for it in written {
        let [unit, axes, gaps, _] = it.about;
        output::line(format_args!(
            "{:9} {}: {unit}; {axes}; a gap: {gaps}",
            it.format,
            it.path.display()
        ))?;
        for note in &it.notes {
            output::line(format_args!("          {note}"))?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;

    fn names(text: &str) -> Result<Vec<&'static str>, String> {
        formats(text).map(|all| all.into_iter().map(Format::name).collect())
    }

    #[test]
    fn duplicate_formats_are_merged_and_unknown_ones_are_refused() {
        assert_eq!(names("glb, c3d,glb"), Ok(vec!["glb", "c3d"]));
        assert_eq!(names("all,csv").unwrap().len(), Format::all().len());
        let error = names("c3d,fbx").unwrap_err();
        assert!(
            error.contains("\"fbx\" is not one of c3d, trc, glb"),
            "{error}"
        );
        names("").unwrap_err();
    }

    #[test]
    fn invalid_directions_and_names_are_refused() {
        assert_eq!(up("0,0,2").unwrap(), Vector3::z_axis());
        assert_eq!(up("0, -1, 0").unwrap(), -Vector3::y_axis());
        for text in [
            "",
            "1,2",
            "0,0,0",
            "a,b,c",
            "1,2,3,4",
            "nan,0,0",
            "inf,0,0",
            "1e200,0,0",
        ] {
            assert!(up(text).is_err(), "{text}");
        }
        for text in ["", "a/b", "..", ".x", "a\n"] {
            assert!(name(text).is_err(), "{text:?}");
        }
        assert_eq!(name("walk, one").unwrap(), "walk, one");
    }
}
