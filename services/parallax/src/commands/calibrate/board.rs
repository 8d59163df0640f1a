//! `parallax calibrate board`: calibrates cameras from a board that is moved around, and draws boards to print.

mod print;
mod words;

use std::path::PathBuf;
use std::process::ExitCode;

use calibration::board::LensKind;
use calibration::boards::{Board, Paper};
use clap::{Args, ValueEnum};
use failure::{Console as _, ExitKind, Failure, OrFail as _, Stop, in_file};
use geometry::files::ReadOptions;
use rigs::boards::{
    Back, BoardSettings, Calibrated, CameraFootage, LookSettings, calibrate, read_frames,
    write_corners,
};
use terminal::{Globals, Terminal, output};

use crate::commands::calib::To;

/// The progress bar.
const BAR: &str = "{elapsed_precise} {bar:20} {pos}/{len} pictures, {per_sec}{left} {prefix} {msg}";

/// Options of `parallax calibrate board`.
#[derive(Debug, Args)]
#[command(after_help = "\
A board is KIND:COLUMNSxROWS:SIDE, with options after further colons:
    charuco:7x5:40mm                  7 x 5 squares; markers of 4x4_1000 (4x4_50 has the same first markers), 0.75 of a square
    charuco:4x5:5.4cm:5x5_250:marker=0.8:legacy      another dictionary, larger markers, the layout of OpenCV before 4.6
    chessboard:9x6:25mm               9 x 6 inner corners
    aprilgrid:6x6:88mm:36h11:gap=0.3  6 x 6 tags with gaps of 0.3 of a tag

Move the board through the whole volume, tilted by 30 to 45 degrees, near and far, and into the corners of every picture. At least two \
cameras at a time must see the board. A table says which pictures were taken together: --timestamps, or timestamps.csv beside the first video. \
It has the format of Caliscope: the n-th row of a camera is its n-th picture. Without a table, pictures with the same number \
belong together; if frame rates differ, pictures with the same time.

The world has the axes and origin of the first camera. `parallax calibrate origin` moves its origin to the floor. If the result is doubtful, \
the files are written, the report and the rig state the doubts, and the exit code is 7. Without a result, the exit code is 5, \
or 4 if no picture shows the board.

With --json, prints one object:
    {\"is_trusted\", \"doubts\", \"notes\", \"board\", \"sigma_px\",
     \"cameras\": [{\"name\", \"size_px\", \"pictures\", \"boards\", \"boards_used\", \"corners\", \"left_out\", \"rms_px\", \"rms_of_all_px\",
                  \"coverage\", \"numbers\": {NAME: {\"value\", \"sd\"}}}],
     \"pairs\": [{\"cameras\", \"together\", \"agree\", \"distance_m\"}]}

Examples:
    parallax calibrate board --print charuco:7x5:40mm --out board.pdf
    parallax calibrate board --board charuco:7x5:40mm cam0.mp4 cam1.mp4 cam2.mp4 --out rig.toml --report rig.html
    parallax calibrate board --board chessboard:9x6:25mm left*.jpg --intrinsics --out left.toml
    parallax calibrate board --board charuco:7x5:40mm wide=a.mp4 b=b.mp4 --known lenses.toml --out rig.toml")]
pub(crate) struct Arguments {
    /// One video, folder of pictures or pattern per camera, in the order of the rig. NAME=PATH names the camera. With --intrinsics, several
    /// pictures of the same camera may be given.
    #[arg(value_name = "FOOTAGE", required_unless_present = "print", num_args = 1..)]
    footage: Vec<String>,
    /// The board.
    #[arg(long, value_name = "BOARD", required_unless_present = "print")]
    board: Option<Board>,
    /// Find only the intrinsics, separately for each camera.
    #[arg(long)]
    intrinsics: bool,
    /// Calibration (in any format) whose intrinsics are kept. Its cameras must have the same names.
    #[arg(long, value_name = "FILE")]
    known: Option<PathBuf>,
    /// The lens model.
    #[arg(long, value_enum, default_value_t = Lens::Five)]
    lens: Lens,
    /// Table that states which pictures were taken together, with the columns `sync_index` and `cam_id`.
    #[arg(long, value_name = "FILE")]
    timestamps: Option<PathBuf>,
    /// Search every n-th frame. If not given, N depends on the length of the footage.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    every: Option<u32>,
    /// Maximum number of pictures per camera that are searched for the board.
    #[arg(long, value_name = "N", default_value_t = 400, value_parser = clap::value_parser!(u32).range(1..))]
    most_pictures: u32,
    /// Maximum number of frames to use. They are chosen so that the boards cover as much of the pictures as possible.
    #[arg(long, value_name = "N", default_value_t = 120, value_parser = clap::value_parser!(u32).range(3..=2000))]
    most_frames: u32,
    /// Read the corners from a table with the columns of Caliscope, instead of searching the pictures.
    #[arg(long, value_name = "FILE")]
    corners: Option<PathBuf>,
    /// Write the corners to a table with the columns of Caliscope.
    #[arg(long, value_name = "FILE")]
    save_corners: Option<PathBuf>,
    /// Treat all footage as mirrored.
    #[arg(long)]
    mirrored: bool,
    /// Back of the board: `mirrored` or `blank`. If not given, it is determined from the pictures where possible. A mirrored back, for
    /// cameras on both sides, shows the mirror image of the front: each corner is exactly behind the same corner of the front.
    #[arg(long, value_enum, conflicts_with = "mirrored")]
    back: Option<BackName>,
    /// File for the calibration. With --print, file for the board (.pdf or .svg). If not given, both a PDF and an SVG file are written.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Format of the calibration file.
    #[arg(long, value_enum, default_value_t = To::Rig)]
    to: To,
    /// Write a page with residuals, coverage, estimates with their uncertainty, the rig, and the worst pictures.
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    /// Draw a board to print.
    #[arg(long, value_name = "BOARD", conflicts_with_all = ["footage", "board", "corners"])]
    print: Option<Board>,
    /// Page size: a4, a3, a2, a1, a0, letter, legal, tabloid, `WIDTHxHEIGHT` in mm, or fit (the smallest of A4 to A0 that holds the board).
    #[arg(long, value_name = "PAGE", default_value = "fit", requires = "print")]
    paper: Paper,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// The lens model.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum Lens {
    /// Pinhole with k1, k2, k3, p1, p2.
    Five,
    /// Pinhole with k1 to k6, p1, p2. Suitable for wide lenses, if there are many pictures.
    Eight,
    /// Fisheye with k1 to k4.
    Fisheye,
}

/// The back of a board.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum BackName {
    /// The mirror image of the front.
    Mirrored,
    /// No pattern.
    Blank,
}

