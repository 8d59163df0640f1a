//! A small model and pictures for the tests of this crate.

use crate::datasets::Picture;
use footage::Size;

use crate::shape::Shape;

/// A shape with a head, a trunk and a leg. The head has one type, the others have two.
pub(crate) fn shape() -> Shape {
    Shape {
        name: "small".to_owned(),
        part_names: ["head", "trunk", "leg"].map(str::to_owned).to_vec(),
        parents: vec![None, Some(0), Some(1)],
        mirror: None,
        anchors: vec![vec![[0, 0]], vec![[0, 3], [1, 2]], vec![[-1, 3], [2, 2]]],
        side: 3,
        cell_px: 4,
        interval: 4,
    }
}

/// A random vector for the shape, with values of the same size as trained values.
pub(crate) fn vector(seed: u64) -> Vec<f64> {
    let at = shape().coordinates();
    let mut random = fastrand::Rng::with_seed(seed);
    let mut v: Vec<f64> = (0..at.len()).map(|_| random.f64() - 0.5).collect();
    for it in &mut v[at.non_negative()] {
        *it = 0.05 * it.abs();
    }
    v[at.root().0] *= 0.01;
    v
}

/// Coarse noise, so that features differ from cell to cell.
pub(crate) fn noise(width: usize, height: usize, seed: u64) -> Picture {
    let mut random = fastrand::Rng::with_seed(seed);
    let blocks: Vec<u8> =
        (0..(width / 3 + 1) * (height / 3 + 1) * 3).map(|_| random.u8(..)).collect();
    let mut picture = Picture::filled(Size::new(width, height), [0; 3]);
    for (at, value) in picture.rgb_mut().iter_mut().enumerate() {
        let (x, y) = (at / 3 % width, at / 3 / width);
        *value = blocks[3 * ((y / 3) * (width / 3 + 1) + x / 3) + at % 3];
    }
    picture
}
