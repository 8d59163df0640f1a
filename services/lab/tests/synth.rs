//! Synthetic sequences, from the command to the last process of a deployment.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use crate::common;

use std::collections::BTreeSet;
use std::fs;

use common::started::signal;
use common::{Case, Ended};
use geometry::files::ReadOptions;
use scene::truth::{Frame, Header};

/// Creates a folder with a model that takes milliseconds.
fn case(name: &str) -> Case {
    Case::new(name, &[1, 1], "")
}

fn synth(case: &Case, arguments: &[&str]) -> Ended {
    let all: Vec<&str> = [&["synth"], arguments].concat();
    case.start(&all).wait()
}

/// Options for two cameras, three frames, and the small test model.
const SMALL: [&str; 8] = [
    "--rig",
    "ring:2",
    "--frames",
    "3",
    "--model",
    "model.plx",
    "--rate",
    "10",
];

/// Runs a deployment that `synth` has written, with small frames, and returns its 2D results.
fn run(case: &Case, folder: &str, more: &[&str]) -> (Ended, String) {
    let file = format!("{folder}/deployment.toml");
    case.edit(&file, "synth-s1-walking-1", &case.name);
    let small = [
        "run",
        &file,
        "--set",
        "capture.size=[160,120]",
        "--set",
        "results.overlay_every=0",
    ];
    let ended = case.start(&[&small, more].concat()).wait();
    case.assert_nothing_left();
    let results = case.path(folder).join("out/pose2d.jsonl");
    (ended, fs::read_to_string(results).unwrap_or_default())
}

#[test]
fn a_written_deployment_runs_and_a_live_scene_gives_the_same_bits() {
    let case = case("synth-run");
    synth(&case, &[&["files"], &SMALL[..]].concat()).ends(0);
    let (ended, from_files) = run(&case, "files", &[]);
    // The small test model finds no person in rendered pictures, so the run is degraded. Only the bits of the results are compared.
    assert_eq!(ended.status.code(), Some(7), "{}", ended.stderr);
    assert_eq!(from_files.lines().count(), 6, "three frames of two views");

    synth(&case, &[&["live", "--live"], &SMALL[..]].concat()).ends(0);
    assert!(!case.path("live/cameras").exists(), "no pictures");
    let truth = |folder: &str| fs::read_to_string(case.path(folder).join("truth.jsonl")).unwrap();
    assert_eq!(truth("live"), truth("files"));
    let lossless = ["--set", "capture.mode=lossless"];
    let (ended, live) = run(&case, "live", &lossless);
    assert_eq!(ended.status.code(), Some(7), "{}", ended.stderr);
    assert_eq!(live, from_files);
}

#[test]
fn the_default_model_finds_the_person() {
    let case = case("synth-shipped");
    let three = ["--rig", "ring:3:5.5", "--frames", "1", "--no-masks"];
    synth(&case, &[&["walk"], &three[..]].concat()).ends(0);
    let truth = fs::read_to_string(case.path("walk/truth.jsonl")).unwrap();
    let mut lines = truth.lines();
    let header = Header::parse(lines.next().unwrap()).unwrap();
    let frame = Frame::parse(lines.next().unwrap(), &header).unwrap();
    let pictures = header.cameras.iter();
    let pictures: Vec<String> = pictures.map(|picture| format!("walk/cameras/{picture}")).collect();
    let pictures: Vec<&str> = pictures.iter().map(String::as_str).collect();
    let best = ["--network", "none", "--max", "1", "--json"];
    let detect = [&["detect"], &pictures[..], &best].concat();
    let ended = case.start(&detect).wait().ends(0);
    let mut n_found = 0;
    for (line, view) in ended.stdout.lines().zip(&frame.views) {
        let found: serde_json::Value = serde_json::from_str(line).unwrap();
        let neck = &found["detections"][0]["joints"]["neck"];
        let [u, v] = [0, 1].map(|i| neck[i].as_f64().unwrap_or(f64::INFINITY));
        let [x, y] = view.pixels[12].unwrap();
        let [_, top, _, bottom] = view.outline.unwrap();
        n_found += usize::from((u - x).hypot(v - y) < 0.1 * (bottom - top));
    }
    assert!(n_found >= 2, "{n_found} of 3 necks: {}", ended.stdout);
}

