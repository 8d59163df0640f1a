//! The scenario `camera-moved`: a camera was moved after the calibration, and the run must identify it.

use std::path::PathBuf;

use failure::{ExitKind, Failure, OrFail as _};
use fastrand::Rng;
use geometry::files::Format;
use geometry::{Camera, Rig};
use nalgebra::{UnitQuaternion, Vector3};
use serde_json::json;

use super::options::Options;
use super::scenario::MOVED;
use super::testbed::Testbed;
use super::verdict::Verdict;
use crate::trial::limit::at_least;

/// Rotation of the camera, in degrees.
const DEGREES: f64 = 2.0;

/// Rotates a camera of a rig by `DEGREES` about a random axis perpendicular to its optical axis.
fn moved(rig: &Rig, camera: &str, random: &mut Rng) -> Result<Rig, Failure> {
    let bearing = core::f64::consts::TAU * random.f64();
    let axis = Vector3::new(bearing.cos(), bearing.sin(), 0.0);
    let turn = UnitQuaternion::new(axis * DEGREES.to_radians());
    let cameras = rig.cameras().iter().map(|original| Camera {
        camera_from_world: if original.name == camera {
            turn * original.camera_from_world
        } else {
            original.camera_from_world
        },
        ..original.clone()
    });
    Rig::new(cameras.collect(), rig.up_in_world(), rig.source()).or_fail(ExitKind::Calibration)
}

/// Runs the deployment with a wrong calibration of a randomly chosen camera.
pub(super) fn attempt(testbed: &Testbed, options: &Options) -> Result<Verdict, Failure> {
    let plain = testbed.plan(MOVED, &[])?;
    let deployment = &plain.resolved().deployment;
    let mut random = Rng::with_seed(options.seed);
    let cameras = &deployment.cameras;
    let camera = cameras[random.usize(..cameras.len())].name.clone();
    let rig = inputs::rig_of(deployment)?;
    let rig = moved(&rig, &camera, &mut random)?;
    let file: PathBuf = testbed.folder.join("moved-rig.toml");
    geometry::files::write(&file, Format::Own, &rig).or_fail(ExitKind::Input)?;
    let planned = testbed.plan_with(MOVED, &[], &|deployment| {
        deployment.rig.clone_from(&file);
        deployment.unit = None;
    })?;
    let run = testbed.run(&planned, &mut |_| None);
    let mut outcome = run.outcome(|_| 0);
    let is_named = outcome.suspected.contains(&camera);
    outcome.suspected.retain(|name| *name != camera);
    let summary = run.report.as_ref().ok().and_then(|report| report.recorded().summary());
    let fits = summary.map(|summary| &summary.calibration);
    let fit = fits.and_then(|fit| fit.get(&camera)).copied();
    let fit = fit.unwrap_or_default();
    let px = |px: Option<f64>| px.map_or_else(|| "unknown".to_owned(), |px| format!("{px:.0} px"));
    let measured = format!(
        "{camera} rotated by {DEGREES} degrees: {}; cameras disagree by {} with it, {} without it; {} results",
        if is_named {
            "identified"
        } else {
            "not identified"
        },
        px(fit.residual_px),
        px(fit.without_px),
        outcome.n_results,
    );
    let named = at_least(
        "moved camera identified",
        1.0,
        Some(f64::from(u8::from(is_named))),
    );
    let limits = [named].into_iter().chain(outcome.judge(0)).collect();
    Ok(Verdict {
        scenario: MOVED.to_owned(),
        measured,
        details: Vec::new(),
        numbers: json!({ "camera": camera, "fits": fits }),
        limits,
        run: run.json(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_camera_is_rotated_in_place_and_the_others_are_unchanged() {
        let rig = scene::RigChoice::parse("ring:4").unwrap().rig().unwrap();
        let name = rig.cameras()[2].name.clone();
        let wrong = moved(&rig, &name, &mut Rng::with_seed(3)).unwrap();
        for (nth, (a, b)) in rig.cameras().iter().zip(wrong.cameras()).enumerate() {
            let off = b.camera_from_world * a.camera_from_world.inverse();
            let expected = if nth == 2 { DEGREES } else { 0.0 };
            assert!(
                (off.rotation.angle().to_degrees() - expected).abs() < 1e-6,
                "{nth}"
            );
            assert!(
                (b.centre_in_world() - a.centre_in_world()).norm() < 1e-9,
                "{nth}"
            );
        }
    }
}
