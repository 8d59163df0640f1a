//! `parallax calibrate refine`: improves an existing rig with recorded footage.

use std::process::ExitCode;

use calibration::people::Recording;
use calibration::refine::{Outcome, Settings, refine};
use clap::Args;
use failure::wording::Table;
use failure::{ExitKind, Failure, OrFail as _, Stop, in_file, uninterrupted};
use launch::films::Poses;
use serde_json::{Value, json};
use terminal::{Globals, output};

use super::misfits;
use super::walk::{Walk, WalkArguments, refuse, walk, write_rig};

/// Hint for the user if the result is refused.
const HINT: &str = "let one person walk through the whole volume for half a minute; if a camera was moved far, \
or the rig belongs to other cameras, make a new rig: parallax calibrate people";

/// Options of `parallax calibrate refine`.
#[derive(Debug, Args)]
#[command(after_help = "\
The rig of the deployment is assumed to be correct to within --sd-degrees and --sd-mm. A camera is moved only if the joints determine its pose better than \
that. Clock offsets are also estimated, within --sd-ms of those in the deployment.

The new rig is judged with data that it was not fitted to. Each half of the recording judges the rig that was fitted to the other half, \
by the distance of each camera's joints from the positions that the other cameras predict.

Exit codes: 0 better, and --out is written; 6 not better, keep the rig; 7 refused, with all reasons.

With --json, prints one object:
    {\"verdict\": \"better\" | \"no better\" | \"refused\", \"doubts\": [text], \"instants\", \"before_px\", \"after_px\", \"certainty\",
     \"blocks\", \"blocks_better\",
     \"cameras\": [{\"name\", \"moved_degrees\", \"moved_metres\", \"rotation_sd_degrees\", \"centre_sd_metres\", \"is_told\",
                  \"before_px\", \"after_px\", \"residual_px\", \"offset_ms\"}]}

Examples:
    parallax calibrate refine my.toml --out rig.toml
    parallax calibrate refine my.toml --sd-degrees 0.2 --sd-mm 5 --report refined.html --json")]
pub(crate) struct Arguments {
    #[command(flatten)]
    walk: WalkArguments,
    /// Standard deviation of the camera rotations in the given rig, in degrees.
    #[arg(long, value_name = "DEGREES", default_value_t = 1.0, value_parser = deviation)]
    sd_degrees: f64,
    /// Standard deviation of the camera positions in the given rig, in millimetres.
    #[arg(long, value_name = "MM", default_value_t = 30.0, value_parser = deviation)]
    sd_mm: f64,
    /// Standard deviation of the clocks, in milliseconds. 0 keeps the clocks fixed.
    #[arg(long, value_name = "MS", default_value_t = 5.0, value_parser = clock)]
    sd_ms: f64,
    /// Also estimate focal lengths, which makes the result less certain.
    #[arg(long)]
    focal: bool,
}

fn deviation(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|value| (1e-3..=1e4).contains(value));
    number.ok_or_else(|| format!("expected 0.001 to 10000, got {text:?}"))
}

fn clock(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|value| (0.0..=1e3).contains(value));
    number.ok_or_else(|| format!("expected 0 to 1000 milliseconds, got {text:?}"))
}

pub(super) fn run(arguments: &Arguments, globals: Globals) -> Result<ExitCode, Failure> {
    let stop = Stop::on_signals().or_fail(ExitKind::Run)?;
    let walk = walk(&arguments.walk, Poses::OfRig, globals, &stop)?;
    let settings = Settings {
        n_joints: walk.found.n_joints,
        sides: walk.found.sides.clone(),
        offsets_s: walk.offsets_s.clone(),
        offset_sd_s: 1e-3 * arguments.sd_ms,
        pose_sd: [arguments.sd_degrees, 1e-3 * arguments.sd_mm],
        focal: arguments.focal,
        most_instants: arguments.walk.instants as usize,
    };
    let (cameras, films) = (walk.found.cameras.clone(), walk.found.films.clone());
    let refined = move || {
        let recording = Recording {
            cameras: &cameras,
            films: &films,
        };
        refine(&recording, &settings)
    };
    let outcome = uninterrupted(&stop, refined)?.or_fail(ExitKind::Input)?;
    let names = walk.names();
    if arguments.walk.json {
        output::json(&as_json(&outcome, &names))?;
    } else {
        table(&outcome, &names)?;
    }
    if let Some(file) = &arguments.walk.report {
        let about = about(arguments, &walk);
        let offsets_s: Vec<f64> = outcome.changes.iter().map(|change| change.offset_s).collect();
        let skeletons = (&outcome.times_s[..], &outcome.skeletons);
        let pictures = misfits::of(&walk, (&outcome.cameras, &offsets_s), skeletons);
        let page = exports::report::walk::of_refinement(&outcome, &names, &about, &pictures);
        files::replace(file, page.as_bytes()).map_err(|error| in_file(file, &error))?;
        output::message(format_args!("wrote {}", file.display()));
    }
    refuse(&outcome.doubts, &names, HINT)?;
    if !outcome.is_better {
        let message = format!(
            "the new rig is not better: the distance of held-out joints from the positions that the other cameras predict is {:.2} px with \
             the old rig, and {:.2} px with the new rig; keep the old rig",
            outcome.held_out_px[0], outcome.held_out_px[1]
        );
        return Err(Failure::new(ExitKind::Limit, message));
    }
    if let Some(file) = &arguments.walk.out {
        let before = inputs::rig_of(&walk.deployment)?;
        let source = format!(
            "{}; refined with a person, over {} instants",
            before.source(),
            outcome.n_instants
        );
        write_rig(file, outcome.cameras.clone(), before.up_in_world(), &source)?;
        output::message(format_args!("wrote {}", file.display()));
    }
    Ok(ExitCode::SUCCESS)
}

