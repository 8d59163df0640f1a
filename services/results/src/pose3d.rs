//! `pose3d.jsonl` and `pose3d.csv`: joints in world coordinates.

use std::collections::BTreeMap;

use messages::{Joint3d, SkeletonMessage, Skeletons, Status};
use runfiles::{FrameLine, JointLine, Kept, PersonLine, PlacedJoint, Sides};

use crate::{Absent, FrameRecord, Scene};

/// First line of `pose3d.csv`. It is followed by one row per joint of each person, with empty cells for joints without a position. A frame
/// in which nobody was found has one row per joint, without a person's id.
pub(crate) const CSV_HEADER: &str = "frame,time_s,person,joint,x_m,y_m,z_m,cov_xx_m2,cov_xy_m2,cov_xz_m2,\
cov_yy_m2,cov_yz_m2,cov_zz_m2,reprojection_px,views,status";

const _: () = assert!(runfiles::MOST_PEOPLE == messages::MAX_PEOPLE);

/// Returns the joints of a person with their names, as many as both lists have.
pub(crate) fn joints<'a>(
    scene: &'a Scene,
    person: &'a SkeletonMessage,
) -> impl Iterator<Item = (&'a str, &'a Joint3d)> {
    let names = scene.joints.joints.iter().map(|joint| joint.name);
    names.zip(person.listed_joints())
}

/// Returns the extra keypoints of a person with their names, as many as both lists have.
pub(crate) fn keypoints<'a>(
    scene: &'a Scene,
    person: &'a SkeletonMessage,
) -> impl Iterator<Item = (&'a str, &'a Joint3d)> {
    let names = scene.extra_keypoints.iter().map(String::as_str);
    names.zip(person.listed_keypoints())
}

/// Returns true if a joint has a finite position.
pub(crate) fn is_placed(joint: &Joint3d) -> bool {
    joint.status == Status::OK && joint.in_world.iter().all(|value| value.is_finite())
}

/// Returns the line of a result.
pub(crate) fn line(scene: &Scene, record: &FrameRecord) -> FrameLine {
    let frame = &record.skeletons;
    let missing = missing(scene, record).into_iter();
    let people = frame.listed().iter();
    FrameLine {
        frame: frame.stamp.frame,
        people: people.map(|person| person_line(scene, person)).collect(),
        reason: None,
        seen: Some(frame.n_seen),
        status: frame.status.reason().to_owned(),
        time_s: scene.time_s(frame.stamp.frame),
        views_missing: missing.map(|(name, reason)| (name.to_owned(), reason.into())).collect(),
        views_present: owned(scene.names(frame.views_present)),
    }
}

fn person_line(scene: &Scene, person: &SkeletonMessage) -> PersonLine {
    let point = |(name, point): (&str, &Joint3d)| (name.to_owned(), joint(scene, point));
    let has_body = person.stature_m > 0.0;
    PersonLine {
        body_deviation: finite(person.body_deviation).filter(|_| has_body),
        facing_margin: finite(person.facing_margin),
        id: person.id,
        joints: joints(scene, person).map(point).collect(),
        kept: Some(match person.kept {
            messages::Kept::START => Kept::Start,
            _ => Kept::Solved,
        }),
        keypoints: keypoints(scene, person).map(point).collect(),
        pairs: person.n_pairs,
        sides: Some(match person.sides {
            messages::Sides::SURE => Sides::Sure,
            messages::Sides::UNSURE => Sides::Unsure,
            _ => Sides::AsSeen,
        }),
        sides_margin: finite(person.sides_margin),
        states: BTreeMap::new(),
        stature_m: finite(person.stature_m).filter(|_| has_body),
        status: person.status.reason().to_owned(),
        views_used: owned(scene.names(person.views_used)),
    }
}

