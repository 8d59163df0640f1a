//! Computes the area average, one row of pixels at a time.

use std::ops::Range;

use super::{PartOfResized, Planes, ShrinkWorkspace};
use crate::Rgb8View;
use crate::dispatch::Body;

/// Taps of all output samples of one axis, with the same number for each.
#[derive(Debug, Default)]
pub(super) struct Taps {
    /// Number of taps of an output sample.
    n: usize,
    /// The first input sample of every output sample.
    first: Vec<usize>,
    /// `n` weights per output sample; zero for missing taps.
    weights: Vec<f64>,
}

impl Taps {
    pub(super) fn reserve(&mut self, from: usize) {
        self.first.clear();
        self.first.reserve(from);
        // There are at most `(ceil(from / to) + 1) to` weights.
        self.weights.clear();
        self.weights.reserve(3 * from);
    }

    /// Computes the taps of some samples of an area average from `from` to `to` samples. They are the taps of the reference,
    /// in the same order, with zeros before or after them.
    fn cover(&mut self, from: usize, to: usize, samples: Range<usize>) {
        let (scale, inverse) = (to as f64 / from as f64, from as f64 / to as f64);
        // The fully covered samples may have a partly covered sample on both sides.
        self.n = (inverse.ceil() as usize + 1).min(from);
        self.first.clear();
        self.weights.clear();
        for d in samples {
            let begin = d as f64 * inverse;
            let end = begin + inverse;
            let (whole, last) = (begin.ceil() as usize, end.floor() as usize);
            let before = whole as f64 - begin > 1e-3;
            let first = (whole - usize::from(before)).min(from - self.n);
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
            self.first.push(first);
            self.weights.extend((first..first + self.n).map(weight));
        }
    }
}

pub(super) struct Resize<'a> {
    pub(super) image: Rgb8View<'a>,
    pub(super) part: &'a PartOfResized,
    pub(super) workspace: &'a mut ShrinkWorkspace,
    /// The output, which already has its new size.
    pub(super) out: &'a mut Planes,
}

impl Body for Resize<'_> {
    #[inline(always)]
    fn run(self) {
        let Self {
            image,
            part,
            workspace,
            out,
        } = self;
        let ShrinkWorkspace {
            down,
            along,
            line,
            pixels,
        } = workspace;
        let [width, height] = part.size;
        down.cover(image.height(), height, part.y.clone());
        along.cover(image.width(), width, part.x.clone());
        // The columns that the samples of the part need.
        let left = along.first.first().map_or(0, |value| 3 * value);
        let right = along.first.last().map_or(0, |value| 3 * (value + along.n));
        along.first.iter_mut().for_each(|index| *index -= left / 3);
        let stride = 3 * image.width();
        line.clear();
        // The fourth sample of the last pixel is read but not used.
        line.resize(right - left + 1, 0.0);
        pixels.resize(out.width, [0.0; 4]);
        for y in 0..out.height {
            let rows = &image.data()[down.first[y] * stride + left..];
            let weights = &down.weights[y * down.n..][..down.n];
            sum_down(rows, stride, weights, &mut line[..right - left]);
            match along.n {
                1 => sum_along::<1>(line, along, pixels),
                2 => sum_along::<2>(line, along, pixels),
                3 => sum_along::<3>(line, along, pixels),
                _ => sum_many_along(line, along, pixels),
            }
            split_colours(pixels, out.rows_mut(y));
        }
    }
}

/// Weighted sums down the columns of some rows. `rows` begins with the first row, and rows are `stride` apart.
#[inline(always)]
fn sum_down(rows: &[u8], stride: usize, weights: &[f64], out: &mut [f64]) {
    let n = out.len();
    let row = |value: usize| &rows[value * stride..][..n];
    match *weights {
        [a] | [a, 0.0] | [a, 0.0, 0.0] => {
            for (out, it) in out.iter_mut().zip(row(0)) {
                *out = a * f64::from(*it);
            }
        }
        [a, b] | [a, b, 0.0] => {
            for (out, (p, q)) in out.iter_mut().zip(row(0).iter().zip(row(1))) {
                *out = a * f64::from(*p) + b * f64::from(*q);
            }
        }
        [a, b, c] => {
            let rows = row(0).iter().zip(row(1)).zip(row(2));
            for (out, ((p, q), r)) in out.iter_mut().zip(rows) {
                *out = a * f64::from(*p) + b * f64::from(*q) + c * f64::from(*r);
            }
        }
        _ => {
            out.fill(0.0);
            for (at, &weight) in weights.iter().enumerate() {
                for (out, it) in out.iter_mut().zip(row(at)) {
                    *out += weight * f64::from(*it);
                }
            }
        }
    }
}

/// Weighted sums along one row of column sums, in which the colours of each pixel are interleaved. Each lane is a colour.
#[inline(always)]
fn sum_along<const N: usize>(line: &[f64], along: &Taps, out: &mut [[f64; 4]]) {
    let (weights, _) = along.weights.as_chunks::<N>();
    for (out, (weights, &first)) in out.iter_mut().zip(weights.iter().zip(&along.first)) {
        let samples = &line[3 * first..][..=3 * N];
        let mut pixel = [0.0; 4];
        for (tap, weight) in weights.iter().enumerate() {
            for (lane, sum) in pixel.iter_mut().enumerate() {
                *sum += weight * samples[3 * tap + lane];
            }
        }
        *out = pixel;
    }
}

#[inline(always)]
fn split_colours(pixels: &[[f64; 4]], [red, green, blue]: [&mut [f64]; 3]) {
    let targets = red.iter_mut().zip(green).zip(blue);
    for (((red, green), blue), pixel) in targets.zip(pixels) {
        [*red, *green, *blue, _] = *pixel;
    }
}

/// The same as [`sum_along`], for any number of taps.
#[inline(always)]
fn sum_many_along(line: &[f64], along: &Taps, out: &mut [[f64; 4]]) {
    let weights = along.weights.chunks_exact(along.n);
    for (out, (weights, first)) in out.iter_mut().zip(weights.zip(&along.first)) {
        let samples = line[3 * first..].windows(4).step_by(3);
        *out = [0.0; 4];
        for (weight, samples) in weights.iter().zip(samples) {
            for (sum, sample) in out.iter_mut().zip(samples) {
                *sum += weight * sample;
            }
        }
    }
}
