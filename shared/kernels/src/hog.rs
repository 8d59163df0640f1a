//! Histograms of oriented gradients (Felzenszwalb et al. 2010, section 6), 32 channels.
//!
//! A cell has 18 contrast-sensitive orientations, 9 contrast-insensitive ones, 4 texture energies
//! and one channel that is 1 in the padding and 0 inside.

mod fast;
mod reference;
#[cfg(test)]
mod single;
mod votes;

use crate::dispatch::dispatch;
use crate::gradient::N_ORIENTATIONS;
use crate::{Isa, Planes};

pub use fast::HogWorkspace;
pub use reference::hog_f64;

/// Number of channels of a cell.
pub const N_CHANNELS: usize = 32;

/// Number of orientations without their sign.
const N_UNSIGNED: usize = N_ORIENTATIONS / 2;
/// Upper limit of a normalised histogram entry.
const CLIP: f64 = 0.2;
/// Value added to the energy of a block, so that the norm of a flat block is not 0.
const FLAT: f64 = 0.0001;
/// Weight of the texture channels, about `1 / sqrt(18)`.
const TEXTURE: f64 = 0.2357;

/// For each channel, the channel of its value when the picture is mirrored (left and right swapped). An orientation of 20 k degrees becomes
/// an orientation of 180 - 20 k degrees. The texture channels belong to blocks of 2 x 2 cells; blocks to the left of the cell become blocks
/// to its right. The mapping is its own inverse.
pub const MIRRORED_CHANNEL: [usize; N_CHANNELS] = {
    let mut to = [0; N_CHANNELS];
    let mut o = 0;
    while o < N_ORIENTATIONS {
        to[o] = (N_ORIENTATIONS + N_UNSIGNED - o) % N_ORIENTATIONS;
        o += 1;
    }
    o = 0;
    while o < N_UNSIGNED {
        to[N_ORIENTATIONS + o] = N_ORIENTATIONS + (N_UNSIGNED - o) % N_UNSIGNED;
        o += 1;
    }
    let texture = N_ORIENTATIONS + N_UNSIGNED;
    o = 0;
    while o < 4 {
        to[texture + o] = texture + (o + 2) % 4;
        o += 1;
    }
    to[N_CHANNELS - 1] = N_CHANNELS - 1;
    to
};

/// The layout of an image's feature map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct HogShape {
    /// Side of a cell, in pixels.
    pub cell_px: usize,
    /// Rows and columns of padding on every side of the map, in cells.
    pub pad: [usize; 2],
}

impl HogShape {
    /// Number of cells `[rows, cols]` into which the image is divided: `round(side / cell_px)`.
    fn cells(&self, width: usize, height: usize) -> [usize; 2] {
        [height, width].map(|side| (side as f64 / self.cell_px as f64).round() as usize)
    }

    /// Size `[rows, cols]` of the padded feature map; the outer ring of cells has no features.
    pub fn map_size(&self, width: usize, height: usize) -> [usize; 2] {
        let [rows, cols] = self.cells(width, height);
        [
            rows.saturating_sub(2) + 2 * self.pad[0],
            cols.saturating_sub(2) + 2 * self.pad[1],
        ]
    }

    /// Fills the padding of the map of an image with the given number of cells. Returns the size of the inner part, if there is one.
    fn pad_map(&self, cells: [usize; 2], map: &mut [[f32; N_CHANNELS]]) -> Option<[usize; 2]> {
        let [pad_rows, pad_cols] = self.pad;
        let [inner_rows, inner_cols] = cells.map(|cell| cell.saturating_sub(2));
        let mut padding = [0.0; N_CHANNELS];
        padding[N_CHANNELS - 1] = 1.0;
        let lines = map.chunks_exact_mut((inner_cols + 2 * pad_cols).max(1));
        for (y, line) in lines.enumerate() {
            if (pad_rows..pad_rows + inner_rows).contains(&y) {
                line[..pad_cols].fill(padding);
                line[pad_cols + inner_cols..].fill(padding);
            } else {
                line.fill(padding);
            }
        }
        (inner_rows > 0 && inner_cols > 0).then_some([inner_rows, inner_cols])
    }
}

