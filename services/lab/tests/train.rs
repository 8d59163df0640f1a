//! `parallax-lab train fmp` as real processes, on figures drawn by the tests.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod finder;
mod joints;
mod network;

use crate::common;

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use common::started::signal;
use common::{Ended, Started};
use footage::{Canvas, Size};
use serde_json::Value;
use tempfile::TempDir;

const SIZE: Size = Size {
    width: 96,
    height: 136,
};

/// Positions of a figure's joints, in the order of PARSE.
const FIGURE: [[f64; 2]; 14] = [
    [41.0, 118.0],
    [42.0, 94.0],
    [43.0, 72.0],
    [55.0, 72.0],
    [56.0, 94.0],
    [57.0, 118.0],
    [33.0, 70.0],
    [35.0, 54.0],
    [39.0, 36.0],
    [59.0, 36.0],
    [63.0, 54.0],
    [65.0, 70.0],
    [49.0, 32.0],
    [49.0, 18.0],
];

/// Limbs, with their thickness and brightness.
const LIMBS: [([usize; 2], f64, u8); 11] = [
    ([0, 1], 5.0, 250),
    ([1, 2], 7.0, 20),
    ([3, 4], 7.0, 20),
    ([4, 5], 5.0, 250),
    ([6, 7], 4.0, 240),
    ([7, 8], 5.0, 10),
    ([9, 10], 5.0, 10),
    ([10, 11], 4.0, 240),
    ([2, 8], 6.0, 235),
    ([3, 9], 6.0, 235),
    ([12, 13], 9.0, 30),
];

/// Settings for a training of a few seconds.
const SETTINGS: &str = "\
n-types = 2
cluster-starts = 3
max-filter-cells = 3
interval = 4
per-image = 10
batch = 1
passes = 1
cache-mib = 64
";

/// A folder with images of figures, images without figures, and settings.
struct Drawn {
    folder: TempDir,
}

impl Drawn {
    /// Draws `n` people to train on and 8 other people, and annotates them in `people.jsonl` and `others.jsonl`.
    fn new(n: usize) -> Self {
        let folder = tempfile::Builder::new().prefix("parallax-").tempdir().unwrap();
        let drawn = Self { folder };
        drawn.write("settings.toml", SETTINGS);
        drawn.people("people", n, 1);
        drawn.people("others", 8, 2);
        fs::create_dir(drawn.path("negatives")).unwrap();
        let mut random = fastrand::Rng::with_seed(3);
        for it in 0..5 {
            let file = format!("negatives/{it}.png");
            noise(&mut random).save_png(&drawn.path(&file)).unwrap();
        }
        drawn
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        fs::write(self.path(name), content).unwrap();
    }

    fn people(&self, name: &str, n: usize, seed: u64) {
        fs::create_dir(self.path(name)).unwrap();
        let mut random = fastrand::Rng::with_seed(seed);
        let mut lines = String::new();
        for it in 0..n {
            let mut canvas = noise(&mut random);
            let joints = pose(&mut random);
            for ([a, b], width, grey) in LIMBS {
                canvas.line(joints[a], joints[b], width, [grey; 3]);
            }
            let file = format!("{name}/{it}.png");
            canvas.save_png(&self.path(&file)).unwrap();
            writeln!(lines, "{}", line(&file, &joints)).unwrap();
        }
        self.write(&format!("{name}.jsonl"), lines);
    }

    fn start(&self, arguments: &[&str]) -> Started {
        Started::new(self.folder.path(), arguments)
    }

    /// Starts a training of `out`.
    fn train(&self, out: &str, more: &[&str]) -> Started {
        let fixed = ["train", "fmp", "people.jsonl", "--negatives", "negatives"];
        let settings = ["--settings", "settings.toml", "--out", out];
        self.start(&[&fixed[..], &settings, more].concat())
    }

    /// Starts a training and waits until its second step is done.
    fn begun(&self, out: &str) -> Started {
        let mut started = self.train(out, &["--threads", "1"]);
        let checkpoint = self.path(&format!("{out}.checkpoint"));
        started.until("a checkpoint", |_| checkpoint.exists());
        started
    }

    fn model(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap()
    }
}

fn noise(random: &mut fastrand::Rng) -> Canvas {
    let rgb: Vec<u8> = (0..SIZE.rgb_bytes()).map(|_| random.u8(100..150)).collect();
    Canvas::from_rgb(SIZE, &rgb)
}

