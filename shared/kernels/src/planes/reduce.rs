//! Reduces an image to half its size, one row of pixels at a time.

use super::{Border, Planes, first, folded, inside};
use crate::dispatch::Body;

pub(super) struct Reduce<'a> {
    pub(super) image: &'a Planes,
    pub(super) line: &'a mut Vec<f64>,
    /// The output, which already has its new size.
    pub(super) out: &'a mut Planes,
}

impl Body for Reduce<'_> {
    #[inline(always)]
    fn run(self) {
        let Self { image, line, out } = self;
        line.resize(image.width, 0.0);
        for plane in 0..3 {
            for y in 0..out.height {
                let row = |back: isize| image.row(plane, (2 * y).wrapping_add_signed(back));
                sum_down(row, Border::of(y, out.height, image.height), line);
                sum_along(line, out.row_mut(plane, y));
            }
        }
    }
}

#[inline(always)]
fn sum_down<'a>(row: impl Fn(isize) -> &'a [f64], border: Border, out: &mut [f64]) {
    let n = out.len();
    match border {
        Border::First => {
            let (a, b, c) = (&row(0)[..n], &row(1)[..n], &row(2)[..n]);
            for (x, it) in out.iter_mut().enumerate() {
                *it = first(a[x], b[x], c[x]);
            }
        }
        Border::Last => {
            let (a, b, c) = (&row(0)[..n], &row(-1)[..n], &row(-2)[..n]);
            for (x, it) in out.iter_mut().enumerate() {
                *it = first(a[x], b[x], c[x]);
            }
        }
        Border::Folded => {
            let (a, b, c, d) = (&row(-2)[..n], &row(-1)[..n], &row(0)[..n], &row(1)[..n]);
            for (x, it) in out.iter_mut().enumerate() {
                *it = folded(a[x], b[x], c[x], d[x]);
            }
        }
        Border::Inside => {
            let (a, b, c) = (&row(-2)[..n], &row(-1)[..n], &row(0)[..n]);
            let (d, e) = (&row(1)[..n], &row(2)[..n]);
            for (x, it) in out.iter_mut().enumerate() {
                *it = inside([a[x], b[x], c[x], d[x], e[x]]);
            }
        }
    }
}

#[inline(always)]
fn sum_along(line: &[f64], out: &mut [f64]) {
    let (n_in, n_out) = (line.len(), out.len());
    out[0] = first(line[0], line[1], line[2]);
    // The weights of output `x` begin two samples before input sample `2 x`.
    let (pairs, _) = line.as_chunks::<2>();
    let middle = pairs.iter().zip(&pairs[1..]).zip(&pairs[2..]);
    for (out, (([a, b], [c, d]), [e, _])) in out[1..].iter_mut().zip(middle) {
        *out = inside([*a, *b, *c, *d, *e]);
    }
    if n_out > 2 && Border::of(n_out - 2, n_out, n_in) == Border::Folded {
        let last = &line[2 * (n_out - 2) - 2..];
        out[n_out - 2] = folded(last[0], last[1], last[2], last[3]);
    }
    let last = &line[2 * (n_out - 1) - 2..];
    out[n_out - 1] = first(last[2], last[1], last[0]);
}
