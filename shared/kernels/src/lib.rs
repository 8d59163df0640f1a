//! Grids, images and the hot loops. Each loop has two implementations, a readable reference and a fast one. Both give the same bits on
//! every instruction set.
#![expect(
    unsafe_code,
    reason = "needed for SIMD dispatch, loads and stores; every block states why it is sound"
)]
#![expect(
    clippy::inline_always,
    reason = "a body is compiled for the instruction set of the function into which it is inlined"
)]

mod conv;
mod correlate;
mod dispatch;
mod distance;
mod envelope;
mod gradient;
mod hog;
mod image;
mod isa;
mod message;
mod peak;
mod planes;
mod simd;
mod spring;

/// A size for a test: the second value is used in the interpreter Miri, which takes a thousand times as long.
#[cfg(test)]
const fn sized(usual: usize, interpreted: usize) -> usize {
    if cfg!(miri) { interpreted } else { usual }
}

pub use conv::{
    Blocked, BlockedShape, Conv, ConvSize, ConvSizeError, Outputs, Scratch, add_repeated,
};
pub use correlate::{CorrelateWorkspace, FeatureMap, FilterBank, Level, Template, correlate_f64};
pub use dispatch::{Body, dispatch};
pub use distance::{LengthSpring, ScoredPoints};
pub use envelope::{Transformed, transform_f64};
pub use hog::{HogShape, HogWorkspace, MIRRORED_CHANNEL, N_CHANNELS, hog, hog_f64};
pub use image::{ImageSizeError, Rgb8View};
pub use isa::Isa;
pub use message::{
    ChildScores, Grid, MessageRule, MessageWorkspace, OwnScores, ScoreBuffer, ScoreRange,
    TracedChild,
};
pub use peak::Peak;
pub use planes::{
    PartOfResized, Planes, ShrinkWorkspace, reduce, reduce_by_taps, reduced, resize,
    resize_by_taps, resize_part,
};
pub use spring::Spring;
