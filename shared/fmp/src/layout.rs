//! The positions of the feature pyramid's cells in the image, and of the maps in memory.

use std::ops::Range;

use crate::Model;

/// The placement of a part on a level of the pyramid: its cell and its type.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Placement {
    /// Column of the response map, which is that of the filter's leftmost cell.
    pub x: u16,
    /// Row of the response map, which is that of the filter's topmost cell.
    pub y: u16,
    /// Type (mixture component) of the part, counted from 0.
    pub mixture: u8,
}

/// One level of the pyramid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LevelLayout {
    /// Side of a cell, in pixels of the original image: `cell_px * 2^(level / interval)`. It is bit-identical to the value in the reference
    /// programs, and exact for whole octaves.
    pub scale: f64,
    /// Size `[width, height]` of the resized image, in pixels of the level.
    pub image_size: [usize; 2],
    /// Size `[rows, cols]` of the padded feature map, in cells.
    pub padded: [usize; 2],
    /// Height of every response map of the level, in cells.
    pub rows: usize,
    /// Width of every response map of the level, in cells.
    pub cols: usize,
    /// Start of the level's maps in the array of responses.
    pub offset: usize,
}

/// The levels of the pyramid for an image size and a model.
#[derive(Debug, Clone, PartialEq)]
pub struct Layout {
    /// Size `[width, height]` of the image, in pixels.
    pub image_size: [usize; 2],
    /// The levels, full resolution first.
    pub levels: Vec<LevelLayout>,
    /// Padding `[rows, cols]` in cells, without the extra ring of cells: the size of the largest filter minus 2.
    pub pad: [usize; 2],
    /// Number of filters of the model.
    pub n_filters: usize,
}

/// The error for an image that is too small for the model on every level.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the image is {width}x{height} pixels, but the smaller side needs at least {minimum}")]
pub struct ImageTooSmall {
    /// Width of the image, in pixels.
    pub width: usize,
    /// Height of the image, in pixels.
    pub height: usize,
    /// Smallest accepted side, in pixels.
    pub minimum: usize,
}

impl Layout {
    /// Lays out the pyramid (Yang & Ramanan's `featpyramid`: `interval` levels per octave, no
    /// upsampled octave).
    ///
    /// The number of levels is `1 + floor(log2(min(width, height) / (5 cell_px)) * interval)`. The response maps of all filters of a level
    /// have the same size: the size for the largest filter.
    ///
    /// # Errors
    ///
    /// [`ImageTooSmall`] if a side is shorter than 10 cells (40 pixels for 4-pixel cells); for smaller
    /// images, the reference programs write out of bounds.
    pub fn new(model: &Model, width: usize, height: usize) -> Result<Self, ImageTooSmall> {
        let spec = model.spec();
        let minimum = 10 * spec.cell_px;
        if width.min(height) < minimum {
            return Err(ImageTooSmall {
                width,
                height,
                minimum,
            });
        }
        let [max_rows, max_cols] = model.max_filter();
        let pad = [max_rows.saturating_sub(2), max_cols.saturating_sub(2)];
        let shorter = width.min(height) as f64 / (5 * spec.cell_px) as f64;
        let step = 2_f64.powf(1.0 / spec.interval as f64);
        let n_levels = 1 + (shorter.ln() / step.ln()).floor() as usize;
        let mut levels: Vec<LevelLayout> = Vec::with_capacity(n_levels);
        let mut offset = 0;
        for level in 0..n_levels {
            // The reference programs compute powers for the first octave, and halve them for every further octave. A running product would
            // differ by a few units in the last place, and a centre halfway between two pixels would then be rounded to the other pixel.
            let shrink = 1.0 / step.powf((level % spec.interval) as f64);
            let relative = shrink * 0.5_f64.powi((level / spec.interval) as i32);
            let image_size = if level < spec.interval {
                [width, height].map(|side| (side as f64 * shrink).round() as usize)
            } else {
                let [w, h] = levels[level - spec.interval].image_size;
                [w, h].map(|side| (side as f64 * 0.5).round() as usize)
            };
            let cells = image_size.map(|side| (side as f64 / spec.cell_px as f64).round() as usize);
            let inner = cells.map(|side| side.saturating_sub(2));
            let padded = [inner[1] + 2 * (pad[0] + 1), inner[0] + 2 * (pad[1] + 1)];
            let rows = (padded[0] + 1).saturating_sub(max_rows);
            let cols = (padded[1] + 1).saturating_sub(max_cols);
            levels.push(LevelLayout {
                scale: spec.cell_px as f64 / relative,
                image_size,
                padded,
                rows,
                cols,
                offset,
            });
            offset += rows * cols * model.n_filters();
        }
        Ok(Self {
            image_size: [width, height],
            levels,
            pad,
            n_filters: model.n_filters(),
        })
    }

    /// Returns the number of response values of all levels and filters.
    pub fn n_responses(&self) -> usize {
        self.levels.last().map_or(0, |level| {
            level.offset + level.rows * level.cols * self.n_filters
        })
    }

    /// Returns the position of a filter's response map in the array of responses.
    pub fn map_range(&self, level: usize, filter: usize) -> Range<usize> {
        let it = &self.levels[level];
        let start = it.offset + filter * it.rows * it.cols;
        start..start + it.rows * it.cols
    }

    /// Returns the centre of a filter placed on a level, in pixels of the image; the centre of the top-left pixel is (0, 0).
    pub fn centre(&self, level: usize, filter: [usize; 2], at: Placement) -> [f64; 2] {
        let [x1, y1, x2, y2] = self.part_box(level, filter, at);
        [f64::midpoint(x1, x2), f64::midpoint(y1, y2)]
    }

    /// Returns the box `[x1, y1, x2, y2]` of a filter placed on a level; see [`Self::centre`].
    ///
    /// `x1 = (x - pad) s`, `x2 = x1 + cols s - 1`, where `s` is the level's scale. These are the reference
    /// programs' boxes minus 1, since the programs count pixels from 1.
    pub fn part_box(&self, level: usize, filter: [usize; 2], at: Placement) -> [f64; 4] {
        let scale = self.levels[level].scale;
        let x1 = (f64::from(at.x) - self.pad[1] as f64) * scale;
        let y1 = (f64::from(at.y) - self.pad[0] as f64) * scale;
        let [rows, cols] = filter.map(|side| side as f64 * scale);
        [x1, y1, x1 + cols - 1.0, y1 + rows - 1.0]
    }

    /// Returns the centre of a filter placed on a level, in pixels counted from 1. It uses the reference programs' order
    /// of operations, for code that must round a centre as they do.
    pub fn centre_from_one(&self, level: usize, filter: [usize; 2], at: Placement) -> [f64; 2] {
        let scale = self.levels[level].scale;
        let centre = |at: f64, pad: usize, side: usize| {
            let first = (at - pad as f64) * scale + 1.0;
            let last = first + side as f64 * scale - 1.0;
            f64::midpoint(first, last)
        };
        [
            centre(f64::from(at.x), self.pad[1], filter[1]),
            centre(f64::from(at.y), self.pad[0], filter[0]),
        ]
    }
}
