//! `pose3d.jsonl` and `pose3d.csv`: joints in the world.

use std::collections::BTreeMap;

use bytemuck::Zeroable as _;
use messages::{Joint3d, Pose3d, Status};
use runfiles::{FrameLine, JointLine, Kept, PlacedJoint, Sides};

use crate::{Absent, FrameRecord, Scene};

/// First line of `pose3d.csv`; one row a joint follows, empty where there is no position.
pub(crate) const CSV_HEADER: &str = "frame,time_s,joint,x_m,y_m,z_m,cov_xx_m2,cov_xy_m2,cov_xz_m2,\
cov_yy_m2,cov_yz_m2,cov_zz_m2,reprojection_px,views,status";

/// The joints of a message with their names, as many as both sides know.
pub(crate) fn joints<'a>(
    scene: &'a Scene,
    pose: &'a Pose3d,
) -> impl Iterator<Item = (&'a str, &'a Joint3d)> {
    let n = pose.n_joints as usize;
    scene
        .joints
        .joints
        .iter()
        .map(|it| it.name)
        .zip(pose.joints.iter().take(n))
}

/// The extra keypoints of a message with their names, as many as both sides know.
pub(crate) fn keypoints<'a>(
    scene: &'a Scene,
    pose: &'a Pose3d,
) -> impl Iterator<Item = (&'a str, &'a Joint3d)> {
    let n = pose.n_keypoints as usize;
    let names = scene.extra_keypoints.iter().map(String::as_str);
    names.zip(pose.keypoints.iter().take(n))
}

/// Whether a joint has a position that can be written down.
pub(crate) fn is_placed(joint: &Joint3d) -> bool {
    joint.status == Status::OK && joint.in_world.iter().all(|it| it.is_finite())
}

/// The line of a result.
pub(crate) fn line(scene: &Scene, record: &FrameRecord) -> FrameLine {
    let pose = &record.pose3d;
    let joints = joints(scene, pose);
    let missing = missing(scene, record).into_iter();
    let has_body = pose.stature_m > 0.0;
    FrameLine {
        body_deviation: finite(pose.body_deviation).filter(|_| has_body),
        facing_margin: finite(pose.facing_margin),
        frame: pose.stamp.frame,
        joints: joints
            .map(|(name, it)| (name.to_owned(), joint(scene, it)))
            .collect(),
        keypoints: keypoints(scene, pose)
            .map(|(name, it)| (name.to_owned(), joint(scene, it)))
            .collect(),
        kept: Some(match pose.kept {
            messages::Kept::START => Kept::Start,
            _ => Kept::Solved,
        }),
        pairs: pose.n_pairs,
        people: Some(pose.n_people),
        reason: None,
        sides: Some(match pose.sides {
            messages::Sides::SURE => Sides::Sure,
            messages::Sides::UNSURE => Sides::Unsure,
            _ => Sides::AsSeen,
        }),
        sides_margin: finite(pose.sides_margin),
        stature_m: finite(pose.stature_m).filter(|_| has_body),
        status: pose.status.reason().to_owned(),
        time_s: scene.time_s(pose.stamp.frame),
        views_missing: missing
            .map(|(name, reason)| (name.to_owned(), reason.into()))
            .collect(),
        views_present: owned(scene.names(pose.views_present)),
        views_used: owned(scene.names(pose.views_used)),
    }
}

/// The line of a frame that has no result: the reason, and why every view has no part in it.
pub(crate) fn absent_line(scene: &Scene, it: &Absent) -> FrameLine {
    let views = scene.views.iter().enumerate();
    let why = |view: usize| {
        it.views
            .get(view)
            .map_or(it.reason.as_str(), |it| it.reason())
    };
    FrameLine {
        body_deviation: None,
        facing_margin: None,
        frame: it.frame,
        joints: BTreeMap::new(),
        keypoints: BTreeMap::new(),
        kept: None,
        pairs: 0,
        people: None,
        reason: Some(it.reason.clone()),
        sides: None,
        sides_margin: None,
        stature_m: None,
        status: FrameLine::NO_RESULT.to_owned(),
        time_s: scene.time_s(it.frame),
        views_missing: views
            .map(|(view, it)| (it.name.clone(), why(view).into()))
            .collect(),
        views_present: Vec::new(),
        views_used: Vec::new(),
    }
}

fn owned(names: Vec<&str>) -> Vec<String> {
    names.into_iter().map(str::to_owned).collect()
}

fn finite(number: f64) -> Option<f64> {
    Some(number).filter(|it| it.is_finite())
}

/// A result without any joint, for the files that have rows of numbers.
pub(crate) fn nothing(scene: &Scene, frame: u64) -> Pose3d {
    let mut pose = Pose3d::zeroed();
    pose.stamp.frame = frame;
    pose.status = Status::NO_FRAME;
    pose.n_joints = scene.joints.joints.len() as u32;
    pose.n_keypoints = scene.extra_keypoints.len() as u32;
    for it in pose.joints.iter_mut().chain(&mut pose.keypoints) {
        it.status = Status::NO_FRAME;
    }
    pose
}

