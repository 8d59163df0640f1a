//! Colour images in double precision, and how they are made smaller.
//!
//! The hard orientation decision of the features turns a difference in the last bit into another
//! histogram bin, so both functions add their products in exactly the order of the reference
//! programs: down the columns first, tap after tap, then along the rows.

use crate::Rgb8View;

/// Three planes of samples, 0..255, `[plane][row][col]`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Planes {
    width: usize,
    height: usize,
    data: Vec<f64>,
}

impl Planes {
    /// Width, pixels.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height, pixels.
    pub fn height(&self) -> usize {
        self.height
    }

    /// All samples: `3 x height x width`.
    pub fn data(&self) -> &[f64] {
        &self.data
    }

    /// One row of one plane.
    pub fn row(&self, plane: usize, y: usize) -> &[f64] {
        &self.data[(plane * self.height + y) * self.width..][..self.width]
    }

    fn row_mut(&mut self, plane: usize, y: usize) -> &mut [f64] {
        &mut self.data[(plane * self.height + y) * self.width..][..self.width]
    }

    /// Gives the image another size; samples are unspecified after it.
    fn reshape(&mut self, width: usize, height: usize) {
        (self.width, self.height) = (width, height);
        self.data.resize(3 * width * height, 0.0);
    }

    /// Makes this image from planar samples `[plane][row][col]`.
    ///
    /// # Panics
    ///
    /// If `data` is not `3 x height x width` samples.
    pub fn from_samples(width: usize, height: usize, data: Vec<f64>) -> Self {
        assert_eq!(data.len(), 3 * width * height, "three full planes");
        Self {
            width,
            height,
            data,
        }
    }
}

/// The input samples that one output sample is the weighted sum of.
#[derive(Debug, Clone)]
struct Taps {
    first: usize,
    weights: Vec<f64>,
}

/// Taps of an area average from `from` to `to` samples.
///
/// Output `d` covers the input interval `[d inv, (d + 1) inv)`, `inv = from / to`; partly covered
/// samples count by their share, shares up to 1e-3 are dropped.
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
        taps.weights
            .extend(std::iter::repeat_n(scale, last.saturating_sub(whole)));
        if end - last as f64 > 1e-3 && last < from {
            taps.weights.push((end - last as f64) * scale);
        }
        taps
    };
    (0..to).map(taps_of).collect()
}

/// Makes `out` the area average of `image` at `width` x `height` pixels.
///
/// The reference programs' `resize`: bit for bit.
///
/// # Panics
///
/// If the new size is zero or larger than the image's.
pub fn resize(image: Rgb8View<'_>, width: usize, height: usize, out: &mut Planes) {
    assert!(
        (1..=image.width()).contains(&width) && (1..=image.height()).contains(&height),
        "resize only makes images smaller"
    );
    out.reshape(width, height);
    let stride = 3 * image.width();
    let down = area_taps(image.height(), height);
    let along = area_taps(image.width(), width);
    // The fourth sample of the last pixel is read and not used.
    let mut column_sums = vec![0.0; stride + 1];
    for (y, taps) in down.iter().enumerate() {
        let sums = &mut column_sums[..stride];
        sums.fill(0.0);
        for (row, &weight) in taps.weights.iter().enumerate() {
            let samples = &image.data()[(taps.first + row) * stride..][..stride];
            for (sum, &sample) in sums.iter_mut().zip(samples) {
                *sum += weight * f64::from(sample);
            }
        }
        average_along(&column_sums, &along, y, out);
    }
}

/// The second pass of [`resize`], on one interleaved row of column sums.
fn average_along(column_sums: &[f64], along: &[Taps], y: usize, out: &mut Planes) {
    let plane = out.width * out.height;
    for (x, taps) in along.iter().enumerate() {
        let mut pixel = [0.0; 4];
        let samples = column_sums[3 * taps.first..].windows(4).step_by(3);
        for (&weight, samples) in taps.weights.iter().zip(samples) {
            for (sum, sample) in pixel.iter_mut().zip(samples) {
                *sum += weight * sample;
            }
        }
        for (colour, sample) in pixel[..3].iter().enumerate() {
            out.data[colour * plane + y * out.width + x] = *sample;
        }
    }
}

/// Side of the image that [`reduce`] makes of `side` samples: half, rounded away from zero.
pub fn reduced(side: usize) -> usize {
    side.div_ceil(2)
}

/// Makes `out` the image at half size: five binomial taps, then every second sample.
///
/// The reference programs' `reduce`, borders included: bit for bit.
///
/// # Panics
///
/// If a side is shorter than 5 pixels.
pub fn reduce(image: &Planes, out: &mut Planes) {
    assert!(image.width.min(image.height) >= 5, "five taps");
    out.reshape(reduced(image.width), reduced(image.height));
    let mut middle = vec![0.0; image.width];
    for plane in 0..3 {
        for y in 0..out.height {
            let row = |back: isize| image.row(plane, (2 * y).wrapping_add_signed(back));
            let border = Border::of(y, out.height, image.height);
            reduce_down(row, border, &mut middle);
            let target = out.row_mut(plane, y);
            let n = target.len();
            for (x, value) in target.iter_mut().enumerate() {
                let at = |back: isize| middle[(2 * x).wrapping_add_signed(back)];
                *value = match Border::of(x, n, middle.len()) {
                    Border::First => first(at(0), at(1), at(2)),
                    Border::Inside => inside([at(-2), at(-1), at(0), at(1), at(2)]),
                    Border::Folded => folded(at(-2), at(-1), at(0), at(1)),
                    Border::Last => first(at(0), at(-1), at(-2)),
                };
            }
        }
    }
}

/// Which taps an output sample of [`reduce`] has.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Border {
    First,
    Inside,
    /// The last but one, when the input ends one sample after it.
    Folded,
    Last,
}

impl Border {
    fn of(at: usize, n_out: usize, n_in: usize) -> Self {
        match at {
            0 => Self::First,
            _ if at + 1 == n_out => Self::Last,
            _ if at + 2 == n_out && 2 * n_out > n_in => Self::Folded,
            _ => Self::Inside,
        }
    }
}

fn reduce_down<'a>(row: impl Fn(isize) -> &'a [f64], border: Border, out: &mut [f64]) {
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

fn first(edge: f64, second: f64, third: f64) -> f64 {
    edge * 0.6875 + second * 0.25 + third * 0.0625
}

fn inside(s: [f64; 5]) -> f64 {
    s[0] * 0.0625 + s[1] * 0.25 + s[2] * 0.375 + s[3] * 0.25 + s[4] * 0.0625
}

/// Taps (1, 4, 6, 5) / 16 on the four last samples, added from the last to the first.
fn folded(a: f64, b: f64, c: f64, last: f64) -> f64 {
    last * 0.3125 + c * 0.375 + b * 0.25 + a * 0.0625
}
