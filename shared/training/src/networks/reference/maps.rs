//! Operations on maps: values and gradients.

use super::convolution::Sizes;
use super::matrix::{Matrix, add_product, dot, sum};
use super::record::{At, Back, Record, by_sample, each};
use crate::networks::ops::{Along, Conv, Places, Scaling, convolved, grid};
use crate::networks::parameters::{EPSILON_OF_LENGTH, GAIN_OF_RELU, standardised};

impl<'a> Record<'a> {
    pub(super) fn convolve(&mut self, map: At, name: &str, conv: Conv) -> At {
        let sizes = Sizes::new(self.dims(map), conv);
        let weight = self.parameter(&format!("{name}.weight"));
        let gain = matches!(conv.scaling, Scaling::Standardised { .. })
            .then(|| self.parameter(&format!("{name}.gain")));
        let bias =
            (conv.scaling != Scaling::Batch).then(|| self.parameter(&format!("{name}.bias")));
        let raw = self.of_parameter(weight);
        let weights = gain.map(|gain| standardised(raw, self.of_parameter(gain)));
        let of_bias = bias.map(|bias| self.of_parameter(bias));
        let used = weights.as_deref().unwrap_or(raw);
        let values = sizes.forward(self.values(map), used, of_bias);
        let dims = convolved(self.dims(map), conv);
        let of_layer: Vec<usize> = [Some(weight), gain, bias].into_iter().flatten().collect();
        let (learns, leads) = (self.learns(&of_layer), self.leads(map));
        let back = (learns || leads).then(|| -> Back<'a> {
            Box::new(move |record, gradient, all| {
                let raw = record.of_parameter(weight);
                let used = weights.as_deref().unwrap_or(raw);
                let of = sizes.backward([record.values(map), used, gradient], leads);
                if leads {
                    all.add(map, of.map);
                }
                if !learns {
                    return;
                }
                if let Some(bias) = bias {
                    all.of_parameter(bias, of.bias);
                }
                if let Some(gain) = gain {
                    let of_raw = of_standardised(raw, record.of_parameter(gain), &of.weights);
                    all.of_parameter(weight, of_raw.weights);
                    all.of_parameter(gain, of_raw.gains);
                } else {
                    all.of_parameter(weight, of.weights);
                }
            })
        });
        self.record(dims, values, back)
    }

    pub(super) fn double(&mut self, map: At) -> At {
        let (dims, n, size) = (self.dims(map).to_vec(), self.n, self.size(map));
        let columns = dims[2];
        let from = self.values(map);
        let values = by_sample(n, 4 * size, |sample, to| {
            let rows = from[sample * size..(sample + 1) * size].chunks_exact(columns);
            for (to, from) in to.chunks_exact_mut(4 * columns).zip(rows) {
                for to in to.chunks_exact_mut(2 * columns) {
                    for (to, from) in to.chunks_exact_mut(2).zip(from) {
                        to.fill(*from);
                    }
                }
            }
        });
        let doubled = vec![dims[0], 2 * dims[1], 2 * dims[2]];
        self.derived(map, (doubled, values), move |_, gradient| {
            by_sample(n, size, |sample, to| {
                let rows = gradient[4 * sample * size..].chunks_exact(4 * columns);
                for (to, from) in to.chunks_exact_mut(columns).zip(rows) {
                    for from in from.chunks_exact(2 * columns) {
                        for (to, from) in to.iter_mut().zip(from.chunks_exact(2)) {
                            *to += from[0] + from[1];
                        }
                    }
                }
            })
        })
    }

    pub(super) fn pool_pairs(&mut self, map: At) -> At {
        let (dims, n, size) = (self.dims(map).to_vec(), self.n, self.size(map));
        let pooled = vec![dims[0], dims[1] / 2, dims[2] / 2];
        let (rows, columns, across) = (pooled[1], pooled[2], dims[2]);
        let size_of_pooled: usize = pooled.iter().product();
        // Index of the largest of four values, within the sample.
        let largest = move |from: &[f32], at: usize| {
            let [channel, row, column] = [at / (rows * columns), at / columns % rows, at % columns];
            let first = (channel * dims[1] + 2 * row) * across + 2 * column;
            let four = [first, first + 1, first + across, first + across + 1];
            four.into_iter()
                .reduce(|best, other| {
                    if from[other] > from[best] {
                        other
                    } else {
                        best
                    }
                })
                .unwrap_or(first)
        };
        let from = self.values(map);
        let values = by_sample(n, size_of_pooled, |sample, to| {
            let from = &from[sample * size..(sample + 1) * size];
            for (at, to) in to.iter_mut().enumerate() {
                *to = from[largest(from, at)];
            }
        });
        self.derived(map, (pooled, values), move |record, gradient| {
            let from = record.values(map);
            by_sample(n, size, |sample, to| {
                let from = &from[sample * size..(sample + 1) * size];
                let gradient = &gradient[sample * size_of_pooled..(sample + 1) * size_of_pooled];
                for (at, gradient) in gradient.iter().enumerate() {
                    to[largest(from, at)] += gradient;
                }
            })
        })
    }

    pub(super) fn average(&mut self, map: At) -> At {
        let [channels, cells] = self.channels(map);
        let share = 1.0 / cells as f32;
        let from = self.values(map).chunks_exact(cells);
        let values = from.map(|channel| sum(channel) * share).collect();
        self.derived(map, (vec![channels], values), move |_, gradient| {
            let each = gradient.iter();
            each.flat_map(|gradient| core::iter::repeat_n(gradient * share, cells))
                .collect()
        })
    }

    pub(super) fn maximum(&mut self, map: At) -> At {
        let [channels, cells] = self.channels(map);
        let from = self.values(map).chunks_exact(cells);
        let values = from
            .map(|channel| channel.iter().copied().fold(f32::NEG_INFINITY, f32::max))
            .collect();
        self.derived(map, (vec![channels], values), move |record, gradient| {
            let mut all = vec![0.0; gradient.len() * cells];
            let channels = record.values(map).chunks_exact(cells);
            let to = all.chunks_exact_mut(cells).zip(channels);
            for ((to, channel), gradient) in to.zip(gradient) {
                let best = (0..cells).reduce(|best, other| {
                    if channel[other] > channel[best] {
                        other
                    } else {
                        best
                    }
                });
                if let Some(best) = best {
                    to[best] = *gradient;
                }
            }
            all
        })
    }

    pub(super) fn soften(&mut self, maps: At, sharpness: f32) -> At {
        let [channels, cells] = self.channels(maps);
        let (n, size) = (self.n, channels * cells);
        let from = self.values(maps);
        let values = by_sample(n, size, |sample, to| {
            let from = from[sample * size..(sample + 1) * size].chunks_exact(cells);
            for (to, from) in to.chunks_exact_mut(cells).zip(from) {
                let most = from.iter().copied().fold(f32::NEG_INFINITY, f32::max);
                for (to, from) in to.iter_mut().zip(from) {
                    *to = ((from - most) * sharpness).exp();
                }
                let total = sum(to);
                for weight in to {
                    *weight /= total;
                }
            }
        });
        let dims = self.dims(maps).to_vec();
        // The backward pass needs these values again.
        let kept = if self.leads(maps) {
            values.clone()
        } else {
            Vec::new()
        };
        self.derived(maps, (dims, values), move |_, gradient| {
            by_sample(n, size, |sample, to| {
                let all = sample * size..(sample + 1) * size;
                let pairs =
                    kept[all.clone()].chunks_exact(cells).zip(gradient[all].chunks_exact(cells));
                for (to, (weights, gradient)) in to.chunks_exact_mut(cells).zip(pairs) {
                    let mean = dot(weights, gradient);
                    for (to, (weight, gradient)) in to.iter_mut().zip(weights.iter().zip(gradient))
                    {
                        *to = sharpness * weight * (gradient - mean);
                    }
                }
            })
        })
    }

    pub(super) fn gaussians(&mut self, list: At, like: At, places: &Places) -> At {
        let dims = self.dims(like);
        let (rows, columns) = (dims[1], dims[2]);
        let across = Along::new(columns, places.width, places.deviation);
        let down = Along::new(rows, 1.0, places.deviation);
        let mut values = Vec::new();
        for row in self.values(list).chunks_exact(self.size(list)) {
            for (x, y) in places.x.iter().zip(&places.y) {
                let across: Vec<f32> = across.weights(row[*x]).collect();
                for down in down.weights(row[*y]) {
                    values.extend(across.iter().map(|across| across * down));
                }
            }
        }
        self.record(vec![places.x.len(), rows, columns], values, None)
    }

    pub(super) fn look_by(&mut self, map: At, weights: At) -> At {
        let ([channels, cells], [n_maps, _]) = (self.channels(map), self.channels(weights));
        let n = self.n;
        let (size, size_of_map, size_of_weights) =
            (n_maps * channels, channels * cells, n_maps * cells);
        let part = |values: &'_ [f32], size: usize, sample: usize| -> core::ops::Range<usize> {
            debug_assert!(
                values.len() >= (sample + 1) * size,
                "the sample must be in the batch"
            );
            sample * size..(sample + 1) * size
        };
        let (from, by) = (self.values(map), self.values(weights));
        let values = by_sample(n, size, |sample, to| {
            let from = Matrix::new(&from[part(from, size_of_map, sample)], cells);
            let by = Matrix::new(&by[part(by, size_of_weights, sample)], cells);
            add_product(to, by, from.transposed());
        });
        let leads = [map, weights].map(|at| self.leads(at));
        let back = (leads[0] || leads[1]).then(|| -> Back<'a> {
            Box::new(move |record, gradient, all| {
                let (from, by) = (record.values(map), record.values(weights));
                let of =
                    |sample: usize| Matrix::new(&gradient[part(gradient, size, sample)], channels);
                if leads[0] {
                    let of_map = by_sample(n, size_of_map, |sample, to| {
                        let by = Matrix::new(&by[part(by, size_of_weights, sample)], cells);
                        add_product(to, of(sample).transposed(), by);
                    });
                    all.add(map, of_map);
                }
                if leads[1] {
                    let of_weights = by_sample(n, size_of_weights, |sample, to| {
                        let from = Matrix::new(&from[part(from, size_of_map, sample)], cells);
                        add_product(to, of(sample), from);
                    });
                    all.add(weights, of_weights);
                }
            })
        });
        self.record(vec![size], values, back)
    }

    pub(super) fn places(&mut self, weights: At) -> At {
        let dims = self.dims(weights).to_vec();
        let [n_maps, cells] = self.channels(weights);
        let (n, size) = (self.n, n_maps * cells);
        let grid = grid(dims[2], dims[1]);
        let from = self.values(weights);
        let values = by_sample(n, 3 * n_maps, |sample, to| {
            let from = Matrix::new(&from[sample * size..(sample + 1) * size], cells);
            add_product(to, from, Matrix::new(&grid, 3));
        });
        self.derived(weights, (vec![3 * n_maps], values), move |_, gradient| {
            by_sample(n, size, |sample, to| {
                let of = &gradient[3 * n_maps * sample..3 * n_maps * (sample + 1)];
                add_product(to, Matrix::new(of, 3), Matrix::new(&grid, 3).transposed());
            })
        })
    }

    /// Replaces negative values of a map or list with 0.
    pub(super) fn positive(&mut self, value: At) -> At {
        let from = self.values(value);
        let values = each(from, from, |from, _| from.max(0.0));
        let dims = self.dims(value).to_vec();
        self.derived(value, (dims, values), move |record, gradient| {
            let pass = |gradient: f32, from: f32| if from > 0.0 { gradient } else { 0.0 };
            each(gradient, record.values(value), pass)
        })
    }

    pub(super) fn sum(&mut self, a: At, b: At) -> At {
        let values = each(self.values(a), self.values(b), |a, b| a + b);
        let leads = [a, b].map(|at| self.leads(at));
        let back = (leads[0] || leads[1]).then(|| -> Back<'a> {
            Box::new(move |_, gradient, all| {
                for (at, _) in [a, b].into_iter().zip(leads).filter(|(_, leads)| *leads) {
                    all.add(at, gradient.to_vec());
                }
            })
        });
        self.record(self.dims(a).to_vec(), values, back)
    }
}