#[test]
fn a_run_with_several_people_follows_one_person_and_counts_all() {
    let case = case("synth-others");
    let crowd = ["--rig", "ring:3:5", "--subjects", "907", "--others", "1"];
    let motion = ["--actions", "boxing", "--frames", "5", "--rate", "10"];
    synth(&case, &[&["crowd"], &crowd[..], &motion[..]].concat()).ends(0);
    let file = "crowd/deployment.toml";
    case.edit(file, "synth-s907-boxing-1", &case.name);
    let sets = [
        "capture.size=[320,240]",
        "results.overlay_every=0",
        "supervise.deadline_ms=20000",
    ];
    let sets = sets.iter().flat_map(|set| ["--set", set]);
    let arguments: Vec<&str> = ["run", file].into_iter().chain(sets).collect();
    let ended = case.start(&arguments).wait();
    assert_eq!(ended.status.code(), Some(0), "{}", ended.stdout);
    case.assert_nothing_left();
    let summary: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(case.path("crowd/out/summary.json")).unwrap())
            .unwrap();
    let people = &summary["summary"]["people"];
    assert_eq!(people["follow"], "last");
    assert!(people["most"].as_u64().unwrap() >= 2, "{people}");
    let text = fs::read_to_string(case.path("crowd/out/pose3d.jsonl")).unwrap();
    let mut last: Option<[f64; 3]> = None;
    let mut n_with_others = 0;
    for line in text.lines() {
        let line: serde_json::Value = serde_json::from_str(line).unwrap();
        n_with_others += usize::from(line["seen"].as_u64() > Some(1));
        let neck = &line["people"][0]["joints"]["neck"]["position_m"];
        let place = [0, 1, 2].map(|axis| neck[axis].as_f64().unwrap_or(f64::NAN));
        if let Some(before) = last.replace(place) {
            let moved: f64 = before.iter().zip(place).map(|(a, b)| (a - b).powi(2)).sum();
            // The two people are two metres apart.
            assert!(
                moved.sqrt() < 1.0,
                "frame {}: {before:?} {place:?}",
                line["frame"]
            );
        }
    }
    assert!(
        n_with_others >= 3,
        "{n_with_others} of 5 frames with others"
    );
}

/// The test must pass on machines of any speed: no picture is taken before its time, and late pictures are skipped.
#[test]
fn a_live_scene_keeps_up_with_the_clock() {
    let case = case("synth-clock");
    synth(&case, &[&["live", "--live"], &SMALL[..]].concat()).ends(0);
    // Runs until there are results, then stops.
    case.edit("live/deployment.toml", "frames=3", "frames=100000");
    let file = "live/deployment.toml";
    case.edit(file, "synth-s1-walking-1", &case.name);
    // These limits are long enough for a late view on a loaded machine.
    let sets = [
        "capture.size=[160,120]",
        "results.overlay_every=0",
        "supervise.deadline_ms=20000",
    ];
    let sets = sets.iter().flat_map(|set| ["--set", set]);
    let arguments: Vec<&str> = ["run", file].into_iter().chain(sets).collect();
    let mut started = case.start(&arguments);
    let lines = || -> Vec<serde_json::Value> {
        let files =
            ["times.jsonl", "times.jsonl.part"].map(|name| case.path("live/out").join(name));
        let text = files.iter().find_map(|file| fs::read_to_string(file).ok());
        let text = text.unwrap_or_default();
        let whole = text.rsplit_once('\n').map_or("", |parts| parts.0);
        let lines = whole.lines().map(|line| serde_json::from_str(line).unwrap());
        lines.collect()
    };
    let shots = || -> Vec<(f64, f64)> {
        let views = lines().into_iter().flat_map(|line| {
            let frame = line["frame"].as_f64().unwrap();
            let views: Vec<_> = line["views"].as_object().unwrap().values().cloned().collect();
            views
                .into_iter()
                .filter_map(move |view| Some((frame, view["camera"]["captured_ms"].as_f64()?)))
        });
        views.collect()
    };
    started.until("three frames", |_| shots().len() >= 6);
    signal("INT", started.id());
    let ended = started.wait();
    case.assert_nothing_left();
    assert_eq!(ended.status.code(), Some(130), "{}", ended.stderr);
    for (frame, captured_ms) in shots() {
        // The scene has ten frames per second. The clock of a run starts before its cameras.
        assert!(
            captured_ms >= 100.0 * frame,
            "frame {frame}: {captured_ms} ms"
        );
    }
}

