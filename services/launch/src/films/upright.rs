//! Rotates pictures until people stand upright in them, as a run rotates its frames.

use failure::{ExitKind, Failure, OrFail as _};
use footage::{Affine, Fill, Size, Warp};

use super::eyes::Found;

/// Minimum angle of an applied rotation, in radians. With smaller angles, people are found without rotation.
const LEAST: f64 = 0.1;

/// Rotates the pictures of a camera.
pub(super) struct Upright {
    warp: Warp,
    /// Mapping from pixels of the rotated picture to pixels of the source picture.
    source_from_turned: Affine,
    pixels: Vec<u8>,
}

impl Upright {
    /// Prepares the rotation. Returns `None` if the angle is too small to matter.
    ///
    /// * `roll`: angle in radians, clockwise as seen. The rotated picture contains the whole source picture.
    pub(super) fn new(size: Size, roll: f64) -> Result<Option<Self>, Failure> {
        if roll.abs() < LEAST {
            return Ok(None);
        }
        let (sin, cos) = roll.sin_cos();
        let [width, height] = [size.width, size.height].map(|value| value as f64);
        let sides = [
            width * cos.abs() + height * sin.abs(),
            width * sin.abs() + height * cos.abs(),
        ];
        let [wide, high] = sides.map(f64::ceil);
        let [right, down] = [wide, high].map(|value| (value - 1.0) / 2.0);
        let centre = [width, height].map(|value| (value - 1.0) / 2.0);
        let map = [
            [cos, sin, centre[0] - cos * right - sin * down],
            [-sin, cos, centre[1] + sin * right - cos * down],
        ];
        let turned = Size::new(wide as usize, high as usize);
        let warp = Warp::new(size, turned, &map, Fill::Black).or_fail(ExitKind::Input)?;
        Ok(Some(Self {
            pixels: vec![0; 3 * turned.width * turned.height],
            source_from_turned: map,
            warp,
        }))
    }

    /// Returns the size of rotated pictures.
    pub(super) fn size(&self) -> Size {
        self.warp.output_size()
    }

    /// Rotates a picture.
    pub(super) fn turned(&mut self, rgb: &[u8]) -> &[u8] {
        self.warp.apply(rgb, &mut self.pixels);
        &self.pixels
    }

    /// Maps keypoints from the rotated picture back to the source picture.
    pub(super) fn back(&self, found: &mut Found) {
        for it in found.iter_mut().flatten() {
            let [x, y] = it.at;
            it.at = self.source_from_turned.map(|[a, b, c]| a * x + b * y + c);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use keypoints::Keypoint;

    use super::*;

    const SIZE: Size = Size {
        width: 61,
        height: 121,
    };

    /// Returns a picture with a white square of 5 pixels around a point.
    fn picture([x, y]: [usize; 2]) -> Vec<u8> {
        let mut rgb = vec![0; 3 * SIZE.width * SIZE.height];
        for row in y - 2..=y + 2 {
            let from = 3 * (row * SIZE.width + x - 2);
            rgb[from..from + 15].fill(255);
        }
        rgb
    }

    /// Returns the centre of the white pixels.
    fn white(rgb: &[u8], size: Size) -> [f64; 2] {
        let mut sums = [0.0; 3];
        for (nth, pixel) in rgb.chunks_exact(3).enumerate() {
            let weight = f64::from(pixel[0]);
            let at = [nth % size.width, nth / size.width].map(|value| value as f64);
            sums[0] += weight * at[0];
            sums[1] += weight * at[1];
            sums[2] += weight;
        }
        [sums[0] / sums[2], sums[1] / sums[2]]
    }

    fn in_source(upright: &Upright, at: [f64; 2]) -> [f64; 2] {
        let mut found = vec![None, Some(Keypoint { at, score: 0.5 })];
        upright.back(&mut found);
        assert_eq!(found[0], None);
        found[1].unwrap().at
    }

    #[test]
    fn joints_found_in_a_rotated_picture_are_mapped_back_to_the_original_picture() {
        for roll in [-2.5, -0.4, 0.45, FRAC_PI_2, 3.0] {
            let mut upright = Upright::new(SIZE, roll).unwrap().unwrap();
            // Corners are not cropped.
            for at in [[3, 3], [57, 3], [3, 117], [57, 117], [20, 80]] {
                let size = upright.size();
                let there = white(upright.turned(&picture(at)), size);
                let back = in_source(&upright, there);
                let off = [0, 1].map(|axis| (back[axis] - at[axis] as f64).abs());
                assert!(off[0].max(off[1]) < 0.1, "{roll} {at:?} {back:?}");
            }
        }
    }

    #[test]
    fn pictures_are_rotated_clockwise_as_seen() {
        let mut upright = Upright::new(SIZE, FRAC_PI_2).unwrap().unwrap();
        let size = upright.size();
        // A point at the top moves to the right.
        let [x, _] = white(upright.turned(&picture([30, 5])), size);
        assert!(x > 100.0, "{x}");
    }

    #[test]
    fn slightly_tilted_pictures_are_not_rotated() {
        assert!(Upright::new(SIZE, 0.05).unwrap().is_none());
        assert!(Upright::new(SIZE, 0.0).unwrap().is_none());
    }
}
