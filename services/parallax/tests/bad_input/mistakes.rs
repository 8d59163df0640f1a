//! Tests with mistakes of new users. Error messages must say what is wrong, where, and what to try.

use std::fs;
use std::os::unix::fs::PermissionsExt as _;

use crate::common::{Case, Ended, PLAIN};

/// Internal terms that must not appear in messages for users.
const NEVER: &[&str] = &[
    "u64",
    "usize",
    "f64",
    "PathBuf",
    "invalid type",
    "invalid value:",
    "Error {",
    "Error::",
    "ships none",
    "stream did not contain",
];

/// A mistake in a valid deployment of two views, `a` and `b`, with two frames each.
pub(crate) struct Mistake {
    what: &'static str,
    made: fn(&Case),
    /// Command and exit code, if they differ from those of the table.
    own: Option<(&'static str, i32)>,
    /// Words of the message that name the mistake and its location.
    says: &'static [&'static str],
    /// Words of the hint.
    tries: &'static [&'static str],
}

/// Returns a mistake with the command and the exit code of its table.
pub(crate) const fn oops(
    what: &'static str,
    made: fn(&Case),
    says: &'static [&'static str],
    tries: &'static [&'static str],
) -> Mistake {
    Mistake {
        what,
        made,
        own: None,
        says,
        tries,
    }
}

impl Mistake {
    /// Sets the command, as shell text, and the exit code.
    pub(crate) const fn with(mut self, command: &'static str, code: i32) -> Self {
        self.own = Some((command, code));
        self
    }
}

pub(crate) const CHECK: &str = "config check deployment.toml";
pub(crate) const DRY: &str = "run deployment.toml --dry-run";
pub(crate) const NOTHING: fn(&Case) = |_| {};

pub(crate) fn source(case: &Case, named: &str) {
    case.edit(
        "deployment.toml",
        "source = \"b\"",
        &format!("source = {named:?}"),
    );
}

pub(crate) fn capture(case: &Case, line: &str) {
    case.edit(
        "deployment.toml",
        "upright = false",
        &format!("upright = false\n{line}"),
    );
}

fn forbid(case: &Case, name: &str) {
    fs::set_permissions(case.path(name), fs::Permissions::from_mode(0o0)).unwrap();
}

/// Restores permissions, so that the folder can be removed.
fn permit(case: &Case) {
    for name in ["b", "films"] {
        if case.path(name).exists() {
            fs::set_permissions(case.path(name), fs::Permissions::from_mode(0o700)).unwrap();
        }
    }
}

/// Returns a shell script. If the text lacks the program's name, it has the arguments.
fn in_shell(command: &str) -> String {
    if command.contains("$PARALLAX") {
        return command.to_owned();
    }
    format!("exec \"$PARALLAX\" {command}")
}

