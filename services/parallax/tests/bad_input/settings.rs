//! Tests with mistakes in deployment files, on command lines, and in files that accompany footage.

use std::fs;

use crate::common::Case;

use super::mistakes::{CHECK, DRY, Mistake, NOTHING, capture, check};

const fn config(
    what: &'static str,
    made: fn(&Case),
    says: &'static [&'static str],
    tries: &'static [&'static str],
) -> Mistake {
    Mistake {
        what,
        made,
        command: CHECK,
        code: 3,
        says,
        tries,
    }
}

const FILES: &[Mistake] = &[
    config(
        "text for a number",
        |case| capture(case, "n_frames = \"many\""),
        &[
            "deployment.toml:16",
            "`capture.n_frames`",
            "found the text \"many\"",
        ],
        &["a whole number of at least 0"],
    ),
    Mistake {
        what: "the rig",
        made: NOTHING,
        command: "config check rig.toml",
        code: 3,
        says: &["this is a rig file"],
        tries: &["give the deployment file"],
    },
    Mistake {
        what: "a folder",
        made: NOTHING,
        command: "config check a",
        code: 4,
        says: &["deployment file a", "is a folder"],
        tries: &["pass the .toml file in it"],
    },
    Mistake {
        what: "a picture",
        made: NOTHING,
        command: "config check a/0000.png",
        code: 4,
        says: &["a/0000.png", "not a text file"],
        tries: &["UTF-8"],
    },
    Mistake {
        what: "no file",
        made: NOTHING,
        command: "config check nowhere.toml",
        code: 4,
        says: &["nowhere.toml"],
        tries: &["No such file"],
    },
];

#[test]
fn deployment_files() {
    check(FILES);
}

const fn usage(
    what: &'static str,
    command: &'static str,
    says: &'static [&'static str],
    tries: &'static [&'static str],
) -> Mistake {
    Mistake {
        what,
        made: NOTHING,
        command,
        code: 2,
        says,
        tries,
    }
}

const LINES: &[Mistake] = &[
    usage(
        "slip in a command",
        "rum deployment.toml",
        &["'rum'"],
        &["'run'"],
    ),
    usage(
        "slip in an option",
        "run deployment.toml --dryrun",
        &["'--dryrun'"],
        &["'--dry-run'"],
    ),
    usage("no file", "run", &["<CONFIG>"], &["--help"]),
    usage(
        "nothing to check",
        "config check",
        &["config check"],
        &["needs a deployment file"],
    ),
    usage(
        "negative budget",
        "run deployment.toml --latency-budget-ms -3",
        &["-3"],
        &["not above 0"],
    ),
    usage(
        "recording into a folder",
        "record deployment.toml --out a",
        &["/a is a folder"],
        &["run.mcap"],
    ),
    usage(
        "unknown stage",
        "replay run.mcap --from posee",
        &["posee"],
        &["'pose'"],
    ),
    Mistake {
        what: "--set of a slip",
        made: NOTHING,
        command: "config check deployment.toml --set paper.wrokers=2",
        code: 3,
        says: &["--set", "`wrokers`"],
        tries: &["did you mean `workers`"],
    },
    Mistake {
        what: "recording into no folder",
        made: NOTHING,
        command: "record deployment.toml --out none/run.mcap",
        code: 4,
        says: &["run.mcap cannot be written", "there is no folder"],
        tries: &["create the folder first"],
    },
    Mistake {
        what: "results in the place of a file",
        made: |fixture| fixture.write("out", ""),
        command: "run deployment.toml",
        code: 4,
        says: &["cannot create the folder", "out is a file"],
        tries: &["--out"],
    },
    Mistake {
        what: "a recording that is none",
        made: NOTHING,
        command: "replay rig.toml --from fuse",
        code: 4,
        says: &["rig.toml"],
        tries: &["not an MCAP file"],
    },
    Mistake {
        what: "images in an empty folder",
        made: |fixture| fs::create_dir(fixture.path("none")).unwrap(),
        command: "detect none",
        code: 4,
        says: &["none: no image"],
        tries: &["png, jpg, jpeg, bmp"],
    },
];

#[test]
fn command_lines() {
    check(LINES);
}

const fn input(
    what: &'static str,
    made: fn(&Case),
    says: &'static [&'static str],
    tries: &'static [&'static str],
) -> Mistake {
    Mistake {
        what,
        made,
        command: DRY,
        code: 4,
        says,
        tries,
    }
}