/// Writes the features of `image` with their padding.
///
/// As in [`hog_f64`], the orientation of every gradient is determined in double precision. All later steps
/// are in single precision, so the values differ only by rounding. A cell's votes are first summed
/// per block of pixels between four cell centres, then over the cell's four blocks.
///
/// * `out`: `rows x cols x N_CHANNELS` of [`HogShape::map_size`]; overwritten.
///
/// # Panics
///
/// Panics if `out` has the wrong size, or a side of the image is shorter than 3 pixels.
pub fn hog(
    isa: Isa,
    image: &Planes,
    shape: HogShape,
    workspace: &mut HogWorkspace,
    out: &mut [f32],
) {
    let [rows, cols] = shape.map_size(image.width(), image.height());
    assert_eq!(
        out.len(),
        rows * cols * N_CHANNELS,
        "there must be one cell per map entry"
    );
    assert!(
        image.width().min(image.height()) >= 3,
        "central differences"
    );
    dispatch(
        isa,
        fast::Hog {
            image,
            shape,
            workspace,
            out,
        },
    );
}

/// The vote of a pixel along one axis: the cell before the pixel, and the shares of that cell and the next.
#[derive(Debug, Clone, Copy)]
struct Vote {
    /// Number of the cell, from 1. Cell 0 is an unused ring outside the image.
    cell: usize,
    share: [f64; 2],
}

