//! Colour images in double precision, and functions that reduce their size.
//!
//! The features assign each gradient to one orientation, so a difference in the last bit can change the histogram bin. Both functions
//! therefore add their products in exactly the order of the reference programs: first down the columns, one sample after another, then
//! along the rows.

mod reduce;
mod reference;
mod resize;

use std::ops::Range;

use crate::dispatch::dispatch;
use crate::{Isa, Rgb8View};

pub use reference::{reduce_by_taps, resize_by_taps};

/// Three planes of samples, 0..255, `[plane][row][col]`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Planes {
    width: usize,
    height: usize,
    data: Vec<f64>,
}

impl Planes {
    /// Width in pixels.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> usize {
        self.height
    }

    /// All samples: `3 x height x width`.
    pub fn data(&self) -> &[f64] {
        &self.data
    }

    /// One row of one plane.
    pub fn row(&self, plane: usize, y: usize) -> &[f64] {
        &self.data[(plane * self.height + y) * self.width..][..self.width]
    }

    /// One row of all three planes.
    #[inline(always)]
    fn rows_mut(&mut self, y: usize) -> [&mut [f64]; 3] {
        let (n, plane) = (self.width, self.width * self.height);
        let (first, rest) = self.data.split_at_mut(plane);
        let (second, third) = rest.split_at_mut(plane);
        [first, second, third].map(|values| &mut values[y * n..][..n])
    }

    fn row_mut(&mut self, plane: usize, y: usize) -> &mut [f64] {
        &mut self.data[(plane * self.height + y) * self.width..][..self.width]
    }

    /// Reserves memory for an image of this size.
    pub fn reserve(&mut self, width: usize, height: usize) {
        let n = 3 * width * height;
        self.data.reserve_exact(n.saturating_sub(self.data.len()));
    }

    /// Changes the size of the image; the samples are unspecified afterwards.
    fn reshape(&mut self, width: usize, height: usize) {
        (self.width, self.height) = (width, height);
        self.data.resize(3 * width * height, 0.0);
    }

    /// Makes this image from planar samples `[plane][row][col]`.
    ///
    /// # Panics
    ///
    /// Panics if `data` is not `3 x height x width` samples.
    pub fn from_samples(width: usize, height: usize, data: Vec<f64>) -> Self {
        assert_eq!(data.len(), 3 * width * height, "three full planes");
        Self {
            width,
            height,
            data,
        }
    }
}

/// Buffers of [`resize`] and [`reduce`], reused from image to image.
#[derive(Debug, Default)]
pub struct ShrinkWorkspace {
    down: resize::Taps,
    along: resize::Taps,
    /// A row after the vertical pass.
    line: Vec<f64>,
    /// A row after both passes of [`resize`], with the colours of a pixel together; the fourth value is unused.
    pixels: Vec<[f64; 4]>,
}

impl ShrinkWorkspace {
    /// Reserves memory for everything that can be made from an image of this size.
    pub fn reserve(&mut self, width: usize, height: usize) {
        self.down.reserve(height);
        self.along.reserve(width);
        self.line.clear();
        self.line.reserve(3 * width + 1);
        self.pixels.clear();
        self.pixels.reserve(width);
    }
}

/// A rectangle of an image at reduced size.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PartOfResized {
    /// Size `[width, height]` of the whole reduced image, in pixels.
    pub size: [usize; 2],
    /// Columns of the rectangle.
    pub x: Range<usize>,
    /// Rows of the rectangle.
    pub y: Range<usize>,
}

/// Reduces `image` to `[width, height]` pixels by averaging areas, and writes the result to `out`.
///
/// The result is the same, bit for bit, as that of the reference programs' `resize` and of [`resize_by_taps`].
///
/// # Panics
///
/// Panics if the new size is zero or larger than the image's.
pub fn resize(
    isa: Isa,
    image: Rgb8View<'_>,
    [width, height]: [usize; 2],
    workspace: &mut ShrinkWorkspace,
    out: &mut Planes,
) {
    let whole = PartOfResized {
        size: [width, height],
        x: 0..width,
        y: 0..height,
    };
    resize_part(isa, image, &whole, workspace, out);
}

