//! `parallax replay`: runs the later stages of a recorded run again.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use deployment::{Deployment, Replay, Stage};
use failure::{ExitKind, Failure, OrFail as _, Stop};
use inputs::Shipped;
use launch::{
    Planned, Resolved, load, plan,
    recorded::{self, Settings},
};
use messages::topic;
use recording::{Kind, Recording};
use terminal::{Globals, output};

mod live;

use crate::stage;

/// Options of `parallax replay`.
#[derive(Debug, Args)]
#[command(after_help = "\
The stages before --from are not run. Instead, processes with their names send the recorded messages. The other \
stages run with the settings of the recorded run, except settings that --set replaces. With lossless delivery, and with \
the same settings and files, the results are equal to the recorded ones, bit for bit.

A truncated file is replayed up to its end. Every chunk (a frame or 4 MiB) has a checksum. The messages of a damaged \
chunk are listed, counted and left out. In both cases the exit code is 7. End-to-end latency is only meaningful at --speed 1. The times \
of the stages that are run are always meaningful.

Examples:
    parallax replay run.mcap                                         run pose and later stages on the recorded frames
    parallax replay run.mcap --from fuse --set paper.alpha=2          run fuse and later stages, which need no frames
    parallax replay run.mcap --speed 2 --set capture.mode=realtime   twice as fast, with realtime delivery")]
pub(crate) struct Arguments {
    /// The recording.
    file: PathBuf,
    /// The first stage that is run.
    #[arg(long, value_name = "STAGE", value_parser = stage::parser(), default_value = "pose")]
    from: Stage,
    /// Speed relative to the recording, or `max`. If not given, `max` with lossless delivery, and 1 otherwise.
    #[arg(long, value_name = "X", value_parser = speed)]
    speed: Option<Speed>,
    /// Folder for the results. If not given, the name of the recording with `-replay` appended.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Replace the results of an earlier run or replay in that folder.
    #[arg(long)]
    force: bool,
    /// Replace a setting of the stages that are run, or capture.mode. May be given several times.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Print the summary as JSON.
    #[arg(long)]
    json: bool,
}

/// The speed of a replay.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Speed {
    Max,
    Times(f64),
}

fn speed(text: &str) -> Result<Speed, String> {
    if text == "max" {
        return Ok(Speed::Max);
    }
    match text.parse::<f64>() {
        Ok(it) if it.is_finite() && (0.001..=1000.0).contains(&it) => Ok(Speed::Times(it)),
        _ => Err("expected max, or a number from 0.001 to 1000".to_owned()),
    }
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments, globals: Globals) -> Result<ExitCode, Failure> {
    let file = std::path::absolute(&arguments.file).or_fail(ExitKind::Usage)?;
    let recording = recorded::open(&file)?;
    if !globals.quiet {
        output::message(recorded::text(&file, &recording));
    }
    let mut settings = recorded::settings(&file, &recording)?;
    // A replay runs on a single machine, even if the recorded run used several hosts.
    settings.resolved.deployment.hosts.clear();
    let from = arguments.from;
    live::settle(
        &mut settings.resolved,
        &file,
        &recording,
        from,
        &arguments.set,
    )?;
    let refused = |key: &str| refused(key, from);
    let mut loaded = load::with_overrides(&settings.resolved.deployment, &arguments.set, refused)?;
    let name = file.file_stem().unwrap_or_default().to_string_lossy();
    let out = arguments.out.clone();
    let out = out.unwrap_or_else(|| file.with_file_name(format!("{name}-replay")));
    loaded.deployment.output = std::path::absolute(out).or_fail(ExitKind::Usage)?;
    launch::make_way(&loaded.deployment.output, arguments.force)?;
    warn_of_changed_files(&settings);
    let resolved = resolve(loaded.deployment, settings.resolved, &file, arguments)?;
    check(&file, &recording, &resolved, from)?;
    let damaged = recorded::damaged(&file, &recording, &resolved, from)?;
    if let Some(text) = recorded::damaged_text(&damaged).filter(|_| !globals.quiet) {
        output::message(text);
    }
    let planned = Planned::begun(resolved, globals.level(), None)?;
    let stop = Stop::on_signals().or_fail(ExitKind::Run)?;
    let report = planned.run(globals.quiet, &stop, &mut |_| None)?;
    if arguments.json {
        let mut value = report.json();
        value["recording"] = recorded::json(&file, &recording);
        value["recording"]["damaged"] = recorded::damaged_json(&damaged);
        output::json(&value)?;
    } else if !globals.quiet {
        output::line(report.text())?;
        if !damaged.is_empty() {
            let n = damaged.len();
            output::line(format_args!(
                "  damaged       {n} messages of the recording were left out"
            ))?;
        }
    }
    let is_sound = damaged.is_empty() && recorded::is_undamaged(&recording);
    let is_flawed = from != Stage::Capture && !is_sound;
    let kind = report.kind().or(is_flawed.then_some(ExitKind::Degraded));
    Ok(ExitCode::from(kind.map_or(0, ExitKind::status)))
}