#[test]
fn the_ground_truth_is_projected_with_the_exact_rig() {
    let case = case("synth-truth");
    let flaws = [
        "flawed",
        "--desync",
        "0.1",
        "--calibration-degrees",
        "1",
        "--noise",
        "3",
        "--no-masks",
    ];
    synth(&case, &[&flaws, &SMALL[..]].concat()).ends(0);
    let rig = |name: &str| {
        geometry::files::read(&case.path("flawed").join(name), &ReadOptions::default()).unwrap()
    };
    let (exact, written) = (rig("rig-exact.toml"), rig("rig.toml"));
    assert_ne!(exact.cameras(), written.cameras());
    let text = fs::read_to_string(case.path("flawed/truth.jsonl")).unwrap();
    let mut lines = text.lines();
    let header = Header::parse(lines.next().unwrap()).unwrap();
    let frames: Vec<Frame> = lines.map(|line| Frame::parse(line, &header).unwrap()).collect();
    assert_eq!(frames.len(), 3);
    let mut off = BTreeSet::new();
    for frame in &frames {
        for (view, camera) in frame.views.iter().zip(exact.cameras()) {
            let late = view.seconds - frame.seconds;
            off.insert((view.camera.clone(), (late * 1e6).round() as i64));
            for (pixel, joint) in view.pixels.iter().zip(frame.joints) {
                let projected = camera.project(&joint.into()).unwrap();
                let [x, y] = pixel.unwrap();
                let error = (x - projected.x).hypot(y - projected.y);
                // A camera without delay sees the joints at their positions at the nominal time.
                assert_eq!(error < 1e-6, late == 0.0, "{}: {error} px", view.camera);
            }
        }
    }
    assert_eq!(off.len(), 2, "every clock is off by one amount: {off:?}");
}

#[test]
fn the_output_does_not_depend_on_the_number_of_threads() {
    let case = case("synth-threads");
    for threads in ["1", "3"] {
        let arguments = [
            threads,
            "--threads",
            threads,
            "--format",
            "jpg",
            "--drop",
            "0.3",
        ];
        synth(&case, &[&arguments, &SMALL[..]].concat()).ends(0);
    }
    for file in [
        "cameras/c1/000001.jpg",
        "cameras/c2/000002.jpg",
        "masks/c2/000001.png",
        "truth.jsonl",
        "people.jsonl",
    ] {
        let bytes = |folder: &str| fs::read(case.path(folder).join(file)).unwrap();
        assert!(bytes("1") == bytes("3"), "{file}");
    }
}

#[test]
fn each_sequence_has_its_own_folder_and_all_share_one_list_of_people() {
    let case = case("synth-many");
    let many = [
        "many",
        "--subjects",
        "2-3",
        "--actions",
        "walking,lying",
        "--json",
    ];
    let ended = synth(&case, &[&many, &SMALL[..]].concat()).ends(0);
    let report: serde_json::Value = serde_json::from_str(&ended.stdout).unwrap();
    assert_eq!(report["sequences"].as_array().unwrap().len(), 4);
    let options = training::datasets::ReadOptions {
        n_joints: Some(14),
        ..training::datasets::ReadOptions::default()
    };
    for list in [
        "people.jsonl",
        "people-as-seen.jsonl",
        "s2-lying/people.jsonl",
    ] {
        let read = training::datasets::read(&case.path("many").join(list), &options).unwrap();
        let expected = if list.starts_with("s2") { 6 } else { 24 };
        assert_eq!(read.people.len() + read.problems.len(), expected, "{list}");
        let pictures = read
            .problems
            .iter()
            .filter(|problem| matches!(problem.fault, training::datasets::Fault::Image(_)));
        assert_eq!(pictures.count(), 0, "every picture is there");
    }
}

/// Returns the joints of a sequence as a TRC file, with y up.
fn trc(case: &Case, folder: &str, rate: u32) -> String {
    let names = skeleton::PARSE14.joints.iter();
    let names: Vec<String> = names.map(|name| name.name.replace(' ', "_")).collect();
    let rows = truth(case, folder).1.into_iter().map(|frame| {
        let cells = frame.joints.iter().flat_map(|[x, y, z]| [y, z, x]);
        let cells: Vec<String> = cells.map(f64::to_string).collect();
        format!(
            "{}\t{}\t{}\n",
            frame.frame + 1,
            frame.seconds,
            cells.join("\t")
        )
    });
    let (n, names) = (names.len(), names.join("\t\t\t"));
    let head = format!("a\nDataRate\tNumMarkers\tUnits\n{rate}\t{n}\tm\nFrame#\tTime\t{names}\n\n");
    head + &rows.collect::<String>()
}