fn pose(random: &mut fastrand::Rng) -> [[f64; 2]; 14] {
    let mut off = |by: f64| [0; 2].map(|_| by * (2.0 * random.f64() - 1.0));
    let moved = off(6.0);
    FIGURE.map(|at| {
        let own = off(2.5);
        [0, 1].map(|axis| at[axis] + moved[axis] + own[axis])
    })
}

fn line(image: &str, joints: &[[f64; 2]]) -> Value {
    serde_json::json!({ "image": image, "joints": joints })
}

fn assert_ended(ended: &Ended, status: i32, words: &[&str]) {
    assert_eq!(ended.status.code(), Some(status), "{}", ended.stderr);
    for word in words {
        let said = &ended.stderr;
        assert!(said.contains(word), "{word:?} is not in\n{said}");
    }
}

fn events(ended: &Ended) -> Vec<Value> {
    let lines = ended.stdout.lines();
    lines.map(|line| serde_json::from_str(line).unwrap()).collect()
}

fn is_gone(path: &Path) -> bool {
    !path.exists()
}

#[test]
fn a_trained_model_finds_new_figures_for_any_number_of_threads_and_after_kills() {
    let drawn = Drawn::new(14);
    for name in ["one", "two", "killed"] {
        fs::create_dir(drawn.path(name)).unwrap();
    }
    let one = drawn.train("one/m.fmp", &["--threads", "1"]).wait();
    assert_ended(&one, 0, &["step  1 of 14", "objective", "support vectors"]);
    assert!(one.stdout.contains("false alarms"), "{}", one.stdout);
    assert!(is_gone(&drawn.path("one/m.fmp.checkpoint")));

    let two = drawn.train("two/m.fmp", &["--threads", "2", "--json"]).wait();
    assert_ended(&two, 0, &[]);
    assert!(drawn.model("one/m.fmp") == drawn.model("two/m.fmp"));
    let events = events(&two);
    let of = |kind: &str| events.iter().filter(|event| event["event"] == kind).count();
    assert_eq!([of("data"), of("step"), of("summary")], [1, 14, 1]);
    let summary = events.last().unwrap();
    assert_eq!(summary["data"]["people"], 14);
    assert_eq!(summary["data"]["images"], 28, "mirror images with them");
    assert_eq!(summary["false_alarms"]["images"], 5);

    let killed = drawn.begun("killed/m.fmp");
    signal("KILL", killed.id());
    assert_eq!(killed.wait().status.code(), None);
    let resumed = drawn.train("killed/m.fmp", &["--resume"]).wait();
    assert_ended(&resumed, 0, &["continuing after step"]);
    assert!(drawn.model("one/m.fmp") == drawn.model("killed/m.fmp"));
    assert!(is_gone(&drawn.path("killed/m.fmp.checkpoint")));

    let judged = drawn.start(&["judge", "one/m.fmp", "others.jsonl", "--json"]);
    let judged = judged.wait();
    assert_ended(&judged, 0, &[]);
    let judged: Value = serde_json::from_str(&judged.stdout).unwrap();
    let pcp = judged["best"]["pcp"]["both_ends"]["total"].as_f64().unwrap();
    assert!(pcp >= 80.0, "PCP {pcp}: {judged}");

    let shown = ["model", "show", "one/m.fmp", "--html", "m.html"];
    assert_ended(&drawn.start(&shown).wait(), 0, &["wrote m.html"]);
}

#[test]
fn an_interrupted_training_prints_how_to_continue_and_refuses_checkpoints_of_other_trainings() {
    let drawn = Drawn::new(14);
    let stopped = drawn.begun("m.fmp");
    signal("INT", stopped.id());
    let stopped = stopped.wait();
    assert_ended(&stopped, 130, &["stopped after", "--resume continues from"]);
    assert!(is_gone(&drawn.path("m.fmp")));
    let checkpoint = drawn.model("m.fmp.checkpoint");

    let again = drawn.train("m.fmp", &[]).wait();
    assert_ended(&again, 2, &["an earlier training was interrupted"]);
    let other = drawn.train("m.fmp", &["--resume", "--seed", "9"]).wait();
    assert_ended(&other, 4, &["belongs to another training", "delete"]);
    let rows = drawn.train("m.fmp", &["--resume", "--only", "1-13"]).wait();
    assert_ended(&rows, 4, &["other image files"]);
    for damage in [&checkpoint[..checkpoint.len() - 1], b"PLXMODEL", b""] {
        drawn.write("m.fmp.checkpoint", damage);
        let damaged = drawn.train("m.fmp", &["--resume"]).wait();
        assert_ended(&damaged, 4, &["is not a valid checkpoint", "delete"]);
    }
}

