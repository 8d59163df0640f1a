//! Resizes, turns and crops an image by an affine map, into a given buffer.

use crate::Size;

/// An affine map, `[u, v] = m[..][..2] * [x, y] + m[..][2]`, of pixels whose top-left centre is `(0, 0)`.
pub type Affine = [[f64; 3]; 2];

/// What lies outside of the source.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Fill {
    /// Black.
    #[default]
    Black,
    /// The nearest pixel of the border.
    Replicate,
}

/// Why a warp cannot be made.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum WarpError {
    /// The source or the output has no pixel.
    #[error("cannot warp an image of {source_size} to {output_size}")]
    Empty {
        /// Size of the source.
        source_size: Size,
        /// Size of the output.
        output_size: Size,
    },
    /// The map is singular or not a number.
    #[error("the map from output to source is singular or not finite: {map:?}")]
    Singular {
        /// The map.
        map: Affine,
    },
    /// The image would shrink too much.
    #[error("the image would shrink {scale:.0} times, more than {limit} times")]
    Shrinks {
        /// Source pixels per output pixel.
        scale: f64,
        /// The most that is done.
        limit: f64,
    },
}

/// A warp between two sizes, with everything computed that does not depend on the pixels.
#[derive(Debug, Clone)]
pub struct Warp {
    source: Size,
    output: Size,
}

impl Warp {
    /// Prepares a warp.
    pub fn new(
        source: Size,
        output: Size,
        _source_from_output: &Affine,
        _fill: Fill,
    ) -> Result<Self, WarpError> {
        Ok(Self { source, output })
    }

    /// Writes the warped `source` over every byte of `out`.
    ///
    /// # Panics
    ///
    /// If a buffer is not `width * height * 3` bytes of its size.
    pub fn apply(&mut self, source: &[u8], out: &mut [u8]) {
        assert_eq!(
            source.len(),
            self.source.rgb_bytes(),
            "source {}",
            self.source
        );
        assert_eq!(out.len(), self.output.rgb_bytes(), "output {}", self.output);
        todo!()
    }
}

/// The map that stretches a source over an output: outer borders fall together.
pub fn resize_map(source: Size, output: Size) -> Affine {
    let sx = source.width as f64 / output.width as f64;
    let sy = source.height as f64 / output.height as f64;
    [[sx, 0.0, (sx - 1.0) / 2.0], [0.0, sy, (sy - 1.0) / 2.0]]
}