/// Runs the subcommand.
pub(super) fn run(arguments: &Arguments, globals: Globals) -> Result<ExitCode, Failure> {
    if let Some(board) = &arguments.print {
        return print::run(board, arguments.paper, arguments.out.as_deref());
    }
    let stop = Stop::on_signals().or_fail(ExitKind::Run)?;
    let settings = settings(arguments)?;
    let terminal = Terminal::with_bar(globals.quiet, false, BAR)
        .ticking()
        .in_lines_off_terminals("pictures");
    let calibrated = calibrate(&settings, &stop, &terminal);
    terminal.finish();
    let calibrated = calibrated?;
    if arguments.json {
        output::json(&words::json(&calibrated))?;
    } else {
        words::table(&calibrated)?;
    }
    write(arguments, &settings, &calibrated)?;
    let doubts = calibrated.doubts();
    if doubts.is_empty() {
        return Ok(ExitCode::SUCCESS);
    }
    let message = format!("the calibration is doubtful:\n  {}", doubts.join("\n  "));
    Err(Failure::new(ExitKind::Degraded, message))
}

fn settings(arguments: &Arguments) -> Result<BoardSettings, Failure> {
    let board = arguments.board.clone();
    let board = board.ok_or("--board is missing").or_fail(ExitKind::Usage)?;
    let frames = arguments.timestamps.as_deref().map(read_frames).transpose()?;
    let options = ReadOptions {
        lenses_suffice: true,
        ..ReadOptions::default()
    };
    let known = arguments
        .known
        .as_ref()
        .map(|known| inputs::rig(&[known], &options))
        .transpose()?;
    Ok(BoardSettings {
        board,
        cameras: cameras(arguments),
        look: LookSettings {
            every: arguments.every.map(|every| every as usize),
            most: arguments.most_pictures as usize,
            first: None,
            frames,
        },
        corners: arguments.corners.clone(),
        known,
        lens: match arguments.lens {
            Lens::Five => LensKind::Five,
            Lens::Eight => LensKind::Eight,
            Lens::Fisheye => LensKind::Fisheye,
        },
        wants_rig: !arguments.intrinsics,
        most_frames: arguments.most_frames as usize,
        is_mirrored: arguments.mirrored,
        back: arguments.back.map(|back| match back {
            BackName::Mirrored => Back::Mirrored,
            BackName::Blank => Back::Blank,
        }),
    })
}

/// Returns one camera per path. For intrinsics alone, several single pictures are one camera.
fn cameras(arguments: &Arguments) -> Vec<CameraFootage> {
    let each: Vec<CameraFootage> =
        arguments.footage.iter().map(|footage| CameraFootage::of(footage)).collect();
    let is_picture = |camera_footage: &CameraFootage| {
        let path = PathBuf::from(&camera_footage.paths[0]);
        path.is_file() && footage::is_image(&path).unwrap_or(false)
    };
    if arguments.intrinsics && each.len() > 1 && each.iter().all(is_picture) {
        let name = each[0].name.clone();
        let paths = each.into_iter().flat_map(|camera| camera.paths).collect();
        return vec![CameraFootage { name, paths }];
    }
    each
}

fn write(
    arguments: &Arguments,
    settings: &BoardSettings,
    calibrated: &Calibrated,
) -> Result<(), Failure> {
    if let Some(file) = &arguments.save_corners {
        write_corners(file, &calibrated.task.sights, &calibrated.task.names)?;
        output::message(format_args!("wrote {}", file.display()));
    }
    if let Some(file) = &arguments.out {
        let rig = calibrated.rig()?;
        geometry::files::write(file, arguments.to.format(), &rig).or_fail(ExitKind::Calibration)?;
        output::message(format_args!("wrote {}", file.display()));
    }
    if let Some(file) = &arguments.report {
        let page = calibrated.page(&settings.cameras, &words::about(arguments, calibrated))?;
        files::replace(file, page.as_bytes()).map_err(|error| in_file(file, &error))?;
        output::message(format_args!("wrote {}", file.display()));
    }
    Ok(())
}
