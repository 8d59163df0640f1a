//! Samples: inputs made from pictures, and the boxes that the network should find.

use fastrand::Rng;

use super::network::{STRIDE, Shape};
use super::picture::{Around, Picture};
use super::settings::Vary;
use crate::networks::pose::{DEVIATION, FILL, MEAN, coarsen, recolour};

mod heat;
mod lay;
mod layer;

use self::layer::Layer;

/// An input of the network, and the true output.
#[derive(Debug, Clone, PartialEq)]
pub struct FinderSample {
    /// Input picture, `[3, side, side]`.
    pub picture: Vec<f32>,
    /// Heat, `[rows, columns]`; see [`Truth`](super::Truth).
    pub heat: Vec<f32>,
    /// Distances to the sides of the boxes, `[4, rows, columns]`.
    pub sides: Vec<f32>,
}

/// A sample as the network normally gets it: the whole picture, placed at the top-left corner.
pub fn plain(picture: &Picture, shape: &Shape) -> FinderSample {
    let [width, height] = picture.size.map(|side| side as f32);
    let step = width.max(height) / shape.side as f32;
    let layer = Layer {
        picture,
        from: [0.5 * step - 0.5; 2],
        step,
        is_mirrored: false,
        window: [-0.5, -0.5, width / step - 0.5, height / step - 0.5],
        is_round: false,
    };
    let rgb = layer::painted(&[layer], shape.side);
    sample(&rgb, &layer::boxes(&[layer]), shape)
}

/// A randomly varied picture with people from other pictures.
///
/// * `others`: pictures from which people are taken.
pub fn varied(
    picture: &Picture,
    others: &[Picture],
    (shape, vary): (&Shape, &Vary),
    rng: &mut Rng,
) -> FinderSample {
    let layers = lay::layers(picture, others, (shape, vary), rng);
    let mut rgb = layer::painted(&layers, shape.side);
    if rng.f32() < vary.coarse {
        coarsen(&mut rgb, [shape.side; 2], rng.usize(2..=3));
    }
    recolour(&mut rgb, vary.grey, rng);
    sample(&rgb, &layer::boxes(&layers), shape)
}

fn sample(rgb: &[[f32; 3]], people: &[Around], shape: &Shape) -> FinderSample {
    let picture = (0..3).flat_map(|channel| {
        let values = rgb.iter();
        values.map(move |pixel| (pixel[channel] - MEAN) / DEVIATION)
    });
    let (heat, sides) = heat::heat(people, shape.cells());
    FinderSample {
        picture: picture.collect(),
        heat,
        sides,
    }
}