/// The gradients of the weights and gains behind standardised weights.
struct OfStandardised {
    weights: Vec<f32>,
    gains: Vec<f32>,
}

fn of_standardised(weights: &[f32], gains: &[f32], gradient: &[f32]) -> OfStandardised {
    let n_inputs = weights.len() / gains.len();
    let mut of = OfStandardised {
        weights: Vec::with_capacity(weights.len()),
        gains: Vec::with_capacity(gains.len()),
    };
    let channels = weights.chunks_exact(n_inputs).zip(gradient.chunks_exact(n_inputs));
    for ((channel, gradient), gain) in channels.zip(gains) {
        let mean = channel.iter().sum::<f32>() / n_inputs as f32;
        let off: Vec<f32> = channel.iter().map(|value| value - mean).collect();
        let length = (dot(&off, &off) + EPSILON_OF_LENGTH).sqrt();
        let along = dot(&off, gradient);
        of.gains.push(along * GAIN_OF_RELU / length);
        let factor = gain * GAIN_OF_RELU / length;
        let slope = along / (length * length);
        let centred = sum(gradient) / n_inputs as f32;
        let each = off.iter().zip(gradient);
        of.weights
            .extend(each.map(|(off, gradient)| factor * (gradient - centred - slope * off)));
    }
    of
}
