//! Synchronisation of a deployment's cameras by sound.

use calibration::synchronisation::{Outcome, Sound, SoundSettings, estimate_by_sound};
use deployment::Deployment;
use failure::{ExitKind, Failure, OrFail as _, Stop, uninterrupted, unless_stopped};
use footage::{RecordedSound, SourceSpec, read_sound};
use geometry::Camera;
use launch::films::{Part, cameras};

/// Sampling rate in hertz. Most sounds in a room have frequencies below half of this rate.
const RATE_HZ: u32 = 8000;

/// Reads the sound of every camera, and compares the times at which sounds begin. Ctrl-C ends the comparison.
///
/// * `reference` and `window_s`: as in [`SoundSettings`].
pub(super) fn compared(
    deployment: &Deployment,
    part: Part,
    (reference, window_s): (usize, f64),
    stop: &Stop,
) -> Result<(Outcome, Vec<String>), Failure> {
    let cameras = cameras(deployment, &inputs::rig_of(deployment)?)?;
    let centres = cameras.iter().map(Camera::centre_in_world).collect();
    let mut sounds = Vec::new();
    for camera in &deployment.cameras {
        let name = camera.name.clone();
        if camera.source.is_empty() {
            return Err(silent(&name, "the camera has no footage"));
        }
        let spec = launch::cameras::source(camera, &deployment.capture);
        let sound = unless_stopped(stop, move || sound(&name, &spec, part))?;
        let interrupted = || Failure::new(ExitKind::Interrupted, "interrupted");
        sounds.push(sound.ok_or_else(interrupted)??);
    }
    let settings = SoundSettings {
        reference,
        window_s,
        centres: Some(centres),
    };
    let outcome = uninterrupted(stop, move || estimate_by_sound(&sounds, &settings))?;
    let outcome = outcome.or_fail(ExitKind::Input)?;
    Ok((outcome, vec!["sound".to_owned(); deployment.cameras.len()]))
}

fn sound(name: &str, spec: &SourceSpec, part: Part) -> Result<Sound, Failure> {
    let recorded = read_sound(spec, RATE_HZ).or_fail(ExitKind::Input)?;
    let RecordedSound { begins_s, samples } =
        recorded.ok_or_else(|| silent(name, &format!("{} has no sound", spec.path)))?;
    let rate_hz = f64::from(RATE_HZ);
    let nth = |at_s: f64| ((at_s - begins_s) * rate_hz).clamp(0.0, samples.len() as f64) as usize;
    let from = nth(part.from_s);
    let to = part.seconds.map_or(samples.len(), |second| nth(part.from_s + second));
    Ok(Sound {
        rate_hz,
        begins_s: begins_s + from as f64 / rate_hz,
        samples: samples[from..to.max(from)].to_vec(),
    })
}

fn silent(name: &str, why: &str) -> Failure {
    let message = format!("camera {name:?}: {why}");
    let hint = "leave out --by sound to compare the movement of people";
    Failure::new(ExitKind::Input, message).with_hint(hint)
}
