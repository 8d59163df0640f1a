//! The gradient at every pixel and its orientation, from which the features are computed.

mod fast;

use crate::Planes;

pub(crate) use fast::gradients;

/// Number of signed orientations; there are half as many unsigned ones.
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

/// Squared length, `(levels of grey)^2`, and orientation of the gradient at an inner pixel.
///
/// The gradient is the central difference without the factor of one half, taken in the colour plane where it is longest (the first plane,
/// if several are equal). Its orientation is that of the unit vector with the largest absolute scalar product (the first, if several are
/// equal), plus 9 if the product is negative.
pub(crate) fn gradient(image: &Planes, y: usize, x: usize) -> (f64, usize) {
    let mut longest = (-1.0, [0.0; 2]);
    for plane in 0..3 {
        let dx = image.row(plane, y)[x + 1] - image.row(plane, y)[x - 1];
        let dy = image.row(plane, y + 1)[x] - image.row(plane, y - 1)[x];
        let squared = dx * dx + dy * dy;
        if squared > longest.0 {
            longest = (squared, [dx, dy]);
        }
    }
    let (squared, [dx, dy]) = longest;
    let (mut closest, mut bin) = (0.0, 0);
    for (orientation, [u, v]) in DIRECTIONS.into_iter().enumerate() {
        let dot = u * dx + v * dy;
        if dot > closest {
            (closest, bin) = (dot, orientation);
        } else if -dot > closest {
            (closest, bin) = (-dot, orientation + DIRECTIONS.len());
        }
    }
    (squared, bin)
}