impl Vote {
    fn of(pixel: usize, cell_px: usize) -> Self {
        let at = (pixel as f64 + 0.5) / cell_px as f64 - 0.5;
        let next = at - at.floor();
        Self {
            cell: (at.floor() + 1.0) as usize,
            share: [1.0 - next, next],
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::sized;

    const SHAPE: HogShape = HogShape {
        cell_px: 4,
        pad: [3, 4],
    };

    /// Images of sixteen grey levels `step` apart, so that equal gradients and flat regions are
    /// common.
    fn images_of(step: f64) -> impl Strategy<Value = Planes> {
        (3..sized(75, 30), 3..sized(45, 18), any::<u64>()).prop_map(move |(width, height, seed)| {
            let mut state = seed | 1;
            let data = std::iter::repeat_with(|| {
                state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                (state >> 60) as f64 * step
            });
            Planes::from_samples(width, height, data.take(3 * width * height).collect())
        })
    }

    fn images() -> impl Strategy<Value = Planes> {
        images_of(17.0)
    }

    /// Images, half of which have samples that are not whole numbers, as in a resized image.
    fn all_images() -> impl Strategy<Value = Planes> {
        prop_oneof![images(), images_of(17.0 / 1.1)]
    }

    fn shapes() -> impl Strategy<Value = HogShape> {
        let cell_px = prop_oneof![Just(4_usize), 2..9_usize];
        let shape = |(cell_px, rows, cols)| HogShape {
            cell_px,
            pad: [rows, cols],
        };
        (cell_px, 0..4_usize, 0..6_usize).prop_map(shape)
    }

    proptest! {
        #[test]
        fn single_precision_differs_from_the_reference_by_rounding_only(
            image in all_images(),
            shape in shapes(),
        ) {
            let want = hog_f64(&image, shape);
            let got = single::hog_f32(&image, shape);
            prop_assert_eq!(want.len(), got.len());
            for (want, got) in want.iter().zip(&got) {
                prop_assert!((want - f64::from(*got)).abs() < 2e-6, "{} {}", want, got);
            }
        }

        /// Computes the features of two images one after the other, to test that no data of the first remain.
        #[test]
        fn every_instruction_set_equals_the_reference_bit_for_bit(
            images in [all_images(), all_images()],
            shape in shapes(),
            misaligned in 0..16_usize,
        ) {
            for isa in Isa::available() {
                let mut workspace = HogWorkspace::default();
                for image in &images {
                    let want = single::hog_f32(image, shape);
                    let mut got = vec![f32::NAN; misaligned + want.len()];
                    hog(isa, image, shape, &mut workspace, &mut got[misaligned..]);
                    prop_assert!(got[misaligned..] == want, "{:?}", isa);
                }
            }
        }

        #[test]
        fn a_mirrored_image_has_mirrored_features(cells in [3..9_usize, 3..9_usize], seed in any::<u64>()) {
            // All gradients of these samples differ, so that no two orientations are equally good.
            let [width, height] = cells.map(|cell| 4 * cell);
            let mut state = seed | 1;
            let samples = std::iter::repeat_with(|| {
                state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                (state >> 11) as f64 / (1_u64 << 53) as f64
            });
            let samples: Vec<f64> = samples.take(3 * width * height).collect();
            let rows = samples.chunks_exact(width);
            let mirrored = rows.flat_map(|row| row.iter().rev()).copied().collect();
            let plain = hog_f64(&Planes::from_samples(width, height, samples.clone()), SHAPE);
            let mirrored = hog_f64(&Planes::from_samples(width, height, mirrored), SHAPE);
            let cols = SHAPE.map_size(width, height)[1];
            for (at, cell) in plain.chunks_exact(N_CHANNELS).enumerate() {
                let there = at / cols * cols + cols - 1 - at % cols;
                for (channel, to) in MIRRORED_CHANNEL.into_iter().enumerate() {
                    let got = mirrored[there * N_CHANNELS + to];
                    prop_assert!((cell[channel] - got).abs() < 1e-9, "channel {}", channel);
                }
            }
        }

        #[test]
        fn adding_a_constant_to_the_image_changes_nothing(image in images(), offset in 1..50_u8) {
            let brighter = image.data().iter().map(|value| value + f64::from(offset)).collect();
            let brighter = Planes::from_samples(image.width(), image.height(), brighter);
            prop_assert_eq!(hog_f64(&brighter, SHAPE), hog_f64(&image, SHAPE));
        }

        #[test]
        fn inverting_the_contrast_keeps_the_insensitive_channels(image in images()) {
            let negative = image.data().iter().map(|value| 255.0 - value).collect();
            let negative = Planes::from_samples(image.width(), image.height(), negative);
            let (a, b) = (hog_f64(&negative, SHAPE), hog_f64(&image, SHAPE));
            for (a, b) in a.chunks_exact(N_CHANNELS).zip(b.chunks_exact(N_CHANNELS)) {
                for channel in 18..27 {
                    prop_assert!((a[channel] - b[channel]).abs() < 1e-12);
                }
                for channel in 0..9 {
                    prop_assert!((a[channel] - b[channel + 9]).abs() < 1e-12);
                }
            }
        }
    }

    #[test]
    fn a_vertical_edge_votes_for_the_first_orientation_only() {
        let data = (0..3 * 24 * 24).map(|at| f64::from(u8::from(at % 24 >= 12)) * 200.0);
        let map = hog_f64(&Planes::from_samples(24, 24, data.collect()), SHAPE);
        let cols = SHAPE.map_size(24, 24)[1];
        let cell = &map[((3 + 2) * cols + 4 + 2) * N_CHANNELS..][..N_CHANNELS];
        assert!(cell[0] > 0.3 && cell[18] > 0.3, "{cell:?}");
        assert!(cell[1..18].iter().all(|&value| value == 0.0), "{cell:?}");
    }

    #[test]
    fn a_gradient_between_two_orientations_votes_for_the_first() {
        let data = (0..3 * 24 * 24).map(|at| f64::from(u8::from(at / 24 % 24 >= 12)) * 200.0);
        let map = hog_f64(&Planes::from_samples(24, 24, data.collect()), SHAPE);
        let cols = SHAPE.map_size(24, 24)[1];
        let cell = &map[((3 + 2) * cols + 4 + 2) * N_CHANNELS..][..N_CHANNELS];
        assert!(cell[4] > 0.3 && cell[5] == 0.0, "{cell:?}");
    }

    #[test]
    fn padding_is_zero_except_for_its_own_channel() {
        let map = hog_f64(&Planes::from_samples(16, 16, vec![9.0; 3 * 256]), SHAPE);
        let [rows, cols] = SHAPE.map_size(16, 16);
        assert_eq!([rows, cols], [2 + 6, 2 + 8]);
        for (at, cell) in map.chunks_exact(N_CHANNELS).enumerate() {
            let (y, x) = (at / cols, at % cols);
            let inside = (3..rows - 3).contains(&y) && (4..cols - 4).contains(&x);
            let expected = if inside { 0.0 } else { 1.0 };
            assert_eq!(cell[31], expected);
            assert!(cell[..31].iter().all(|&value| value == 0.0));
        }
    }
}
