//! Keypoints that OpenPose found in the demo of Pose2Sim.

#![expect(
    clippy::print_stdout,
    reason = "the tests print the figures that they measure"
)]

use keypoints::files::NameSet;
use keypoints::joint_ways;
use keypoints::keypointfiles::KeypointSource;
use posenetwork::{JointMaps, MapSettings};
use std::time::Instant;

use crate::shared_dir;

#[test]
#[ignore = "needs ../shared"]
fn keypoints_of_the_balancing_person_become_maps_with_maxima_at_the_keypoints() {
    let Some(shared) = shared_dir() else { return };
    let folder = shared.join("data/pose2sim_balancing/openpose");
    for (camera, n_people) in [("cam01", 141), ("cam02", 140), ("cam03", 70), ("cam04", 70)] {
        let path = folder.join(format!("{camera}_json"));
        let refused = KeypointSource::open(&path, None).unwrap_err().to_string();
        assert!(refused.contains("body-25b"), "{refused}");
        let names = NameSet::of_set("body-25b").ok();
        let source = KeypointSource::open(&path, names).unwrap();
        assert_eq!(source.n_frames(), 70);
        let rows = joint_ways(source.names().names());
        let (mut maps, mut people) = (JointMaps::default(), Vec::new());
        let (mut n, mut n_peaks, mut seconds) = (0, 0, 0.0);
        for frame in 0..source.n_frames() {
            n += source.of_frame(frame, &mut people).unwrap().unwrap();
            for person in &people {
                let begin = Instant::now();
                maps.of_keypoints(&person.keypoints, &rows, &MapSettings::default(), 0.02);
                seconds += begin.elapsed().as_secs_f64();
                let [left, top, right, bottom] = person.outline().unwrap();
                let cell = 1.25 * (right - left).max(bottom - top) / 64.0;
                for (joint, peak) in maps.peaks().iter().enumerate() {
                    let Some(peak) = peak else { continue };
                    n_peaks += 1;
                    let (at, _) = maps.maxima(joint, 1)[0];
                    let away = (at[0] - peak.at[0]).hypot(at[1] - peak.at[1]);
                    assert!(away < 2.9 * cell, "{camera} {frame} {joint}: {away} {cell}");
                }
            }
        }
        assert_eq!(n, n_people, "{camera}");
        println!(
            "{camera}: {n} people, {:.1} of 14 joints each, {:.2} ms for the maps of one",
            f64::from(n_peaks) / n as f64,
            1e3 * seconds / n as f64
        );
    }
}