fn truth(case: &Case, folder: &str) -> (Header, Vec<Frame>) {
    let text = fs::read_to_string(case.path(folder).join("truth.jsonl")).unwrap();
    let mut lines = text.lines();
    let header = Header::parse(lines.next().unwrap()).unwrap();
    let frames = lines.map(|line| Frame::parse(line, &header).unwrap()).collect();
    (header, frames)
}

#[test]
fn recorded_motion_can_be_performed_by_another_person() {
    let case = case("synth-motion");
    let first = ["first", "--live", "--rig", "ring:2", "--actions", "boxing"];
    synth(
        &case,
        &[&first[..], &["--frames", "5", "--rate", "10"]].concat(),
    )
    .ends(0);
    case.write("My take.trc", trc(&case, "first", 10));
    let second = [
        "second",
        "--motion",
        "My take.trc",
        "--subjects",
        "2",
        "--no-masks",
    ];
    let small = ["--rig", "ring:2", "--rate", "10", "--model", "model.plx"];
    synth(&case, &[&second[..], &small].concat()).ends(0);
    let (header, got) = truth(&case, "second");
    assert_eq!((header.subject, header.action.as_str()), (2, "my-take"));
    let recorded = truth(&case, "first").1;
    assert_eq!(got.len(), 5, "as many as were recorded");
    assert!(case.path("second/cameras/c2/000004.png").is_file());
    for (got, recorded) in got.iter().zip(&recorded) {
        for [from, to] in [
            [2, 1],
            [1, 0],
            [3, 4],
            [4, 5],
            [8, 7],
            [7, 6],
            [9, 10],
            [10, 11],
        ] {
            let along = |frame: &Frame| {
                let [a, b] = [from, to].map(|joint| nalgebra::Vector3::from(frame.joints[joint]));
                b - a
            };
            let angle = along(got).angle(&along(recorded));
            assert!(angle < 1e-6, "{from} to {to}: {angle}");
        }
    }
}

#[test]
fn an_unusable_motion_recording_is_refused_with_the_right_exit_code() {
    let case = case("synth-motion-refused");
    let first = ["first", "--live", "--rig", "ring:2", "--frames", "5"];
    synth(&case, &[&first[..], &["--rate", "10"]].concat()).ends(0);
    case.write("My take.trc", trc(&case, "first", 10));
    let small = ["--motion", "My take.trc", "--rate", "10", "--rig", "ring:2"];
    for (more, code, words) in [
        (&["--frames", "6"][..], 2, "ends after 5"),
        (&["--live"], 2, "cannot be used with"),
        (&["--actions", "boxing"], 2, "cannot be used with"),
        (
            &["--motion-frames", "2-9"],
            2,
            "not among the file's frames 1-5",
        ),
        (&["--markers", "cmu"], 4, "no marker"),
        (&["--markers", "absent.toml"], 4, "absent.toml"),
    ] {
        let ended = synth(&case, &[&["third"], &small[..], more].concat());
        assert_eq!(
            ended.status.code(),
            Some(code),
            "{more:?}: {}",
            ended.stderr
        );
        assert!(ended.stderr.contains(words), "{more:?}: {}", ended.stderr);
    }
}

#[test]
fn impossible_sequences_are_refused_with_the_right_exit_code() {
    let case = case("synth-refused");
    let code = |arguments: &[&str]| {
        let ended = synth(&case, arguments);
        (ended.status.code(), ended.stderr)
    };
    for (arguments, expected, words) in [
        (&["."][..], 2, "not empty"),
        (&["a", "--rig", "nowhere"], 2, "ring:N"),
        (&["a", "--actions", "flying"], 2, "walking"),
        (&["a", "--subjects", "3-1"], 2, "1-20,25"),
        (&["a", "--drop", "2"], 2, "drop"),
        (&["x", "--rig", "absent.toml"], 4, "absent.toml"),
        (&["y", "--backdrop", "absent"], 4, "absent"),
    ] {
        let (got, said) = code(arguments);
        assert_eq!(got, Some(expected), "{arguments:?}: {said}");
        assert!(said.contains(words), "{arguments:?}: {said}");
    }
}
