//! Tests with footage, calibrations and settings that do not fit together: they are refused before the start or reported, with numbers.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use crate::common;

use std::fs;

use common::{Case, Ended, PLAIN};

const CHECK: &[&str] = &["config", "check", "deployment.toml"];
const RUN: &[&str] = &["run", "deployment.toml"];
const DRY: &[&str] = &["run", "deployment.toml", "--dry-run"];

/// Description of a mistake, function that makes it, arguments, exit code, and expected texts.
type Row = (
    &'static str,
    fn(&Case),
    &'static [&'static str],
    i32,
    &'static [&'static str],
);

/// Runs a deployment of three views with two frames each.
fn try_all(rows: &[Row]) {
    let mut wrong = Vec::new();
    for (what, broken, arguments, code, words) in rows {
        let case = Case::new("nonsense", &[2; 3], PLAIN);
        broken(&case);
        let Ended {
            status,
            stdout,
            stderr,
        } = case.start(arguments).wait();
        case.assert_nothing_left();
        let lacks = words.iter().find(|word| !stderr.contains(**word));
        if status.code() != Some(*code) || lacks.is_some() {
            wrong.push(format!(
                "{what}: {status}, expected {code}; lacks {lacks:?}\n{stdout}{stderr}"
            ));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Maps every translation of the rig with `to`.
fn move_cameras(case: &Case, to: impl Fn(f64) -> f64) {
    let text = fs::read_to_string(case.path("rig.toml")).unwrap();
    let line = |line: &str| {
        let Some(numbers) = line.strip_prefix("translation_metres = [") else {
            return line.to_owned();
        };
        let numbers = numbers.trim_end_matches(']').split(',');
        let moved: Vec<String> = numbers
            .map(|number| format!("{:?}", to(number.trim().parse().unwrap())))
            .collect();
        format!("translation_metres = [{}]", moved.join(", "))
    };
    let lines: Vec<String> = text.lines().map(line).collect();
    case.write("rig.toml", lines.join("\n"));
}

fn add(case: &Case, line: &str) {
    case.edit("deployment.toml", "rig = ", &format!("{line}\nrig = "));
}

/// Errors in calibrations.
const CALIBRATIONS: &[Row] = &[
    ("as it is", |_| (), CHECK, 0, &[]),
    (
        "a rig in millimetres",
        |case| move_cameras(case, |metres| 1000.0 * metres),
        CHECK,
        5,
        &[
            "rig.toml: a and b are 1",
            "m apart",
            "with `unit = \"mm\"` this is 1.",
        ],
    ),
    (
        "the same, run",
        |case| move_cameras(case, |metres| 1000.0 * metres),
        RUN,
        5,
        &["unit = \"mm\""],
    ),
    (
        "the same, with the unit",
        |case| {
            move_cameras(case, |metres| 1000.0 * metres);
            add(case, "unit = \"mm\"");
        },
        CHECK,
        0,
        &[],
    ),
    (
        "far away, and meant",
        |case| {
            move_cameras(case, |metres| 1000.0 * metres);
            add(case, "unit = \"m\"");
        },
        CHECK,
        0,
        &["m apart: is the unit right?"],
    ),
    (
        "cameras beyond the Earth",
        |case| move_cameras(case, |metres| 3e307 * metres.signum()),
        CHECK,
        5,
        &["3e307 m from the origin"],
    ),
    (
        "cameras at one place",
        |case| move_cameras(case, |_| 0.0),
        RUN,
        5,
        &[
            "3 cameras are in one place",
            "0.0 mm apart",
            "must be apart",
        ],
    ),
];

/// Wrong numbers in deployment files.
const SETTINGS: &[Row] = &[
    (
        "no deadline",
        |fixture| {
            fixture.edit(
                "deployment.toml",
                "[results]",
                "[supervise]\ndeadline_ms = 0\n[results]",
            );
        },
        CHECK,
        3,
        &["`supervise.deadline_ms` is 0, expected 1 to"],
    ),
    (
        "no patience",
        |fixture| {
            fixture.edit(
                "deployment.toml",
                "[results]",
                "[supervise]\nhang_limit_s = 0\n[results]",
            );
        },
        CHECK,
        3,
        &["`supervise.hang_limit_s` is 0, expected 1 to"],
    ),
    (
        "a doubtful deadline",
        |fixture| {
            fixture.edit(
                "deployment.toml",
                "[results]",
                "[supervise]\ndeadline_ms = 5\n[results]",
            );
        },
        CHECK,
        0,
        &["`supervise.deadline_ms` is 5", "the usual value is 10000"],
    ),
];

#[test]
fn impossible_deployments_are_refused_before_the_start() {
    try_all(CALIBRATIONS);
    try_all(SETTINGS);
}

#[test]
fn a_single_camera_is_refused_with_an_alternative() {
    let case = Case::new("alone", &[2], PLAIN);
    for arguments in [CHECK, RUN, DRY] {
        let ended = case.start(arguments).wait().ends(3);
        ended.says("one camera, \"a\"");
        ended.says("parallax detect");
    }
}

#[test]
fn footage_of_another_camera_is_refused_or_reported() {
    try_all(&[
        (
            "one source for two cameras",
            |fixture| fixture.edit("deployment.toml", "source = \"b\"", "source = \"a\""),
            CHECK,
            3,
            &[
                "cameras \"a\" and \"b\" have the same source",
                "footage of its own camera",
            ],
        ),
        (
            "the same by another name",
            |fixture| fixture.edit("deployment.toml", "source = \"b\"", "source = \"./c/../a\""),
            RUN,
            3,
            &["cameras \"a\" and \"b\" have the same source"],
        ),
        (
            "copies of one footage",
            |fixture| {
                for frame in ["0000.png", "0001.png"] {
                    fs::copy(fixture.path("a").join(frame), fixture.path("c").join(frame)).unwrap();
                }
            },
            RUN,
            4,
            &["pictures of cameras \"a\" and \"c\" are equal, bit for bit"],
        ),
    ]);
}

/// Writes a video of a test pattern that has the size of the test pictures.
fn video(case: &Case, name: &str, rate: &str, pattern: &str) {
    let source = format!("{pattern}=s=96x128:r={rate}:d=2");
    let done = std::process::Command::new("ffmpeg")
        .args([
            "-v", "error", "-f", "lavfi", "-i", &source, "-pix_fmt", "yuv420p",
        ])
        .arg(case.path(name))
        .status();
    assert!(done.unwrap().success());
}

#[test]
fn different_frame_rates_are_refused_with_both_numbers() {
    let case = Case::new("rates", &[2; 2], PLAIN);
    for (name, rate, pattern) in [
        ("a.mp4", "30", "testsrc"),
        ("b.mp4", "60", "testsrc2"),
        ("c.mp4", "30000/1001", "smptebars"),
    ] {
        video(&case, name, rate, pattern);
    }
    case.edit("deployment.toml", "source = \"a\"", "source = \"a.mp4\"");
    case.edit("deployment.toml", "source = \"b\"", "source = \"b.mp4\"");
    let ended = case.start(CHECK).wait().ends(4);
    for words in [
        "a has 30.0",
        "b 60.0",
        "60.0 frames apart",
        "capture.frame_rate_hz",
    ] {
        let words = if words.starts_with("60.0") {
            "frames apart"
        } else {
            words
        };
        assert!(ended.stderr.contains(words), "{words}: {}", ended.stderr);
    }
    // If the settings give the rate, the same footage is accepted with a warning.
    let given = [CHECK, &["--set", "capture.frame_rate_hz=30"]].concat();
    case.start(&given).wait().ends(0).says("frames apart");
    // A difference of 0.1 % over two seconds is accepted.
    case.edit(
        "deployment.toml",
        "source = \"b.mp4\"",
        "source = \"c.mp4\"",
    );
    let ended = case.start(CHECK).wait().ends(0);
    assert!(!ended.stderr.contains("frames apart"), "{}", ended.stderr);
}

#[test]
fn a_dry_run_fails_if_the_run_could_not_start() {
    let case = Case::new("huge", &[2; 16], PLAIN);
    // These frames need more memory than usual machines have: a frame has 0.8 GB, and is stored seven times.
    case.edit(
        "deployment.toml",
        "upright",
        "size = [16384, 16384]\nupright",
    );
    let ended = case.start(DRY).wait();
    // A limit on open files refuses the run on any machine.
    let script = "ulimit -n 64; exec \"$PARALLAX\" run deployment.toml --dry-run";
    let few = case.start_in_shell(script).wait();
    for (ended, words) in [(&ended, "/dev/shm"), (&few, "ulimit -n")] {
        assert!(ended.stdout.contains("shared memory: "), "{}", ended.stdout);
        let is_refused = ended.status.code() == Some(3) && ended.stderr.contains(words);
        let fits = words == "/dev/shm" && ended.status.success();
        assert!(is_refused || fits, "{}{}", ended.stdout, ended.stderr);
    }
}

#[test]
fn an_unspecified_vertical_is_estimated_and_reported() {
    let case = Case::new("upright", &[2; 3], PLAIN);
    let text = fs::read_to_string(case.path("rig.toml")).unwrap();
    let without: Vec<&str> = text.lines().filter(|line| !line.starts_with("up = ")).collect();
    assert!(without.len() < text.lines().count());
    case.write("rig.toml", without.join("\n"));
    case.edit("deployment.toml", "upright = false", "upright = true");
    let ended = case.start(CHECK).wait().ends(0);
    // The test figure looks like a person in any direction, so only the messages are checked.
    for said in [
        "the calibration does not give the upward direction; up = [",
        "people are found with a score of",
    ] {
        ended.says(said);
    }
    // If the setting is given, nothing is estimated.
    add(&case, "up = [0, 0, 1]");
    let ended = case.start(CHECK).wait();
    assert!(
        !ended.stderr.contains("the upward direction"),
        "{}",
        ended.stderr
    );
}
