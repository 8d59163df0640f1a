//! Tests of the files of a run.

use messages::{Searched, Status};
use serde_json::{Value, json};

use super::*;
use crate::Missing;
use crate::testing::{record, scene};

fn written(records: Vec<FrameRecord>) -> (tempfile::TempDir, Summary) {
    let dir = tempfile::tempdir().unwrap();
    let folder = Folder::open(dir.path(), false).unwrap();
    let mut output = Output::begin(scene(), &Config::default(), 1, folder).unwrap();
    for record in records {
        output.frame(&record);
    }
    let summary = output.finish(1);
    (dir, summary)
}

fn text(dir: &tempfile::TempDir, name: &str) -> String {
    fs::read_to_string(dir.path().join(name)).unwrap()
}

#[test]
fn all_files_are_complete_at_the_end_and_no_partial_file_is_left() {
    let (dir, _) = written(vec![record(0), record(2)]);
    let mut names: Vec<String> = fs::read_dir(dir.path())
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    let expected = [
        "latency.json",
        "overlays",
        "pose2d.jsonl",
        "pose3d.csv",
        "pose3d.jsonl",
        "pose3d.trc",
        "summary.json",
        "times.jsonl",
    ];
    assert_eq!(names, expected);
    assert_eq!(text(&dir, "pose3d.jsonl").lines().count(), 2);
    assert_eq!(text(&dir, "pose3d.csv").lines().count(), 1 + 2 * 14);
    assert_eq!(text(&dir, "pose2d.jsonl").lines().count(), 4);
    let trc = formats::trc::Trc::parse(&text(&dir, "pose3d.trc")).unwrap();
    assert_eq!(trc.frames.len(), 2);
}

#[test]
fn a_file_that_needs_the_frame_rate_is_not_written_without_one() {
    let dir = tempfile::tempdir().unwrap();
    let folder = Folder::open(dir.path(), false).unwrap();
    let scene = Scene {
        frame_rate_hz: None,
        ..scene()
    };
    let mut output = Output::begin(scene, &Config::default(), 1, folder).unwrap();
    output.frame(&record(0));
    assert_eq!(output.finish(1).writes_failed, 0);
    assert!(!dir.path().join("pose3d.trc").exists());
}

#[test]
fn skipped_frames_and_missing_views_are_counted() {
    let mut last = record(8);
    last.skeletons.views_present = 0b01;
    last.views[1].missing = Some(Missing::Late);
    // Every second frame is used: 0, 2, (4, 6), 8.
    let (_, summary) = written(vec![record(0), record(2), last]);
    assert_eq!(summary.frames, 3);
    assert_eq!(summary.frames_missed, 2);
    assert_eq!(summary.frames_with_views_missing, 1);
    assert_eq!(
        summary.views_used,
        [("left".to_owned(), 3), ("right".to_owned(), 3)]
    );
    assert!((summary.reprojection_px.unwrap() - 1.5).abs() < 1e-12);
}

#[test]
fn searches_and_the_bytes_of_their_evidence_are_counted_by_view() {
    let searched = |frame, searched, evidence_bytes| {
        let mut it = record(frame);
        let pose = it.views[1].pose.as_mut().unwrap();
        (pose.searched, pose.evidence_bytes) = (searched, evidence_bytes);
        it
    };
    let mut without = record(6);
    without.views[1].pose.as_mut().unwrap().status = Status::NO_FRAME;
    let (dir, summary) = written(vec![
        searched(0, Searched::FULL, 1000),
        searched(2, Searched::TRACKED, 200),
        searched(4, Searched::TRACKED, 300),
        without,
    ]);
    let of_right = [("full".to_owned(), 1), ("tracked".to_owned(), 2)];
    assert_eq!(summary.searches["right"], of_right.into());
    assert_eq!(summary.searches["left"], [("full".to_owned(), 4)].into());
    assert_eq!(summary.evidence_bytes_per_frame["right"], 500);
    let text = text(&dir, "pose2d.jsonl");
    let lines = text.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
    let said: Vec<Value> = lines.map(|line| line["search"].clone()).collect();
    assert_eq!(said[3], "tracked");
    assert_eq!(said[7], Value::Null, "there was no frame");
}

#[test]
fn a_restarted_recorder_counts_what_it_had_written() {
    let dir = tempfile::tempdir().unwrap();
    let begin = |resume| {
        let folder = Folder::open(dir.path(), resume).unwrap();
        Output::begin(scene(), &Config::default(), 1, folder).unwrap()
    };
    let mut killed = begin(false);
    killed.frame(&record(0));
    killed.frame(&record(2));
    drop(killed);
    let mut restarted = begin(true);
    restarted.frame(&record(6));
    let summary = restarted.finish(1);
    assert_eq!((summary.frames, summary.frames_with_pose), (3, 3));
    assert_eq!(summary.frames_missed, 1);
    assert_eq!(summary.views_used[0].1, 3);
    assert_eq!(text(&dir, "pose3d.csv").lines().count(), 1 + 4 * 14);
}

