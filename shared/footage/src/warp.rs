//! Resizes, rotates and crops an image by an affine map, into a given buffer.
#![expect(
    clippy::inline_always,
    reason = "only inlined functions are compiled for the chosen instruction set"
)]

mod area;
mod bilinear;
mod near;

use area::Area;
use bilinear::Bilinear;
use kernels::{Body, Isa, dispatch};
use near::Near;

use crate::Size;

/// An affine map, `[u, v] = m[..][..2] * [x, y] + m[..][2]`, of pixels. The centre of the top-left pixel is `(0, 0)`.
pub type Affine = [[f64; 3]; 2];

/// Maximum factor by which an image is shrunk.
const MAX_SCALE: f64 = 64.0;

/// Maximum translation, in pixels: larger than any image, and exact in fixed point.
const MAX_SHIFT: f64 = 1e6;

/// Maximum distance between neighbouring output pixels at which a picture is not shrunk before it is rotated, in source pixels. The two
/// focal lengths of a lens differ by less than the excess, so that a picture that is only rotated is not shrunk.
const SINGLE: f64 = 1.05;
/// Distance between neighbouring samples of a picture that is scaled down to half its size or less, in pixels of the shrunk picture. The
/// two steps together blur less than with a distance of 1.
const STEP: f64 = 1.5;

/// The value of pixels outside of the source.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Fill {
    /// Black.
    #[default]
    Black,
    /// The nearest pixel of the border.
    Replicate,
}

/// Reason why a warp cannot be created.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum WarpError {
    /// The source or the output has no pixels.
    #[error("cannot warp an image of {source_size} to {output_size}")]
    Empty {
        /// Size of the source.
        source_size: Size,
        /// Size of the output.
        output_size: Size,
    },
    /// The map is singular or not finite, or its translation is too large.
    #[error("the map from output to source is singular or unbounded: {map:?}")]
    BadMap {
        /// The rejected map.
        map: Affine,
    },
    /// The image would shrink too much.
    #[error("the image would shrink {scale:.1} times, more than {limit} times")]
    ShrinksTooMuch {
        /// Source pixels per output pixel.
        scale: f64,
        /// Maximum factor, source pixels per output pixel.
        limit: f64,
    },
}

/// A warp between two sizes. Everything that does not depend on the pixels is precomputed.
///
/// The value of an output pixel depends on the map:
/// * With the identity, the pixel is copied.
/// * With a map that keeps rows and columns and does not enlarge (shrink, crop, mirror), the value is the area mean of the rectangle that
///   the output pixel covers. It is exact up to rounding to a grey level (half up).
/// * With any other map, the value is one bilinear sample. If the map shrinks more than 1.05 times, the image is first shrunk by area
///   means, so that the samples are one pixel apart, or 1.5 if the map shrinks at least twice. Positions are rounded to 1/32 pixel of that
///   image.
///
/// The result is bit-identical on every machine, because it only sums integers, or `f32` values in a fixed order.
#[derive(Debug, Clone)]
pub struct Warp {
    source: Size,
    output: Size,
    plan: Plan,
}

#[derive(Debug, Clone)]
enum Plan {
    Copy,
    Area(Area),
    Near(Near),
    Shrunk(Shrunk),
}

/// A picture that is shrunk before it is rotated.
#[derive(Debug, Clone)]
struct Shrunk {
    area: Area,
    /// The shrunk picture.
    rgb: Vec<u8>,
    near: Near,
}

impl Shrunk {
    /// Prepares both steps.
    ///
    /// * `by`: factor by which the picture is shrunk before it is rotated.
    fn new([source, output]: [Size; 2], map: &Affine, by: f64, fill: Fill) -> Self {
        let side = |side: usize| ((side as f64 / by - 1e-9).ceil() as usize).max(1);
        let small = Size::new(side(source.width), side(source.height));
        let axis = [by, (by - 1.0) / 2.0];
        Self {
            area: Area::new(source, small, [axis, axis], Fill::Replicate),
            rgb: vec![0; small.rgb_bytes()],
            near: Near(Bilinear::new([small, output], &shrunk_map(map, by), fill)),
        }
    }