/// Writes a part of the result of [`resize`] for `image` to `out`, with the same bits. The time is proportional to the size of the part.
///
/// # Panics
///
/// Panics like [`resize`], and if the part is empty or not inside the smaller image.
pub fn resize_part(
    isa: Isa,
    image: Rgb8View<'_>,
    part: &PartOfResized,
    workspace: &mut ShrinkWorkspace,
    out: &mut Planes,
) {
    check_resize(image, part.size);
    for (range, side) in [&part.x, &part.y].into_iter().zip(part.size) {
        assert!(
            !range.is_empty() && range.end <= side,
            "a part of the smaller image"
        );
    }
    out.reshape(part.x.len(), part.y.len());
    dispatch(
        isa,
        resize::Resize {
            image,
            part,
            workspace,
            out,
        },
    );
}

fn check_resize(image: Rgb8View<'_>, [width, height]: [usize; 2]) {
    assert!(
        (1..=image.width()).contains(&width) && (1..=image.height()).contains(&height),
        "resize can only reduce the size of an image"
    );
}

/// Length of a side of `side` samples after [`reduce`]: half, rounded away from zero.
pub fn reduced(side: usize) -> usize {
    side.div_ceil(2)
}

/// Writes the image at half size to `out`: smooths with five binomial weights, then takes every second sample.
///
/// The result, including borders, is the same, bit for bit, as that of the reference programs' `reduce` and of [`reduce_by_taps`].
///
/// # Panics
///
/// Panics if a side is shorter than 5 pixels.
pub fn reduce(isa: Isa, image: &Planes, workspace: &mut ShrinkWorkspace, out: &mut Planes) {
    check_reduce(image);
    out.reshape(reduced(image.width), reduced(image.height));
    let line = &mut workspace.line;
    dispatch(isa, reduce::Reduce { image, line, out });
}

fn check_reduce(image: &Planes) {
    assert!(image.width.min(image.height) >= 5, "five taps");
}

/// The taps of an output sample of [`reduce`].
#[derive(Debug, Clone, Copy, PartialEq)]
enum Border {
    First,
    Inside,
    /// The second-to-last output sample, if the input ends one sample after the centre of that output sample.
    Folded,
    Last,
}

impl Border {
    fn of(at: usize, n_out: usize, n_in: usize) -> Self {
        match at {
            0 => Self::First,
            _ if at + 1 == n_out => Self::Last,
            _ if at + 2 == n_out && 2 * n_out > n_in => Self::Folded,
            _ => Self::Inside,
        }
    }
}

#[inline(always)]
fn first(edge: f64, second: f64, third: f64) -> f64 {
    edge * 0.6875 + second * 0.25 + third * 0.0625
}

#[inline(always)]
fn inside(s: [f64; 5]) -> f64 {
    s[0] * 0.0625 + s[1] * 0.25 + s[2] * 0.375 + s[3] * 0.25 + s[4] * 0.0625
}

