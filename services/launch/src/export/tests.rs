//! Tests of exports: folders are written once, incomplete runs are read, and missing facts are reported.

use std::fs;

use super::*;

/// A console that shows nothing.
#[derive(Debug)]
struct Silent;

impl Console for Silent {
    fn message(&self, _: &str) {}
    fn event(&self, _: &Value) -> Result<(), Failure> {
        Ok(())
    }
    fn result(&self, _: &str) -> Result<(), Failure> {
        Ok(())
    }
    fn shows_bar(&self) -> bool {
        false
    }
    fn begin(&self, _: &str, _: &str) {}
    fn details(&self, _: &str) {}
    fn set(&self, _: usize, _: usize) {}
    fn advance(&self, _: usize) {}
    fn finish(&self) {}
}

/// A line of a frame in which nobody was found.
const LINE: &str = r#"{"frame":0,"people":[],"status":"too few views","time_s":0.0,"views_missing":{},"views_present":[]}"#;

/// Returns a person whose joints are all at the same position.
fn person(id: u64, x_m: f64) -> String {
    let joint = format!(
        r#"{{"covariance_m2":[1e-4,0,0,1e-4,0,1e-4],"position_m":[{x_m:?},2.0,3.0],"reprojection_px":1.0,"views":["a"]}}"#
    );
    let joints = skeleton::PARSE14.joints.iter();
    let joints = joints.map(|named| format!("\"{}\":{joint}", named.name));
    let joints = joints.collect::<Vec<_>>().join(",");
    format!(
        r#"{{"facing_margin":null,"id":{id},"joints":{{{joints}}},"pairs":1,"status":"ok","views_used":["a"]}}"#
    )
}

fn line(frame: u64, people: &[String]) -> String {
    let status = if people.is_empty() {
        "too few views"
    } else {
        "ok"
    };
    LINE.replace("too few views", status)
        .replace(
            "\"people\":[]",
            &format!("\"people\":[{}]", people.join(",")),
        )
        .replace("\"frame\":0", &format!("\"frame\":{frame}"))
        .replace(
            "\"time_s\":0.0",
            &format!("\"time_s\":{}", frame as f64 / 50.0),
        )
        + "\n"
}

/// Returns lines of frames with one person.
fn lines(n: u64) -> String {
    (0..n).map(|frame| line(frame, &[person(1, 1.0)])).collect()
}

