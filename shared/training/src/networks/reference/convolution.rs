//! Convolutions of the maps of a batch, and their gradients. Samples are unfolded into columns of patches and multiplied with matrices.

use rayon::prelude::*;

use super::matrix::{Matrix, add_product, add_to, dot, sum};
use crate::networks::ops::{Conv, convolved};

/// Number of groups of samples whose gradients are summed in parallel. It does not depend on the number of threads.
const GROUPS: usize = 16;

/// The sizes of a convolution.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sizes {
    /// Channels, rows and columns of the input.
    from: [usize; 3],
    /// Channels, rows and columns of the output.
    to: [usize; 3],
    kernel: usize,
    stride: usize,
    is_by_channel: bool,
}

/// The gradients of a convolution.
#[derive(Debug)]
pub(super) struct Gradients {
    pub(super) weights: Vec<f32>,
    pub(super) bias: Vec<f32>,
    /// Gradient of the input; empty if it was not requested.
    pub(super) map: Vec<f32>,
}

/// The outputs in a row that use the input through one column of the kernel, and the first input that they use.
struct Seen {
    from: usize,
    to: usize,
    input: usize,
}

impl Sizes {
    pub(super) fn new(map: &[usize], conv: Conv) -> Self {
        let to = convolved(map, conv);
        Self {
            from: [map[0], map[1], map[2]],
            to: [to[0], to[1], to[2]],
            kernel: conv.kernel,
            stride: conv.stride,
            is_by_channel: conv.by_channel,
        }
    }

    fn n_from(&self) -> usize {
        self.from.iter().product()
    }

    fn n_to(&self) -> usize {
        self.to.iter().product()
    }

    fn cells_to(&self) -> usize {
        self.to[1] * self.to[2]
    }

    /// Returns true if the columns of patches are identical to the map.
    fn is_pointwise(&self) -> bool {
        self.kernel == 1 && self.stride == 1
    }

    fn n_columns(&self) -> usize {
        self.from[0] * self.kernel * self.kernel * self.cells_to()
    }

    /// The outputs along one side that use an input through one position in the kernel.
    fn seen(&self, [inputs, outputs]: [usize; 2], at: usize) -> Seen {
        let half = self.kernel / 2;
        let from = half.saturating_sub(at).div_ceil(self.stride);
        let last = (inputs + half).saturating_sub(at + 1) / self.stride;
        Seen {
            from,
            to: (last + 1).min(outputs).max(from),
            input: (from * self.stride + at).saturating_sub(half),
        }
    }

    /// Calls a function for every run of outputs in a row that use consecutive inputs. Its arguments are the first input within the
    /// channel, the first output within the map, and the number of outputs.
    fn runs(&self, [down, across]: [usize; 2], mut run: impl FnMut(usize, usize, usize)) {
        let rows = self.seen([self.from[1], self.to[1]], down);
        let columns = self.seen([self.from[2], self.to[2]], across);
        let n = columns.to - columns.from;
        if n == 0 {
            return;
        }
        for row in rows.from..rows.to {
            let input = rows.input + (row - rows.from) * self.stride;
            run(
                input * self.from[2] + columns.input,
                row * self.to[2] + columns.from,
                n,
            );
        }
    }

    /// Row and column of every position in the kernel.
    fn places(&self) -> impl Iterator<Item = [usize; 2]> + use<> {
        let kernel = self.kernel;
        (0..kernel * kernel).map(move |at| [at / kernel, at % kernel])
    }

    /// The patches of a sample: a row for every channel and position in the kernel, a column for every output.
    fn unfold(&self, map: &[f32], columns: &mut [f32]) {
        let (cells, stride) = (self.cells_to(), self.stride);
        columns.fill(0.0);
        let mut rows = columns.chunks_exact_mut(cells);
        for channel in map.chunks_exact(self.from[1] * self.from[2]) {
            for (place, row) in self.places().zip(&mut rows) {
                self.runs(place, |input, output, n| {
                    let row = &mut row[output..output + n];
                    if stride == 1 {
                        row.copy_from_slice(&channel[input..input + n]);
                    } else {
                        let values = channel[input..].iter().step_by(stride);
                        for (to, value) in row.iter_mut().zip(values) {
                            *to = *value;
                        }
                    }
                });
            }
        }
    }

    /// Adds patches back to the map from which they were taken.
    fn fold(&self, columns: &[f32], map: &mut [f32]) {
        let (cells, stride) = (self.cells_to(), self.stride);
        let mut rows = columns.chunks_exact(cells);
        for channel in map.chunks_exact_mut(self.from[1] * self.from[2]) {
            for (place, row) in self.places().zip(&mut rows) {
                self.runs(place, |input, output, n| {
                    let row = &row[output..output + n];
                    if stride == 1 {
                        add_to(&mut channel[input..input + n], row);
                    } else {
                        let values = channel[input..].iter_mut().step_by(stride);
                        for (to, value) in values.zip(row) {
                            *to += value;
                        }
                    }
                });
            }
        }
    }

    /// Convolves the maps of a batch.
    pub(super) fn forward(&self, map: &[f32], weights: &[f32], bias: Option<&[f32]>) -> Vec<f32> {
        let n = map.len() / self.n_from();
        let mut all = vec![0.0; n * self.n_to()];
        let samples =
            all.par_chunks_exact_mut(self.n_to()).zip(map.par_chunks_exact(self.n_from()));
        samples.for_each_init(Vec::new, |columns, (to, map)| {
            if let Some(bias) = bias {
                for (channel, bias) in to.chunks_exact_mut(self.cells_to()).zip(bias) {
                    channel.fill(*bias);
                }
            }
            if self.is_by_channel {
                self.forward_by_channel(map, weights, to);
                return;
            }
            let patches = self.patches(map, columns);
            let weights = Matrix::new(weights, weights.len() / self.to[0]);
            add_product(to, weights, Matrix::new(patches, self.cells_to()));
        });
        all
    }

