//! Readable versions of the functions that reduce the size of images.

use super::{Border, Planes, first, folded, inside};
use crate::Rgb8View;

/// The input samples whose weighted sum is one output sample.
struct Taps {
    first: usize,
    weights: Vec<f64>,
}

/// Returns the taps of an area average that reduces `from` samples to `to` samples.
///
/// Output `d` covers the input interval `[d inv, (d + 1) inv)`, where `inv = from / to`. A partly covered sample has its covered share as
/// weight; shares up to 1e-3 are dropped.
fn area_taps(from: usize, to: usize) -> Vec<Taps> {
    let (scale, inverse) = (to as f64 / from as f64, from as f64 / to as f64);
    let taps_of = |d: usize| {
        let begin = d as f64 * inverse;
        let end = begin + inverse;
        let (whole, last) = (begin.ceil() as usize, end.floor() as usize);
        let mut taps = Taps {
            first: whole,
            weights: Vec::new(),
        };
        if whole as f64 - begin > 1e-3 {
            taps.first = whole - 1;
            taps.weights.push((whole as f64 - begin) * scale);
        }
        taps.weights.extend(std::iter::repeat_n(scale, last.saturating_sub(whole)));
        if end - last as f64 > 1e-3 && last < from {
            taps.weights.push((end - last as f64) * scale);
        }
        taps
    };
    (0..to).map(taps_of).collect()
}

/// The area average of `image` at `width` x `height` pixels; see [`resize`](crate::resize()).
///
/// # Panics
///
/// Panics if the new size is zero or larger than the image's.
pub fn resize_by_taps(image: Rgb8View<'_>, [width, height]: [usize; 2]) -> Planes {
    super::check_resize(image, [width, height]);
    let mut out = Planes::default();
    out.reshape(width, height);
    let down = area_taps(image.height(), height);
    let along = area_taps(image.width(), width);
    let sample = |y: usize, x: usize, plane: usize| {
        f64::from(image.data()[(y * image.width() + x) * 3 + plane])
    };
    for plane in 0..3 {
        for (y, down) in down.iter().enumerate() {
            let column = |x: usize| {
                let rows = down.weights.iter().enumerate();
                rows.fold(0.0, |sum, (row, weight)| {
                    sum + weight * sample(down.first + row, x, plane)
                })
            };
            let columns: Vec<f64> = (0..image.width()).map(column).collect();
            for (target, along) in out.row_mut(plane, y).iter_mut().zip(&along) {
                let taps = along.weights.iter().zip(&columns[along.first..]);
                *target = taps.fold(0.0, |sum, (weight, column)| sum + weight * column);
            }
        }
    }
    out
}

/// `image` at half size; see [`reduce`](crate::reduce()).
///
/// # Panics
///
/// Panics if a side is shorter than 5 pixels.
pub fn reduce_by_taps(image: &Planes) -> Planes {
    super::check_reduce(image);
    let mut out = Planes::default();
    out.reshape(super::reduced(image.width), super::reduced(image.height));
    for plane in 0..3 {
        for y in 0..out.height {
            let column = |x: usize| {
                let at = |back| image.row(plane, (2 * y).wrapping_add_signed(back))[x];
                weigh(at, Border::of(y, out.height, image.height))
            };
            let columns: Vec<f64> = (0..image.width).map(column).collect();
            let n_out = out.width;
            for (x, target) in out.row_mut(plane, y).iter_mut().enumerate() {
                let at = |back| columns[(2 * x).wrapping_add_signed(back)];
                *target = weigh(at, Border::of(x, n_out, columns.len()));
            }
        }
    }
    out
}

fn weigh(at: impl Fn(isize) -> f64, border: Border) -> f64 {
    match border {
        Border::First => first(at(0), at(1), at(2)),
        Border::Inside => inside([at(-2), at(-1), at(0), at(1), at(2)]),
        Border::Folded => folded(at(-2), at(-1), at(0), at(1)),
        Border::Last => first(at(0), at(-1), at(-2)),
    }
}