/// Returns the settings of the stages that the replay runs.
///
/// * `recorded`: the settings of the recorded run.
fn resolve(
    deployment: Deployment,
    recorded: Resolved,
    file: &Path,
    arguments: &Arguments,
) -> Result<Resolved, Failure> {
    let (from, capture) = (arguments.from, &deployment.capture);
    let (mode, is_sized) = (
        capture.mode,
        capture.size.is_some() || capture.scale.is_some(),
    );
    // The recorded size is used, unless the user sets another size.
    let search_size = recorded.search_size.filter(|_| !is_sized);
    if from == Stage::Capture {
        return Ok(Resolved {
            search_size,
            ..plan::resolve(&deployment)?
        });
    }
    let speed = match (arguments.speed, mode) {
        (Some(Speed::Times(it)), _) => Some(it),
        (None, deployment::capture::Mode::Realtime) => Some(1.0),
        (Some(Speed::Max) | None, _) => None,
    };
    Ok(Resolved {
        host: None,
        footage: recorded.footage,
        deployment,
        search_size,
        extra_keypoints: recorded.extra_keypoints,
        sides_as_seen: recorded.sides_as_seen,
        recording: None,
        replay: Some(Replay {
            file: file.to_path_buf(),
            from,
            speed,
        }),
    })
}

/// Returns the reason why a setting may not be replaced, or `None` if it may. Settings of stages that the recording replaces are
/// refused.
fn refused(key: &str, from: Stage) -> Option<String> {
    let is_given = stage_of(key).is_some_and(|stage| stage < from);
    let from = from.name();
    is_given.then(|| format!("with --from {from}, the recording determines this value"))
}

/// Returns the first stage that a setting affects, or `None` if recorded messages do not depend on the setting.
fn stage_of(key: &str) -> Option<Stage> {
    let (section, name) = key.split_once('.').unwrap_or((key, ""));
    match (section, name) {
        ("capture", "mode") => None,
        ("capture" | "camera", _) => Some(Stage::Capture),
        ("method" | "network", _)
        | ("paper", "" | "model" | "search" | "candidates" | "orientation") => Some(Stage::Pose),
        ("paper", "errors") => Some(Stage::Quality),
        ("paper", "combine" | "joint_map" | "bodies") => Some(Stage::Triangulate),
        ("paper", _) => Some(Stage::Fuse),
        _ => None,
    }
}

/// Warns of input files that have changed since the recorded run.
fn warn_of_changed_files(settings: &Settings) {
    for (file, recorded) in &settings.files {
        let now = match Shipped::of_name(file) {
            Some(it) => Some(formats::checksum::fnv1a(it.bytes())),
            None => files::read(file, files::MODEL)
                .ok()
                .map(|bytes| formats::checksum::fnv1a(&bytes)),
        };
        if now != Some(*recorded) {
            let file = file.display();
            output::message(format_args!("{file} has changed since the recorded run"));
        }
    }
}

/// Checks that the recording contains the messages of the stages that are not run.
fn check(
    file: &Path,
    recording: &Recording,
    resolved: &Resolved,
    from: Stage,
) -> Result<(), Failure> {
    let without = recording.about.as_ref().map(|about| about.without);
    let without = without.unwrap_or_default();
    let n_pairs = resolved.deployment.cameras.len().saturating_sub(1);
    let needs_pixels =
        from == Stage::Pose || (from == Stage::Quality && resolved.deployment.predicts_errors());
    let reads_evidence = if resolved.deployment.has_maps() {
        Stage::Quality..=Stage::Triangulate
    } else {
        Stage::Quality..=Stage::Fuse
    };
    let needs_evidence = reads_evidence.contains(&from) && n_pairs > 0;
    let missing = if needs_pixels && without.pixels {
        Some((Kind::Frame, "the pixels of the frames"))
    } else if needs_evidence && without.evidence {
        Some((Kind::Evidence, "evidence"))
    } else {
        needed(resolved, from).find(|(kind, _)| {
            let tracks = recording.tracks.values().filter(|value| value.kind == *kind);
            tracks.map(|track| track.entries.len()).sum::<usize>() == 0
        })
    };
    let Some((kind, what)) = missing else {
        return check_views(
            file,
            recording,
            resolved,
            from,
            (needs_pixels, needs_evidence),
        );
    };
    let message = format!(
        "{} lacks {what}, which --from {} needs",
        file.display(),
        from.name()
    );
    let failure = Failure::new(ExitKind::Input, message);
    Err(match recording.counts.keys().find(|key| kind.is_of_another_version(key)) {
        Some(topic) => failure.with_hint(format!(
            "the messages of {topic} have a different layout in this version of Parallax: replay the file with the version that recorded it"
        )),
        None => failure,
    })
}