/// The views that have no part in the result, and why.
pub(crate) fn missing<'a>(
    scene: &'a Scene,
    record: &FrameRecord,
) -> BTreeMap<&'a str, &'static str> {
    let views = scene.views.iter().zip(&record.views);
    views
        .filter_map(|(view, it)| Some((view.name.as_str(), it.missing?.reason())))
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

/// The rows of one frame in `pose3d.csv`, each with its end.
pub(crate) fn csv_rows(scene: &Scene, pose: &Pose3d) -> String {
    let frame = pose.stamp.frame;
    let time = scene
        .time_s(frame)
        .map_or(String::new(), |it| format!("{it:.6}"));
    joints(scene, pose)
        .chain(keypoints(scene, pose))
        .map(|(name, it)| {
            let views = scene.names(it.views_used).join("+");
            let numbers = if is_placed(it) {
                let all = it.in_world.iter().chain(&it.covariance);
                let mut cells: Vec<String> = all.map(|value| cell(*value)).collect();
                cells.push(cell(it.reprojection_px));
                cells.join(",")
            } else {
                ",".repeat(9)
            };
            format!(
                "{frame},{time},{name},{numbers},{views},{}\n",
                it.status.reason()
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
    use crate::testing::{pose3d, record, scene};

    #[test]
    fn a_line_says_which_views_were_used() {
        let mut record = record(7);
        record.pose3d.views_present = 0b10;
        record.pose3d.views_used = 0b10;
        record.views[0].missing = Some(Missing::Lost);
        let line: Value = serde_json::to_value(line(&scene(), &record)).unwrap();
        assert_eq!(line["frame"], 7);
        assert_eq!(line["views_present"], json!(["right"]));
        assert_eq!(line["views_missing"], json!({ "left": "process lost" }));
        assert_eq!(line["views_used"], json!(["right"]));
        assert_eq!(line["joints"]["head"]["position_m"], json!([1.0, 2.0, 3.0]));
    }

    #[test]
    fn a_number_that_is_none_is_never_written_as_one() {
        let mut record = record(0);
        let pose = &mut record.pose3d;
        pose.facing_margin = f64::INFINITY;
        pose.joints[0].reprojection_px = f64::NAN;
        pose.joints[1].in_world[2] = f64::NAN;
        let text = runfiles::to_line(&line(&scene(), &record)).unwrap();
        let line: Value = serde_json::from_str(&text).unwrap();
        assert_eq!(
            line["joints"]["right ankle"]["reprojection_px"],
            Value::Null
        );
        assert_eq!(line["joints"]["right knee"].get("position_m"), None);
        assert!(
            !csv_rows(&scene(), &record.pose3d)
                .to_lowercase()
                .contains("nan")
        );
    }

    #[test]
    fn every_row_has_as_many_cells_as_the_header() {
        let mut pose = pose3d(3);
        pose.joints[4].status = Status::TOO_FEW_VIEWS;
        let columns = CSV_HEADER.split(',').count();
        let rows = csv_rows(&scene(), &pose);
        assert_eq!(rows.lines().count(), 14);
        for row in rows.lines() {
            assert_eq!(row.split(',').count(), columns, "{row}");
        }
    }

    #[test]
    fn extra_keypoints_are_written_by_name_after_the_joints() {
        let mut scene = scene();
        scene.extra_keypoints = vec!["nose".to_owned(), "left heel".to_owned()];
        let mut record = record(7);
        record.pose3d.n_keypoints = 2;
        record.pose3d.keypoints[1].status = Status::IMPLAUSIBLE;
        let text = runfiles::to_line(&line(&scene, &record)).unwrap();
        let line: Value = serde_json::from_str(&text).unwrap();
        assert_eq!(
            line["keypoints"]["nose"]["position_m"],
            json!([1.0, 2.0, 3.0])
        );
        assert_eq!(line["joints"].get("nose"), None);
        let heel = &line["keypoints"]["left heel"];
        assert_eq!(*heel, json!({ "status": Status::IMPLAUSIBLE.reason() }));
        let rows = csv_rows(&scene, &record.pose3d);
        assert_eq!(rows.lines().count(), 16);
        assert!(
            rows.lines().nth(14).unwrap().contains(",nose,1.0"),
            "{rows}"
        );
        let rows = csv_rows(&scene, &nothing(&scene, 8));
        assert_eq!(rows.lines().count(), 16, "{rows}");
    }

    #[test]
    fn a_count_beyond_the_joint_set_is_cut() {
        let mut pose = pose3d(0);
        pose.n_joints = u32::MAX;
        assert_eq!(joints(&scene(), &pose).count(), 14);
    }
}
