//! `parallax new`: creates a deployment from footage. It runs a sequence of commands, each of which can also be run alone.

use std::fs;
use std::path::{Path, PathBuf, absolute};
use std::process::{Command, ExitCode};

use calibration::boards::Board;
use clap::Args;
use failure::{ExitKind, Failure, OrFail as _, in_file};
use nalgebra::UnitVector3;
use rigs::boards::CameraFootage;
use terminal::{Globals, output};

use crate::commands::calibrate::height;

/// Options of `parallax new`.
#[derive(Debug, Args)]
#[command(after_help = "\
Each step is a command, which is printed before it runs. Files of finished steps are kept. If `new` is run \
again, it continues after these steps; delete a file to repeat its step. If a step fails, `new` ends with the \
exit code of the step. It also ends after a doubtful result (exit code 7), unless --go-on is given.

    1  Get the rig: --rig converts a calibration, --board with --show finds one (`parallax calibrate board`).
    2  Move the origin of the rig to the floor: --floor (`parallax calibrate origin`).
    3  Write ROOM/deployment.toml. You may edit this file: `new` does not replace it
       (`parallax config check`).
    4  With --people, find the poses of the cameras, and the floor, from a person who walks about
       in their footage (`parallax calibrate people`). Only the lenses of --rig or of the board are
       used. No board on the floor is needed.
    5  With --sync, find the clock offsets of recorded cameras from people
       (`parallax sync estimate --write`).
    6  With --run, start a first run (`parallax run`).

Examples:
    parallax new room --camera a=walk/a.mp4 --camera b=walk/b.mp4 --rig Calib.toml --run
    parallax new room --camera a=walk/a.mp4 --camera b=walk/b.mp4 --board charuco:7x5:40mm --show a=board/a.mp4 --show b=board/b.mp4 \\
        --floor a=floor/a.mp4 --floor b=floor/b.mp4 --sync --run
    parallax new room --camera a=walk/a.mp4 --camera b=walk/b.mp4 --camera c=walk/c.mp4 --rig lenses.toml --people 1.78 --run
    parallax new room --camera a=walk/a.mp4 --camera b=walk/b.mp4 --rig Calib.toml --dry-run")]
#[expect(
    clippy::struct_excessive_bools,
    reason = "each is a flag of the command line"
)]
pub(crate) struct Arguments {
    /// The folder to create.
    room: PathBuf,
    /// A camera: its name, and a video, a folder or pattern of pictures, or a live address. Give the option once per camera. `parallax
    /// cameras` lists video devices.
    #[arg(long, value_name = "NAME=SOURCE", required = true)]
    camera: Vec<String>,
    /// A calibration of these cameras, in any format.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["board", "show"], required_unless_present = "board")]
    rig: Option<PathBuf>,
    /// The board in the footage of --show and --floor.
    #[arg(long, value_name = "BOARD", requires = "show")]
    board: Option<Board>,
    /// Footage of a camera in which the board is moved about. Give the option once per camera.
    #[arg(long, value_name = "NAME=PATH", requires = "board")]
    show: Vec<String>,
    /// Footage of a camera in which the board is on the floor.
    #[arg(long, value_name = "NAME=PATH", requires = "board")]
    floor: Vec<String>,
    /// Find the poses of the cameras from footage in which a person of height METRES walks about.
    #[arg(long, value_name = "METRES", conflicts_with = "floor", value_parser = height)]
    people: Option<f64>,
    /// For cropped footage: position of the footage's upper left pixel in the calibrated picture (`source_offset_px`). Give the option once
    /// per camera.
    #[arg(long, value_name = "NAME=X,Y", value_parser = offset)]
    offset: Vec<Offset>,
    /// Upward direction in the world of the rig, for example 0,0,1.
    #[arg(long, value_name = "X,Y,Z", value_parser = super::export::up, allow_hyphen_values = true)]
    up: Option<UnitVector3<f64>>,
    /// Find the offset and drift of the cameras' clocks.
    #[arg(long)]
    sync: bool,
    /// Run the deployment at the end.
    #[arg(long)]
    run: bool,
    /// Continue after a step whose result is doubtful.
    #[arg(long)]
    go_on: bool,
    /// Only print the commands.
    #[arg(long)]
    dry_run: bool,
}

/// Name of the rig file that contains only intrinsics.
const LENSES: &str = "lenses.toml";

