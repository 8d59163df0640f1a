//! Tests of reading and writing every file. The samples are from a run in which a camera's process was killed.

use proptest::prelude::*;
use serde::Serialize;
use serde_json::Value;

use super::*;

const SUMMARY: &str = include_str!("samples/summary.json");
const LATENCY: &str = include_str!("samples/latency.json");
const POSE3D: &str = include_str!("samples/pose3d.jsonl");
const POSE2D: &str = include_str!("samples/pose2d.jsonl");
const TIMES: &str = include_str!("samples/times.jsonl");

fn read<L: Line>(text: &str) -> Vec<L> {
    lines(text).collect::<Result<_, _>>().unwrap()
}

fn written<L: Line>(lines: &[L]) -> String {
    lines.iter().map(|line| to_line(line).unwrap()).collect()
}

#[test]
fn files_of_a_run_are_read_and_written_back_byte_for_byte() {
    assert_eq!(written(&read::<FrameLine>(POSE3D)), POSE3D);
    assert_eq!(written(&read::<ViewLine>(POSE2D)), POSE2D);
    assert_eq!(written(&read::<TimesLine>(TIMES)), TIMES);
    let summary = RunSummary::parse(SUMMARY).unwrap();
    assert_eq!(summary.to_text().unwrap(), SUMMARY);
    let latency = LatencyReport::parse(LATENCY).unwrap();
    assert_eq!(latency.to_text().unwrap(), LATENCY);
    assert_eq!(summary.latency, latency);
}

#[test]
fn missing_results_and_joints_have_a_reason() {
    let [without, partial, whole] = &read::<FrameLine>(POSE3D)[..] else {
        panic!("three lines")
    };
    assert!(!without.has_result() && !without.has_pose());
    assert!(without.reason.is_some() && without.people.is_empty());
    assert!(without.views_missing.len() == 4);
    assert!(whole.has_pose() && whole.reason.is_none());
    let joints = |line: &FrameLine| line.people[0].joints.clone();
    assert!(joints(whole).values().all(|joint| joint.placed().is_some()));
    let is_missing = |joint: &JointLine| matches!(joint, JointLine::Missing { status } if status == "too few views");
    assert!(joints(partial).values().any(is_missing));
}

/// Checks that each field of an object, if it is replaced by a text or left out, gives an error that contains its name. Fields that may be
/// missing are not checked.
fn assert_strict<T: Serialize>(
    text: &str,
    may_be_missing: &[&str],
    parse: impl Fn(&str) -> Result<T, ReadError>,
) {
    let whole: Value = serde_json::from_str(text).unwrap();
    for field in whole.as_object().unwrap().keys() {
        let mut wrong = whole.clone();
        wrong[field] = Value::from(true);
        let error = parse(&wrong.to_string()).map(|_| ()).unwrap_err();
        assert_eq!(&error.field, field, "{error}");
        assert!(error.problem.contains("boolean"), "{error}");
        let mut missing = whole.clone();
        missing.as_object_mut().unwrap().remove(field);
        match parse(&missing.to_string()) {
            Ok(_) => assert!(may_be_missing.contains(&field.as_str()), "{field}"),
            Err(error) => assert!(
                error.to_string().contains(&format!("missing field `{field}`")),
                "{error}"
            ),
        }
    }
}

#[test]
fn a_missing_or_wrong_field_is_an_error_that_names_it() {
    for line in POSE3D.lines() {
        assert_strict(line, &["reason", "seen"], read::parse::<FrameLine>);
    }
    for line in POSE2D.lines() {
        assert_strict(line, &[], read::parse::<ViewLine>);
    }
    for line in TIMES.lines() {
        assert_strict(line, &[], read::parse::<TimesLine>);
    }
    assert_strict(LATENCY, &[], LatencyReport::parse);
    assert_strict(SUMMARY, &[], RunSummary::parse);
    let summary: Value = serde_json::from_str(SUMMARY).unwrap();
    let section = summary["summary"].to_string();
    assert_strict(&section, &[], read::parse::<Summary>);
}

#[test]
fn errors_contain_the_place_and_the_value_found() {
    let broken = SUMMARY.replace("\"frames_missed\": ", "\"frames_missed\": -");
    let error = RunSummary::parse(&broken).unwrap_err().to_string();
    assert!(
        error.contains("field `summary.frames_missed`") && error.contains("expected u64"),
        "{error}"
    );
    let broken = TIMES.replacen("\"epoch\":", "\"epoch\":\"x\",\"was\":", 1);
    let last = TIMES.lines().next().unwrap().to_owned() + "\n" + &broken;
    let mut lines = lines::<TimesLine>(&last);
    lines.next().unwrap().unwrap();
    let error = lines.next().unwrap().unwrap_err();
    assert_eq!(
        (error.line, error.field.as_str(), error.problem.as_str()),
        (2, "epoch", "invalid type: string \"x\", expected u32")
    );
    lines.next().expect("the others are read").unwrap();
    let cut = POSE3D.lines().next().unwrap();
    let error = read::parse::<FrameLine>(&cut[..cut.len() - 1]).unwrap_err();
    assert!(error.to_string().contains("EOF"), "{error}");
    let joint = r#"{"position_m":[1,2,3],"views":[]}"#;
    let error = read::parse::<JointLine>(joint).unwrap_err().to_string();
    assert!(error.contains("missing field `covariance_m2`"), "{error}");
}

/// Returns a line with people who have these ids.
fn line_of(ids: &[u64]) -> String {
    let line = read::<FrameLine>(POSE3D).pop().unwrap();
    let person = |id: &u64| PersonLine {
        id: *id,
        ..line.people[0].clone()
    };
    let people = ids.iter().map(person).collect();
    to_line(&FrameLine { people, ..line }).unwrap()
}

