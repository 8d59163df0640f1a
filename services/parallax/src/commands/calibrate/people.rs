//! `parallax calibrate people`: finds the poses of cameras from people walking about.

use std::process::ExitCode;

use calibration::people::{Doubt, Outcome, Recording, Scale, Settings, Vertical, estimate};
use clap::Args;
use failure::wording::Table;
use failure::{ExitKind, Failure, OrFail as _, Stop, in_file, uninterrupted};
use launch::films::Poses;
use launch::load;
use serde_json::{Value, json};
use terminal::{Globals, output};

use super::misfits;
use super::walk::{Walk, WalkArguments, refuse, walk, write_rig};

/// Hint for the user if the result is refused.
const HINT: &str = "let one person walk through the whole volume for half a minute, in view of at least two cameras at every moment, \
moving the arms and turning; check that the intrinsics fit the pictures (`parallax calib show`); if the cameras were not started \
together, search for clock offsets with --window 2; if nothing helps, calibrate with a board";

/// Hint for the user if the result is too uncertain.
const CAUTION_HINT: &str = "to improve it, use longer footage in which the person walks through more of the volume, in all directions; the residuals \
of a run with this rig show how large the errors of joints are";

/// Options of `parallax calibrate people`.
#[derive(Debug, Args)]
#[command(after_help = "\
People are read from the `keypoints` of a camera, or found by its network, as in `parallax sync estimate`. \
It is best if only one person walks about. If there are several people, the command uses the person whom the cameras see together for the \
longest time. The deployment's rig supplies intrinsics and names. Its poses are only used with `--scale rig`.

Pictures do not show the scale. Give the person's standing height (--height-m), which is compared with the lengths of the bones. The scale is then \
right to 2 or 3 percent for usual proportions. Or give the distance between two cameras (--distance), or keep the scale and the world of \
the given rig (--scale rig). Without `--scale rig`, the world has its floor at z = 0, its origin under the middle of the walk, and z \
pointing up. The vertical is found from the standing feet, or else from upright bodies.

A result is refused if two halves of the recording give different rigs, a camera has too \
little in common with the others, its pose is too uncertain, or no person was found. All reasons are printed, nothing is written, and the \
exit code is 7. If the pose of a camera is uncertain by more than 0.3 degrees or 1 percent of its distance to the people (one standard \
deviation), the rig is written with a note. Every such camera is printed, and the exit code is 6.

The clock offsets of the deployment are used, unless --window is given, or joints fit clearly better with other offsets.

With --json, prints one object:
    {\"is_determined\", \"doubts\": [text], \"cautions\": [text], \"clocks_are_found\", \"instants\", \"span_s\", \"vertical\", \"scale_error\", \"stature_metres\", \"exchanged\",
     \"cameras\": [{\"name\", \"found_by\", \"centre_metres\", \"joints\", \"residual_px\", \"inliers\", \"rotation_sd_degrees\",
                  \"centre_sd_metres\", \"focal_px\", \"focal_sd_px\", \"halves_degrees\", \"halves_metres\", \"offset_ms\",
                  \"offset_sd_ms\"}]}

Examples:
    parallax calibrate people my.toml --height-m 1.78 --out rig.toml
    parallax calibrate people my.toml --distance cam01:cam03=4.27 --out rig.toml --report rig.html
    parallax calibrate people my.toml --height-m 1.78 --window 2 --json")]
pub(crate) struct Arguments {
    #[command(flatten)]
    walk: WalkArguments,
    /// Standing height of the person, in metres.
    #[arg(long, value_name = "METRES", value_parser = height, conflicts_with_all = ["distance", "scale"])]
    height_m: Option<f64>,
    /// Distance between two cameras in metres, for example `cam01:cam03=4.27`.
    #[arg(long, value_name = "A:B=METRES", value_parser = distance, conflicts_with = "scale")]
    distance: Option<(String, String, f64)>,
    /// Keep the scale and the world of the deployment's rig.
    #[arg(long, value_name = "rig", value_parser = ["rig"])]
    scale: Option<String>,
    /// Also estimate focal lengths, which makes the result less certain.
    #[arg(long)]
    focal: bool,
    /// Largest clock offset between two cameras, in seconds. Offsets of a few pictures are found without this option.
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0, value_parser = window)]
    window: f64,
    /// Seed of the random samples. Try another seed to see their influence.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
}

