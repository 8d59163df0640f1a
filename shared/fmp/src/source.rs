//! The inputs from which the features of an image are computed.

use kernels::{HogShape, Isa, Rgb8View};

use crate::{Layout, Scope};

/// Inputs of the features.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Source<'a> {
    pub(crate) isa: Isa,
    pub(crate) image: Rgb8View<'a>,
    pub(crate) layout: &'a Layout,
    pub(crate) scope: &'a Scope,
    /// Levels per octave.
    pub(crate) interval: usize,
    pub(crate) cell_px: usize,
}

impl Source<'_> {
    /// Returns the size `[rows, cols]` of the features that determine the responses of a level's window.
    pub(crate) fn map_size(&self, level: usize) -> [usize; 2] {
        let it = &self.layout.levels[level];
        let window = self.layout.window(self.scope, level);
        [
            window.rows + it.padded[0] - it.rows,
            window.cols + it.padded[1] - it.cols,
        ]
    }

    /// Returns the memory layout of an image's features.
    pub(crate) fn shape(&self) -> HogShape {
        HogShape {
            cell_px: self.cell_px,
            pad: self.layout.pad.map(|pad| pad + 1),
        }
    }
}