#[test]
fn a_line_has_at_most_eight_people_with_unique_ids() {
    for ids in [&[][..], &[3], &[7, 2], &[1, 2, 3, 4, 5, 6, 7, u64::MAX]] {
        let lines = read::<FrameLine>(&line_of(ids));
        let found = lines[0].people.iter().map(|person| person.id);
        assert_eq!(found.collect::<Vec<_>>(), ids, "in their order");
        assert_eq!(
            lines[0].followed().map(|person| person.id),
            ids.first().copied()
        );
    }
    for (ids, problem) in [
        (
            &[1, 2, 3, 4, 5, 6, 7, 8, 9][..],
            "the frame has 9 people, but at most 8 are possible",
        ),
        (
            &[4, 5, 4],
            "two people have the id 4, but the ids in a frame must differ",
        ),
        (&[0], "a person has the id 0, but ids begin at 1"),
    ] {
        let error = read::parse::<FrameLine>(&line_of(ids)).unwrap_err();
        assert_eq!(
            (error.field.as_str(), error.problem.as_str()),
            ("people", problem)
        );
    }
    let two = line_of(&[1, 2]);
    let wrong = two.replacen("\"id\":2,\"joints\":", "\"id\":2,\"joint\":", 1);
    let error = read::parse::<FrameLine>(&wrong).unwrap_err();
    assert_eq!(
        (error.field.as_str(), error.problem.as_str()),
        ("people[1]", "missing field `joints`")
    );
    let wrong = two.replacen(
        "\"position_m\":[-0.36290584760858785",
        "\"position_m\":[NaN",
        1,
    );
    let error = read::parse::<FrameLine>(&wrong).unwrap_err();
    assert!(error.field.starts_with("people[0].joints"), "{error}");
}

#[test]
fn a_field_of_a_person_that_is_missing_or_wrong_is_an_error_that_names_it() {
    for line in POSE3D.lines() {
        let line: Value = serde_json::from_str(line).unwrap();
        for person in line["people"].as_array().unwrap() {
            let may_be_missing = [
                "body_deviation",
                "kept",
                "sides",
                "sides_margin",
                "stature_m",
            ];
            assert_strict(
                &person.to_string(),
                &may_be_missing,
                read::parse::<PersonLine>,
            );
        }
    }
}

#[test]
fn a_summary_of_another_version_is_refused_but_its_session_is_readable() {
    let other = SUMMARY.replace("\"schema_version\": 2", "\"schema_version\": 9");
    let error = RunSummary::parse(&other).unwrap_err().to_string();
    assert!(error.contains("version 9"), "{error}");
    let session = RunSummary::parse(SUMMARY).unwrap().session;
    assert_eq!(RunSummary::parse_session(&other), Ok(session));
}

#[test]
fn unknown_fields_are_ignored() {
    let more = TIMES.replace("{\"epoch\"", "{\"a\":[1],\"epoch\"");
    assert_eq!(read::<TimesLine>(&more), read::<TimesLine>(TIMES));
}

#[test]
fn numbers_that_are_not_finite_become_null() {
    let mut line = read::<FrameLine>(POSE3D).pop().unwrap();
    let Some(JointLine::Placed(joint)) = line.people[0].joints.get_mut("head") else {
        panic!("a head")
    };
    joint.covariance_m2[1] = f64::NAN;
    joint.reprojection_px = None;
    let text = to_line(&line).unwrap();
    assert!(text.contains("null") && !text.contains("NaN"));
    let again = read::<FrameLine>(&text).pop().unwrap();
    let head = again.people[0].joints["head"].placed().unwrap();
    assert!(head.covariance_m2[1].is_nan() && head.covariance_m2[0].is_finite());
    assert_eq!(head.reprojection_px, None);
}

#[test]
fn fields_are_declared_in_the_order_in_which_they_are_written() {
    fn sorted(it: &impl Serialize) -> String {
        // An object of `serde_json` is sorted by name.
        serde_json::to_value(it).unwrap().to_string()
    }
    let summary = Summary {
        exchanged: Some(Exchanged {
            cameras: ["a", "b"].map(str::to_owned),
            degrees: 3.0,
            exchanged_degrees: 0.5,
            sure: true,
        }),
        contradicted: Some(Contradicted {
            degrees: 3.0,
            likely: None,
            usual_degrees: 1.0,
        }),
        ..Summary::default()
    };
    assert_eq!(serde_json::to_string(&summary).unwrap(), sorted(&summary));
}

proptest! {
    #[test]
    fn reasons_and_times_survive_a_round_trip(
        reason in "[a-z ]{0,20}",
        epoch: u32,
        sent_ms in 0.0..1e12_f64,
        name: String,
    ) {
        for text in [reason.as_str(), Missing::LATE, Missing::DROPPED, Missing::PROCESS_LOST, Missing::END_OF_FOOTAGE] {
            let missing = Missing::from(text);
            prop_assert_eq!(missing.text(), text);
            let written = serde_json::to_string(&missing).unwrap();
            prop_assert_eq!(serde_json::from_str::<Missing>(&written).unwrap(), missing);
        }
        let pose = Some(PoseTimes { epoch, sent_ms });
        let line = TimesLine {
            epoch,
            frame: u64::MAX,
            sent_ms,
            views: [(name, ViewTimes { camera: None, pose })].into(),
        };
        prop_assert_eq!(read::<TimesLine>(&to_line(&line).unwrap()), vec![line]);
    }
}
