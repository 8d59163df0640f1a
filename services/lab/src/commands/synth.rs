//! `parallax-lab synth`: makes synthetic sequences of people, with ground truth.

mod motion;
mod parse;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, ValueEnum};
use failure::{ExitKind, Failure, OrFail as _, Stop};
use lab::synth::{self, Done, Job, Written};
use scene::{Action, Flaws, RigChoice};
use serde_json::json;
use terminal::{Globals, Terminal, output};

use crate::commands::pool;
use motion::MotionArguments;
use parse::{actions, rig, subjects};

const HELP: &str = "\
OUT contains deployment.toml (start it by `parallax run OUT/deployment.toml`), rig.toml, the pictures \
(cameras/NAME/000000.png), the masks, and two files of ground truth. truth.jsonl has the joints in 3D and in every picture, visibility, and \
capture times; shared/scene/TRUTH.md describes the format. people.jsonl has the same scenes as annotated people, for `train fmp` and `judge`. \
In people-as-seen.jsonl, left and right are as in published models. With several subjects or actions, each sequence has \
its own folder, for example OUT/s1-walking, and people.jsonl covers all of them.

The same options give the same files, bit for bit, on any number of threads. The number of a subject determines a person's body shape, \
clothes and style of movement. The seed determines the motion, the room and the lighting.

RIG is humaneva (3 cameras, 640x480), umpm (4, 644x486), ring:N[:RADIUS[:HEIGHT]] (metres; 4.2 and 1.5 if not \
given), or a rig file. Actions: walking, jogging, boxing, gestures, throw-catch, chair, grab, lean, table, lying.

With --motion, the subjects move as recorded in a C3D or TRC file. Limbs have the recorded directions, but the lengths of \
the subject. The path is moved to the middle of the room. Joint angles are not limited. A table (--markers) maps \
markers to joints. Gaps of up to --motion-gap seconds are interpolated. Longer gaps are an error, and the message names the frames. \
Impossible motions are an error, too: implausible leg lengths, a head below the feet, or knees that bend forward.

With --live, no pictures are written. The cameras of the deployment have the source synth://RIG?camera=C1&action=..., \
and each capture process renders its pictures during the run. The ground truth is that of these pictures.

--json prints one object: {\"schema_version\", \"sequences\": [{\"folder\", \"subject\", \"action\", \"seed\", \
\"pictures\", \"people\"}], \"seconds\", \"pictures_per_second\"}.

Exit codes: 0 done; 2 the command line is wrong, or OUT is not empty; 4 a rig file, a backdrop or the output folder cannot be used; \
5 the rig does not define the upward direction; 130 stopped by Ctrl-C.

Examples:
    parallax-lab synth out/walk && parallax run out/walk/deployment.toml
    parallax-lab synth out/set --subjects 1-20 --actions all --rate 2 --frames 10 --rig ring:4:6.5 --format jpg
    parallax-lab judge person.mat out/set/people-as-seen.jsonl
    parallax-lab synth out/bad --noise 8 --blur 1 --desync 0.04 --drop 0.05 --calibration-degrees 1
    parallax-lab synth out/punch --motion 02_05.c3d --motion-frames 1-600 --rig umpm
    parallax-lab synth out/skewed --rig ring:4 --actions jogging --skew-ms 0,5,11,16
    parallax-lab synth out/live --live --frames 900 --rig umpm --actions gestures";

/// The file format of pictures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    /// PNG, which is lossless.
    Png,
    /// JPEG, as most cameras write it (quality 95). The files are smaller.
    Jpg,
}

impl From<Format> for synth::Format {
    fn from(format: Format) -> Self {
        match format {
            Format::Png => Self::Png,
            Format::Jpg => Self::Jpg,
        }
    }
}

