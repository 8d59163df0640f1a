//! `parallax calib`: shows, checks and converts calibrations.

mod own_views;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, Subcommand, ValueEnum};
use failure::{ExitKind, Failure, OrFail as _};
use geometry::files::{Format, ReadOptions, Unit};
use geometry::{Camera, LeftOut, Rig, Shared, Survey, upright_roll};
use serde_json::{Value, json};
use terminal::output;

/// The subcommands.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Print the content of a calibration: cameras, image sizes, positions.
    Show {
        #[command(flatten)]
        input: Input,
        /// Print JSON.
        #[arg(long)]
        json: bool,
    },
    /// Check units, handedness and image sizes. With --detections, also check that each view's own poses agree with the rig.
    #[command(after_help = "The exit code is 5 if something is probably wrong.")]
    Check {
        #[command(flatten)]
        input: Input,
        /// Poses that each view found alone: `pose2d.jsonl` of a run with one person and uncropped footage. Poses after fusion are not
        /// used, because they are projections of one solution and agree with any rig.
        #[arg(long, value_name = "FILE")]
        detections: Option<PathBuf>,
        /// Print JSON.
        #[arg(long)]
        json: bool,
    },
    /// Convert a calibration into a rig file, or into another program's format.
    #[command(after_help = "\
Examples:
    parallax calib convert Calib.qca.txt --out rig.toml
    parallax calib convert calibration_171204_pose1.json --out rig.toml      (CMU Panoptic)
    parallax calib convert C1.cal C2.cal --size 640 480 --up 0 0 1 --out rig.toml
    parallax calib convert rig.toml --to pose2sim --out Calib.toml")]
    Convert {
        #[command(flatten)]
        input: Input,
        /// The file to write, or an existing folder for `humaneva` and `umpm`.
        #[arg(long, value_name = "FILE")]
        out: PathBuf,
        /// Format of the file to write.
        #[arg(long, value_enum, default_value_t = To::Rig)]
        to: To,
    },
}

/// The files to read, and values that the files may lack.
#[derive(Debug, Args)]
pub(crate) struct Input {
    /// The calibration file, or one file per camera.
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Unit of length, if the format does not define it: m, cm, mm, ft, or in. If the unit of the calibration
    /// is the square of a board, give the side of a square, such as 30mm.
    #[arg(long)]
    unit: Option<Unit>,
    /// Upward direction in the world, if the file does not give it.
    #[arg(long, num_args = 3, value_names = ["X", "Y", "Z"], allow_hyphen_values = true)]
    up: Option<Vec<f64>>,
    /// Image size in pixels, if the file does not give it.
    #[arg(long, num_args = 2, value_names = ["WIDTH", "HEIGHT"])]
    size: Option<Vec<u32>>,
}

/// Output formats.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum To {
    /// Parallax's own rig file.
    Rig,
    /// TOML of Pose2Sim, Caliscope and similar programs.
    Pose2sim,
    /// TOML of anipose and `FreeMoCap`: as `pose2sim`, but in millimetres.
    Anipose,
    /// YAML of OpenCV.
    Opencv,
    /// One `.cal` file per camera.
    Humaneva,
    /// One `.ini` file per camera.
    Umpm,
}

impl To {
    /// Returns the format of the crate `geometry`.
    pub(crate) fn format(self) -> Format {
        match self {
            Self::Rig => Format::Own,
            Self::Pose2sim => Format::Pose2Sim,
            Self::Anipose => Format::Anipose,
            Self::Opencv => Format::OpenCv,
            Self::Humaneva => Format::HumanEva,
            Self::Umpm => Format::Umpm,
        }
    }
}

impl Input {
    /// Reads the calibration.
    ///
    /// * `lenses_suffice`: true to accept cameras without a position.
    fn read(&self, lenses_suffice: bool) -> Result<Rig, Failure> {
        let up = match self.up.as_deref() {
            Some(&[x, y, z]) => {
                let up = geometry::direction([x, y, z]);
                let message = format!("--up {x} {y} {z} is not a direction");
                Some(up.ok_or(message).or_fail(ExitKind::Usage)?)
            }
            _ => None,
        };
        let options = ReadOptions {
            unit: self.unit,
            up,
            size: match self.size.as_deref() {
                Some(&[width, height]) => Some([width, height]),
                _ => None,
            },
            lenses_suffice,
        };
        inputs::rig(&self.files, &options)
    }
}