/// Parses the standing height of a person, in metres.
pub(crate) fn height(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|value| (0.8..=2.4).contains(value));
    number.ok_or_else(|| format!("expected 0.8 to 2.4 metres, got {text:?}"))
}

fn window(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|value| (0.0..=10.0).contains(value));
    number.ok_or_else(|| format!("expected 0 to 10 seconds, got {text:?}"))
}

fn distance(text: &str) -> Result<(String, String, f64), String> {
    let expected = || format!("expected CAMERA:CAMERA=METRES, got {text:?}");
    let (pair, metres) = text.rsplit_once('=').ok_or_else(expected)?;
    let (a, b) = pair.split_once(':').ok_or_else(expected)?;
    let metres = metres.parse().ok().filter(|value| (0.01..=1000.0).contains(value));
    Ok((a.to_owned(), b.to_owned(), metres.ok_or_else(expected)?))
}

/// Fails if the scale of the rig is to be kept, but the rig contains only intrinsics.
fn has_places(arguments: &WalkArguments) -> Result<(), Failure> {
    let deployment = load::read(&arguments.config, &arguments.set)?.deployment;
    let rig = inputs::rig_of(&deployment)?;
    let lacking = deployment.cameras.iter().find(|camera| rig.camera(&camera.name).is_none());
    let Some(camera) = lacking else {
        return Ok(());
    };
    let message = format!(
        "{} has {}",
        deployment.rig.display(),
        rig.lacks(&camera.name)
    );
    let failure = Failure::new(ExitKind::Calibration, message);
    Err(failure.with_hint(
        "the rig has no camera poses, so it has no scale to keep: give --height-m or --distance",
    ))
}

pub(super) fn run(arguments: &Arguments, globals: Globals) -> Result<ExitCode, Failure> {
    if arguments.height_m.is_none() && arguments.distance.is_none() && arguments.scale.is_none() {
        let message = "pictures do not show the scale: give the height of the person (--height-m), the distance between two cameras (--distance), \
                       or keep the scale of the deployment's rig (--scale rig)";
        return Err(Failure::new(ExitKind::Usage, message));
    }
    let stop = Stop::on_signals().or_fail(ExitKind::Run)?;
    if arguments.scale.is_some() {
        has_places(&arguments.walk)?;
    }
    let walk = walk(&arguments.walk, Poses::Unknown, globals, &stop)?;
    let settings = settings(arguments, &walk)?;
    let (cameras, films) = (walk.found.cameras.clone(), walk.found.films.clone());
    let estimated = move || {
        let recording = Recording {
            cameras: &cameras,
            films: &films,
        };
        estimate(&recording, &settings)
    };
    let outcome = uninterrupted(&stop, estimated)?.or_fail(ExitKind::Input)?;
    let names = walk.names();
    if arguments.walk.json {
        output::json(&as_json(&outcome, &names, &walk.found.finders))?;
    } else {
        table(&outcome, &names)?;
    }
    if let Some(file) = &arguments.walk.report {
        write_page(file, arguments, &outcome, &walk)?;
        output::message(format_args!("wrote {}", file.display()));
    }
    refuse(&outcome.doubts, &names, HINT)?;
    if let Some(file) = &arguments.walk.out {
        let source = format!(
            "calibrated from a person walking about, over {} instants{}{}",
            outcome.n_instants,
            source_of_scale(arguments),
            how_sure(&outcome)
        );
        write_rig(file, outcome.cameras.clone(), outcome.up, &source)?;
        output::message(format_args!("wrote {}", file.display()));
    }
    warn(&outcome.cautions, &names)?;
    Ok(ExitCode::SUCCESS)
}