/// Returns the line of a frame without a result: the reason, and for every view the reason why it does not contribute to the result.
pub(crate) fn absent_line(scene: &Scene, it: &Absent) -> FrameLine {
    let views = scene.views.iter().enumerate();
    let why = |view: usize| it.views.get(view).map_or(it.reason.as_str(), |view| view.reason());
    FrameLine {
        frame: it.frame,
        people: Vec::new(),
        reason: Some(it.reason.clone()),
        seen: None,
        status: FrameLine::NO_RESULT.to_owned(),
        time_s: scene.time_s(it.frame),
        views_missing: views.map(|(view, named)| (named.name.clone(), why(view).into())).collect(),
        views_present: Vec::new(),
    }
}

fn owned(names: Vec<&str>) -> Vec<String> {
    names.into_iter().map(str::to_owned).collect()
}

fn finite(number: f64) -> Option<f64> {
    Some(number).filter(|value| value.is_finite())
}

/// Returns a person without joints, for the rows of a frame in which nobody was found.
///
/// * `status`: status of the frame.
pub(crate) fn nobody(scene: &Scene, status: Status) -> SkeletonMessage {
    let mut person = SkeletonMessage {
        status,
        n_joints: scene.joints.joints.len() as u32,
        n_keypoints: scene.extra_keypoints.len() as u32,
        ..SkeletonMessage::default()
    };
    for point in person.joints.iter_mut().chain(&mut person.keypoints) {
        point.status = status;
    }
    person
}

/// Returns a frame without a result.
pub(crate) fn nothing(frame: u64) -> Box<Skeletons> {
    let mut nothing = Box::<Skeletons>::default();
    (nothing.stamp.frame, nothing.status) = (frame, Status::NO_FRAME);
    nothing
}

/// Returns the views that do not contribute to the result, with the reasons.
pub(crate) fn missing<'a>(
    scene: &'a Scene,
    record: &FrameRecord,
) -> BTreeMap<&'a str, &'static str> {
    let views = scene.views.iter().zip(&record.views);
    views
        .filter_map(|(view, record)| Some((view.name.as_str(), record.missing?.reason())))
        .collect()
}

fn joint(scene: &Scene, it: &Joint3d) -> JointLine {
    if !is_placed(it) {
        let status = it.status.reason().to_owned();
        return JointLine::Missing { status };
    }
    JointLine::Placed(PlacedJoint {
        covariance_m2: it.covariance,
        position_m: it.in_world,
        reprojection_px: finite(it.reprojection_px),
        views: owned(scene.names(it.views_used)),
    })
}

/// Returns the rows of one frame in `pose3d.csv`, each with its line end.
pub(crate) fn csv_rows(scene: &Scene, frame: &Skeletons) -> String {
    if frame.listed().is_empty() {
        return rows_of(scene, frame.stamp.frame, &nobody(scene, frame.status));
    }
    let people = frame.listed().iter();
    people.map(|person| rows_of(scene, frame.stamp.frame, person)).collect()
}

fn rows_of(scene: &Scene, frame: u64, person: &SkeletonMessage) -> String {
    let time = scene.time_s(frame).map_or(String::new(), |time_s| format!("{time_s:.6}"));
    let id = match person.id {
        0 => String::new(),
        id => id.to_string(),
    };
    joints(scene, person)
        .chain(keypoints(scene, person))
        .map(|(name, joint)| {
            let views = scene.names(joint.views_used).join("+");
            let numbers = if is_placed(joint) {
                let all = joint.in_world.iter().chain(&joint.covariance);
                let mut cells: Vec<String> = all.map(|value| cell(*value)).collect();
                cells.push(cell(joint.reprojection_px));
                cells.join(",")
            } else {
                ",".repeat(9)
            };
            format!(
                "{frame},{time},{id},{name},{numbers},{views},{}\n",
                joint.status.reason()
            )
        })
        .collect::<Vec<_>>()
        .concat()
}

