//! Gradients with one pixel per lane; every lane follows the reference in the same order.

use super::DIRECTIONS;
use crate::Planes;

/// Lengths (levels of grey) and orientations of the gradients of row `y`, without the first and the last pixel.
///
/// Orientations are determined in double precision; only the length is rounded to single precision.
///
/// * `lengths`, `bins`: two values fewer than pixels in the row; overwritten.
#[inline(always)]
pub(crate) fn gradients(image: &Planes, y: usize, lengths: &mut [f32], bins: &mut [u32]) {
    let n = image.width() - 2;
    let (lengths, bins) = (&mut lengths[..n], &mut bins[..n]);
    let planes = [0, 1, 2].map(|plane| {
        let here = image.row(plane, y);
        [
            &here[..n],
            &here[2..][..n],
            &image.row(plane, y - 1)[1..][..n],
            &image.row(plane, y + 1)[1..][..n],
        ]
    });
    for x in 0..n {
        let [left, right, above, below] = planes[0].map(|plane| plane[x]);
        let (mut dx, mut dy) = (right - left, below - above);
        let mut squared = dx * dx + dy * dy;
        for plane in &planes[1..] {
            let [left, right, above, below] = plane.map(|plane| plane[x]);
            let (along, down) = (right - left, below - above);
            let length = along * along + down * down;
            let longer = length > squared;
            squared = if longer { length } else { squared };
            dx = if longer { along } else { dx };
            dy = if longer { down } else { dy };
        }
        lengths[x] = (squared as f32).sqrt();
        bins[x] = orientation(dx, dy);
    }
}

#[inline(always)]
fn orientation(dx: f64, dy: f64) -> u32 {
    let (mut closest, mut signed, mut bin) = (0.0, 0.0, 0_u64);
    for (orientation, [u, v]) in DIRECTIONS.iter().enumerate() {
        let dot = u * dx + v * dy;
        let closer = dot.abs() > closest;
        closest = if closer { dot.abs() } else { closest };
        signed = if closer { dot } else { signed };
        bin = if closer { orientation as u64 } else { bin };
    }
    (if signed < 0.0 { bin + 9 } else { bin }) as u32
}