/// Fails if the result is too uncertain. The rig file has been written nevertheless.
fn warn(cautions: &[Doubt], names: &[&str]) -> Result<(), Failure> {
    if cautions.is_empty() {
        return Ok(());
    }
    let texts: Vec<String> = cautions.iter().map(|caution| caution.text(names)).collect();
    let message = format!(
        "the rig is usable, but uncertain:\n  {}",
        texts.join("\n  ")
    );
    Err(Failure::new(ExitKind::Limit, message).with_hint(CAUTION_HINT))
}

/// Describes the uncertainty of the least certain camera.
fn how_sure(outcome: &Outcome) -> String {
    let worst =
        |axis: usize| outcome.reports.iter().map(|report| report.sd[axis]).fold(0.0, f64::max);
    format!(
        ", cameras known to within {:.2} degrees and {:.0} mm",
        worst(0),
        1e3 * worst(1)
    )
}

fn source_of_scale(arguments: &Arguments) -> String {
    match (&arguments.height_m, &arguments.distance) {
        (Some(metres), _) => format!(", scale from a height of {metres} m"),
        (None, Some((a, b, metres))) => {
            format!(", scale from a distance of {metres} m between {a} and {b}")
        }
        (None, None) => ", scale and world of the previous rig".to_owned(),
    }
}

fn settings(arguments: &Arguments, walk: &Walk) -> Result<Settings, Failure> {
    let number = |name: &String| {
        let names = walk.names();
        names.iter().position(|other| other == name).ok_or_else(|| {
            let message = format!(
                "--distance: there is no camera {name:?}; the cameras are {}",
                names.join(", ")
            );
            Failure::new(ExitKind::Usage, message)
        })
    };
    let scale = match (arguments.height_m, &arguments.distance) {
        (Some(metres), _) => Scale::Height(metres),
        (None, Some((a, b, metres))) => {
            let (a, b) = (number(a)?, number(b)?);
            if a == b {
                let message = "--distance names the same camera twice";
                return Err(Failure::new(ExitKind::Usage, message));
            }
            Scale::Distance(a, b, *metres)
        }
        (None, None) => Scale::Rig,
    };
    Ok(Settings {
        n_joints: walk.found.n_joints,
        sides: walk.found.sides.clone(),
        as_seen: walk.found.mirror.is_some(),
        offsets_s: walk.offsets_s.clone(),
        window_s: arguments.window,
        scale,
        focal: arguments.focal,
        most_instants: arguments.walk.instants as usize,
        seed: arguments.seed,
    })
}

/// Returns a description of how the vertical was found.
fn vertical(outcome: &Outcome) -> &'static str {
    match outcome.vertical {
        Vertical::Feet => "standing feet",
        Vertical::Bodies => "upright bodies",
        Vertical::Leaning => {
            "the mean of all bodies (nobody stood upright, so the vertical may be off by many degrees)"
        }
        Vertical::Rig => "the previous rig",
    }
}

fn table(outcome: &Outcome, names: &[&str]) -> Result<(), Failure> {
    let [from, to] = outcome.span_s;
    output::line(format_args!(
        "{} instants over {:.1} s; vertical from {}; scale known to within {:.1} %; height of the person from the bones {:.3} m; sides \
         of {} views swapped; clocks {}",
        outcome.n_instants,
        to - from,
        vertical(outcome),
        100.0 * outcome.scale_sd,
        outcome.stature_m.unwrap_or(f64::NAN),
        outcome.n_exchanged,
        if outcome.clocks_are_found {
            "found"
        } else {
            "as given"
        }
    ))?;
    let mut table = Table::new([
        "<camera",
        "centre, m",
        "joints",
        "resid, px",
        "fit, %",
        "+- deg",
        "+- mm",
        "halves, deg and mm",
        "offset, ms",
    ]);
    for ((name, camera), found) in names.iter().zip(&outcome.cameras).zip(&outcome.reports) {
        let centre = camera.centre_in_world();
        let halves = found.halves.map_or("-".to_owned(), |[degrees, metres]| {
            format!("{degrees:.2} {:.0}", 1e3 * metres)
        });
        let [offset_ms, offset_sd_ms] = found.offset_s.map(|seconds| 1e3 * seconds);
        table.row([
            (*name).to_owned(),
            format!("{:.3} {:.3} {:.3}", centre.x, centre.y, centre.z),
            found.joints.to_string(),
            format!("{:.2}", found.residual_px),
            format!("{:.0}", 100.0 * found.inliers),
            format!("{:.2}", found.sd[0]),
            format!("{:.0}", 1e3 * found.sd[1]),
            halves,
            format!("{offset_ms:.1} +- {offset_sd_ms:.1}"),
        ]);
    }
    output::line(table)?;
    for ((name, camera), it) in names.iter().zip(&outcome.cameras).zip(&outcome.reports) {
        if let Some(sd) = it.focal_sd_px {
            let focal = camera.intrinsics.fx;
            output::line(format_args!(
                "{name}: focal length {focal:.1} +- {sd:.1} px"
            ))?;
        }
    }
    Ok(())
}

