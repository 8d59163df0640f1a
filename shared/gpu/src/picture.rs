//! The features of an image: tables of the shrunken pictures, and the kernels that compute features from the image.

use fmp::{Layout, Model};
use wgpu::Buffer;

use crate::device::Device;
use crate::dispatch::Dispatch;
use crate::programs::{Kernel, Programs};
use crate::{Unsuitable, suits};

/// Number of pixels or cells in a workgroup.
const BLOCK: usize = 128;
/// Number of cells in a workgroup of the histograms.
const HISTOGRAM_BLOCK: usize = 42;
/// Maximum number of samples along an axis that are averaged for a pixel of a shrunken picture.
const TAPS: usize = 4;
/// Number of orientations in a histogram.
const ORIENTATIONS: u64 = 18;

/// The picture of a level, in the layout that the kernels expect.
#[derive(Debug, Clone, Copy, Default, bytemuck_derive::Pod, bytemuck_derive::Zeroable)]
#[repr(C)]
struct Picture {
    w: u32,
    h: u32,
    pixel0: u32,
    source: u32,
    rows: u32,
    cols: u32,
    cell0: u32,
    feature0: u32,
    pad_rows: u32,
    pad_cols: u32,
    padded_rows: u32,
    padded_cols: u32,
    table_x: u32,
    table_y: u32,
    taps_x: u32,
    taps_y: u32,
}

/// Tables of the pictures of all levels.
#[derive(Debug, Default)]
struct Tables {
    pictures: Vec<Picture>,
    /// First sample for every row or column of a shrunken picture.
    first: Vec<u32>,
    /// [`TAPS`] weights for every row or column of a shrunken picture.
    weights: Vec<f64>,
    /// Blocks of pixels in the pictures of each octave.
    octaves: Vec<Vec<[u32; 2]>>,
    pixels: Vec<[u32; 2]>,
    histograms: Vec<[u32; 2]>,
    padded: Vec<[u32; 2]>,
    n_pixels: usize,
    n_cells: usize,
    n_features: usize,
}

/// Kernels and buffers that compute the features of all levels from an image.
#[derive(Debug)]
pub(crate) struct Features {
    pub(crate) image: Buffer,
    /// Features, `[level][row][col][channel]`.
    pub(crate) values: Buffer,
    pub(crate) dispatches: Vec<Dispatch>,
}

impl Features {
    /// Prepares the kernels for images of one size.
    pub(crate) fn new(
        device: &Device,
        programs: &Programs,
        model: &Model,
        layout: &Layout,
    ) -> Result<Self, Unsuitable> {
        let tables = Tables::new(model, layout);
        let image_bytes = tables.n_pixels as u64 * 3 * size_of::<f64>() as u64;
        suits::fits(device, "bytes for the shrunken pictures", image_bytes)?;
        let feature_bytes = (tables.n_features * fmp::N_CHANNELS * size_of::<f32>()) as u64;
        suits::fits(device, "bytes for the features", feature_bytes)?;
        let [width, height] = layout.image_size;
        let image = device.space(3 * (width * height) as u64);
        let values = device.space(feature_bytes);
        let mut dispatches = tables.shrinking(device, programs, (&image, width), image_bytes);
        let shrunken = dispatches.1;
        dispatches.0.extend(tables.describing(device, programs, &shrunken, &values));
        Ok(Self {
            image,
            values,
            dispatches: dispatches.0,
        })
    }
}

impl Tables {
    fn new(model: &Model, layout: &Layout) -> Self {
        let interval = model.spec().interval;
        let mut tables = Self::default();
        for (level, of_level) in layout.levels.iter().enumerate() {
            let [w, h] = of_level.image_size;
            let cells =
                [h, w].map(|side| (side as f64 / model.spec().cell_px as f64).round() as usize);
            let mut picture = Picture {
                w: w as u32,
                h: h as u32,
                pixel0: tables.n_pixels as u32,
                source: level.saturating_sub(interval) as u32,
                rows: cells[0] as u32,
                cols: cells[1] as u32,
                cell0: tables.n_cells as u32,
                feature0: tables.n_features as u32,
                pad_rows: layout.pad[0] as u32 + 1,
                pad_cols: layout.pad[1] as u32 + 1,
                padded_rows: of_level.padded[0] as u32,
                padded_cols: of_level.padded[1] as u32,
                ..Picture::default()
            };
            if level < interval {
                (picture.table_x, picture.taps_x) = tables.cover(layout.image_size[0], w);
                (picture.table_y, picture.taps_y) = tables.cover(layout.image_size[1], h);
            }
            if level % interval == 0 {
                tables.octaves.push(Vec::new());
            }
            let blocks = |n: usize, block: usize| {
                (0..n).step_by(block).map(move |first| [level as u32, first as u32])
            };
            tables.octaves[level / interval].extend(blocks(w * h, BLOCK));
            tables.pixels.extend(blocks(w * h, BLOCK));
            tables.histograms.extend(blocks(cells[0] * cells[1], HISTOGRAM_BLOCK));
            let n_padded = of_level.padded[0] * of_level.padded[1];
            tables.padded.extend(blocks(n_padded, BLOCK));
            tables.n_pixels += w * h;
            tables.n_cells += cells[0] * cells[1];
            tables.n_features += n_padded;
            tables.pictures.push(picture);
        }
        tables
    }