/// Options of `parallax-lab synth`.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub(crate) struct Arguments {
    /// Folder to write. It must be empty or not exist.
    out: PathBuf,
    /// Cameras: humaneva, umpm, a ring (ring:N, ring:N:RADIUS, ring:N:RADIUS:HEIGHT), or a rig file.
    #[arg(long, value_name = "RIG", default_value = "humaneva", value_parser = rig)]
    rig: RigChoice,
    /// Numbers of the subjects, for example 3 or 1-20,25.
    #[arg(long, value_name = "LIST", default_value = "1", value_parser = subjects)]
    subjects: Subjects,
    /// Number of other people who stand around the subject (at most 4).
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u64).range(..=4))]
    others: u64,
    /// Number of other people who walk past the subject and each other, at most 4. The truth has the joints of all people, but masks and
    /// visible joints only of the subject.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u64).range(..=4))]
    passers: u64,
    /// Actions of the subjects: names separated by commas, or all.
    #[arg(long, value_name = "LIST", default_value = "walking", value_parser = actions)]
    actions: Actions,
    /// Seed of the motion, the room and the lighting.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Frames per camera. If not given, 60, or the length of the recorded motion.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    frames: Option<u64>,
    /// Frames per second. At a lower rate, successive pictures differ more.
    #[arg(long, value_name = "HZ", default_value_t = 30.0, value_parser = terminal::rate)]
    rate: f64,
    /// File format of pictures.
    #[arg(long, value_enum, default_value_t = Format::Png)]
    format: Format,
    /// Do not write masks.
    #[arg(long)]
    no_masks: bool,
    /// Use photographs from this folder as the background, instead of a room.
    #[arg(long, value_name = "DIR")]
    backdrop: Option<PathBuf>,
    /// Model for the deployment file. If not given, the shipped person model.
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// Do not write pictures. Instead, the capture processes of the deployment render them during the run.
    #[arg(long)]
    live: bool,
    /// Delay of each camera's pictures after the nominal instants of the frames, in milliseconds, in the order of the rig: 0,5,11,16.
    /// Negative values mean earlier pictures. The deployment contains these times, and a run corrects the joints for them.
    #[arg(long, value_name = "LIST", default_value = "0", allow_hyphen_values = true, value_parser = parse::skews)]
    skew_ms: Skews,
    /// Recorded motion.
    #[command(flatten)]
    motion: MotionArguments,
    /// Flaws of the cameras.
    #[command(flatten)]
    flaws: FlawArguments,
    /// Number of threads, which does not affect the files. If not given, one per core.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=256))]
    threads: Option<u16>,
    /// Print a summary as JSON.
    #[arg(long)]
    json: bool,
}

type Subjects = Vec<u64>;
type Actions = Vec<Action>;
type Skews = Vec<f64>;

/// Flaws of the cameras; none by default.
#[derive(Debug, Clone, Copy, Args)]
#[command(next_help_heading = "Flaws of the cameras")]
struct FlawArguments {
    /// Standard deviation of the noise, in grey levels.
    #[arg(long, value_name = "LEVELS", default_value_t = 0.0)]
    noise: f64,
    /// Standard deviation of the blur, in pixels.
    #[arg(long, value_name = "PX", default_value_t = 0.0)]
    blur: f64,
    /// Change of the exposure in stops; negative values are darker.
    #[arg(
        long,
        value_name = "STOPS",
        default_value_t = 0.0,
        allow_hyphen_values = true
    )]
    exposure: f64,
    /// Largest clock offset of the cameras, except for the first, in seconds.
    #[arg(long, value_name = "S", default_value_t = 0.0)]
    desync: f64,
    /// Share of frames that a camera drops. Each dropped frame is replaced by the previous picture.
    #[arg(long, value_name = "SHARE", default_value_t = 0.0)]
    drop: f64,
    /// Rotation error of every camera in rig.toml, in degrees. The ground truth remains exact.
    #[arg(long, value_name = "DEGREES", default_value_t = 0.0)]
    calibration_degrees: f64,
    /// Position error of every camera in rig.toml, in millimetres. The ground truth remains exact.
    #[arg(long, value_name = "MM", default_value_t = 0.0)]
    calibration_mm: f64,
}