fn as_json(outcome: &Outcome, names: &[&str], finders: &[String]) -> Value {
    let finite = |value: f64| value.is_finite().then_some(value);
    let each = names.iter().zip(&outcome.cameras).zip(&outcome.reports).zip(finders);
    let cameras: Vec<Value> = each
        .map(|(((name, camera), it), finder)| {
            let centre = camera.centre_in_world();
            json!({
                "name": name,
                "found_by": finder,
                "centre_metres": [centre.x, centre.y, centre.z],
                "joints": it.joints,
                "residual_px": finite(it.residual_px),
                "inliers": finite(it.inliers),
                "rotation_sd_degrees": finite(it.sd[0]),
                "centre_sd_metres": finite(it.sd[1]),
                "focal_px": camera.intrinsics.fx,
                "focal_sd_px": it.focal_sd_px.and_then(finite),
                "halves_degrees": it.halves.map(|half| half[0]),
                "halves_metres": it.halves.map(|half| half[1]),
                "offset_ms": 1e3 * it.offset_s[0],
                "offset_sd_ms": finite(1e3 * it.offset_s[1]),
            })
        })
        .collect();
    let doubts: Vec<String> = outcome.doubts.iter().map(|doubt| doubt.text(names)).collect();
    let cautions = outcome.cautions.iter().map(|caution| caution.text(names));
    let cautions: Vec<String> = cautions.collect();
    json!({
        "schema_version": 1,
        "is_determined": doubts.is_empty(),
        "doubts": doubts,
        "cautions": cautions,
        "clocks_are_found": outcome.clocks_are_found,
        "instants": outcome.n_instants,
        "span_s": outcome.span_s,
        "vertical": vertical(outcome),
        "scale_error": finite(outcome.scale_sd),
        "stature_metres": outcome.stature_m,
        "exchanged": outcome.n_exchanged,
        "cameras": cameras,
    })
}

fn write_page(
    file: &std::path::Path,
    arguments: &Arguments,
    outcome: &Outcome,
    walk: &Walk,
) -> Result<(), Failure> {
    let mut about = vec![(
        "deployment".to_owned(),
        format!(
            "{} ({})",
            walk.deployment.name,
            arguments.walk.config.display()
        ),
    )];
    let found = walk.names().into_iter().zip(&walk.found.finders);
    about.extend(found.map(|(name, finder)| (format!("joints of {name}"), finder.clone())));
    about.push((
        "scale".to_owned(),
        source_of_scale(arguments).trim_start_matches(", ").to_owned(),
    ));
    about.push(("vertical".to_owned(), vertical(outcome).to_owned()));
    let offsets_s: Vec<f64> = outcome.reports.iter().map(|report| report.offset_s[0]).collect();
    let pictures = misfits::of(
        walk,
        (&outcome.cameras, &offsets_s),
        (&outcome.times_s, &outcome.skeletons),
    );
    let page = exports::report::walk::of_people(outcome, &walk.names(), &about, &pictures);
    files::replace(file, page.as_bytes()).map_err(|error| in_file(file, &error))
}