/// Adds a bad line at the beginning, and one line for each kind of bad label at the end.
fn add_bad_labels(drawn: &Drawn) {
    let sound = fs::read_to_string(drawn.path("people.jsonl")).unwrap();
    let outside = FIGURE.map(|figure| [figure[0] + 60.0, figure[1]]);
    let one_place = [[40.0; 2]; 14];
    let named = |image: &str| {
        let mut line = line(image, &FIGURE);
        line["name"] = "ann".into();
        line.to_string()
    };
    let bad = [
        line("people/0.png", &outside).to_string(),
        line("people/99.png", &FIGURE).to_string(),
        line("people/1.png", &FIGURE).to_string().replace("[41.0,118.0]", "null"),
        line("people/2.png", &one_place).to_string(),
        line("people/3.png", &FIGURE[1..]).to_string(),
        sound.lines().next().unwrap().to_owned(),
        "once upon a time".to_owned(),
        named("people/4.png"),
    ];
    let sound = format!("{}\n{sound}", named("people/5.png"));
    drawn.write("people.jsonl", sound + &bad.join("\n"));
}

#[test]
fn bad_labels_are_reported_and_are_fatal_if_requested() {
    let drawn = Drawn::new(14);
    add_bad_labels(&drawn);
    drawn.write("negatives/9.png", "no image");
    let quick = SETTINGS.replace("batch = 1", "batch = 100\nlatent-rounds = 0");
    drawn.write("settings.toml", quick);

    let ended = drawn.train("m.fmp", &["--json"]).wait();
    assert_ended(
        &ended,
        0,
        &["people.jsonl, line 16", "px outside", "negatives/9.png"],
    );
    let events = events(&ended);
    let left_out = events.iter().filter(|event| event["event"] == "left-out");
    let told: Vec<_> = left_out
        .map(|left_out| {
            (
                left_out["row"].as_str().unwrap(),
                left_out["kind"].as_str().unwrap(),
            )
        })
        .collect();
    let expected = [
        ("line 16", "outside"),
        ("line 17", "image"),
        ("line 18", "unknown"),
        ("line 19", "zero-size"),
        ("line 20", "count"),
        ("line 21", "twice"),
        ("line 22", "syntax"),
        ("line 23", "same-name"),
    ];
    assert_eq!(told, expected);
    let data = &events.last().unwrap()["data"];
    assert_eq!(
        (&data["people"], &data["unreadable"]),
        (&15.into(), &1.into())
    );
    assert!(
        expected.iter().all(|fault| data["left_out"][fault.1] == 1),
        "{data}"
    );

    let fatal = drawn.train("n.fmp", &["--fatal", "syntax,image"]).wait();
    assert_ended(
        &fatal,
        4,
        &["2 of 23 people", "fault of a fatal kind", "line 17"],
    );
    let all = drawn.train("n.fmp", &["--fatal", "all"]).wait();
    assert_ended(&all, 4, &["8 of 23 people"]);
    assert!(is_gone(&drawn.path("n.fmp")));
}

#[test]
fn a_wrong_command_line_is_refused_before_the_training() {
    let drawn = Drawn::new(2);
    drawn.write("wrong.toml", "n-tpyes = 3\n");
    drawn.write("none.toml", "interval = 0\n");
    let rows: [(&[&str], i32, &str); 8] = [
        (&["--only", "5-9"], 2, "rows 5-9"),
        (&["--only", "first"], 2, "neither rows"),
        (
            &["others.jsonl", "--only", "1-2"],
            2,
            "--only people.jsonl=1-2",
        ),
        (&["people.jsonl"], 2, "named twice"),
        (&["--rotate", "-15,x"], 2, "expected degrees"),
        (
            &["--fatal", "blurred"],
            2,
            "expected all, or some of syntax",
        ),
        (&["--judge", "nowhere"], 4, "nowhere"),
        (&["--skeleton", "settings.toml"], 4, "settings.toml"),
    ];
    for (more, status, word) in rows {
        assert_ended(&drawn.train("m.fmp", more).wait(), status, &[word]);
    }
    for (file, word) in [("wrong.toml", "n-tpyes"), ("none.toml", "interval is 0")] {
        let ended = drawn.start(&["train", "fmp", "--print-settings", "--settings", file]);
        assert_ended(&ended.wait(), 3, &[word]);
    }
    let folder = drawn.train("no/m.fmp", &[]).wait();
    assert_ended(&folder, 2, &["no such folder"]);
    let printed = drawn.start(&["train", "fmp", "--print-settings", "--seed", "7"]).wait();
    assert!(printed.stdout.contains("seed = 7\n"), "{}", printed.stdout);
}
