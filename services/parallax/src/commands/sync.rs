//! `parallax sync`: finds the clock offsets between the cameras of recorded footage.

mod heard;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use calibration::synchronisation::{Outcome, Settings, estimate};
use clap::{Args, Subcommand, ValueEnum};
use deployment::{ClockKeys, Deployment, with_clocks};
use failure::wording::Table;
use failure::{Console as _, ExitKind, Failure, OrFail as _, Stop, in_file, uninterrupted};
use launch::films::{Films, Part, Poses, films};
use launch::load;
use serde_json::{Value, json};
use terminal::{Globals, Terminal, output};

/// The progress bar.
const BAR: &str = "{elapsed_precise} {bar:20} {pos}/{len} pictures, {per_sec}{left} {prefix} {msg}";

/// The subcommands.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Estimate the clock offset and drift of every camera, from the movement of people or from sounds.
    Estimate(Box<Arguments>),
}

/// Options of `parallax sync estimate`.
#[derive(Debug, Args)]
#[command(after_help = "\
People are read from the `keypoints` of a camera. If it has none, the camera's network finds them, or the shipped network with the \
paper's method. The calibration must be right; identities of people are not needed. If two cameras see a joint at the same instant, the \
two pixels satisfy the epipolar constraint. The offset of a pair is the one that satisfies this constraint best, and the offsets of all pairs must \
agree. Offsets are relative to the first camera, or to --reference. They do not depend on `offset_ms` and `drift_ppm` in the file.

A result is refused, with exit code 7 and the reason, in these cases: another offset is nearly as good (people on a treadmill), the minimum \
is flat (nobody moves), a pair or a part of the footage contradicts the rest, the views do not fit each other, or a camera sees \
nobody. Nothing is written then. If the footage is too short to find the drift, the table says so.

With --by sound, the command compares the times at which sounds begin: steps, voices, doors, claps. Nobody needs to be visible. Sound \
travels a metre in 2.9 ms, so an offset is uncertain by the distance of the two cameras divided by 343 m/s. The printed uncertainties include this. \
In JSON, `joints` then counts sounds, and pixels are null. A result is refused if there are too few sounds, sounds that only one camera recorded, a \
regular beat, or pairs or parts that contradict each other.

With --json, prints one object:
    {\"is_determined\", \"doubts\": [text], \"reference\", \"length_s\", \"second_best\",
     \"cameras\": [{\"name\", \"offset_ms\", \"error_ms\", \"drift_ppm\", \"drift_error_ppm\", \"joints\", \"before_px\", \"after_px\",
                  \"found_by\"}],
     \"pairs\": [{\"cameras\", \"offset_ms\", \"best_ms\", \"second_best_ms\", \"ratio\", \"samples\"}]}

Examples:
    parallax sync estimate my.toml
    parallax sync estimate my.toml --window 10 --write
    parallax sync estimate my.toml --by sound --window 10 --write
    parallax sync estimate my.toml --every 2 --seconds 30 --out clocks.html --json")]
pub(crate) struct Arguments {
    /// The deployment file.
    config: PathBuf,
    /// Signal by which the clocks are compared.
    #[arg(long, value_enum, default_value_t = By::Movement)]
    by: By,
    /// Largest clock offset between two cameras, in seconds. Use 10 if the recordings were started by hand.
    #[arg(long, value_name = "SECONDS", default_value_t = 2.0, value_parser = window)]
    window: f64,
    /// Camera with the reference clock. If not given, the first camera of the deployment.
    #[arg(long, value_name = "CAMERA")]
    reference: Option<String>,
    /// Use every n-th picture.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..=1000))]
    every: u64,
    /// Start at this time in the footage of each camera, in seconds.
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0, value_parser = seconds)]
    from: f64,
    /// Length of the footage to use, in seconds. If not given, all footage.
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    seconds: Option<f64>,
    /// Write a page that plots the cost of each pair of cameras against its offset.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Write `offset_ms` and `drift_ppm` into the deployment file. The rest of the file is not changed.
    #[arg(long)]
    write: bool,
    /// Replace a value of the deployment, for example `--set network.file=other.onnx`. May be given several times.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// Evidence by which the clocks are compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum By {
    /// The movement of people.
    Movement,
    /// The times at which sounds begin.
    Sound,
}

fn window(text: &str) -> Result<f64, String> {
    within(text, [0.1, 60.0])
}

fn seconds(text: &str) -> Result<f64, String> {
    within(text, [0.0, 1e6])
}

fn within(text: &str, [least, most]: [f64; 2]) -> Result<f64, String> {
    let number = text.parse().ok().filter(|value| (least..=most).contains(value));
    number.ok_or_else(|| format!("expected {least} to {most} seconds, got {text:?}"))
}

/// Runs the subcommand.
pub(crate) fn run(command: &Command, globals: Globals) -> Result<ExitCode, Failure> {
    match command {
        Command::Estimate(arguments) => run_estimate(arguments, globals),
    }
}

