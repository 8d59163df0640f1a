//! Evaluation of a detector of people on the held-out pictures.

use failure::{Console, ExitKind, Failure, OrFail as _, Stop};
use kernels::Rgb8View;
use posenetwork::Detector;
use training::networks::finder::{Score, Tally};

use super::Prepared;

/// Evaluates a detector on the held-out pictures.
///
/// # Errors
///
/// Fails if the detector fails on a picture, or on a stop request ([`ExitKind::Interrupted`]).
pub fn judge(
    detector: &Detector,
    pictures: &Prepared,
    (stop, console): (&Stop, &dyn Console),
) -> Result<Score, Failure> {
    let mut tally = Tally::default();
    let mut values = Vec::new();
    console.begin("", "pictures");
    console.set(0, pictures.kept.len());
    for picture in &pictures.kept {
        stop.check("stopped")?;
        let [width, height] = picture.size;
        let view = Rgb8View::new(width, height, &picture.rgb).or_fail(ExitKind::Input)?;
        let found = detector.people(view, &mut values);
        let found = found.or_fail(ExitKind::Input)?.into_iter();
        let outlines = found.map(|found| found.outline.map(|side| side as f32));
        tally.add(&picture.people, &outlines.collect::<Vec<_>>());
        console.advance(1);
    }
    console.finish();
    Ok(tally.score())
}
