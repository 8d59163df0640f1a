//! Tests of the export for OpenSim, with OpenSim itself.
#![expect(
    clippy::print_stderr,
    reason = "the test prints what it skips and what it measures"
)]

use std::path::Path;
use std::process::Command;

use serde_json::Value;

use crate::common::started::parallax;

/// Largest root mean square distance between the markers of the scaled model and those of the run, in mm, as a mean over the frames.
const MOST_MM: f64 = 40.0;

#[test]
#[ignore = "needs ../shared"]
fn opensim_scales_its_model_to_the_balancing_person_and_follows_the_markers() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    if !root.join("../shared/data/pose2sim_balancing").is_dir() {
        eprintln!("skipped: no footage beside the clone");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_str().unwrap();
    let config = root.join("configs/pose2sim-balancing.toml");
    let commands: [&[&str]; 3] = [
        &["run", config.to_str().unwrap(), "--out", out, "--force"],
        &["smooth", out],
        &["export", out, "--from", "smooth", "--to", "opensim"],
    ];
    for command in commands {
        let ended = Command::new(parallax()).args(command).output().unwrap();
        let said = String::from_utf8_lossy(&ended.stderr);
        assert!(ended.status.success(), "{command:?}: {said}");
    }
    // A woman in the background of two cameras is the second person of the run.
    let names = ["pose3d-opensim", "pose3d-person1-opensim"];
    let exported = names.map(|name| folder.path().join("export").join(name));
    let exported = exported.into_iter().find(|folder| folder.is_dir()).unwrap();
    let ended = Command::new("python3")
        .args(["-c", include_str!("kinematics.py")])
        .arg(exported)
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&ended.stdout);
    let complaint = String::from_utf8_lossy(&ended.stderr);
    assert!(ended.status.success(), "{said}{complaint}");
    // OpenSim writes its log to the same stream.
    let line = said.lines().find(|line| line.starts_with('{') || *line == "null").unwrap();
    let said: Value = serde_json::from_str(line).unwrap();
    if said.is_null() {
        eprintln!("skipped: Python has no OpenSim, or no model (see .ci/run)");
        return;
    }
    eprintln!("distances of the markers in mm: {said}");
    assert_eq!(said["frames"], 100);
    assert!(said["rms"].as_f64().unwrap() < MOST_MM, "{said}");
}