/// Makes every mistake of a table, and checks the error message.
///
/// * `common`: the arguments of the program, as shell text, and the exit code.
pub(crate) fn check(common: (&str, i32), table: &[Mistake]) {
    let mut wrong = Vec::new();
    for it in table {
        let case = Case::new("oops", &[2; 2], PLAIN);
        (it.made)(&case);
        let (command, code) = it.own.unwrap_or(common);
        let Ended {
            status,
            stdout,
            stderr,
        } = case.start_in_shell(&in_shell(command)).wait();
        case.assert_nothing_left();
        permit(&case);
        let words = it.says.iter().chain(it.tries);
        let lacks: Vec<&&str> = words.filter(|word| !stderr.contains(**word)).collect();
        let has: Vec<&&str> = NEVER.iter().filter(|word| stderr.contains(**word)).collect();
        let is_as_expected = lacks.is_empty() && has.is_empty() && stdout.is_empty();
        if status.code() != Some(code) || !is_as_expected {
            wrong.push(format!(
                "{}: {status}, expected {code}; lacks {lacks:?}, has {has:?}\n{stdout}{stderr}",
                it.what
            ));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

const NO_FILES: &[Mistake] = &[
    oops(
        "RTSP",
        |case| source(case, "rtsp://me:secret@127.0.0.1:9/live"),
        &[
            "no pictures were received from rtsp://127.0.0.1:9/live",
            "Connection refused",
        ],
        &["camera \"b\""],
    ),
    oops(
        "HTTP",
        |case| source(case, "http://127.0.0.1:9/b"),
        &["http://127.0.0.1:9/b", "Connection refused"],
        &["camera \"b\""],
    ),
    oops(
        "V4L2",
        |case| source(case, "v4l2:/dev/null"),
        &["/dev/null is not a camera"],
        &["camera \"b\""],
    ),
    oops(
        "device",
        |case| source(case, "/dev/video97"),
        &["cannot open the camera /dev/video97", "No such file"],
        &["camera \"b\""],
    ),
    oops(
        "number of a webcam",
        |case| source(case, "0"),
        &["number of a webcam", "its source is /dev/video0"],
        &["camera \"b\""],
    ),
    oops(
        "file:// address",
        |case| source(case, "file:///tmp/b.mp4"),
        &["without file://: /tmp/b.mp4"],
        &["camera \"b\""],
    ),
    oops(
        "number of a webcam without quotes",
        |fixture| fixture.edit("deployment.toml", "source = \"b\"", "source = 0"),
        &["deployment.toml:12", "`camera.source`", "found 0"],
        &["text in quotes"],
    )
    .with(CHECK, 3),
    oops(
        "scene of an unknown rig",
        |case| source(case, "synth://humanevaa?camera=C1"),
        &["synth://humanevaa", "is not a rig"],
        &["expected humaneva, umpm, ring"],
    ),
];

#[test]
fn sources_other_than_files() {
    check((CHECK, 4), NO_FILES);
}

const FOOTAGE: &[Mistake] = &[
    oops(
        "absent video",
        |case| source(case, "films/b.mp4"),
        &["no such footage", "there is no folder", "camera \"b\""],
        &["relative to the deployment file"],
    ),
    oops(
        "empty video",
        |case| {
            source(case, "b.mp4");
            case.write("b.mp4", "");
        },
        &["b.mp4", "0 bytes"],
        &["ffprobe"],
    ),
    oops(
        "video whose copying was cut off",
        |case| {
            source(case, "b.mp4");
            case.write("b.mp4", b"\0\0\0\x20ftypisom\0\0\x02\0");
        },
        &["cannot decode the video", "b.mp4"],
        &["ffprobe"],
    ),
    oops(
        "text",
        |case| source(case, "rig.toml"),
        &["cannot decode", "rig.toml", "camera \"b\""],
        &["check that the file is complete"],
    ),
    oops(
        "pattern without a match",
        |case| source(case, "b/%04d.jpg"),
        &["no image", "b/%04d.jpg"],
        &["a folder of images, a glob"],
    ),
    oops(
        "later first frame than there are",
        |case| capture(case, "start_frame = 9"),
        &["first frame 9", "2 frames"],
        &["`capture.start_frame`"],
    ),
    oops(
        "no ffmpeg",
        |case| {
            source(case, "b.mp4");
            case.write("b.mp4", "x");
        },
        &["cannot run ffprobe", "b.mp4"],
        &["apt-get install ffmpeg"],
    )
    .with(
        "PATH=/nowhere exec \"$PARALLAX\" config check deployment.toml",
        4,
    ),
    oops(
        "absent, and its name is not UTF-8",
        NOTHING,
        &["no such footage: \u{fffd}.png", "not UTF-8"],
        &["rename it"],
    )
    .with("detect \"$(printf '\\377.png')\"", 4),
];

#[test]
fn footage_with_a_misleading_name() {
    check((CHECK, 4), FOOTAGE);
}

/// The superuser may read everything, so the command runs in a user namespace of its own.
const FORBIDDEN: &str = "test $(id -u) = 0 || exec \"$PARALLAX\" config check deployment.toml\n\
                         exec unshare -U \"$PARALLAX\" config check deployment.toml";

const MAY_NOT: &[Mistake] = &[
    oops(
        "folder of images",
        |case| forbid(case, "b"),
        &["cannot read", "/b", "Permission denied"],
        &["camera \"b\"", "you need permission to read it"],
    ),
    oops(
        "rig",
        |case| forbid(case, "rig.toml"),
        &["cannot read", "rig.toml", "Permission denied"],
        &["must be able to read"],
    ),
    oops(
        "model",
        |case| forbid(case, "model.plx"),
        &["cannot read the model file", "model.plx"],
        &["Permission denied"],
    ),
    oops(
        "deployment",
        |case| forbid(case, "deployment.toml"),
        &["cannot read the deployment file deployment.toml"],
        &["Permission denied"],
    ),
    oops(
        "folder above the footage",
        |case| {
            fs::create_dir(case.path("films")).unwrap();
            fs::rename(case.path("b"), case.path("films/b")).unwrap();
            source(case, "films/b");
            forbid(case, "films");
        },
        &["cannot read", "films/b", "Permission denied"],
        &["enter (x) every folder above it"],
    ),
];

#[test]
fn unreadable_files() {
    let probe = Case::new("oops-may", &[2; 2], PLAIN);
    let probe = probe.start_in_shell("test $(id -u) != 0 || exec unshare -U true");
    if probe.wait().status.code() != Some(0) {
        return; // This user can read everything.
    }
    check((FORBIDDEN, 4), MAY_NOT);
}