/// Runs the subcommand.
pub(crate) fn run(command: &Command) -> Result<ExitCode, Failure> {
    match command {
        Command::Show { input, json } => show(&input.read(true)?, *json),
        Command::Check {
            input,
            detections,
            json,
        } => check(&input.read(false)?, detections.as_deref(), *json),
        Command::Convert { input, out, to } => {
            convert(&input.read(matches!(to, To::Rig))?, out, *to)
        }
    }
}

fn show(rig: &Rig, as_json: bool) -> Result<ExitCode, Failure> {
    if as_json {
        let cameras: Vec<Value> =
            rig.cameras().iter().map(|camera| describe(camera, rig)).collect();
        let up = rig.up_in_world().map(|up_in_world| <[f64; 3]>::from(up_in_world.into_inner()));
        output::json(&json!({
            "schema_version": 1, "source": rig.source(), "up": up, "cameras": cameras,
        }))?;
        return Ok(ExitCode::SUCCESS);
    }
    output::line(format_args!(
        "{} cameras; {}",
        rig.cameras().len(),
        rig.source()
    ))?;
    match rig.up_in_world() {
        Some(up) => output::line(format_args!(
            "up is ({:.3}, {:.3}, {:.3})",
            up.x, up.y, up.z
        ))?,
        None => output::line(
            "the upward direction is not known: a run finds this direction, unless `up` in the deployment sets it",
        )?,
    }
    for camera in rig.cameras() {
        let intrinsics = &camera.intrinsics;
        let centre = camera.centre_in_world();
        let roll = upright_roll(camera, rig).map_or("unknown".to_owned(), |value| {
            format!("{:.1} degrees", value.to_degrees())
        });
        let place = if has_place(rig, camera) {
            format!(
                "at ({:.3}, {:.3}, {:.3}) m, roll to upright {roll}",
                centre.x, centre.y, centre.z
            )
        } else {
            "position unknown".to_owned()
        };
        output::line(format_args!(
            "  {:<10} {}x{} px, f ({:.1}, {:.1}), c ({:.1}, {:.1}), {place}",
            camera.name,
            intrinsics.size[0],
            intrinsics.size[1],
            intrinsics.fx,
            intrinsics.fy,
            intrinsics.cx,
            intrinsics.cy,
        ))?;
        output::line(format_args!(
            "             lens {}",
            intrinsics.lens.model()
        ))?;
    }
    for LeftOut { camera, why } in rig.left_out() {
        output::line(format_args!("  {camera}: {why}"))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn has_place(rig: &Rig, camera: &Camera) -> bool {
    rig.left_out().iter().all(|missing| missing.camera != camera.name)
}

fn describe(camera: &Camera, rig: &Rig) -> Value {
    let intrinsics = &camera.intrinsics;
    json!({
        "name": camera.name,
        "size_px": intrinsics.size,
        "focal_px": [intrinsics.fx, intrinsics.fy],
        "principal_point_px": [intrinsics.cx, intrinsics.cy],
        "lens": intrinsics.lens.model().to_string(),
        "centre_m": has_place(rig, camera).then(|| <[f64; 3]>::from(camera.centre_in_world().coords)),
        "axis": has_place(rig, camera).then(|| <[f64; 3]>::from(camera.axis_in_world().into_inner())),
        "roll_to_upright_degrees": upright_roll(camera, rig).map(f64::to_degrees),
    })
}

fn check(rig: &Rig, detections: Option<&Path>, as_json: bool) -> Result<ExitCode, Failure> {
    let findings = geometry::files::check(rig);
    let has_problems = findings
        .iter()
        .any(|finding| finding.severity() != geometry::files::Severity::Note);
    let report = detections.map(|file| own_views::agreement(rig, file));
    let report = report.transpose()?;
    let disagreements = report.as_ref().map_or(&[][..], |report| &report.disagreements);
    let name = |index: usize| rig.cameras()[index].name.as_str();
    if as_json {
        let findings: Vec<Value> = findings
            .iter()
            .map(|finding| json!({ "severity": format!("{:?}", finding.severity()).to_lowercase(), "text": finding.to_string() }))
            .collect();
        let cameras = report.as_ref().map(|report| {
            let each = report.errors.cameras.iter();
            each.map(|error| json!({ "camera": name(error.camera), "median_px": error.median_px, "points": error.n_points }))
                .collect::<Vec<_>>()
        });
        output::json(&json!({
            "schema_version": 1, "findings": findings, "epipolar": cameras, "disagreements": disagreements,
            "survey": survey_json(&geometry::survey(rig)),
        }))?;
    } else {
        for finding in &findings {
            output::line(format_args!("{:?}: {finding}", finding.severity()))?;
        }
        output::line(survey_text(&geometry::survey(rig)))?;
        if findings.is_empty() {
            output::line("OK: no problems were found; check these numbers with a tape measure")?;
        }
        for camera in report.iter().flat_map(|report| &report.errors.cameras) {
            output::line(format_args!(
                "{}: median epipolar error {:.2} px over {} pairs of points",
                name(camera.camera),
                camera.median_px,
                camera.n_points
            ))?;
        }
        for disagreement in disagreements {
            output::line(format_args!("Warning: {disagreement}"))?;
        }
    }
    Ok(if has_problems || !disagreements.is_empty() {
        ExitCode::from(ExitKind::Calibration.status())
    } else {
        ExitCode::SUCCESS
    })
}

/// Formats the distances in a rig that the user can check with a tape measure.
fn survey_text(survey: &Survey) -> String {
    let mut lines = vec![format!("{} cameras", survey.cameras.len())];
    for place in &survey.cameras {
        let height = place.height_m.map(|height_m| format!("{height_m:.2} m above the origin"));
        let distance =
            place.distance_m.map(|distance_m| format!("{distance_m:.2} m from the middle"));
        let known: Vec<String> = height.into_iter().chain(distance).collect();
        lines.push(format!("  {:<12} {}", place.name, known.join(", ")));
    }
    if let Some([least, most]) = survey.apart_m {
        lines.push(format!(
            "distances between cameras: {least:.2} to {most:.2} m"
        ));
    }
    lines.push(match survey.shared {
        Some(Shared { sides_m: [x, y, z], volume_m3 }) => format!(
            "volume that all cameras see: {volume_m3:.1} m3, in a box of {x:.1} x {y:.1} x {z:.1} m around the middle"
        ),
        None => "volume that all cameras see: none".to_owned(),
    });
    if let Some(mm) = survey.error_mm {
        lines.push(format!(
            "an error of 1 px in every view moves a point in the middle by {mm:.1} mm"
        ));
    }
    lines.join("\n")
}

fn survey_json(survey: &Survey) -> Value {
    let cameras = survey.cameras.iter().map(|place| {
        json!({ "camera": place.name, "height_m": place.height_m, "distance_to_middle_m": place.distance_m })
    });
    json!({
        "cameras": cameras.collect::<Vec<_>>(),
        "camera_distance_m": survey.apart_m,
        "middle_m": survey.focus.map(|focus| <[f64; 3]>::from(focus.coords)),
        "shared_box_m": survey.shared.map(|shared| shared.sides_m),
        "shared_volume_m3": survey.shared.map(|shared| shared.volume_m3),
        "error_mm_per_px": survey.error_mm,
    })
}

fn convert(rig: &Rig, out: &Path, to: To) -> Result<ExitCode, Failure> {
    geometry::files::write(out, to.format(), rig).or_fail(ExitKind::Input)?;
    output::message(format_args!("wrote {}", out.display()));
    Ok(ExitCode::SUCCESS)
}
