//! Tests with mistakes in deployment files, on command lines, and in files that accompany footage.

use std::fs;

use crate::common::Case;

use super::mistakes::{CHECK, DRY, Mistake, NOTHING, capture, check, oops};

const FILES: &[Mistake] = &[
    oops(
        "text for a number",
        |case| capture(case, "n_frames = \"many\""),
        &[
            "deployment.toml:16",
            "`capture.n_frames`",
            "found the text \"many\"",
        ],
        &["a whole number of at least 0"],
    ),
    oops(
        "the rig",
        NOTHING,
        &["this is a rig file"],
        &["give the deployment file"],
    )
    .with("config check rig.toml", 3),
    oops(
        "a folder",
        NOTHING,
        &["deployment file a", "is a folder"],
        &["pass the .toml file in it"],
    )
    .with("config check a", 4),
    oops(
        "a picture",
        NOTHING,
        &["a/0000.png", "not a text file"],
        &["UTF-8"],
    )
    .with("config check a/0000.png", 4),
    oops("no file", NOTHING, &["nowhere.toml"], &["No such file"])
        .with("config check nowhere.toml", 4),
];

#[test]
fn deployment_files() {
    check((CHECK, 3), FILES);
}

const LINES: &[Mistake] = &[
    oops("slip in a command", NOTHING, &["'rum'"], &["'run'"]).with("rum deployment.toml", 2),
    oops(
        "slip in an option",
        NOTHING,
        &["'--dryrun'"],
        &["'--dry-run'"],
    )
    .with("run deployment.toml --dryrun", 2),
    oops("no file", NOTHING, &["<CONFIG>"], &["--help"]).with("run", 2),
    oops(
        "nothing to check",
        NOTHING,
        &["config check"],
        &["needs a deployment file"],
    )
    .with("config check", 2),
    oops("negative budget", NOTHING, &["-3"], &["not above 0"])
        .with("run deployment.toml --latency-budget-ms -3", 2),
    oops(
        "recording into a folder",
        NOTHING,
        &["/a is a folder"],
        &["run.mcap"],
    )
    .with("record deployment.toml --out a", 2),
    oops("unknown stage", NOTHING, &["posee"], &["'pose'"]).with("replay run.mcap --from posee", 2),
    oops(
        "--set of a slip",
        NOTHING,
        &["--set", "`wrokers`"],
        &["did you mean `workers`"],
    )
    .with("config check deployment.toml --set paper.wrokers=2", 3),
    oops(
        "recording into no folder",
        NOTHING,
        &["run.mcap cannot be written", "there is no folder"],
        &["create the folder first"],
    )
    .with("record deployment.toml --out none/run.mcap", 4),
    oops(
        "results in the place of a file",
        |fixture| fixture.write("out", ""),
        &["cannot create the folder", "out is a file"],
        &["--out"],
    )
    .with("run deployment.toml", 4),
    oops(
        "a recording that is none",
        NOTHING,
        &["rig.toml"],
        &["not an MCAP file"],
    )
    .with("replay rig.toml --from fuse", 4),
    oops(
        "images in an empty folder",
        |fixture| fs::create_dir(fixture.path("none")).unwrap(),
        &["none: no image"],
        &["png, jpg, jpeg, bmp"],
    )
    .with("detect none", 4),
];

#[test]
fn command_lines() {
    check((CHECK, 2), LINES);
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
    oops(
        "absent model",
        |fixture| fixture.edit("deployment.toml", "model.plx", "person.mat"),
        &["there is no model file", "person.mat"],
        &[
            "the one that ships with Parallax",
            "parallax-lab model import",
        ],
    ),
    oops(
        "empty model",
        |fixture| fixture.write("model.plx", ""),
        &["model.plx is empty"],
        &["0 bytes"],
    ),
    oops(
        "folder for a model",
        |fixture| fixture.edit("deployment.toml", "model.plx", "a"),
        &["cannot read the model file", "/a"],
        &["is a folder, not a regular file"],
    ),
    oops(
        "absent network",
        |case| errors(case, "person.quality.onnx"),
        &["person.quality.onnx"],
        &["`paper.errors`", "\"shipped\""],
    ),
    oops(
        "model for a network",
        |case| errors(case, "model.plx"),
        &["model.plx"],
        &["not an ONNX file"],
    ),
    oops(
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
    oops(
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
    oops(
        "absent joints",
        |case| joints(case, "person.joints"),
        &["person.joints"],
        &["`paper.joint_map`", "\"shipped\""],
    ),
    oops(
        "joints of another model",
        |case| {
            let file = include_str!("../../../../configs/models/person.joints");
            case.write("person.joints", file);
            joints(case, "person.joints");
        },
        &["person.joints", "was learned with the model"],
        &["`parallax-lab train joints`"],
    ),
    oops(
        "rig for joints",
        |case| joints(case, "rig.toml"),
        &["rig.toml"],
        &["not JSON"],
    ),
    oops(
        "folder for a rig",
        |fixture| fixture.edit("deployment.toml", "rig = \"rig.toml\"", "rig = \"a\""),
        &["cannot read", "/a"],
        &["the rig must be a file"],
    ),
];

const RIGS: &[Mistake] = &[
    oops(
        "empty rig",
        |fixture| fixture.write("rig.toml", ""),
        &["rig.toml", "the file has no camera"],
        &["rig.toml is empty"],
    ),
    oops(
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
    oops(
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
    oops(
        "size as text",
        |case| super::replace_line(case, "size_px", "size_px = \"96x128\""),
        &[
            "rig.toml",
            "size_px = \"96x128\"",
            "found the text \"96x128\"",
        ],
        &["a list of 2 values"],
    ),
    oops(
        "negative focal length",
        |case| super::replace_line(case, "focal_px", "focal_px = [-170.0, 170.0]"),
        &["rig.toml", "camera \"a\"", "-170"],
        &["must be positive"],
    ),
];

#[test]
fn models_rigs_and_related_files() {
    check((DRY, 4), INPUTS);
    check((DRY, 5), RIGS);
}
