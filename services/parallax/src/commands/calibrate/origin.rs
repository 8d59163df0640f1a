//! `parallax calibrate origin`: moves the origin of a rig to the floor.

mod stood;

use std::path::PathBuf;
use std::process::ExitCode;

use calibration::boards::Board;
use calibration::origin::{Click, OriginError, from_board, from_floor, from_points, rebased};
use calibration::people::Vertical;
use clap::Args;
use failure::{ExitKind, Failure, OrFail as _, Stop};
use geometry::Rig;
use geometry::files::{Format, ReadOptions};
use nalgebra::Point2;
use rigs::boards::{CameraFootage, LookSettings, look};
use terminal::{Globals, Terminal, output};

/// Options of `parallax calibrate origin`.
#[derive(Debug, Args)]
#[command(after_help = "\
The floor can be found from a board, three points, or people.

With --board, a board is on the floor, with its printed side up. The origin is the upper left corner of the board. x runs along its rows, \
y against its columns, and z is up.

With --at, --x and --floor, three points on the floor are given: the origin, a point on the x axis, and any other point. Give each point as pixels of \
at least two cameras.

With --people, the floor is below the feet of people who stand in a finished run of this rig. The origin is in the \
middle of the places where they stood, and x is as close to the old x as possible. If a person walked about, the vertical is perpendicular to \
the plane of the standing feet. Otherwise it is the direction of upright bodies. This is less certain: the file is written, but the exit code is 7.

Examples:
    parallax calibrate origin rig.toml --board charuco:7x5:40mm cam0.mp4 cam1.mp4 --frames 1 --out room.toml
    parallax calibrate origin rig.toml --out room.toml --at cam0=412,633 --at cam1=820.5,590 \\
        --x cam0=700,610 --x cam1=1010,566 --floor cam0=500,480 --floor cam1=700,500
    parallax calibrate origin rig.toml --people out/walk --out room.toml")]