    /// The patches of a sample. They are written to a buffer unless they are identical to the map.
    fn patches<'a>(&self, map: &'a [f32], columns: &'a mut Vec<f32>) -> &'a [f32] {
        if self.is_pointwise() {
            return map;
        }
        columns.resize(self.n_columns(), 0.0);
        self.unfold(map, columns);
        columns
    }

    fn forward_by_channel(&self, map: &[f32], weights: &[f32], to: &mut [f32]) {
        let channels = map
            .chunks_exact(self.from[1] * self.from[2])
            .zip(weights.chunks_exact(self.kernel * self.kernel));
        for (to, (map, weights)) in to.chunks_exact_mut(self.cells_to()).zip(channels) {
            for (place, weight) in self.places().zip(weights) {
                self.runs(place, |input, output, n| {
                    let values = map[input..].iter().step_by(self.stride);
                    for (to, value) in to[output..output + n].iter_mut().zip(values) {
                        *to += weight * value;
                    }
                });
            }
        }
    }

    /// Returns the gradients of a batch.
    ///
    /// * `gradient`: gradient of the outputs.
    /// * `is_map_wanted`: true if the gradient of the input is requested.
    pub(super) fn backward(
        &self,
        [map, weights, gradient]: [&[f32]; 3],
        is_map_wanted: bool,
    ) -> Gradients {
        let n = map.len() / self.n_from();
        let each = n.div_ceil(GROUPS).max(1);
        let mut of_map = vec![0.0; if is_map_wanted { map.len() } else { 0 }];
        let mut parts: Vec<&mut [f32]> = of_map.chunks_mut(each * self.n_from()).collect();
        parts.resize_with(n.div_ceil(each), Default::default);
        let groups = map
            .par_chunks(each * self.n_from())
            .zip(gradient.par_chunks(each * self.n_to()))
            .zip(parts);
        let groups: Vec<[Vec<f32>; 2]> = groups
            .map(|((map, gradient), of_map)| self.of_group([map, weights, gradient], of_map))
            .collect();
        let mut groups = groups.into_iter();
        let [mut weights, mut bias] = groups.next().unwrap_or_default();
        for group in groups {
            add_to(&mut weights, &group[0]);
            add_to(&mut bias, &group[1]);
        }
        Gradients {
            weights,
            bias,
            map: of_map,
        }
    }

    /// The gradients of weights and bias for some samples. The gradient of the input is written to `of_map`.
    fn of_group(&self, [map, weights, gradient]: [&[f32]; 3], of_map: &mut [f32]) -> [Vec<f32>; 2] {
        let mut of_weights = vec![0.0; weights.len()];
        let mut of_bias = vec![0.0; self.to[0]];
        let mut columns = Vec::new();
        let mut of_map = of_map.chunks_exact_mut(self.n_from());
        let samples = map.chunks_exact(self.n_from()).zip(gradient.chunks_exact(self.n_to()));
        for (map, gradient) in samples {
            let channels = gradient.chunks_exact(self.cells_to());
            for (bias, channel) in of_bias.iter_mut().zip(channels) {
                *bias += sum(channel);
            }
            let of_map = of_map.next();
            if self.is_by_channel {
                self.of_channels([map, weights, gradient], &mut of_weights, of_map);
                continue;
            }
            let gradients = Matrix::new(gradient, self.cells_to());
            let patches = Matrix::new(self.patches(map, &mut columns), self.cells_to());
            add_product(&mut of_weights, gradients, patches.transposed());
            let Some(of_map) = of_map else {
                continue;
            };
            let turned = Matrix::new(weights, weights.len() / self.to[0]).transposed();
            if self.is_pointwise() {
                add_product(of_map, turned, gradients);
            } else {
                columns.fill(0.0);
                add_product(&mut columns, turned, gradients);
                self.fold(&columns, of_map);
            }
        }
        [of_weights, of_bias]
    }

    fn of_channels(
        &self,
        [map, weights, gradient]: [&[f32]; 3],
        of_weights: &mut [f32],
        mut of_map: Option<&mut [f32]>,
    ) {
        let (cells, places) = (self.from[1] * self.from[2], self.kernel * self.kernel);
        for (at, gradient) in gradient.chunks_exact(self.cells_to()).enumerate() {
            let from = &map[at * cells..(at + 1) * cells];
            for (nth, place) in self.places().enumerate() {
                let weight = at * places + nth;
                self.runs(place, |input, output, n| {
                    let gradient = &gradient[output..output + n];
                    of_weights[weight] += if self.stride == 1 {
                        dot(&from[input..input + n], gradient)
                    } else {
                        let values = from[input..].iter().step_by(self.stride);
                        values.zip(gradient).map(|(a, b)| a * b).sum()
                    };
                    if let Some(of_map) = &mut of_map {
                        let to = &mut of_map[at * cells + input..(at + 1) * cells];
                        for (to, value) in to.iter_mut().step_by(self.stride).zip(gradient) {
                            *to += weights[weight] * value;
                        }
                    }
                });
            }
        }
    }
}