    /// Adds the samples that every pixel of a shrunken picture covers along an axis, with the weights of `kernels::resize_part`. Returns
    /// the index of the first entry, and the number of samples per pixel.
    fn cover(&mut self, from: usize, to: usize) -> (u32, u32) {
        let (scale, inverse) = (to as f64 / from as f64, from as f64 / to as f64);
        let n = (inverse.ceil() as usize + 1).min(from);
        let at = self.first.len() as u32;
        for pixel in 0..to {
            let begin = pixel as f64 * inverse;
            let end = begin + inverse;
            let (whole, last) = (begin.ceil() as usize, end.floor() as usize);
            let before = whole as f64 - begin > 1e-3;
            let first = (whole - usize::from(before)).min(from - n);
            let weight = |sample: usize| {
                if before && sample + 1 == whole {
                    (whole as f64 - begin) * scale
                } else if (whole..last).contains(&sample) {
                    scale
                } else if sample == last && end - last as f64 > 1e-3 {
                    (end - last as f64) * scale
                } else {
                    0.0
                }
            };
            self.first.push(first as u32);
            let mut weights = [0.0; TAPS];
            for (tap, to) in weights.iter_mut().enumerate().take(n) {
                *to = weight(first + tap);
            }
            self.weights.extend(weights);
        }
        (at, n as u32)
    }

    /// Makes the kernels from the image to the shrunken pictures.
    fn shrinking(
        &self,
        device: &Device,
        programs: &Programs,
        (image, width): (&Buffer, usize),
        n_bytes: u64,
    ) -> (Vec<Dispatch>, Buffer) {
        let pictures = device.table(&self.pictures);
        let [first, width] = [&self.first[..], &[width as u32]].map(|table| device.table(table));
        let weights = device.table(&self.weights);
        let shrunken = device.space(n_bytes);
        let octave = |(octave, blocks): (usize, &Vec<[u32; 2]>)| {
            let groups = [blocks.len(), 1];
            let blocks = device.table(blocks);
            if octave == 0 {
                let buffers = [
                    &pictures, &blocks, image, &first, &weights, &width, &shrunken,
                ];
                return Dispatch::new(device, programs.get(Kernel::Shrink), &buffers, groups);
            }
            let buffers = [&pictures, &blocks, &shrunken];
            Dispatch::new(device, programs.get(Kernel::Halve), &buffers, groups)
        };
        (
            self.octaves.iter().enumerate().map(octave).collect(),
            shrunken,
        )
    }

    /// Makes the kernels from the shrunken pictures to the features.
    fn describing(
        &self,
        device: &Device,
        programs: &Programs,
        shrunken: &Buffer,
        features: &Buffer,
    ) -> [Dispatch; 4] {
        let pictures = device.table(&self.pictures);
        let [pixels, cells, padded] =
            [&self.pixels, &self.histograms, &self.padded].map(|blocks| device.table(blocks));
        let shares = device.table(&shares());
        let [lengths, bins] = [0; 2].map(|_| device.space(self.n_pixels as u64 * 4));
        let votes = device.space(self.n_cells as u64 * ORIENTATIONS * 4);
        let energies = device.space(self.n_cells as u64 * 4);
        let new = |kernel, buffers: &[&Buffer], n_groups: usize| {
            Dispatch::new(device, programs.get(kernel), buffers, [n_groups, 1])
        };
        [
            new(
                Kernel::Gradient,
                &[&pictures, &pixels, shrunken, &lengths, &bins],
                self.pixels.len(),
            ),
            new(
                Kernel::Histograms,
                &[&pictures, &cells, &lengths, &bins, &shares, &votes],
                self.histograms.len(),
            ),
            new(
                Kernel::Energies,
                &[&pictures, &cells, &votes, &energies],
                self.n_cells.div_ceil(BLOCK),
            ),
            new(
                Kernel::Describe,
                &[&pictures, &padded, &votes, &energies, features],
                self.padded.len(),
            ),
        ]
    }
}

/// Weights by which a pixel of a block is divided between the four cells at the corners of the block, `[row][col][corner]`.
fn shares() -> Vec<f32> {
    let share = |pixel: usize| {
        let at = ((2 + pixel) as f64 + 0.5) / 4.0 - 0.5;
        let next = at - at.floor();
        [1.0 - next, next].map(|share| share as f32)
    };
    let mut shares = Vec::new();
    for row in 0..4 {
        for col in 0..4 {
            let ([up, down], [left, right]) = (share(row), share(col));
            shares.extend([left * up, right * up, left * down, right * down]);
        }
    }
    shares
}