/// A command, and the file that exists once the command has succeeded.
struct Step {
    words: Vec<String>,
    done: Option<PathBuf>,
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments, globals: Globals) -> Result<ExitCode, Failure> {
    let room = &arguments.room;
    let deployment = room.join("deployment.toml");
    let text = deployment_text(arguments)?;
    if !arguments.dry_run {
        fs::create_dir_all(room).map_err(|error| in_file(room, &error))?;
    }
    for step in rig_steps(arguments) {
        if let Some(code) = step.run(arguments, globals)? {
            return Ok(code);
        }
    }
    if deployment.exists() {
        let is_other = fs::read_to_string(&deployment).is_ok_and(|kept| kept != text);
        let differs = if is_other {
            ", which differs from the file that these options would create: edit it, or delete it to create it again"
        } else {
            ""
        };
        output::message(format_args!("kept {}{differs}", deployment.display()));
    } else if arguments.dry_run {
        output::line(format_args!("# writes {}\n{text}", deployment.display()))?;
    } else {
        files::replace(&deployment, text.as_bytes())
            .map_err(|error| in_file(&deployment, &error))?;
        output::message(format_args!("wrote {}", deployment.display()));
    }
    for step in later_steps(arguments, &deployment) {
        if let Some(code) = step.run(arguments, globals)? {
            return Ok(code);
        }
    }
    if !arguments.run {
        let deployment = failure::wording::shell(deployment.display());
        output::message(format_args!("next: parallax run {deployment}"));
    }
    Ok(ExitCode::SUCCESS)
}

impl Step {
    fn new(words: &[&str], done: Option<PathBuf>) -> Self {
        let words = words.iter().map(|word| (*word).to_owned()).collect();
        Self { words, done }
    }

    /// Runs the step. Returns an exit code if `parallax new` must end.
    fn run(&self, arguments: &Arguments, globals: Globals) -> Result<Option<ExitCode>, Failure> {
        let line: Vec<String> = self.words.iter().map(failure::wording::shell).collect();
        if let Some(file) = self.done.as_ref().filter(|file| file.exists()) {
            output::message(format_args!("kept {}", file.display()));
            return Ok(None);
        }
        if arguments.dry_run {
            output::line(format_args!("parallax {}", line.join(" ")))?;
            return Ok(None);
        }
        output::message(format_args!("$ parallax {}", line.join(" ")));
        let program = std::env::current_exe().or_fail(ExitKind::Run)?;
        let mut command = Command::new(program);
        command.args(&self.words);
        if globals.quiet {
            command.arg("--quiet");
        }
        let status = command.status().or_fail(ExitKind::Run)?;
        let code = status.code().unwrap_or(1);
        let doubts = [ExitKind::Degraded, ExitKind::Limit].map(|kind| i32::from(kind.status()));
        let is_doubt = doubts.contains(&code);
        if status.success() || (is_doubt && arguments.go_on) {
            return Ok(None);
        }
        if let Some(file) = self.done.as_ref().filter(|file| is_doubt && file.exists()) {
            output::message(format_args!(
                "{} was written: run the same command again to continue with this file",
                file.display()
            ));
        }
        Ok(Some(ExitCode::from(u8::try_from(code).unwrap_or(1))))
    }
}

/// Returns the steps that create the rig in the folder and move its origin to the floor.
fn rig_steps(arguments: &Arguments) -> Vec<Step> {
    let room = &arguments.room;
    let rig = room.join("rig.toml");
    let raw = if arguments.people.is_some() {
        room.join(LENSES)
    } else if arguments.floor.is_empty() {
        rig.clone()
    } else {
        room.join("rig-of-board.toml")
    };
    let (rig_text, raw_text) = (rig.display().to_string(), raw.display().to_string());
    let mut steps = Vec::new();
    if let Some(file) = &arguments.rig {
        let file = file.display().to_string();
        let words = ["calib", "convert", &file, "--out", &raw_text];
        steps.push(Step::new(&words, Some(raw)));
        return steps;
    }
    let board = arguments.board.as_ref().map(ToString::to_string).unwrap_or_default();
    let report = if arguments.people.is_some() {
        room.join("lenses.html")
    } else {
        room.join("rig.html")
    };
    let report = report.display().to_string();
    let mut words = vec!["calibrate", "board", "--board", &board];
    if arguments.people.is_some() {
        words.push("--intrinsics");
    }
    words.extend(arguments.show.iter().map(String::as_str));
    words.extend(["--out", &raw_text, "--report", &report]);
    steps.push(Step::new(&words, Some(raw.clone())));
    if !arguments.floor.is_empty() {
        let mut words = vec!["calibrate", "origin", raw_text.as_str(), "--board", &board];
        words.extend(arguments.floor.iter().map(String::as_str));
        words.extend(["--out", &rig_text]);
        steps.push(Step::new(&words, Some(rig)));
    }
    steps
}