pub(crate) struct Arguments {
    /// The rig: a calibration in any format.
    rig: PathBuf,
    /// Footage of the board on the floor, one path per camera of the rig: NAME=PATH, or a file with the name of the camera.
    #[arg(value_name = "FOOTAGE", requires = "board")]
    footage: Vec<String>,
    /// The board.
    #[arg(long, value_name = "BOARD", requires = "footage")]
    board: Option<Board>,
    /// Number of frames, from the first, in which the board does not move.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u64).range(1..=1000))]
    frames: u64,
    /// Pixel at which a camera sees the origin. Give the option once per camera.
    #[arg(long, value_name = "CAMERA=X,Y", conflicts_with = "board", requires_all = ["x", "floor"])]
    at: Vec<String>,
    /// Pixel at which a camera sees a point on the x axis.
    #[arg(long, value_name = "CAMERA=X,Y")]
    x: Vec<String>,
    /// Pixel at which a camera sees any other point of the floor.
    #[arg(long, value_name = "CAMERA=X,Y")]
    floor: Vec<String>,
    /// Folder of a finished run of this rig in which a person walks about.
    #[arg(long, value_name = "RUN", conflicts_with_all = ["board", "at"])]
    people: Option<PathBuf>,
    /// Frames per second, if the run has no frame rate.
    #[arg(long, value_name = "HZ", requires = "people", value_parser = rate)]
    rate: Option<f64>,
    /// The rig file to write.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

fn rate(text: &str) -> Result<f64, String> {
    let rate = text.parse().ok().filter(|value| (0.1..=1000.0).contains(value));
    rate.ok_or_else(|| format!("expected 0.1 to 1000 frames per second, got {text:?}"))
}

/// Runs the subcommand.
pub(super) fn run(arguments: &Arguments, globals: Globals) -> Result<ExitCode, Failure> {
    let rig = inputs::rig(&[&arguments.rig], &ReadOptions::default())?;
    let mut by_bodies = false;
    let (new_from_old, source) = match (&arguments.board, &arguments.people) {
        (Some(board), _) => (
            by_board(arguments, &rig, board, globals)?,
            format!("origin from {board}"),
        ),
        (None, Some(run)) => {
            let floor = stood::find(&rig, run, arguments.rate)?;
            by_bodies = floor.vertical != Vertical::Feet;
            output::message(format_args!(
                "found the floor below {} standing feet, whose heights differ by {:.0} mm (median)",
                floor.n,
                1e3 * floor.spread_m
            ));
            (from_floor(&floor), "origin from standing people".to_owned())
        }
        (None, None) if arguments.at.is_empty() => {
            let message = "no board, no points on the floor and no people are given";
            let hint = "pass --board BOARD FOOTAGE..., or --at, --x and --floor, or --people RUN";
            return Err(Failure::new(ExitKind::Usage, message).with_hint(hint));
        }
        (None, None) => {
            let clicks = [&arguments.at, &arguments.x, &arguments.floor];
            let clicks = clicks.map(|texts| clicks_of(&rig, texts));
            let [at, x, floor] = clicks;
            let found = from_points(&rig, &[at?, x?, floor?]).or_fail(ExitKind::Calibration)?;
            (found, "origin from three points".to_owned())
        }
    };
    let new = rebased(&rig, &new_from_old, &source).or_fail(ExitKind::Calibration)?;
    geometry::files::write(&arguments.out, Format::Own, &new).or_fail(ExitKind::Input)?;
    for camera in new.cameras() {
        let at = camera.centre_in_world();
        output::line(format_args!(
            "{:<14} at ({:.3}, {:.3}, {:.3}) m",
            camera.name, at.x, at.y, at.z
        ))?;
    }
    output::message(format_args!("wrote {}", arguments.out.display()));
    let below = new.cameras().iter().find(|camera| camera.centre_in_world().z < 0.0);
    match below {
        None if by_bodies => {
            let message = "all feet stood on one spot, so the vertical was found from upright bodies, and is only accurate to a few \
                           degrees";
            let hint = "to find it from the feet, use a run in which a person walks about";
            Err(Failure::new(ExitKind::Degraded, message).with_hint(hint))
        }
        None => Ok(ExitCode::SUCCESS),
        Some(camera) => Err(Failure::new(
            ExitKind::Degraded,
            format!(
                "camera {} is now below the floor: was the board, the point or the person really on the floor?",
                camera.name
            ),
        )),
    }
}

fn by_board(
    arguments: &Arguments,
    rig: &Rig,
    board: &Board,
    globals: Globals,
) -> Result<nalgebra::Isometry3<f64>, Failure> {
    let stop = Stop::on_signals().or_fail(ExitKind::Run)?;
    let cameras: Vec<CameraFootage> =
        arguments.footage.iter().map(|footage| CameraFootage::of(footage)).collect();
    let places: Vec<usize> = cameras
        .iter()
        .map(|camera| camera_named(rig, &camera.name))
        .collect::<Result<_, _>>()?;
    let settings = LookSettings {
        every: Some(1),
        first: Some(arguments.frames),
        ..LookSettings::default()
    };
    let terminal = Terminal::without_bar(globals.quiet, false);
    let looked = look(board, &cameras, &settings, &stop, &terminal)?;
    let mut sights = looked.sights();
    for sight in &mut sights {
        sight.camera = places[sight.camera];
    }
    from_board(rig, &looked.layout.points, &sights).map_err(|error| {
        let hint = match error {
            OriginError::BoardApart { .. } => {
                "set --frames to the number of frames in which the board does not move"
            }
            _ => "is the board flat on the floor and in view of a camera in the first frames?",
        };
        Failure::new(ExitKind::Calibration, error).with_hint(hint)
    })
}

fn camera_named(rig: &Rig, name: &str) -> Result<usize, Failure> {
    let found = rig.cameras().iter().position(|camera| camera.name == name);
    found.ok_or_else(|| {
        let known: Vec<&str> = rig.cameras().iter().map(|camera| camera.name.as_str()).collect();
        Failure::new(
            ExitKind::Usage,
            format!("the rig has the cameras {}, not {name}", known.join(", ")),
        )
    })
}

/// Parses several `CAMERA=X,Y`.
fn clicks_of(rig: &Rig, texts: &[String]) -> Result<Vec<Click>, Failure> {
    let each = texts.iter().map(|text| {
        let parts = text.split_once('=').and_then(|(name, at)| {
            let (x, y) = at.split_once(',')?;
            let number =
                |text: &str| text.trim().parse::<f64>().ok().filter(|value| value.is_finite());
            Some((name, Point2::new(number(x)?, number(y)?)))
        });
        let (name, at) = parts.ok_or_else(|| {
            Failure::new(
                ExitKind::Usage,
                format!("{text:?}: expected CAMERA=X,Y in pixels"),
            )
        })?;
        Ok((camera_named(rig, name)?, at))
    });
    each.collect()
}
