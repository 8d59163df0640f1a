//! Gradient and its orientation at every pixel of a row: the decision behind the features.

use crate::Planes;

/// Number of signed orientations; the unsigned ones are half as many.
pub(crate) const N_ORIENTATIONS: usize = 18;

/// Unit vectors of the first nine orientations, to the four decimals of the reference programs.
const DIRECTIONS: [[f64; 2]; 9] = [
    [1.0000, 0.0000],
    [0.9397, 0.3420],
    [0.7660, 0.6428],
    [0.5000, 0.8660],
    [0.1736, 0.9848],
    [-0.1736, 0.9848],
    [-0.5000, 0.8660],
    [-0.7660, 0.6428],
    [-0.9397, 0.3420],
];

/// Gradients along one row of an image.
#[derive(Debug, Clone, Default)]
pub(crate) struct GradientRow {
    /// Squared length, `(levels of grey)^2`, of the colour plane in which it is largest.
    pub(crate) squared: Vec<f64>,
    /// Orientation 0..18; kept as a float while it is decided, so that all lanes are equally wide.
    pub(crate) bin: Vec<f64>,
    dx: Vec<f64>,
    dy: Vec<f64>,
    best: Vec<f64>,
}

impl GradientRow {
    /// Computes the row `y`; values at the first and last column are unspecified.
    ///
    /// The gradient is the central difference without the factor one half, taken in the colour
    /// plane where it is longest (first wins). Its orientation is that of the unit vector with the
    /// largest scalar product (first wins), 9 more if the product is negative.
    #[inline(always)]
    pub(crate) fn compute(&mut self, image: &Planes, y: usize) {
        let n = image.width();
        for buffer in [
            &mut self.squared,
            &mut self.bin,
            &mut self.dx,
            &mut self.dy,
            &mut self.best,
        ] {
            buffer.clear();
            buffer.resize(n, 0.0);
        }
        for plane in 0..3 {
            let (above, here, below) = (
                &image.row(plane, y - 1)[..n],
                &image.row(plane, y)[..n],
                &image.row(plane, y + 1)[..n],
            );
            self.take_longer(above, here, below, plane == 0);
        }
        for (orientation, direction) in DIRECTIONS.iter().enumerate() {
            self.take_closer(orientation as f64, *direction);
        }
    }

    #[inline(always)]
    fn take_longer(&mut self, above: &[f64], here: &[f64], below: &[f64], always: bool) {
        let n = here.len();
        let (squared, dx, dy) = (
            &mut self.squared[1..n - 1],
            &mut self.dx[1..n - 1],
            &mut self.dy[1..n - 1],
        );
        let (left, right) = (&here[..n - 2], &here[2..]);
        let (above, below) = (&above[1..n - 1], &below[1..n - 1]);
        for x in 0..n - 2 {
            let (along, down) = (right[x] - left[x], below[x] - above[x]);
            let length = along * along + down * down;
            let longer = always || length > squared[x];
            squared[x] = if longer { length } else { squared[x] };
            dx[x] = if longer { along } else { dx[x] };
            dy[x] = if longer { down } else { dy[x] };
        }
    }

    #[inline(always)]
    fn take_closer(&mut self, orientation: f64, [u, v]: [f64; 2]) {
        let n = self.dx.len();
        let (dx, dy) = (&self.dx[..n], &self.dy[..n]);
        let (best, bin) = (&mut self.best[..n], &mut self.bin[..n]);
        for x in 0..n {
            let dot = u * dx[x] + v * dy[x];
            let closer = dot.abs() > best[x];
            let signed = if dot > 0.0 {
                orientation
            } else {
                orientation + 9.0
            };
            best[x] = if closer { dot.abs() } else { best[x] };
            bin[x] = if closer { signed } else { bin[x] };
        }
    }
}
