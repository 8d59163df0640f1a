//! The pictures with the largest residuals, in which the detected and expected corners are drawn.

use calibration::board::{Outcome, Residual};
use failure::Failure;
use footage::{ACCENT, Canvas, LEFT, RIGHT, Size, Source, SourceSpec};

use super::{CameraFootage, Seen, footage_failure};

/// Margin around the corners, in pixels.
const MARGIN: f64 = 40.0;
/// Magnification of the drawn residuals.
const LONGER: f64 = 20.0;
const JPEG_QUALITY: u8 = 80;

/// A picture of a board with its residuals.
#[derive(Debug, Clone, PartialEq)]
pub struct Overlay {
    /// Index of the camera.
    pub camera: usize,
    /// Number of the frame.
    pub frame: usize,
    /// Root mean square of the picture's residuals, in pixels.
    pub rms_px: f64,
    /// The part of the picture around the board.
    pub jpeg: Vec<u8>,
}

/// Returns the pictures with the largest residuals: at most `most` pictures, and at most a third of them from one camera.
///
/// # Errors
///
/// Fails if the footage cannot be read again.
pub fn worst(
    outcome: &Outcome,
    cameras: &[CameraFootage],
    seen: &[Seen],
    most: usize,
) -> Result<Vec<Overlay>, Failure> {
    let mut list: Vec<(usize, usize, f64)> = Vec::new();
    for (nth, camera) in outcome.cameras.iter().enumerate() {
        let mut own: Vec<(usize, f64)> = Vec::new();
        let mut frames: Vec<usize> =
            camera.residuals.iter().map(|residual| residual.frame).collect();
        frames.dedup();
        for frame in frames {
            let each = camera.residuals.iter().filter(|residual| residual.frame == frame);
            let squares: Vec<f64> = each.map(|residual| residual.off.norm_squared()).collect();
            own.push((
                frame,
                (squares.iter().sum::<f64>() / squares.len() as f64).sqrt(),
            ));
        }
        own.sort_by(|a, b| b.1.total_cmp(&a.1));
        let share = most.div_ceil(3.min(outcome.cameras.len().max(1)));
        list.extend(own.into_iter().take(share).map(|(frame, rms)| (nth, frame, rms)));
    }
    list.sort_by(|a, b| b.2.total_cmp(&a.2));
    list.truncate(most);
    let mut overlays = Vec::new();
    for (nth, frame, rms_px) in list {
        let Some(picture) = seen[nth].pictures.get(&frame) else {
            continue;
        };
        let own = outcome.cameras[nth].residuals.iter().filter(|residual| residual.frame == frame);
        let residuals: Vec<Residual> = own.copied().collect();
        if let Some(jpeg) = drawn(&cameras[nth], *picture, &residuals)? {
            overlays.push(Overlay {
                camera: nth,
                frame,
                rms_px,
                jpeg,
            });
        }
    }
    Ok(overlays)
}

/// Returns the part of a picture around its corners, with the residuals drawn in.
fn drawn(
    camera: &CameraFootage,
    [path, nth]: [usize; 2],
    residuals: &[Residual],
) -> Result<Option<Vec<u8>>, Failure> {
    let Some(path) = camera.paths.get(path) else {
        return Ok(None);
    };
    let mut source = Source::open(&SourceSpec::upright(path)).map_err(footage_failure)?;
    let size = source.info().size;
    while let Some(picture) = source.next_frame().map_err(footage_failure)? {
        if picture.index as usize == nth {
            return Ok(around(size, picture.rgb, residuals));
        }
    }
    Ok(None)
}

fn around(size: Size, rgb: &[u8], residuals: &[Residual]) -> Option<Vec<u8>> {
    let extent = |axis: usize, side: usize| {
        let values = residuals.iter().map(|residual| residual.at[axis]);
        let low = values.clone().fold(f64::MAX, f64::min) - MARGIN;
        let high = values.fold(f64::MIN, f64::max) + MARGIN;
        [low, high].map(|value| value.clamp(0.0, side as f64) as usize)
    };
    let ([left, right], [top, bottom]) = (extent(0, size.width), extent(1, size.height));
    let mut canvas = Canvas::part(size, rgb, [left..right, top..bottom])?;
    for it in residuals {
        let at = [it.at.x - left as f64, it.at.y - top as f64];
        let colour = if it.is_wrong { ACCENT } else { LEFT };
        let long = if it.off.norm() > 50.0 {
            it.off * (50.0 / it.off.norm())
        } else {
            it.off
        };
        let to = [at[0] + LONGER * long.x, at[1] + LONGER * long.y];
        canvas.line(at, to, 1.5, RIGHT);
        canvas.ring(at, 5.0, 1.5, colour);
    }
    canvas.jpeg(JPEG_QUALITY)
}
