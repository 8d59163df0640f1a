//! Tests of deployment files that are accepted or refused.

use proptest::prelude::*;

use super::*;
use crate::{AnyMachine, keys, paper};

const SHORT: &str = r#"
name = "two"
rig = "rig.toml"
method = "paper"
output = "out"

[[camera]]
name = "a"
source = "videos/a.mp4"

[[camera]]
name = "b"
source = "/videos/b.mp4"

[paper]
model = "/models/m.mat"
workers = 2
"#;

fn read(text: &str, set: &[&str]) -> Result<Loaded, ConfigError> {
    let set: Vec<String> = set.iter().map(|set| (*set).to_owned()).collect();
    Loaded::parse(text, Path::new("/room/deployment.toml"), &set, &AnyMachine)
}

fn refused(text: &str, set: &[&str]) -> String {
    let error = read(text, set).unwrap_err().to_string();
    error.split_once("deployment.toml").map_or_else(
        || error.clone(),
        |(_, rest)| format!("deployment.toml{rest}"),
    )
}

#[test]
fn a_common_mistake_is_reported_with_its_line() {
    let with = |from: &str, to: &str| refused(&SHORT.replace(from, to), &[]);
    let path = with("videos/a.mp4", r"C:\Users\a.mp4");
    assert!(path.starts_with("deployment.toml:9: a backslash"), "{path}");
    let path = with("videos/a.mp4", r"videos\new.mp4");
    assert!(path.contains("a backslash"), "{path}");
    let up = with("output = \"out\"", "output = \"out\"\nup = [0 0 1]");
    assert!(
        up.starts_with("deployment.toml:6: the numbers of a list need commas"),
        "{up}"
    );
}

#[test]
fn a_short_deployment_file_is_enough() {
    let got = read(SHORT, &[]).unwrap().deployment;
    assert_eq!(got.paper.workers, 2);
    assert_eq!(got.capture, crate::capture::Config::default());
    assert_eq!(got.cameras.len(), 2);
}

#[test]
fn relative_paths_are_relative_to_the_file() {
    let loaded = read(SHORT, &[]).unwrap();
    let folder = loaded.deployment.rig.parent().unwrap();
    assert!(folder.is_absolute() && loaded.deployment.rig.ends_with("rig.toml"));
    assert_eq!(
        loaded.deployment.paper.model.as_deref(),
        Some(Path::new("/models/m.mat"))
    );
    assert!(Path::new(&loaded.deployment.cameras[0].source).starts_with(folder));
    assert_eq!(loaded.deployment.cameras[1].source, "/videos/b.mp4");
}

#[test]
fn the_command_line_takes_precedence_over_the_file() {
    let set = [
        "paper.workers=3",
        "paper.energy=released",
        "capture.n_frames=7",
    ];
    let got = read(SHORT, &set).unwrap().deployment;
    assert_eq!(got.paper.workers, 3);
    assert_eq!(got.paper.energy, paper::Energy::Released);
    assert_eq!(got.capture.n_frames, Some(7));
}

#[test]
fn a_list_that_is_too_long_is_refused_and_a_shorter_list_can_replace_a_longer_one() {
    let text = SHORT.replace("workers = 2", "pairs = [['a', 'b'], ['b', 'a']]");
    let one = read(&text, &["paper.pairs=[['a', 'b']]"]).unwrap();
    assert_eq!(one.deployment.paper.pairs.len(), 1);
    let pairs = text.replace("['b', 'a']", "['b', 'a', 'c']");
    let got = refused(&pairs, &[]);
    assert!(
        got.ends_with("`paper.pairs` is a list of 3 values, expected 2"),
        "{got}"
    );
    let size = format!("{SHORT}\n[capture]\nsize = [64, 48, 3]\n");
    let got = refused(&size, &[]);
    assert!(
        got.ends_with("`capture.size` is a list of 3 values, expected 2"),
        "{got}"
    );
}

#[test]
fn an_unknown_key_is_named_with_its_line_and_a_suggestion() {
    let text = SHORT.replace("workers", "wrokers");
    assert_eq!(
        refused(&text, &[]),
        "deployment.toml:17: unknown key `wrokers`: did you mean `workers`?"
    );
}

#[test]
fn an_unknown_key_of_the_command_line_is_named_too() {
    assert_eq!(
        refused(SHORT, &["paper.wrokers=3"]),
        "--set: unknown key `wrokers`: did you mean `workers`?"
    );
}