fn later_steps(arguments: &Arguments, deployment: &Path) -> Vec<Step> {
    let file = deployment.display().to_string();
    let mut steps = Vec::new();
    if let Some(metres) = arguments.people {
        let in_room = |name: &str| arguments.room.join(name).display().to_string();
        let rig = arguments.room.join("rig.toml");
        let (height, out, page) = (metres.to_string(), in_room("rig.toml"), in_room("rig.html"));
        // Paths in the deployment file are relative to its folder.
        let lenses = format!("rig={LENSES}");
        let mut words = vec!["calibrate", "people", &file, "--set", &lenses];
        words.extend(["--height-m", &height, "--out", &out, "--report", &page]);
        if arguments.sync {
            words.extend(["--window", "2"]);
        }
        steps.push(Step::new(&words, Some(rig)));
    }
    steps.push(Step::new(&["config", "check", &file], None));
    if arguments.sync {
        let page = arguments.room.join("clocks.html");
        let page_text = page.display().to_string();
        let words = ["sync", "estimate", &file, "--write", "--out", &page_text];
        steps.push(Step::new(&words, Some(page)));
    }
    if arguments.run {
        steps.push(Step::new(&["run", &file], None));
    }
    steps
}

/// Returns the text of the deployment file: the cameras, the rig and the output folder.
fn deployment_text(arguments: &Arguments) -> Result<String, Failure> {
    let stem = arguments.room.file_name().unwrap_or_default().to_string_lossy();
    let plain = |letter: char| {
        if letter.is_ascii_alphanumeric() || letter == '-' {
            letter
        } else {
            '-'
        }
    };
    let name: String = stem.chars().map(plain).collect();
    let name = if geometry::is_plain_name(&name) {
        name
    } else {
        "room".to_owned()
    };
    let mut text = format!(
        "# Created by `parallax new`. All other settings have defaults: `parallax config show` prints them.\n\n\
         name = {name:?}\nrig = \"rig.toml\"\noutput = \"out\"\n"
    );
    if let Some(up) = arguments.up {
        text.extend([format!("up = [{:?}, {:?}, {:?}]\n", up.x, up.y, up.z)]);
    }
    let is_camera = |name: &str| {
        let names = arguments.camera.iter().map(|camera| CameraFootage::of(camera).name);
        names.into_iter().any(|camera| camera == name)
    };
    if let Some(stray) = arguments.offset.iter().find(|offset| !is_camera(&offset.camera)) {
        let message = format!("--offset {}: no --camera has this name", stray.camera);
        return Err(Failure::new(ExitKind::Usage, message));
    }
    for camera in &arguments.camera {
        let CameraFootage { name, paths } = CameraFootage::of(camera);
        let source = source(&paths[0]).or_fail(ExitKind::Input)?;
        let source = toml::Value::from(source);
        text.extend([format!(
            "\n[[camera]]\nname = {name:?}\nsource = {source}\n"
        )]);
        if let Some(offset) = arguments.offset.iter().find(|offset| offset.camera == name) {
            text.extend([format!("source_offset_px = {:?}\n", offset.px)]);
        }
    }
    Ok(text)
}

/// Position of a camera's footage within the calibrated picture.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Offset {
    camera: String,
    px: [u32; 2],
}

fn offset(text: &str) -> Result<Offset, String> {
    let parsed = || {
        let (camera, numbers) = text.rsplit_once('=')?;
        let (x, y) = numbers.split_once(',')?;
        let px = [x.trim().parse().ok()?, y.trim().parse().ok()?];
        let camera = camera.to_owned();
        Some(Offset { camera, px })
    };
    parsed().ok_or_else(|| "expected NAME=X,Y in whole pixels, for example left=0,240".to_owned())
}

/// Returns an absolute path for a file. Addresses and devices are returned unchanged.
fn source(path: &str) -> std::io::Result<String> {
    if footage::is_address(path) {
        return Ok(path.to_owned());
    }
    Ok(absolute(path)?.display().to_string())
}