const fn rig(
    what: &'static str,
    made: fn(&Case),
    says: &'static [&'static str],
    tries: &'static [&'static str],
) -> Mistake {
    Mistake {
        what,
        made,
        command: DRY,
        code: 5,
        says,
        tries,
    }
}

/// Sets a network that predicts errors.
fn errors(case: &Case, file: &str) {
    let named = format!("workers = 2\nerrors = {file:?}");
    case.edit("deployment.toml", "workers = 2", &named);
}

/// Sets a file of joints.
fn joints(case: &Case, file: &str) {
    let named = format!("bodies = false\njoint_map = {file:?}");
    case.edit("deployment.toml", "bodies = false", &named);
}

const INPUTS: &[Mistake] = &[
    input(
        "absent model",
        |fixture| fixture.edit("deployment.toml", "model.plx", "person.mat"),
        &["there is no model file", "person.mat"],
        &[
            "the one that ships with Parallax",
            "parallax-lab model import",
        ],
    ),
    input(
        "empty model",
        |fixture| fixture.write("model.plx", ""),
        &["model.plx is empty"],
        &["0 bytes"],
    ),
    input(
        "folder for a model",
        |fixture| fixture.edit("deployment.toml", "model.plx", "a"),
        &["cannot read the model file", "/a"],
        &["is a folder, not a regular file"],
    ),
    input(
        "absent network",
        |case| errors(case, "person.quality.onnx"),
        &["person.quality.onnx"],
        &["`paper.errors`", "\"shipped\""],
    ),
    input(
        "model for a network",
        |case| errors(case, "model.plx"),
        &["model.plx"],
        &["not an ONNX file"],
    ),
    input(
        "absent consistency",
        |fixture| {
            fixture.edit(
                "deployment.toml",
                "workers = 2",
                "workers = 2\nconsistency = \"person.consistency\"",
            );
        },
        &["person.consistency"],
        &["`paper.consistency`", "\"shipped\""],
    ),
    input(
        "rig for consistency",
        |fixture| {
            fixture.edit(
                "deployment.toml",
                "workers = 2",
                "workers = 2\nconsistency = \"rig.toml\"",
            );
        },
        &["rig.toml"],
        &["not JSON"],
    ),
    input(
        "absent joints",
        |case| joints(case, "person.joints"),
        &["person.joints"],
        &["`paper.joint_map`", "\"shipped\""],
    ),
    input(
        "joints of another model",
        |case| {
            let file = include_str!("../../../../configs/models/person.joints");
            case.write("person.joints", file);
            joints(case, "person.joints");
        },
        &["person.joints", "was learned with the model"],
        &["`parallax-lab train joints`"],
    ),
    input(
        "rig for joints",
        |case| joints(case, "rig.toml"),
        &["rig.toml"],
        &["not JSON"],
    ),
    input(
        "folder for a rig",
        |fixture| fixture.edit("deployment.toml", "rig = \"rig.toml\"", "rig = \"a\""),
        &["cannot read", "/a"],
        &["the rig must be a file"],
    ),
    rig(
        "empty rig",
        |fixture| fixture.write("rig.toml", ""),
        &["rig.toml", "the file has no camera"],
        &["rig.toml is empty"],
    ),
    rig(
        "deployment for a rig",
        |fixture| {
            fixture.edit(
                "deployment.toml",
                "rig = \"rig.toml\"",
                "rig = \"deployment.toml\"",
            );
        },
        &["deployment.toml"],
        &["give the file that its key `rig` names"],
    ),
    rig(
        "unknown lens",
        |fixture| {
            fixture.edit(
                "rig.toml",
                "name = \"a\"",
                "name = \"a\"\nlens = \"fisheyee\"",
            );
        },
        &["rig.toml", "fisheyee"],
        &["`pinhole`, `brown-conrady`, `kannala-brandt`"],
    ),
    rig(
        "size as text",
        |case| super::replace_line(case, "size_px", "size_px = \"96x128\""),
        &[
            "rig.toml",
            "size_px = \"96x128\"",
            "found the text \"96x128\"",
        ],
        &["a list of 2 values"],
    ),
    rig(
        "negative focal length",
        |case| super::replace_line(case, "focal_px", "focal_px = [-170.0, 170.0]"),
        &["rig.toml", "camera \"a\"", "-170"],
        &["must be positive"],
    ),
];

#[test]
fn models_rigs_and_related_files() {
    check(INPUTS);
}