#[test]
fn a_missing_key_is_named() {
    let text = SHORT.replace("rig = ", "# rig = ");
    assert!(refused(&text, &[]).contains("missing key `rig`"));
}

#[test]
fn a_value_of_another_kind_is_refused_with_its_line() {
    let text = SHORT.replace("workers = 2", "workers = \"two\"");
    let got = refused(&text, &[]);
    assert!(got.starts_with("deployment.toml:17: "), "{got}");
}

#[test]
fn an_impossible_value_is_refused_with_its_line() {
    let text = SHORT.replace("workers = 2", "workers = 0");
    assert_eq!(
        refused(&text, &[]),
        "deployment.toml:17: `paper.workers` is 0, expected 1 to 16"
    );
}

#[test]
fn settings_that_do_not_apply_to_all_views_at_once_are_refused() {
    let text = SHORT.replace("workers = 2", "views = \"all\"");
    read(&text, &[]).unwrap();
    for (set, expected) in [
        ("paper.energy=released", "`paper.energy` is \"released\""),
        ("paper.pairs=[['a', 'b']]", "`paper.pairs` is given"),
        (
            "paper.combine=consensus",
            "`paper.combine` is \"consensus\"",
        ),
    ] {
        let got = refused(&text, &[set]);
        assert!(got.contains(expected), "{got}");
        read(&text, &["paper.views=pairs", set]).unwrap();
    }
}

#[test]
fn text_that_is_not_toml_is_refused_with_its_line() {
    let got = refused(&SHORT.replace("[paper]", "[paper"), &[]);
    assert!(got.starts_with("deployment.toml:15: "), "{got}");
}

/// Returns true if a text with an option is accepted. Checks that a refusal names its place.
fn is_taken(text: &str, set: &str) -> bool {
    let file = Path::new("deployment.toml");
    match Loaded::parse(text, file, &[set.to_owned()], &AnyMachine) {
        Ok(loaded) => {
            loaded.entries().unwrap();
            true
        }
        Err(error) => {
            let said = error.to_string();
            let begin = ["deployment.toml", "--set"];
            assert!(begin.iter().any(|start| said.starts_with(start)), "{said}");
            assert!(!said.contains('\n'), "{said}");
            false
        }
    }
}

proptest! {
    #[test]
    fn any_text_is_parsed_as_a_deployment_or_gives_an_error_with_its_line(text: String, set: String) {
        is_taken(&text, "paper.workers=3");
        is_taken(SHORT, &set);
    }

    #[test]
    fn a_changed_deployment_is_valid_or_gives_an_error_with_its_line(
        at in 0..SHORT.len(),
        n in 0_usize..6,
        to in "[a-z0-9=\\[\\]{}.,\"'\n -]{0,8}",
    ) {
        let mut text = SHORT.to_owned();
        text.replace_range(at..(at + n).min(SHORT.len()), &to);
        is_taken(&text, "paper.workers=3");
    }

    #[test]
    fn any_value_of_a_known_key_is_accepted_or_refused(
        key in prop::sample::select(keys().into_iter().map(|key| key.name).collect::<Vec<_>>()),
        value in prop::sample::select(vec![
            "-1", "0", "1", "99999999999", "1e308", "nan", "-inf", "''", "'x'", "[]", "[1]",
            "[nan]", "{}", "[[1]]", "{ file = 3 }", "{ a = 'b' }", "true", "1979-05-27", "=",
        ]),
    ) {
        is_taken(SHORT, &format!("{key}={value}"));
    }
}

#[test]
fn an_override_without_a_value_is_refused() {
    assert!(refused(SHORT, &["paper.workers"]).contains("expected key=value"));
}

#[test]
fn a_wrong_value_is_refused_with_its_line() {
    let text = format!("{SHORT}\n[capture]\nframe_step = 0\n");
    assert_eq!(
        refused(&text, &[]),
        "deployment.toml:20: `capture.frame_step` is 0, expected at least 1"
    );
    let text = format!("{SHORT}\n[results]\nsmoth = true\n");
    assert_eq!(
        refused(&text, &[]),
        "deployment.toml:20: unknown key `smoth`: did you mean `smooth`?"
    );
}