/// Taps (1, 4, 6, 5) / 16 on the last four samples, added from the last to the first.
#[inline(always)]
fn folded(a: f64, b: f64, c: f64, last: f64) -> f64 {
    last * 0.3125 + c * 0.375 + b * 0.25 + a * 0.0625
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::sized;

    fn noise(seed: u64, n: usize) -> Vec<u8> {
        let mut state = seed | 1;
        let bytes = std::iter::repeat_with(|| {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 56) as u8
        });
        bytes.take(n).collect()
    }

    /// An image that already contains other data.
    fn used() -> Planes {
        Planes::from_samples(3, 5, vec![f64::NAN; 45])
    }

    proptest! {
        #[test]
        fn every_instruction_set_resizes_like_the_reference(
            size in [1..sized(70, 25), 1..sized(50, 15)],
            share in [0.0..1.0_f64, 0.0..1.0_f64],
            misaligned in 0..16_usize,
            seed in any::<u64>(),
        ) {
            let [width, height] = size;
            // The pyramid reduces images by factors near 1.
            let smaller = |value: usize, share: f64| ((value as f64 * share.sqrt()).round() as usize).max(1);
            let to = [smaller(width, share[0]), smaller(height, share[1])];
            let bytes = noise(seed, misaligned + 3 * width * height);
            let image = Rgb8View::new(width, height, &bytes[misaligned..]).unwrap();
            let want = resize_by_taps(image, to);
            let mut workspace = ShrinkWorkspace::default();
            for isa in Isa::available() {
                for _ in 0..2 {
                    let mut got = used();
                    resize(isa, image, to, &mut workspace, &mut got);
                    prop_assert!(got == want, "{:?}", isa);
                }
            }
        }

        #[test]
        fn a_region_of_a_smaller_image_equals_the_same_region_of_the_whole_bit_for_bit(
            size in [1..70_usize, 1..50_usize],
            share in [0.1..1.0_f64, 0.1..1.0_f64],
            cut in [[0.0..1.0_f64, 0.0..1.0], [0.0..1.0, 0.0..1.0]],
            seed in any::<u64>(),
        ) {
            let [width, height] = size;
            let to = [0, 1].map(|i| ((size[i] as f64 * share[i]).round() as usize).max(1));
            let bytes = noise(seed, 3 * width * height);
            let image = Rgb8View::new(width, height, &bytes).unwrap();
            let [x, y] = [0, 1].map(|axis| {
                let at = cut[axis].map(|cut| (cut * to[axis] as f64) as usize);
                at[0].min(at[1])..at[0].max(at[1]) + 1
            });
            let part = PartOfResized { size: to, x, y };
            let mut workspace = ShrinkWorkspace::default();
            for isa in Isa::available() {
                let (mut whole, mut got) = (used(), used());
                resize(isa, image, to, &mut workspace, &mut whole);
                resize_part(isa, image, &part, &mut workspace, &mut got);
                prop_assert_eq!([got.width(), got.height()], [part.x.len(), part.y.len()]);
                for plane in 0..3 {
                    for (at, y) in part.y.clone().enumerate() {
                        prop_assert_eq!(got.row(plane, at), &whole.row(plane, y)[part.x.clone()]);
                    }
                }
            }
        }

        #[test]
        fn every_instruction_set_shrinks_like_the_reference(
            size in [5..sized(70, 25), 5..sized(30, 15)],
            seed in any::<u64>(),
        ) {
            let samples = noise(seed, 3 * size[0] * size[1]);
            let samples = samples.into_iter().map(|sample| f64::from(sample) / 1.1).collect();
            let image = Planes::from_samples(size[0], size[1], samples);
            let want = reduce_by_taps(&image);
            let mut workspace = ShrinkWorkspace::default();
            for isa in Isa::available() {
                let mut got = used();
                reduce(isa, &image, &mut workspace, &mut got);
                prop_assert!(got == want, "{:?}", isa);
            }
        }
    }

    #[test]
    fn a_flat_image_stays_flat() {
        let bytes = [77; 3 * 23 * 31];
        let image = Rgb8View::new(23, 31, &bytes).unwrap();
        let mut out = used();
        let mut workspace = ShrinkWorkspace::default();
        resize(Isa::best(), image, [17, 12], &mut workspace, &mut out);
        assert_eq!([out.width(), out.height()], [17, 12]);
        assert!(out.data().iter().all(|value| (value - 77.0).abs() < 1e-9));
        let mut half = used();
        reduce(Isa::best(), &out, &mut workspace, &mut half);
        assert_eq!([half.width(), half.height()], [9, 6]);
        assert!(half.data().iter().all(|value| (value - 77.0).abs() < 1e-9));
    }

    /// The rows are so long that some samples are covered by less than a thousandth of their width, others by slightly more.
    #[test]
    fn weights_near_a_thousandth_are_treated_like_in_the_reference() {
        let all = [(1030, 1029), (2003, 2001), (2001, 1009)];
        for (from, to) in all.into_iter().take(sized(3, 1)) {
            let bytes = noise(from as u64, 3 * from);
            let image = Rgb8View::new(from, 1, &bytes).unwrap();
            let mut out = used();
            let mut workspace = ShrinkWorkspace::default();
            resize(Isa::best(), image, [to, 1], &mut workspace, &mut out);
            assert!(out == resize_by_taps(image, [to, 1]), "{from} to {to}");
        }
    }

    #[test]
    fn the_same_size_copies_the_pixels() {
        let bytes = noise(3, 3 * 9 * 7);
        let image = Rgb8View::new(9, 7, &bytes).unwrap();
        let mut out = used();
        let mut workspace = ShrinkWorkspace::default();
        resize(Isa::best(), image, [9, 7], &mut workspace, &mut out);
        for (at, pixel) in bytes.chunks_exact(3).enumerate() {
            for (plane, sample) in pixel.iter().enumerate() {
                assert_eq!(out.row(plane, at / 9)[at % 9], f64::from(*sample));
            }
        }
    }
}