fn run(files: &[(&str, &str)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files {
        fs::write(folder.path().join(name), text).unwrap();
    }
    folder
}

fn job(folder: &Path, formats: &[&str]) -> Job {
    let all = Format::all().into_iter();
    Job {
        formats: all.filter(|format| formats.contains(&format.name())).collect(),
        out: folder.join("export"),
        name: "x".to_owned(),
        force: false,
    }
}

fn given() -> Given {
    Given {
        up: Some(nalgebra::Vector3::z_axis()),
        ..Given::default()
    }
}

fn exported(origin: &Origin, job: &Job) -> Result<Vec<Written>, Failure> {
    export(origin, job, &Stop::new().unwrap(), &Silent)
}

#[test]
fn an_export_folder_is_overwritten_only_with_force() {
    let folder = run(&[("pose3d.jsonl", &lines(3))]);
    let origin = Origin::read(folder.path(), &given()).unwrap();
    let mut job = job(folder.path(), &["c3d", "csv", "csv-long", "trc"]);
    assert_eq!(exported(&origin, &job).unwrap().len(), 4);
    let read = fs::read(folder.path().join("export/x.c3d")).unwrap();
    assert!(read.len() > 1024);
    let manifest = fs::read_to_string(folder.path().join("export/x.export.json")).unwrap();
    let manifest: Value = serde_json::from_str(&manifest).unwrap();
    assert_eq!(
        (&manifest["frames"], &manifest["rate_hz"]),
        (&json!(3), &json!(50.0))
    );
    let error = exported(&origin, &job).unwrap_err();
    assert_eq!(error.kind(), ExitKind::Usage);
    job.force = true;
    exported(&origin, &job).unwrap();
    fs::remove_file(folder.path().join("export/x.c3d")).unwrap();
    fs::create_dir(folder.path().join("export/x.c3d")).unwrap();
    let error = exported(&origin, &job).unwrap_err().to_string();
    assert!(error.contains("x.c3d is a folder"), "{error}");
}

#[test]
fn each_of_several_people_has_a_numbered_file_and_a_single_person_has_none() {
    let text: String = [
        line(0, &[person(4, 4.0), person(1, 1.0)]),
        line(1, &[person(4, 4.0)]),
        line(2, &[person(1, 1.0), person(4, 4.0)]),
        line(3, &[]),
    ]
    .concat();
    let folder = run(&[("pose3d.jsonl", &text)]);
    let origin = Origin::read(folder.path(), &given()).unwrap();
    // `glb` and `bvh` are left out: if all joints are at one point, there are no bones.
    let formats = ["c3d", "trc", "csv", "csv-long"];
    let written = exported(&origin, &job(folder.path(), &formats)).unwrap();
    assert_eq!(written.len(), 2 * formats.len());
    let read = |name: &str| fs::read_to_string(folder.path().join("export").join(name)).unwrap();
    for (id, frames) in [
        (1, [true, false, true, false]),
        (4, [true, true, true, false]),
    ] {
        let trc = read(&format!("x-person{id}.trc"));
        for (nth, is_there) in frames.into_iter().enumerate() {
            let row = trc.lines().nth(5 + nth).unwrap_or_else(|| panic!("{trc}"));
            assert_eq!(row.contains("NaN"), !is_there, "{row}");
        }
        let table = read(&format!("x-person{id}-long.csv"));
        for (frame, is_there) in frames.into_iter().enumerate() {
            let row = format!("{frame},{},{id},head,", frame as f64 / 50.0);
            let rest = table.lines().find_map(|line| line.strip_prefix(&row)).unwrap();
            let place = if is_there {
                format!("{id},2,3,")
            } else {
                ",,,".to_owned()
            };
            assert!(rest.starts_with(&place), "{row}{rest}");
        }
        assert!(read(&format!("x-person{id}.csv")).contains(&format!("\n0,0,{id},ok,")));
    }
    let manifest: Value = serde_json::from_str(&read("x.export.json")).unwrap();
    let people = manifest["people"].as_array().unwrap();
    let told = |person: &Value| {
        let frames = person["frames_with_points"].clone();
        (
            person["ids"].clone(),
            frames,
            person["gaps"]["head"].clone(),
        )
    };
    let told: Vec<_> = people.iter().map(told).collect();
    let expected = [
        (json!([1]), json!(2), json!([[1, 1], [3, 3]])),
        (json!([4]), json!(3), json!([[3, 3]])),
    ];
    assert_eq!(told, expected);
    let alone = line(0, &[]) + &line(1, &[person(4, 4.0)]);
    let folder = run(&[("pose3d.jsonl", &alone)]);
    let origin = Origin::read(folder.path(), &given()).unwrap();
    exported(&origin, &job(folder.path(), &["trc"])).unwrap();
    assert!(folder.path().join("export/x.trc").exists());
}

#[test]
fn impossible_people_are_refused_with_the_line_and_the_field() {
    let refused = |people: &[String]| {
        let text = line(0, &[person(1, 1.0)]) + &line(1, people);
        let folder = run(&[("pose3d.jsonl", &text)]);
        let error = Origin::read(folder.path(), &given()).unwrap_err();
        assert_eq!(error.kind(), ExitKind::Input);
        error.to_string()
    };
    let nine: Vec<String> = (1..=9).map(|id| person(id, 0.5)).collect();
    let one = || person(1, 1.0);
    for (people, due) in [
        (nine, "line 2, column 1"),
        (
            vec![one(), one()],
            "two people have the id 1, but the ids in a frame must differ",
        ),
        (
            vec![one().replace("1.0,2.0", "NaN,2.0")],
            "field `people[0].joints",
        ),
        (
            vec![one(), person(2, 2.0).replace("joints", "joint")],
            "field `people[1]`: missing field `joints`",
        ),
    ] {
        let error = refused(&people);
        assert!(error.contains("line 2") && error.contains(due), "{error}");
    }
}

#[test]
fn export_asks_for_missing_information_before_it_writes_a_file() {
    let timeless = lines(2).replace("\"time_s\":0.02", "\"time_s\":null");
    let timeless = timeless.replace("\"time_s\":0,", "\"time_s\":null,");
    let folder = run(&[("pose3d.jsonl", &timeless)]);
    let origin = Origin::read(folder.path(), &Given::default()).unwrap();
    let refused =
        |formats: &[&str]| exported(&origin, &job(folder.path(), formats)).unwrap_err().to_string();
    assert!(refused(&["c3d", "csv"]).contains("the frame rate of the run is not known"));
    assert!(refused(&["openpose"]).contains("deployment.json"));
    assert!(!folder.path().join("export").exists());
    exported(&origin, &job(folder.path(), &["csv"])).unwrap();
    let rate_hz = Some(25.0);
    let origin = Origin::read(
        folder.path(),
        &Given {
            rate_hz,
            ..Given::default()
        },
    )
    .unwrap();
    let error = exported(&origin, &job(folder.path(), &["trc"])).unwrap_err();
    assert!(
        error.to_string().contains("the upward direction is not known"),
        "{error}"
    );
    let folder = run(&[("pose3d.jsonl", &lines(2))]);
    let error = Origin::read(
        folder.path(),
        &Given {
            rate_hz,
            ..Given::default()
        },
    )
    .unwrap_err();
    assert!(error.to_string().contains("contradicts"), "{error}");
}

#[test]
fn exporting_an_incomplete_run_warns_and_a_run_without_joints_is_refused() {
    let text = lines(3);
    let cut = run(&[("pose3d.jsonl.part", &text[..text.len() - 9])]);
    let origin = Origin::read(cut.path(), &given()).unwrap();
    assert_eq!(origin.trials[0].slots.len(), 2);
    let flaws = origin.flaws.join("\n");
    assert!(
        flaws.contains("has not ended") && flaws.contains("line 3 is truncated"),
        "{flaws}"
    );
    for text in ["", LINE, &format!("{LINE}\n{LINE}\n")] {
        let empty = run(&[("pose3d.jsonl", text)]);
        let error = Origin::read(empty.path(), &given()).unwrap_err();
        assert_eq!(error.kind(), ExitKind::Degraded, "{error}");
    }
    let wrong = run(&[(
        "pose3d.jsonl",
        &text.replace("\"frame\":1,", "\"frame\":-1,"),
    )]);
    let error = Origin::read(wrong.path(), &given()).unwrap_err().to_string();
    assert!(
        error.contains("line 2") && error.contains("frame"),
        "{error}"
    );
    let error = Origin::read(tempfile::tempdir().unwrap().path(), &given()).unwrap_err();
    assert_eq!(error.kind(), ExitKind::Input);
}

#[test]
fn a_stop_request_ends_the_export_and_leaves_no_partial_file() {
    let folder = run(&[("pose3d.jsonl", &lines(3))]);
    let origin = Origin::read(folder.path(), &given()).unwrap();
    let stop = Stop::new().unwrap();
    stop.request();
    let error = export(&origin, &job(folder.path(), &["csv"]), &stop, &Silent).unwrap_err();
    assert_eq!(error.kind(), ExitKind::Interrupted);
    assert_eq!(
        fs::read_dir(folder.path().join("export")).unwrap().count(),
        0
    );
}
