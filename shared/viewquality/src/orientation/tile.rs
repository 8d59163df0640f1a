//! The part of a frame around a pose, and patches of it.

use crate::{Normalisation, Sampler, TileShape};
use kernels::Rgb8View;

/// The size of a tile.
pub const TILE: TileShape = TileShape {
    height: 192,
    width: 128,
};

/// Size of the part of [`TILE`] that shows the box of the pose with a margin.
const BOX: TileShape = TileShape {
    height: 160,
    width: 96,
};

/// The surroundings of a pose at a fixed scale: the detector's input.
#[derive(Debug, Clone, PartialEq)]
pub struct Tile {
    /// Red, green and blue of every pixel, row major: `192 x 128 x 3`.
    pub rgb: Vec<u8>,
    /// The midpoint between head and neck in the tile, `[x, y]` in pixels.
    pub head: [f32; 2],
}

impl Tile {
    /// The tile around a pose.
    ///
    /// * `bounds`: the pose's box in the frame, `[x1, y1, x2, y2]` in pixels.
    /// * `head`: the midpoint between head and neck in the frame, `[x, y]` in pixels.
    /// * Returns `None` if `bounds` or `head` is not finite, or if the box is empty.
    pub fn around(
        frame: Rgb8View<'_>,
        bounds: [f64; 4],
        head: [f64; 2],
        sampler: &mut Sampler,
    ) -> Option<Self> {
        const PLAIN: Normalisation = Normalisation {
            mean: [0.0; 3],
            deviation: [1.0; 3],
        };
        let tile = crate::Tile {
            shape: TILE,
            ..crate::Tile::around(bounds, BOX)?
        };
        if head.iter().any(|value| !value.is_finite()) {
            return None;
        }
        let mut planes = vec![0.0; TILE.n_values()];
        sampler.sample(frame, &tile, &PLAIN, &mut planes);
        let area = TILE.height * TILE.width;
        let rgb = (0..area)
            .flat_map(|at| [0, 1, 2].map(|channel| planes[channel * area + at]))
            .map(|value| (value * 255.0).round() as u8)
            .collect();
        let middle = [TILE.width, TILE.height].map(|side| (side as f64 - 1.0) / 2.0);
        let in_tile =
            |axis: usize| ((head[axis] - tile.centre[axis]) / tile.scale + middle[axis]) as f32;
        Some(Self {
            rgb,
            head: [in_tile(0), in_tile(1)],
        })
    }

    /// The colour at a position, interpolated bilinearly; outside the tile, the border is repeated.
    fn at(&self, [x, y]: [f32; 2]) -> [f32; 3] {
        let x = x.clamp(0.0, (TILE.width - 1) as f32);
        let y = y.clamp(0.0, (TILE.height - 1) as f32);
        let [left, top] = [x as usize, y as usize];
        let right = (left + 1).min(TILE.width - 1);
        let bottom = (top + 1).min(TILE.height - 1);
        let [u, v] = [x - left as f32, y - top as f32];
        let pixel = |x: usize, y: usize| {
            let first = (y * TILE.width + x) * 3;
            [0, 1, 2].map(|channel| f32::from(self.rgb[first + channel]))
        };
        let [a, b] = [pixel(left, top), pixel(right, top)];
        let [c, d] = [pixel(left, bottom), pixel(right, bottom)];
        [0, 1, 2]
            .map(|k| (a[k] * (1.0 - u) + b[k] * u) * (1.0 - v) + (c[k] * (1.0 - u) + d[k] * u) * v)
    }

    /// Samples a square patch with the variation of a crop.
    ///
    /// * `below`: distance of the patch's centre below [`Tile::head`], in pixels of the tile.
    /// * `side`: side of the patch in pixels.
    /// * `scale`: pixels of the tile per pixel of the patch.
    /// * `out`: `side x side x 3`, overwritten.
    pub(crate) fn patch(
        &self,
        (below, side, scale): (f32, usize, f32),
        crop: &Crop,
        out: &mut Vec<u8>,
    ) {
        let (sine, cosine) = crop.turn.sin_cos();
        let middle = (side as f32 - 1.0) / 2.0;
        let step = scale * crop.scale;
        let centre = [
            self.head[0] + crop.shift_px[0],
            self.head[1] + below + crop.shift_px[1],
        ];
        out.clear();
        for row in 0..side {
            for column in 0..side {
                let column = if crop.mirrored {
                    side - 1 - column
                } else {
                    column
                };
                let x = (column as f32 - middle) * step;
                let y = (row as f32 - middle) * step;
                let place = [
                    centre[0] + x * cosine - y * sine,
                    centre[1] + x * sine + y * cosine,
                ];
                let colour = self.at(place);
                out.extend([0, 1, 2].map(|k| (colour[k] * crop.gain[k]).clamp(0.0, 255.0) as u8));
            }
        }
    }
}

/// Variation of a tile: none in the detector, random in training.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crop {
    /// True if left and right are swapped.
    pub mirrored: bool,
    /// Factor of the patches' size.
    pub scale: f32,
    /// Shift of the patches' centres, `[x, y]` in pixels of the tile.
    pub shift_px: [f32; 2],
    /// Rotation about the centres, in radians.
    pub turn: f32,
    /// Factors of red, green and blue.
    pub gain: [f32; 3],
}

impl Default for Crop {
    fn default() -> Self {
        Self {
            mirrored: false,
            scale: 1.0,
            shift_px: [0.0; 2],
            turn: 0.0,
            gain: [1.0; 3],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame() -> Vec<u8> {
        (0..300 * 200 * 3).map(|i| (i * 7 % 251) as u8).collect()
    }

    #[test]
    fn the_tile_has_the_head_at_the_place_in_the_frame() {
        let rgb = frame();
        let frame = Rgb8View::new(200, 300, &rgb).unwrap();
        let bounds = [50.0, 40.0, 110.0, 239.0];
        let middle = [80.0, 139.5];
        let tile = Tile::around(frame, bounds, middle, &mut Sampler::default()).unwrap();
        assert_eq!(tile.head, [63.5, 95.5]);
        assert_eq!(tile.rgb.len(), TILE.n_values());
    }

    #[test]
    fn an_invalid_box_gives_no_tile() {
        let rgb = frame();
        let frame = Rgb8View::new(200, 300, &rgb).unwrap();
        let around = |bounds, head| Tile::around(frame, bounds, head, &mut Sampler::default());
        assert_eq!(around([f64::NAN, 0.0, 10.0, 10.0], [5.0; 2]), None);
        assert_eq!(around([20.0, 0.0, 10.0, 10.0], [5.0; 2]), None);
        assert_eq!(around([0.0, 0.0, 10.0, 10.0], [5.0, f64::INFINITY]), None);
    }

    #[test]
    fn a_mirrored_patch_is_the_mirror_image_of_the_patch() {
        let rgb = frame();
        let frame = Rgb8View::new(200, 300, &rgb).unwrap();
        let tile = Tile::around(
            frame,
            [50.0, 40.0, 110.0, 239.0],
            [80.0, 60.0],
            &mut Sampler::default(),
        );
        let tile = tile.unwrap();
        let patch = |mirrored| {
            let crop = Crop {
                mirrored,
                ..Crop::default()
            };
            let mut out = Vec::new();
            tile.patch((0.0, 8, 0.8), &crop, &mut out);
            out
        };
        let [plain, mirrored] = [false, true].map(patch);
        for row in 0..8 {
            for column in 0..8 {
                let at = |x: usize| (row * 8 + x) * 3;
                assert_eq!(plain[at(column)..][..3], mirrored[at(7 - column)..][..3]);
            }
        }
    }
}