#[test]
fn every_running_process_accepts_cores_and_other_names_are_refused() {
    let loaded = read(SHORT, &["paper.errors=shipped"]).unwrap();
    let topology = crate::Topology::new(&loaded.deployment, None, None);
    for process in topology.processes() {
        for name in [&process.name, process.service] {
            let set = format!("runtime.cores={{ {name} = [0] }}");
            assert!(read(SHORT, &[&set]).is_ok(), "{set}");
        }
    }
    let got = refused(SHORT, &["runtime.cores={ pose-2 = [0] }"]);
    assert!(
        got.ends_with(
            "`runtime.cores` is \"pose-2\", expected one of capture, pose, quality, fuse, triangulate, results, or a single process, such \
             as pose-0"
        ),
        "{got}"
    );
}

#[test]
fn a_number_that_overflows_is_refused_with_the_expected_type() {
    let text = SHORT.replace("workers = 2", "workers = 99999999999999999999");
    let got = refused(&text, &[]);
    assert!(
        got.contains("`paper.workers`: expected a whole number"),
        "{got}"
    );
}

/// Internal terms that must not appear in a message to the user.
const NEVER: [&str; 5] = ["u64", "usize", "f64", "invalid type", "invalid value:"];

/// Lines of `[capture]`, and parts of the messages about them.
const LINES: &[(&str, &[&str])] = &[
    (
        "n_frames = \"many\"",
        &[
            "deployment.toml:20",
            "`capture.n_frames`",
            "found the text \"many\"",
            "a whole number of at least 0",
        ],
    ),
    (
        "n_frames = -1",
        &[
            "`capture.n_frames`",
            "found -1",
            "a whole number of at least 0",
        ],
    ),
    (
        "start_frame = 1.5",
        &["`capture.start_frame`", "found 1.5", "a whole number"],
    ),
    (
        "n_frames = 99999999999999999999",
        &[
            "`capture.n_frames`",
            "99999999999999999999",
            "a whole number",
        ],
    ),
    (
        "size = \"640x480\"",
        &[
            "`capture.size`",
            "found the text \"640x480\"",
            "a list of 2 values",
        ],
    ),
    (
        "upright = 1",
        &["`capture.upright`", "found 1", "true or false"],
    ),
    (
        "mode = realtime",
        &["deployment.toml:20", "text must be in quotes"],
    ),
    (
        "mode = \"live\"",
        &["`live`", "one of `lossless`, `paced`, `realtime`"],
    ),
    (
        "upright = true\nupright = true",
        &["deployment.toml:21", "`upright` is given twice"],
    ),
];

/// Replacements in the file, and parts of the messages about them.
const EDITS: &[(&str, &str, &[&str])] = &[
    (
        "[[camera]]\nname = \"a\"",
        "[camera]\nname = \"a\"",
        &["`camera` is given twice", "[[camera]] in double brackets"],
    ),
    (
        "[[camera]]",
        "[[cameras]]",
        &["unknown key `cameras`", "did you mean `camera`"],
    ),
    (
        SHORT,
        "",
        &[
            "missing key `name`",
            "a deployment file needs `name`, `rig`, `output`",
        ],
    ),
    (
        "source = \"/videos/b.mp4\"",
        "",
        &[
            "`camera.source` is missing for camera \"b\"",
            "every [[camera]] needs",
            "`keypoints`",
        ],
    ),
    (
        "/videos/b.mp4",
        "",
        &[
            "`camera.source` is missing for camera \"b\"",
            "every [[camera]] needs",
        ],
    ),
    (
        "name = \"two\"",
        "name = \"My Room\"",
        &["`name` is \"My Room", "lower-case letters"],
    ),
];

#[test]
fn an_error_states_the_value_found_and_the_value_to_write() {
    let lines = LINES
        .iter()
        .map(|(line, words)| (format!("{SHORT}\n[capture]\n{line}\n"), "", *words));
    let edits = EDITS.iter().map(|(from, to, words)| (SHORT.replace(from, to), "", *words));
    let set: &[&str] = &[
        "--set",
        "`paper.workers`",
        "found the text \"two\"",
        "a whole number",
    ];
    let set = (SHORT.to_owned(), "paper.workers=two", set);
    for (text, set, words) in lines.chain(edits).chain([set]) {
        let set: &[&str] = if set.is_empty() { &[] } else { &[set] };
        let got = refused(&text, set);
        assert!(
            words.iter().all(|word| got.contains(word)),
            "{words:?}: {got}"
        );
        assert!(!NEVER.iter().any(|word| got.contains(word)), "{got}");
    }
}
