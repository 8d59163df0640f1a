//! Samples of people who do not exist.

use std::sync::Arc;

use kernels::Rgb8View;
use qualitytraining::sample::Sample;
use rayon::prelude::*;
use runtime::{ExitKind, Failure, OrFail as _};
use scene::{Action, Flaws, RigChoice, Scene, Settings, View};

use super::samples::{Arguments, Work};

/// Reads `FROM-TO`.
pub(super) fn subjects(text: &str) -> Result<[u64; 2], String> {
    let ends = text.split_once('-').unwrap_or((text, text));
    match (ends.0.trim().parse(), ends.1.trim().parse()) {
        (Ok(from), Ok(to)) if from <= to => Ok([from, to]),
        _ => Err("expected numbers of subjects, FROM-TO".to_owned()),
    }
}

/// The samples of all scenes, in the order of the scenes, whatever the threads.
pub(super) fn samples(arguments: &Arguments, work: &Work) -> Result<Vec<Sample>, Failure> {
    let scenes = 0..arguments.scenes;
    let found: Result<Vec<_>, Failure> = scenes
        .into_par_iter()
        .map(|nth| of_scene(arguments, &settings(arguments, nth), work))
        .collect();
    Ok(found?.into_iter().flatten().collect())
}

/// What a scene is, by its number: actions and subjects in turn, all else by chance.
fn settings(arguments: &Arguments, nth: u32) -> Settings {
    let mut rng = fastrand::Rng::with_seed(arguments.seed.wrapping_mul(1_000_003) + u64::from(nth));
    let [from, to] = arguments.subjects;
    let mut between = |low: f64, high: f64| low + (high - low) * rng.f64();
    let rig = match nth % 4 {
        0 => RigChoice::HumanEva,
        1 => RigChoice::Umpm,
        _ => RigChoice::Ring {
            n: 3,
            radius: between(3.4, 5.5),
            height: between(0.8, 2.4),
        },
    };
    // Half of the cameras are good ones.
    let is_bad = between(0.0, 1.0) < 0.5;
    let flaws = Flaws {
        noise: between(1.0, 12.0),
        blur_px: between(0.3, 1.5),
        exposure_stops: between(-1.2, 0.8),
        ..Flaws::default()
    };
    let is_photo = between(0.0, 1.0) < 1.0 / 3.0;
    Settings {
        rig,
        subject: from + rng.u64(0..=to - from),
        action: Action::ALL[rng.usize(0..Action::ALL.len())],
        seed: rng.u64(1..1 << 32),
        // One frame in three quarters of a second: no two show the same pose.
        rate_hz: 4.0 / 3.0,
        backdrop: arguments.backdrop.clone().filter(|_| is_photo),
        flaws: if is_bad { flaws } else { Flaws::default() },
    }
}

fn of_scene(
    arguments: &Arguments,
    settings: &Settings,
    work: &Work,
) -> Result<Vec<Sample>, Failure> {
    let scene = Arc::new(Scene::new(settings).or_fail(ExitKind::Input)?);
    let group = format!("subject {}", settings.subject);
    let mut samples = Vec::new();
    for camera in 0..scene.rig().cameras().len() {
        let mut view = View::new(&scene, camera).or_fail(ExitKind::Input)?;
        let size = view.size();
        let mut rgb = vec![0; size.rgb_bytes()];
        let before = samples.len();
        for frame in 0..u64::from(arguments.frames) {
            work.go_on()?;
            let truth = view.picture(frame, &mut rgb);
            let joints = truth.pixels.map(|it| it.unwrap_or([f64::NAN; 2]));
            let picture = Rgb8View::new(size.width, size.height, &rgb).or_fail(ExitKind::Run)?;
            let source = format!(
                "{group} {} seed {} camera {} frame {frame}",
                settings.action.name(),
                settings.seed,
                truth.camera
            );
            let named = (group.clone(), source);
            samples.extend(work.observer.observe(picture, &joints, named).ok());
        }
        let n = usize::from(arguments.frames);
        work.done(n, n - (samples.len() - before));
    }
    Ok(samples)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn subjects_are_a_range() {
        assert_eq!(subjects("3-7"), Ok([3, 7]));
        assert_eq!(subjects("5"), Ok([5, 5]));
        for wrong in ["", "7-3", "a-b", "-1"] {
            assert!(subjects(wrong).is_err(), "{wrong}");
        }
    }
}