#[test]
fn every_frame_is_in_all_result_files() {
    let dir = tempfile::tempdir().unwrap();
    let folder = Folder::open(dir.path(), false).unwrap();
    let mut output = Output::begin(scene(), &Config::default(), 1, folder).unwrap();
    let absent = |frame| Absent {
        frame,
        reason: "dropped".to_owned(),
        views: vec![Missing::Dropped; 2],
    };
    output.absent(&[absent(0)]);
    output.frame(&record(2));
    // Frame 4 was not taken, because the queue was full.
    output.absent(&[absent(6)]);
    output.frame(&record(8));
    output.absent(&[absent(10)]);
    // Frame 12, the last one, was not taken either.
    output.fill_up_to(14);
    let summary = output.finish(1);
    assert_eq!((summary.frames, summary.frames_missed), (2, 5));
    let lines = text(&dir, "pose3d.jsonl");
    let lines = lines.lines().map(|line| serde_json::from_str(line).unwrap());
    let lines: Vec<Value> = lines.collect();
    let told = |value: &Value| {
        (
            value["frame"].as_u64(),
            value["reason"].as_str().map(str::to_owned),
        )
    };
    let dropped = Some("dropped".to_owned());
    let not_written = Some("its result could not be written".to_owned());
    let expected = [
        (Some(0), dropped.clone()),
        (Some(2), None),
        (Some(4), not_written.clone()),
        (Some(6), dropped.clone()),
        (Some(8), None),
        (Some(10), dropped),
        (Some(12), not_written),
    ];
    assert_eq!(lines.iter().map(told).collect::<Vec<_>>(), expected);
    assert_eq!(
        lines[0]["views_missing"],
        json!({ "left": "dropped", "right": "dropped" })
    );
    assert_eq!(text(&dir, "pose3d.csv").lines().count(), 1 + 7 * 14);
    let trc = formats::trc::Trc::parse(&text(&dir, "pose3d.trc")).unwrap();
    assert_eq!(trc.frames.len(), 7);
}

#[test]
fn a_file_cut_by_a_full_disk_is_not_counted_as_written_and_not_renamed() {
    let dir = tempfile::tempdir().unwrap();
    let folder = Folder::open(dir.path(), false).unwrap();
    let mut output = Output::begin(scene(), &Config::default(), 1, folder).unwrap();
    output.pose3d_jsonl = Lines::new(fs::File::create("/dev/full").unwrap()).unwrap();
    output.frame(&record(0));
    output.frame(&record(2));
    let summary = output.finish(1);
    assert!(summary.writes_failed >= 2, "{summary:?}");
    assert!(summary.first_failure.is_some());
    assert_eq!((summary.frames, summary.frames_not_recorded), (0, 2));
    assert_eq!(text(&dir, "pose3d.csv").lines().count(), 1);
    assert!(dir.path().join("pose3d.jsonl.part").exists());
    assert!(!dir.path().join("pose3d.jsonl").exists());
}

#[test]
fn some_files_list_everybody_and_others_only_the_followed_person() {
    let dir = tempfile::tempdir().unwrap();
    let folder = Folder::open(dir.path(), false).unwrap();
    let mut output = Output::begin(scene(), &Config::default(), 1, folder).unwrap();
    output.smooth().unwrap();
    // In the third frame another person is followed, and in the last frame there is nobody.
    for (frame, ids) in [(0, &[3, 8][..]), (2, &[3, 8]), (4, &[8, 3]), (6, &[])] {
        let mut record = record(frame);
        let result = &mut record.skeletons;
        let somebody = result.people[0];
        result.n_people = ids.len() as u32;
        for (person, id) in result.people.iter_mut().zip(ids) {
            *person = somebody;
            (person.id, person.joints[0].in_world[0]) = (*id, *id as f64);
        }
        if ids.is_empty() {
            result.status = Status::TOO_FEW_VIEWS;
        }
        output.frame(&record);
    }
    let summary = output.finish(1);
    assert_eq!(
        (summary.frames_with_pose, summary.people.followed),
        (3, vec![3, 8])
    );
    let ids = |name: &str| -> Vec<Vec<u64>> {
        let text = text(&dir, name);
        let lines = runfiles::lines::<FrameLine>(&text).map(Result::unwrap);
        let ids = lines.map(|line| line.people.iter().map(|person| person.id).collect());
        ids.collect()
    };
    let expected = [vec![3, 8], vec![3, 8], vec![8, 3], vec![]];
    assert_eq!(ids("pose3d.jsonl"), expected);
    assert_eq!(ids("pose3d-smooth.jsonl")[..3], expected[..3]);
    let rows = text(&dir, "pose3d.csv");
    assert_eq!(rows.lines().count(), 1 + 3 * 28 + 14);
    assert!(rows.contains("\n4,0.066667,3,right ankle,3.0"), "{rows}");
    assert!(rows.contains("\n6,0.100000,,right ankle,,"), "{rows}");
    let trc = formats::trc::Trc::parse(&text(&dir, "pose3d.trc")).unwrap();
    // z is up in the scene, so the axes are (y, z, x).
    let x = trc.frames.iter().map(|frame| frame[0].map(|place| place[2]));
    assert_eq!(
        x.collect::<Vec<_>>(),
        [Some(3.0), Some(3.0), Some(8.0), None]
    );
    let report = SmoothReport::parse(&text(&dir, SmoothReport::FILE)).unwrap();
    let people = report.people.iter();
    let measured = people.map(|person| (person.ids[0], person.joints["head"].measured));
    assert_eq!(measured.collect::<Vec<_>>(), [(3, 3), (8, 3)]);
}
