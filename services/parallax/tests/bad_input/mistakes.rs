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
    pub(crate) what: &'static str,
    pub(crate) made: fn(&Case),
    /// The arguments of the program, as shell text.
    pub(crate) command: &'static str,
    pub(crate) code: i32,
    /// Words of the message that name the mistake and its location.
    pub(crate) says: &'static [&'static str],
    /// Words of the hint.
    pub(crate) tries: &'static [&'static str],
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
pub(crate) fn check(table: &[Mistake]) {
    let mut wrong = Vec::new();
    for it in table {
        let case = Case::new("oops", &[2; 2], PLAIN);
        (it.made)(&case);
        let Ended { status, stderr, .. } = case.start_in_shell(&in_shell(it.command)).wait();
        case.assert_nothing_left();
        permit(&case);
        let words = it.says.iter().chain(it.tries);
        let lacks: Vec<&&str> = words.filter(|word| !stderr.contains(**word)).collect();
        let has: Vec<&&str> = NEVER.iter().filter(|word| stderr.contains(**word)).collect();
        if status.code() != Some(it.code) || !lacks.is_empty() || !has.is_empty() {
            wrong.push(format!(
                "{}: {status}, expected {}; lacks {lacks:?}, has {has:?}\n{stderr}",
                it.what, it.code
            ));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

const fn live(what: &'static str, made: fn(&Case), says: &'static [&'static str]) -> Mistake {
    Mistake {
        what,
        made,
        command: CHECK,
        code: 4,
        says,
        tries: &["camera \"b\""],
    }
}

const NO_FILES: &[Mistake] = &[
    live(
        "RTSP",
        |case| source(case, "rtsp://me:secret@127.0.0.1:9/live"),
        &[
            "no pictures were received from rtsp://127.0.0.1:9/live",
            "Connection refused",
        ],
    ),
    live(
        "HTTP",
        |case| source(case, "http://127.0.0.1:9/b"),
        &["http://127.0.0.1:9/b", "Connection refused"],
    ),
    live(
        "V4L2",
        |case| source(case, "v4l2:/dev/null"),
        &["/dev/null is not a camera"],
    ),
    live(
        "device",
        |case| source(case, "/dev/video97"),
        &["cannot open the camera /dev/video97", "No such file"],
    ),
    live(
        "number of a webcam",
        |case| source(case, "0"),
        &["number of a webcam", "its source is /dev/video0"],
    ),
    live(
        "file:// address",
        |case| source(case, "file:///tmp/b.mp4"),
        &["without file://: /tmp/b.mp4"],
    ),
    Mistake {
        what: "number of a webcam without quotes",
        made: |fixture| fixture.edit("deployment.toml", "source = \"b\"", "source = 0"),
        command: CHECK,
        code: 3,
        says: &["deployment.toml:12", "`camera.source`", "found 0"],
        tries: &["text in quotes"],
    },
    Mistake {
        what: "scene of an unknown rig",
        made: |case| source(case, "synth://humanevaa?camera=C1"),
        command: CHECK,
        code: 4,
        says: &["synth://humanevaa", "is not a rig"],
        tries: &["expected humaneva, umpm, ring"],
    },
];

#[test]
fn sources_other_than_files() {
    check(NO_FILES);
}

const fn footage(
    what: &'static str,
    made: fn(&Case),
    says: &'static [&'static str],
    tries: &'static [&'static str],
) -> Mistake {
    Mistake {
        what,
        made,
        command: CHECK,
        code: 4,
        says,
        tries,
    }
}

const FOOTAGE: &[Mistake] = &[
    footage(
        "absent video",
        |case| source(case, "films/b.mp4"),
        &["no such footage", "there is no folder", "camera \"b\""],
        &["relative to the deployment file"],
    ),
    footage(
        "empty video",
        |case| {
            source(case, "b.mp4");
            case.write("b.mp4", "");
        },
        &["b.mp4", "0 bytes"],
        &["ffprobe"],
    ),
    footage(
        "video whose copying was cut off",
        |case| {
            source(case, "b.mp4");
            case.write("b.mp4", b"\0\0\0\x20ftypisom\0\0\x02\0");
        },
        &["cannot decode the video", "b.mp4"],
        &["ffprobe"],
    ),
    footage(
        "text",
        |case| source(case, "rig.toml"),
        &["cannot decode", "rig.toml", "camera \"b\""],
        &["check that the file is complete"],
    ),
    footage(
        "pattern without a match",
        |case| source(case, "b/%04d.jpg"),
        &["no image", "b/%04d.jpg"],
        &["a folder of images, a glob"],
    ),
    footage(
        "later first frame than there are",
        |case| capture(case, "start_frame = 9"),
        &["first frame 9", "2 frames"],
        &["`capture.start_frame`"],
    ),
    Mistake {
        what: "no ffmpeg",
        made: |case| {
            source(case, "b.mp4");
            case.write("b.mp4", "x");
        },
        command: "PATH=/nowhere exec \"$PARALLAX\" config check deployment.toml",
        code: 4,
        says: &["cannot run ffprobe", "b.mp4"],
        tries: &["apt-get install ffmpeg"],
    },
    Mistake {
        what: "absent, and its name is not UTF-8",
        made: NOTHING,
        command: "detect \"$(printf '\\377.png')\"",
        code: 4,
        says: &["no such footage: \u{fffd}.png", "not UTF-8"],
        tries: &["rename it"],
    },
];

#[test]
fn footage_with_a_misleading_name() {
    check(FOOTAGE);
}

/// The superuser may read everything, so the command runs in a user namespace of its own.
const FORBIDDEN: &str = "test $(id -u) = 0 || exec \"$PARALLAX\" config check deployment.toml\n\
                         exec unshare -U \"$PARALLAX\" config check deployment.toml";

const fn forbidden(
    what: &'static str,
    made: fn(&Case),
    says: &'static [&'static str],
    tries: &'static [&'static str],
) -> Mistake {
    Mistake {
        what,
        made,
        command: FORBIDDEN,
        code: 4,
        says,
        tries,
    }
}

const MAY_NOT: &[Mistake] = &[
    forbidden(
        "folder of images",
        |case| forbid(case, "b"),
        &["cannot read", "/b", "Permission denied"],
        &["camera \"b\"", "you need permission to read it"],
    ),
    forbidden(
        "rig",
        |case| forbid(case, "rig.toml"),
        &["cannot read", "rig.toml", "Permission denied"],
        &["must be able to read"],
    ),
    forbidden(
        "model",
        |case| forbid(case, "model.plx"),
        &["cannot read the model file", "model.plx"],
        &["Permission denied"],
    ),
    forbidden(
        "deployment",
        |case| forbid(case, "deployment.toml"),
        &["cannot read the deployment file deployment.toml"],
        &["Permission denied"],
    ),
    forbidden(
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
    check(MAY_NOT);
}