fn run_estimate(arguments: &Arguments, globals: Globals) -> Result<ExitCode, Failure> {
    let stop = Stop::on_signals().or_fail(ExitKind::Run)?;
    let deployment = load::read(&arguments.config, &arguments.set)?.deployment;
    let reference = reference(arguments, &deployment)?;
    let terminal = Terminal::with_bar(globals.quiet, false, BAR)
        .ticking()
        .in_lines_off_terminals("pictures");
    let part = Part {
        every: arguments.every,
        from_s: arguments.from,
        seconds: arguments.seconds,
    };
    let (outcome, finders) = match arguments.by {
        By::Movement => {
            let found = films(&deployment, part, Poses::OfRig, (&stop, &terminal))?;
            terminal.begin("", "comparing");
            compared(found, reference, arguments.window, &stop)?
        }
        By::Sound => {
            terminal.begin("", "listening");
            heard::compared(&deployment, part, (reference, arguments.window), &stop)?
        }
    };
    terminal.finish();
    let names: Vec<&str> = deployment.cameras.iter().map(|camera| camera.name.as_str()).collect();
    if arguments.json {
        output::json(&as_json(&outcome, &names, &finders, reference))?;
    } else {
        table(&outcome, &names, (reference, arguments.by))?;
    }
    if let Some(file) = &arguments.out {
        write_page(file, arguments, &outcome, &names, &finders)?;
        output::message(format_args!("wrote {}", file.display()));
    }
    refuse(&outcome, &names, arguments.by)?;
    if arguments.write {
        write(&arguments.config, &outcome, &names)?;
        output::message(format_args!(
            "wrote the clock offsets to {}",
            arguments.config.display()
        ));
    }
    Ok(ExitCode::SUCCESS)
}

/// Returns the index of the reference camera.
fn reference(arguments: &Arguments, deployment: &Deployment) -> Result<usize, Failure> {
    if let [_] | [] = &deployment.cameras[..] {
        let message =
            "the deployment has only one camera, so there is no other clock to compare with";
        return Err(Failure::new(ExitKind::Config, message));
    }
    let Some(name) = &arguments.reference else {
        return Ok(0);
    };
    let found = deployment.cameras.iter().position(|camera| camera.name == *name);
    found.ok_or_else(|| {
        let known: Vec<&str> =
            deployment.cameras.iter().map(|camera| camera.name.as_str()).collect();
        let message = format!(
            "--reference: there is no camera {name:?}; the cameras are {}",
            known.join(", ")
        );
        Failure::new(ExitKind::Usage, message)
    })
}

/// Compares the clocks. Ctrl-C ends the comparison.
fn compared(
    found: Films,
    reference: usize,
    window_s: f64,
    stop: &Stop,
) -> Result<(Outcome, Vec<String>), Failure> {
    let Films {
        cameras,
        films,
        n_joints,
        mirror,
        finders,
        ..
    } = found;
    let settings = Settings {
        reference,
        window_s,
        mirror,
        n_joints,
    };
    let outcome = uninterrupted(stop, move || estimate(&cameras, &films, &settings))?;
    let outcome = outcome.or_fail(ExitKind::Input)?;
    Ok((outcome, finders))
}

fn table(outcome: &Outcome, names: &[&str], (reference, by): (usize, By)) -> Result<(), Failure> {
    let counted = match by {
        By::Movement => "joints",
        By::Sound => "sounds",
    };
    output::line(format_args!(
        "offsets relative to {} from {:.1} s of footage; add them to a camera's times to get common times",
        names[reference], outcome.length_s
    ))?;
    let mut table = Table::new([
        "<camera",
        "offset, ms",
        "+-",
        "drift, ppm",
        "+-",
        counted,
        "before, px",
        "after, px",
    ]);
    for (name, clock) in names.iter().zip(&outcome.cameras) {
        let ppm = |drift: f64| format!("{:.1}", 1e6 * drift);
        let drift = clock.drift_error.map(|error| [clock.drift, error].map(ppm));
        let [drift, drift_error] = drift.unwrap_or_else(|| ["-"; 2].map(str::to_owned));
        table.row([
            (*name).to_owned(),
            format!("{:.2}", 1e3 * clock.offset_s),
            format!("{:.2}", 1e3 * clock.error_s),
            drift,
            drift_error,
            clock.n.to_string(),
            pixels(clock.before_px),
            pixels(clock.after_px),
        ]);
    }
    output::line(table)?;
    if outcome.cameras.iter().all(|camera| camera.drift_error.is_none()) {
        output::line("drift: not determined by the footage, so 0 is used")?;
    } else if outcome.cameras.iter().any(|camera| camera.drift == 0.0) {
        output::line("drift: 0 means that the drift is not significant")?;
    }
    output::line(format_args!(
        "{:<25} {:>9} {:>15} {:>12} {:>8}",
        "pair alone", "best, ms", "second best, ms", "ratio, %", "samples"
    ))?;
    for it in &outcome.pairs {
        let [a, b] = it.cameras.map(|camera| names[camera]);
        output::line(format_args!(
            "{:<25} {:>9.0} {:>15.0} {:>12.0} {:>8}",
            format!("{a} - {b}"),
            1e3 * it.best_s,
            1e3 * it.second_s,
            100.0 * it.ratio,
            it.n
        ))?;
    }
    Ok(())
}