/// Checks that the recording has the frames, evidence or poses of every view. A recording by one of several hosts may lack some of these
/// messages.
///
/// * `needs`: whether pixels are needed, and whether evidence is needed.
fn check_views(
    file: &Path,
    recording: &Recording,
    resolved: &Resolved,
    from: Stage,
    needs: (bool, bool),
) -> Result<(), Failure> {
    let cameras = resolved.deployment.cameras.iter().enumerate();
    let lacks = |topic: fn(usize) -> String| {
        let is_empty = move |view: usize| {
            let track = recording.tracks.get(&topic(view));
            track.is_none_or(|track| track.entries.is_empty())
        };
        let names = cameras.clone().filter(|(view, _)| is_empty(*view));
        names.map(|(_, camera)| camera.name.as_str()).collect::<Vec<_>>()
    };
    let poses = from > Stage::Pose;
    let wanted = [
        (needs.0, topic::frame as fn(usize) -> String, "frames"),
        (needs.1, topic::evidence, "evidence"),
        (poses, topic::sightings, "single-view poses"),
    ];
    for (is_needed, topic, what) in wanted {
        let names = lacks(topic);
        if is_needed && !names.is_empty() {
            let message = format!(
                "{} has no {what} of {}, which --from {} needs",
                file.display(),
                names.join(", "),
                from.name()
            );
            let failure = Failure::new(ExitKind::Input, message);
            return Err(failure.with_hint(
                "with several hosts, a recording has only the messages that reached its host: if poses were sent, use `--from fuse`, which needs \
                 no frames; pictures of live cameras are in the recordings of the hosts with these cameras",
            ));
        }
    }
    Ok(())
}

/// Returns the kinds of messages that the stages before `from` send, each with its name for the user.
fn needed(resolved: &Resolved, from: Stage) -> impl Iterator<Item = (Kind, &'static str)> {
    let has_maps = resolved.deployment.has_maps();
    let all = [
        (Stage::Capture, Kind::Frame, "frames"),
        (Stage::Pose, Kind::Sightings, "single-view poses"),
        (Stage::Quality, Kind::ViewQuality, "expected errors"),
        (
            Stage::Fuse,
            if has_maps {
                Kind::People
            } else {
                Kind::PairPose
            },
            if has_maps { "people" } else { "pair poses" },
        ),
    ];
    let has_quality = resolved.deployment.has_quality();
    let n_cameras = resolved.deployment.cameras.len();
    let is_sent = move |stage: Stage| match stage {
        Stage::Quality => has_quality,
        Stage::Fuse => n_cameras > 1,
        _ => true,
    };
    let given = all.into_iter();
    given
        .filter(move |input| input.0 < from && is_sent(input.0))
        .map(|input| (input.1, input.2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_speed_is_max_or_a_positive_number() {
        assert_eq!(speed("max"), Ok(Speed::Max));
        assert_eq!(speed("2"), Ok(Speed::Times(2.0)));
        for other in ["0", "-1", "nan", "inf", "fast", "", "1e9"] {
            assert!(speed(other).is_err(), "{other}");
        }
    }

    #[test]
    fn settings_of_recorded_stages_cannot_be_replaced() {
        let may = |key, from| refused(key, from).is_none();
        assert!(may("paper.alpha", Stage::Fuse) && may("rig", Stage::Fuse));
        assert!(!may("paper.workers", Stage::Triangulate));
        assert!(!may("paper.search", Stage::Fuse) && may("paper.search", Stage::Pose));
        assert!(!may("network.people", Stage::Fuse) && !may("method", Stage::Fuse));
        assert!(may("paper.bodies", Stage::Triangulate));
        assert!(!may("capture.size", Stage::Pose) && may("capture.mode", Stage::Pose));
        assert!(!may("camera", Stage::Pose) && may("camera", Stage::Capture));
    }

    #[test]
    fn a_stage_is_found_by_the_name_of_its_service() {
        for (service, stage) in [
            ("pose", Some(Stage::Pose)),
            ("results", None),
            ("record", None),
        ] {
            assert_eq!(Stage::of_name(service), stage);
        }
    }
}