fn about(arguments: &Arguments, walk: &Walk) -> Vec<(String, String)> {
    let mut about = vec![
        (
            "deployment".to_owned(),
            format!(
                "{} ({})",
                walk.deployment.name,
                arguments.walk.config.display()
            ),
        ),
        (
            "believed".to_owned(),
            format!(
                "rotations to within {} degrees, positions to within {} mm, clocks to within {} ms",
                arguments.sd_degrees, arguments.sd_mm, arguments.sd_ms
            ),
        ),
    ];
    let found = walk.names().into_iter().zip(&walk.found.finders);
    about.extend(found.map(|(name, finder)| (format!("joints of {name}"), finder.clone())));
    about
}

fn table(outcome: &Outcome, names: &[&str]) -> Result<(), Failure> {
    output::line(format_args!(
        "{} instants; the distance of held-out joints from the positions that the other cameras predict is {:.2} px with the old rig, \
         and {:.2} px with the new rig; {} of {} blocks improved ({:.1} standard errors)",
        outcome.n_instants,
        outcome.held_out_px[0],
        outcome.held_out_px[1],
        outcome.blocks[1],
        outcome.blocks[0],
        outcome.certainty
    ))?;
    let mut table = Table::new([
        "<camera",
        "moved, deg",
        "mm",
        "+- deg",
        "+- mm",
        "told",
        "before, px",
        "after, px",
        "offset, ms",
    ]);
    for (name, change) in names.iter().zip(&outcome.changes) {
        table.row([
            (*name).to_owned(),
            format!("{:.2}", change.moved[0]),
            format!("{:.1}", 1e3 * change.moved[1]),
            format!("{:.2}", change.sd[0]),
            format!("{:.1}", 1e3 * change.sd[1]),
            if change.is_told { "yes" } else { "held" }.to_owned(),
            format!("{:.2}", change.held_out_px[0]),
            format!("{:.2}", change.held_out_px[1]),
            format!("{:.1}", 1e3 * change.offset_s),
        ]);
    }
    output::line(table)?;
    Ok(())
}

fn as_json(outcome: &Outcome, names: &[&str]) -> Value {
    let finite = |value: f64| value.is_finite().then_some(value);
    let each = names.iter().zip(&outcome.changes);
    let cameras: Vec<Value> = each
        .map(|(name, change)| {
            json!({
                "name": name,
                "moved_degrees": finite(change.moved[0]),
                "moved_metres": finite(change.moved[1]),
                "rotation_sd_degrees": finite(change.sd[0]),
                "centre_sd_metres": finite(change.sd[1]),
                "is_told": change.is_told,
                "before_px": finite(change.held_out_px[0]),
                "after_px": finite(change.held_out_px[1]),
                "residual_px": finite(change.residual_px),
                "offset_ms": 1e3 * change.offset_s,
            })
        })
        .collect();
    let doubts: Vec<String> = outcome.doubts.iter().map(|doubt| doubt.text(names)).collect();
    let verdict = match (doubts.is_empty(), outcome.is_better) {
        (false, _) => "refused",
        (true, true) => "better",
        (true, false) => "no better",
    };
    json!({
        "schema_version": 1,
        "verdict": verdict,
        "doubts": doubts,
        "instants": outcome.n_instants,
        "before_px": finite(outcome.held_out_px[0]),
        "after_px": finite(outcome.held_out_px[1]),
        "certainty": finite(outcome.certainty),
        "blocks": outcome.blocks[0],
        "blocks_better": outcome.blocks[1],
        "cameras": cameras,
    })
}
