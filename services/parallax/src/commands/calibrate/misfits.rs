//! The pictures whose joints agree least with a rig. Detected and expected joints are drawn in the pictures.

use calibration::people::Skeletons;
use calibration::people::misfit::{Fitted, Misfit};
use failure::{ExitKind, Failure, OrFail as _};
use footage::{Canvas, LEFT, RIGHT, Size, Source, SourceSpec};
use geometry::Camera;
use terminal::output;

use super::walk::Walk;

/// Maximum number of pictures per camera, and of all cameras together.
const MOST: [usize; 2] = [2, 9];
/// Margin around the person, as a fraction of the person's size.
const MARGIN: f64 = 0.25;
const JPEG_QUALITY: u8 = 80;

/// Returns the worst pictures, with captions. Cameras that have only keypoints are left out, because they have no pictures.
///
/// * `offsets_s`: seconds to add to the times of each camera. If there is a rig, there is one entry per camera.
/// * `skeletons`: times, with the skeleton at each time.
/// * A picture that cannot be read again is left out, and reported.
pub(super) fn of(
    walk: &Walk,
    (cameras, offsets_s): (&[Camera], &[f64]),
    skeletons: (&[f64], &Skeletons),
) -> Vec<(String, Vec<u8>)> {
    let fitted = Fitted {
        cameras,
        films: &walk.found.films,
        offsets_s,
        sides: &walk.found.sides,
        skeletons,
    };
    let mut pictures = Vec::new();
    if offsets_s.len() != cameras.len() {
        // Without a rig there is nothing to draw.
        return pictures;
    }
    for misfit in fitted.worst(MOST[0]).iter().take(MOST[1]) {
        let name = walk.names()[misfit.camera];
        match drawn(walk, misfit) {
            Ok(None) => {}
            Ok(Some(jpeg)) => {
                let (time_s, off_px) = (misfit.time_s, misfit.residual_px);
                let caption = format!("{name} at {time_s:.2} s: off by {off_px:.1} px");
                pictures.push((caption, jpeg));
            }
            Err(why) => output::message(format_args!("a picture of {name} is left out: {why}")),
        }
    }
    pictures
}

fn drawn(walk: &Walk, misfit: &Misfit) -> Result<Option<Vec<u8>>, Failure> {
    let camera = &walk.deployment.cameras[misfit.camera];
    if camera.source.is_empty() {
        return Ok(None);
    }
    let whole = SourceSpec {
        start: 0,
        step: 1,
        count: None,
        ..launch::cameras::source(camera, &walk.deployment.capture)
    };
    let rate_hz = Source::open(&whole).or_fail(ExitKind::Input)?.info().frame_rate_hz;
    let Some(rate_hz) = rate_hz else {
        return Ok(None);
    };
    let pace = 1.0 + 1e-6 * camera.drift_ppm.unwrap_or(0.0);
    let one = SourceSpec {
        start: (misfit.time_s / pace * rate_hz).round().max(0.0) as u64,
        count: Some(1),
        ..whole
    };
    let mut source = Source::open(&one).or_fail(ExitKind::Input)?;
    let size = source.info().size;
    let Some(picture) = source.next_frame().or_fail(ExitKind::Input)? else {
        return Ok(None);
    };
    let offset = camera.source_offset_px.unwrap_or([0, 0]).map(f64::from);
    let in_footage = |point: &[f64; 2]| [point[0] - offset[0], point[1] - offset[1]];
    let joints: Vec<[[f64; 2]; 2]> = misfit
        .joints
        .iter()
        .map(|[seen, expected]| [in_footage(seen), in_footage(expected)])
        .collect();
    Ok(around(size, picture.rgb, &joints))
}

/// Returns the part of a picture around its person, with the joints drawn in.
fn around(size: Size, rgb: &[u8], joints: &[[[f64; 2]; 2]]) -> Option<Vec<u8>> {
    let ends = |axis: usize| {
        let values = joints.iter().map(|joint| joint[0][axis]);
        let low = values.clone().fold(f64::MAX, f64::min);
        [low, values.fold(f64::MIN, f64::max)]
    };
    let ([left, right], [top, bottom]) = (ends(0), ends(1));
    let extent = (right - left).max(bottom - top);
    let margin = MARGIN * extent;
    let within = |value: f64, side: usize| value.clamp(0.0, side as f64) as usize;
    let [left, right] = [left - margin, right + margin].map(|edge| within(edge, size.width));
    let [top, bottom] = [top - margin, bottom + margin].map(|edge| within(edge, size.height));
    let mut canvas = Canvas::part(size, rgb, [left..right, top..bottom])?;
    let thick = (extent / 250.0).clamp(1.0, 4.0);
    for [seen, expected] in joints {
        let [at, to] =
            [seen, expected].map(|point| [point[0] - left as f64, point[1] - top as f64]);
        canvas.line(at, to, 1.2 * thick, RIGHT);
        canvas.ring(at, 3.0 * thick, thick, LEFT);
    }
    canvas.jpeg(JPEG_QUALITY)
}