impl FlawArguments {
    fn flaws(self) -> Result<Flaws, Failure> {
        let flaws = Flaws {
            noise: self.noise,
            blur_px: self.blur,
            exposure_stops: self.exposure,
            desync_s: self.desync,
            drop: self.drop,
            calibration_degrees: self.calibration_degrees,
            calibration_mm: self.calibration_mm,
        };
        flaws.check().or_fail(ExitKind::Usage)?;
        Ok(flaws)
    }
}

/// The template of the progress bar.
const BAR: &str = "{elapsed_precise} {msg} {bar:20} {pos}/{len} pictures, {per_sec}{left}";

/// Default number of frames per camera.
const N_FRAMES: u64 = 60;

/// Runs the command.
pub(crate) fn run(arguments: &Arguments, globals: Globals) -> Result<ExitCode, Failure> {
    let n_cameras = arguments.rig.rig().map_err(synth::rig_failure)?.cameras().len();
    let skews_ms = skews_of(&arguments.skew_ms, n_cameras)?;
    let recording = arguments.motion.recording()?;
    let job = Job {
        out: arguments.out.clone(),
        rig: arguments.rig.clone(),
        subjects: arguments.subjects.clone(),
        others: arguments.others,
        passers: arguments.passers,
        actions: arguments.actions.clone(),
        seed: arguments.seed,
        flaws: arguments.flaws.flaws()?,
        n_frames: synth::n_frames(
            arguments.frames,
            arguments.rate,
            recording.as_ref(),
            N_FRAMES,
        )?,
        recording,
        rate_hz: arguments.rate,
        format: arguments.format.into(),
        with_masks: !arguments.no_masks,
        backdrop: arguments.backdrop.clone(),
        model: arguments.model.clone(),
        live: arguments.live,
        skews_ms,
    };
    create_folder(&arguments.out)?;
    let stop = Stop::on_signals().or_fail(ExitKind::Run)?;
    let pool = pool(arguments.threads, "synth")?;
    let terminal = Terminal::with_bar(globals.quiet, arguments.json, BAR);
    let done = pool.install(|| synth::write(&job, &stop, &terminal))?;
    report(arguments, globals, &done)?;
    Ok(ExitCode::SUCCESS)
}

/// Checks the skews of the cameras, and returns them. The list is empty if all skews are 0.
fn skews_of(skews_ms: &[f64], n_cameras: usize) -> Result<Skews, Failure> {
    if skews_ms.len() > n_cameras {
        let message = format!(
            "--skew-ms has {} values, but the rig has only {n_cameras} cameras",
            skews_ms.len()
        );
        return Err(Failure::new(ExitKind::Usage, message));
    }
    let is_off = skews_ms.iter().any(|skew_ms| *skew_ms != 0.0);
    Ok(if is_off {
        skews_ms.to_vec()
    } else {
        Skews::new()
    })
}

/// Creates the folder; refuses a folder that is not empty.
fn create_folder(out: &Path) -> Result<(), Failure> {
    inputs::make_folder(out)?;
    let mut inside = std::fs::read_dir(out).map_err(|error| failure::in_file(out, &error))?;
    if inside.next().is_some() {
        let message = format!("{} is not empty", out.display());
        return Err(Failure::new(ExitKind::Usage, message)
            .with_hint("name a folder that does not exist yet"));
    }
    Ok(())
}

fn report(arguments: &Arguments, globals: Globals, done: &Done) -> Result<(), Failure> {
    let Done { sequences, seconds } = done;
    let pictures: u64 = sequences.iter().map(|sequence| sequence.n_pictures).sum();
    let rate = pictures as f64 / seconds.max(1e-9);
    if arguments.json {
        return output::json(&json!({
            "schema_version": 1,
            "sequences": sequences.iter().map(Written::json).collect::<Vec<_>>(),
            "seconds": seconds,
            "pictures_per_second": rate,
        }));
    }
    if !globals.quiet {
        let (n, out) = (sequences.len(), arguments.out.display());
        let what = if arguments.live {
            "frames of cameras"
        } else {
            "pictures"
        };
        output::message(format_args!(
            "{out}: {n} sequences, {pictures} {what} in {seconds:.1} s ({rate:.1} per second)"
        ));
    }
    Ok(())
}