/// Formats a residual, if there is one.
fn pixels(it: f64) -> String {
    if it.is_finite() {
        format!("{it:.2}")
    } else {
        "-".to_owned()
    }
}

fn as_json(outcome: &Outcome, names: &[&str], finders: &[String], reference: usize) -> Value {
    let finite = |value: f64| value.is_finite().then_some(value);
    let cameras = names.iter().zip(&outcome.cameras).zip(finders);
    let cameras: Vec<Value> = cameras
        .map(|((name, it), finder)| {
            json!({
                "name": name,
                "offset_ms": 1e3 * it.offset_s,
                "error_ms": finite(1e3 * it.error_s),
                "drift_ppm": it.drift_error.map(|_| 1e6 * it.drift),
                "drift_error_ppm": it.drift_error.map(|drift_error| 1e6 * drift_error).filter(|value| value.is_finite()),
                "joints": it.n,
                "before_px": finite(it.before_px),
                "after_px": finite(it.after_px),
                "found_by": finder,
            })
        })
        .collect();
    let pairs: Vec<Value> = outcome
        .pairs
        .iter()
        .map(|pair| {
            json!({
                "cameras": pair.cameras.map(|camera| names[camera]),
                "offset_ms": 1e3 * pair.offset_s,
                "best_ms": 1e3 * pair.best_s,
                "second_best_ms": 1e3 * pair.second_s,
                "ratio": finite(pair.ratio),
                "samples": pair.n,
            })
        })
        .collect();
    let doubts: Vec<String> = outcome.doubts.iter().map(|doubt| doubt.text(names)).collect();
    json!({
        "schema_version": 1,
        "is_determined": doubts.is_empty(),
        "doubts": doubts,
        "reference": names[reference],
        "length_s": outcome.length_s,
        "second_best": finite(outcome.second_best),
        "cameras": cameras,
        "pairs": pairs,
    })
}

fn write_page(
    file: &Path,
    arguments: &Arguments,
    outcome: &Outcome,
    names: &[&str],
    finders: &[String],
) -> Result<(), Failure> {
    let mut about = vec![
        (
            "deployment".to_owned(),
            arguments.config.display().to_string(),
        ),
        ("footage".to_owned(), format!("{:.1} s", outcome.length_s)),
        ("window".to_owned(), format!("+-{} s", arguments.window)),
    ];
    let each = names.iter().zip(finders);
    if arguments.by == By::Movement {
        about.extend(each.map(|(name, finder)| (format!("joints of {name}"), finder.clone())));
    }
    let page = exports::report::clocks::html(&exports::report::clocks::Page {
        names,
        outcome,
        is_heard: arguments.by == By::Sound,
        about: &about,
    });
    files::replace(file, page.as_bytes()).map_err(|error| in_file(file, &error))
}

/// Fails if the clocks are not determined.
fn refuse(outcome: &Outcome, names: &[&str], by: By) -> Result<(), Failure> {
    if outcome.doubts.is_empty() {
        return Ok(());
    }
    let doubts: Vec<String> = outcome.doubts.iter().map(|doubt| doubt.text(names)).collect();
    let message = format!("the clocks are not determined:\n  {}", doubts.join("\n  "));
    let failure = Failure::new(ExitKind::Degraded, message);
    Err(failure.with_hint(match by {
        By::Movement => {
            "use footage in which people walk through the view of all cameras; --window sets a larger range of offsets; --by sound \
             compares recorded sounds; `parallax calib check` checks the calibration"
        }
        By::Sound => {
            "use sounds that all cameras record: clap a few times, at irregular intervals; --window sets a larger range of offsets; \
             without --by sound, the movement of people is compared"
        }
    }))
}

fn write(file: &Path, outcome: &Outcome, names: &[&str]) -> Result<(), Failure> {
    let keys = |(name, clock): (&&str, &calibration::synchronisation::CameraClock)| ClockKeys {
        name: (*name).to_owned(),
        offset_ms: 1e3 * clock.offset_s,
        drift_ppm: clock.drift_error.map(|_| 1e6 * clock.drift).filter(|ppm| *ppm != 0.0),
    };
    let keys: Vec<ClockKeys> = names.iter().zip(&outcome.cameras).map(keys).collect();
    let text = failure::read_text(file)?;
    let changed = with_clocks(&text, &keys).map_err(|error| {
        let lines = keys.iter().map(|key| {
            let drift = key.drift_ppm.map_or(String::new(), |drift_ppm| {
                format!(", drift_ppm = {drift_ppm:.3}")
            });
            format!("{}: offset_ms = {:.3}{drift}", key.name, key.offset_ms)
        });
        let hint = format!(
            "enter the offsets by hand: {}",
            lines.collect::<Vec<_>>().join("; ")
        );
        Failure::new(ExitKind::Config, format!("{}: {error}", file.display())).with_hint(hint)
    })?;
    files::replace(file, changed.as_bytes()).map_err(|error| in_file(file, &error))
}