    #[inline(always)]
    fn apply(&mut self, source: &[u8], out: &mut [u8]) {
        self.area.apply(source, &mut self.rgb);
        self.near.apply(&self.rgb, out);
    }
}

/// Converts a map from the output to full-size pictures into a map to pictures that are shrunk by a factor.
pub fn shrunk_map(source_from_output: &Affine, by: f64) -> Affine {
    source_from_output.map(|[x, y, shift]| [x / by, y / by, (shift + 0.5) / by - 0.5])
}

impl Warp {
    /// Prepares the warp that gives output pixel `p` the colour of the source around
    /// `source_from_output(p)`.
    ///
    /// * `source_from_output`: map from pixels of the output to pixels of the source, both with the centre of the
    ///   top-left pixel at `(0, 0)`.
    /// * `fill`: the value outside the source. At the border, it is interpolated with the outermost pixels.
    ///
    /// # Errors
    ///
    /// Returns [`Empty`](WarpError::Empty), [`BadMap`](WarpError::BadMap), or
    /// [`ShrinksTooMuch`](WarpError::ShrinksTooMuch) for more than 64 source pixels per output pixel.
    pub fn new(
        source: Size,
        output: Size,
        source_from_output: &Affine,
        fill: Fill,
    ) -> Result<Self, WarpError> {
        if source.rgb_bytes() == 0 || output.rgb_bytes() == 0 {
            return Err(WarpError::Empty {
                source_size: source,
                output_size: output,
            });
        }
        let scales = scales(source_from_output)?;
        let [[a, b, tx], [c, d, ty]] = *source_from_output;
        let keeps_rows = b == 0.0 && c == 0.0;
        let plan = if source == output && *source_from_output == IDENTITY {
            Plan::Copy
        } else if keeps_rows && a.abs() >= 1.0 && d.abs() >= 1.0 {
            Plan::Area(Area::new(source, output, [[a, tx], [d, ty]], fill))
        } else {
            let scale = scales[0].max(scales[1]);
            let sizes = [source, output];
            if scale > SINGLE {
                let by = if scale < 2.0 { scale } else { scale / STEP };
                Plan::Shrunk(Shrunk::new(sizes, source_from_output, by, fill))
            } else {
                Plan::Near(Near(Bilinear::new(sizes, source_from_output, fill)))
            }
        };
        Ok(Self {
            source,
            output,
            plan,
        })
    }

    /// Returns the size of the output images.
    pub fn output_size(&self) -> Size {
        self.output
    }

    /// Writes the warped `source` over every byte of `out`.
    ///
    /// # Panics
    ///
    /// Panics if a buffer is not `width * height * 3` bytes of its size.
    pub fn apply(&mut self, source: &[u8], out: &mut [u8]) {
        assert_eq!(
            source.len(),
            self.source.rgb_bytes(),
            "the source is {}",
            self.source
        );
        assert_eq!(
            out.len(),
            self.output.rgb_bytes(),
            "the output is {}",
            self.output
        );
        self.apply_with(Isa::best(), source, out);
    }

    /// Applies the warp with the same loops, compiled for one instruction set.
    fn apply_with(&mut self, isa: Isa, source: &[u8], out: &mut [u8]) {
        let plan = &mut self.plan;
        dispatch(isa, Run { plan, source, out });
    }
}

/// The loops of a plan.
struct Run<'a> {
    plan: &'a mut Plan,
    source: &'a [u8],
    out: &'a mut [u8],
}

impl Body for Run<'_> {
    #[inline(always)]
    fn run(self) {
        match self.plan {
            Plan::Copy => self.out.copy_from_slice(self.source),
            Plan::Area(area) => area.apply(self.source, self.out),
            Plan::Near(near) => near.apply(self.source, self.out),
            Plan::Shrunk(shrunk) => shrunk.apply(self.source, self.out),
        }
    }
}

const IDENTITY: Affine = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