fn cell(value: f64) -> String {
    if value.is_finite() {
        format!("{value:.9e}")
    } else {
        String::new()
    }
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::*;
    use crate::Missing;
    use crate::testing::{record, scene, skeletons};

    #[test]
    fn a_line_says_which_views_were_used() {
        let mut record = record(7);
        record.skeletons.views_present = 0b10;
        record.skeletons.people[0].views_used = 0b10;
        record.views[0].missing = Some(Missing::Lost);
        let line: Value = serde_json::to_value(line(&scene(), &record)).unwrap();
        assert_eq!(line["frame"], 7);
        assert_eq!(line["views_present"], json!(["right"]));
        assert_eq!(line["views_missing"], json!({ "left": "process lost" }));
        let person = &line["people"][0];
        assert_eq!(
            (&line["people"][1], &person["id"]),
            (&Value::Null, &json!(1))
        );
        assert_eq!(person["views_used"], json!(["right"]));
        assert_eq!(
            person["joints"]["head"]["position_m"],
            json!([1.0, 2.0, 3.0])
        );
    }

    #[test]
    fn values_that_are_not_finite_are_never_written_as_numbers() {
        let mut record = record(0);
        let pose = &mut record.skeletons.people[0];
        pose.facing_margin = f64::INFINITY;
        pose.joints[0].reprojection_px = f64::NAN;
        pose.joints[1].in_world[2] = f64::NAN;
        let text = runfiles::to_line(&line(&scene(), &record)).unwrap();
        let line: Value = serde_json::from_str(&text).unwrap();
        assert_eq!(
            line["people"][0]["joints"]["right ankle"]["reprojection_px"],
            Value::Null
        );
        assert_eq!(
            line["people"][0]["joints"]["right knee"].get("position_m"),
            None
        );
        assert!(!csv_rows(&scene(), &record.skeletons).to_lowercase().contains("nan"));
    }

    #[test]
    fn every_row_has_as_many_cells_as_the_header() {
        let mut pose = skeletons(3);
        pose.people[0].joints[4].status = Status::TOO_FEW_VIEWS;
        pose.people[1] = pose.people[0];
        (pose.n_people, pose.people[1].id) = (2, 9);
        let columns = CSV_HEADER.split(',').count();
        let rows = csv_rows(&scene(), &pose);
        assert_eq!(rows.lines().count(), 28);
        assert!(rows.lines().nth(13).unwrap().starts_with("3,0.050000,1,head,"));
        assert!(rows.lines().nth(27).unwrap().starts_with("3,0.050000,9,head,"));
        for row in rows.lines() {
            assert_eq!(row.split(',').count(), columns, "{row}");
        }
    }

    #[test]
    fn extra_keypoints_are_written_by_name_after_the_joints() {
        let mut scene = scene();
        scene.extra_keypoints = vec!["nose".to_owned(), "left heel".to_owned()];
        let mut record = record(7);
        record.skeletons.people[0].n_keypoints = 2;
        record.skeletons.people[0].keypoints[1].status = Status::IMPLAUSIBLE;
        let text = runfiles::to_line(&line(&scene, &record)).unwrap();
        let line: Value = serde_json::from_str(&text).unwrap();
        assert_eq!(
            line["people"][0]["keypoints"]["nose"]["position_m"],
            json!([1.0, 2.0, 3.0])
        );
        assert_eq!(line["people"][0]["joints"].get("nose"), None);
        let heel = &line["people"][0]["keypoints"]["left heel"];
        assert_eq!(*heel, json!({ "status": Status::IMPLAUSIBLE.reason() }));
        let rows = csv_rows(&scene, &record.skeletons);
        assert_eq!(rows.lines().count(), 16);
        assert!(
            rows.lines().nth(14).unwrap().contains(",nose,1.0"),
            "{rows}"
        );
        let rows = csv_rows(&scene, &nothing(8));
        assert_eq!(rows.lines().count(), 16, "{rows}");
        assert!(rows.contains("\n8,0.133333,,neck,,,,"), "{rows}");
    }

    #[test]
    fn a_joint_count_beyond_the_joint_set_is_limited() {
        let mut person = skeletons(0).people[0];
        person.n_joints = u32::MAX;
        assert_eq!(joints(&scene(), &person).count(), 14);
    }
}
