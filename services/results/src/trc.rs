//! `pose3d.trc` for `OpenSim`: tab separated, in metres, y up.
//!
//! The format is for one person. During the run, the number of people is not known in advance, so the file has the followed person.
//! `parallax export` writes a file for every person.

use messages::Skeletons;
use nalgebra::Vector3;

use crate::Scene;
use crate::pose3d::{is_placed, joints, keypoints, nobody};

/// Returns one row, with its line end. The three cells of a missing joint are `NaN`.
///
/// * `row`: number of the row, counted from 1.
pub(crate) fn row(scene: &Scene, row: u64, frame: &Skeletons) -> String {
    let axes = scene.opensim_from_world();
    let time = scene.time_s(frame.stamp.frame).unwrap_or(0.0);
    let nobody = nobody(scene, frame.status);
    let person = frame.followed().unwrap_or(&nobody);
    let points = joints(scene, person)
        .chain(keypoints(scene, person))
        .map(|(_, joint)| is_placed(joint).then(|| (axes * Vector3::from(joint.in_world)).into()));
    formats::trc::row(row, time, points)
}

/// Returns the rows of a file without the five lines before them, which a killed process may have written.
pub(crate) fn rows(text: &str) -> &str {
    let is_headed = text.starts_with("PathFileType");
    let ends = text.match_indices('\n').map(|(at, _)| at + 1);
    let begin = if is_headed { ends.take(5).last() } else { None };
    &text[begin.unwrap_or(0)..]
}

/// Returns the five lines before the rows.
///
/// * `rate_hz`: frames of the footage per second.
/// * `n_rows`: number of rows that follow.
pub(crate) fn header(scene: &Scene, rate_hz: f64, n_rows: u64) -> String {
    let rate_hz = rate_hz / scene.frame_step.max(1) as f64;
    let joints = scene.joints.joints.iter().map(|joint| joint.name);
    let names = joints.chain(scene.extra_keypoints.iter().map(String::as_str));
    let names: Vec<String> = names.map(|name| name.replace(' ', "_")).collect();
    let heading = formats::trc::Heading {
        file_name: "pose3d.trc",
        rate_hz,
        units: "m",
        markers: &names.iter().map(String::as_str).collect::<Vec<_>>(),
        n_rows,
    };
    heading.to_string()
}

#[cfg(test)]
mod tests {
    use formats::trc::Trc;
    use messages::Status;

    use super::*;
    use crate::testing::{scene, skeletons};

    fn written(poses: Vec<Box<Skeletons>>) -> Trc {
        let scene = scene();
        let mut text = header(&scene, 60.0, poses.len() as u64);
        for (index, pose) in poses.into_iter().enumerate() {
            text.push_str(&row(&scene, index as u64 + 1, &pose));
        }
        Trc::parse(&text).unwrap()
    }

    #[test]
    fn the_rows_are_found_with_and_without_a_head() {
        let scene = scene();
        let rows_of = row(&scene, 1, &skeletons(0)) + &row(&scene, 2, &skeletons(1));
        assert_eq!(rows(&rows_of), rows_of);
        assert_eq!(rows(&(header(&scene, 60.0, 2) + &rows_of)), rows_of);
        assert_eq!(rows(&header(&scene, 60.0, 0)), "");
    }

    #[test]
    fn written_files_read_back() {
        let mut moved = skeletons(1);
        moved.people[0].joints[0].in_world = [-0.25, 0.5, 1.75];
        let got = written(vec![skeletons(0), moved]);
        assert_eq!(got.rate_hz, 30.0);
        assert_eq!(got.units, "m");
        assert_eq!(got.markers.len(), 14);
        assert_eq!(got.markers[0], "right_ankle");
        assert_eq!(got.frames.len(), 2);
        // z is up in the scene, so the axes are (y, z, x).
        assert_eq!(got.frames[1][0], Some([0.5, 1.75, -0.25]));
    }

    #[test]
    fn extra_keypoints_are_markers_after_the_joints() {
        let mut scene = scene();
        scene.extra_keypoints = vec!["left heel".to_owned()];
        let mut pose = skeletons(0);
        pose.people[0].n_keypoints = 1;
        pose.people[0].keypoints[0].in_world = [-0.25, 0.5, 1.75];
        let text = header(&scene, 60.0, 1) + &row(&scene, 1, &pose);
        let got = Trc::parse(&text).unwrap();
        assert_eq!(got.markers[14], "left_heel");
        assert_eq!(got.frames[0][14], Some([0.5, 1.75, -0.25]));
    }

    #[test]
    fn a_missing_joint_reads_back_as_missing() {
        let mut pose = skeletons(0);
        pose.people[0].joints[3].status = Status::TOO_FEW_VIEWS;
        pose.people[0].joints[13].in_world[0] = f64::NAN;
        let got = written(vec![pose]);
        assert_eq!(got.frames[0][3], None);
        assert_eq!(got.frames[0][13], None);
        assert!(got.frames[0][4].is_some());
    }
}