/// Returns the map from an output to a source (resizing) for which their outer borders coincide.
pub fn resize_map(source: Size, output: Size) -> Affine {
    let sx = source.width as f64 / output.width as f64;
    let sy = source.height as f64 / output.height as f64;
    [[sx, 0.0, (sx - 1.0) / 2.0], [0.0, sy, (sy - 1.0) / 2.0]]
}

/// Returns the number of source pixels per output pixel along the output's rows and columns.
fn scales(map: &Affine) -> Result<[f64; 2], WarpError> {
    let [[a, b, tx], [c, d, ty]] = *map;
    let determinant = a * d - b * c;
    let is_bounded = tx.abs() <= MAX_SHIFT && ty.abs() <= MAX_SHIFT;
    if !(determinant.is_finite() && determinant != 0.0 && is_bounded) {
        return Err(WarpError::BadMap { map: *map });
    }
    let scales = [a.hypot(c), b.hypot(d)];
    let scale = scales[0].max(scales[1]);
    if scale > MAX_SCALE {
        return Err(WarpError::ShrinksTooMuch {
            scale,
            limit: MAX_SCALE,
        });
    }
    Ok(scales)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const SOURCE: Size = Size::new(37, 29);

    fn noise() -> Vec<u8> {
        let mut state = 1_u32;
        let mut next = || {
            state = state.wrapping_mul(1664525).wrapping_add(1013904223);
            (state >> 24) as u8
        };
        (0..SOURCE.rgb_bytes()).map(|_| next()).collect()
    }

    /// A lens whose focal lengths differ by some thousandths is scaled by as much when its picture is rotated.
    #[test]
    fn a_rotated_picture_of_two_focal_lengths_is_not_shrunk() {
        let (sin, cos) = f64::sin_cos(0.03);
        for scale in [0.997, 1.0, 1.003] {
            let map = [[scale * cos, -sin, 1.0], [scale * sin, cos, -1.0]];
            let warp = Warp::new(SOURCE, SOURCE, &map, Fill::Black).unwrap();
            assert!(matches!(warp.plan, Plan::Near(_)), "{scale}");
        }
    }

    proptest! {
        #[test]
        fn every_instruction_set_gives_the_same_bits(
            a in -5.0..5.0, b in -5.0..5.0, c in -5.0..5.0, d in -5.0..5.0,
            tx in -9.0..45.0, ty in -9.0..45.0, keeps_rows: bool,
        ) {
            let map = if keeps_rows {
                [[a, 0.0, tx], [0.0, d, ty]]
            } else {
                [[a, b, tx], [c, d, ty]]
            };
            prop_assume!(scales(&map).is_ok());
            let output = Size::new(11, 7);
            let mut warp = Warp::new(SOURCE, output, &map, Fill::Black).unwrap();
            let results: Vec<Vec<u8>> = Isa::available()
                .into_iter()
                .map(|isa| {
                    let mut out = vec![99; output.rgb_bytes()];
                    warp.apply_with(isa, &noise(), &mut out);
                    out
                })
                .collect();
            for result in &results {
                prop_assert_eq!(result, &results[0]);
            }
        }

        #[test]
        fn samples_in_few_steps_equal_the_reference_bit_for_bit(
            angle in -3.2..3.2_f64, scale in 0.3..1.0_f64, tx in -40.0..60.0, ty in -40.0..60.0,
            size in (1..90_usize, 1..40_usize), replicate: bool,
        ) {
            let (sin, cos) = f64::sin_cos(angle);
            let map = [[scale * cos, -scale * sin, tx], [scale * sin, scale * cos, ty]];
            let fill = if replicate { Fill::Replicate } else { Fill::Black };
            let output = Size::new(size.0, size.1);
            let bilinear = Bilinear::new([SOURCE, output], &map, fill);
            let each = (0..size.1).flat_map(|y| (0..size.0).map(move |x| [x, y]));
            let expected: Vec<u8> = each.flat_map(|at| bilinear.pixel(&noise(), at)).collect();
            let mut actual = vec![77; output.rgb_bytes()];
            Near(bilinear).apply(&noise(), &mut actual);
            prop_assert_eq!(actual, expected);
        }
    }
}
