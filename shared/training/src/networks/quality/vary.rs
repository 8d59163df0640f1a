//! Network inputs made from samples, unchanged or augmented.

use fastrand::Rng;
use skeleton::{MIRROR, N_PARTS};
use viewquality::{N_TYPES, Normalisation, PART_NUMBERS, POSE_NUMBERS, TileShape};

use super::network::{PER_PART, column};
use super::sample::{MARGIN, Sample, picture_size};
use super::settings::Vary;
use crate::networks::parameters::normal;

/// The inputs and labels of one sample.
#[derive(Debug, Clone, PartialEq)]
pub struct NetworkSample {
    /// Normalised colour planes of the tile, `3 x height x width`.
    pub tile: Vec<f32>,
    /// See [`viewquality::evidence()`].
    pub evidence: Vec<f32>,
    /// Height of the area that the tile shows, in pixels of the picture.
    pub height_px: f32,
    /// Distance of every part from its true position, in pixels of the picture.
    pub errors_px: Vec<f32>,
}

/// The position of an augmented tile in its sample.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Place {
    /// Pixels of the sample's tile per pixel of the augmented tile.
    scale: f32,
    /// Offset of the augmented tile's centre from the sample's, in pixels of the sample's tile.
    shift: [f32; 2],
    mirrored: bool,
}

const AS_IT_IS: Place = Place {
    scale: 1.0,
    shift: [0.0; 2],
    mirrored: false,
};

/// A sample without augmentation.
///
/// * `with_tile`: true if the network uses tiles.
pub fn plain(sample: &Sample, tile: TileShape, with_tile: bool) -> NetworkSample {
    NetworkSample {
        tile: if with_tile {
            normalised(&pixels(sample, tile, AS_IT_IS), tile)
        } else {
            Vec::new()
        },
        evidence: sample.evidence.clone(),
        height_px: sample.height_px,
        errors_px: sample.errors_px.clone(),
    }
}

/// A randomly augmented sample.
///
/// * `unknown`: values for unknown evidence (the means). If a person is mirrored, the types of the parts are replaced with them, because
///   the types on the left and right side of the body do not correspond.
pub fn varied(
    sample: &Sample,
    (tile, with_tile): (TileShape, bool),
    (vary, unknown): (&Vary, &[f32]),
    dice: &mut Rng,
) -> NetworkSample {
    let mut around = |most: f32| most * (2.0 * dice.f32() - 1.0);
    let reach = vary.shift * tile.height as f32;
    let place = Place {
        scale: 1.0 + around(vary.scale),
        shift: [around(reach), around(reach)],
        mirrored: false,
    };
    let place = Place {
        mirrored: dice.f32() < vary.mirror,
        ..place
    };
    let tile_values = if with_tile {
        let mut planes = pixels(sample, tile, place);
        if dice.f32() < vary.blur {
            blur(&mut planes, tile, vary.blur_px * dice.f32());
        }
        if dice.f32() < vary.noise {
            let level = vary.noise_level * dice.f32();
            for value in &mut planes {
                *value += level * normal(dice);
            }
        }
        normalised(&planes, tile)
    } else {
        Vec::new()
    };
    let errors =
        (0..N_PARTS).map(|part| sample.errors_px[if place.mirrored { MIRROR[part] } else { part }]);
    NetworkSample {
        tile: tile_values,
        evidence: moved(&sample.evidence, tile, place, unknown),
        height_px: sample.height_px * place.scale,
        errors_px: errors.collect(),
    }
}

/// The evidence for a moved tile.
fn moved(evidence: &[f32], tile: TileShape, place: Place, unknown: &[f32]) -> Vec<f32> {
    let mut moved = evidence.to_vec();
    if place.mirrored {
        for part in 0..N_PARTS {
            let from = &evidence[MIRROR[part] * PER_PART..][..PER_PART];
            let to = &mut moved[part * PER_PART..][..PER_PART];
            to.copy_from_slice(from);
            let types = part * PER_PART + PART_NUMBERS.len();
            to[PART_NUMBERS.len()..].copy_from_slice(&unknown[types..][..N_TYPES]);
        }
    }
    let heights = place.shift.map(|pixels| pixels / tile.height as f32);
    for part in 0..N_PARTS {
        for (axis, name) in ["x", "y"].into_iter().enumerate() {
            let Some(at) = column(part, name) else {
                continue;
            };
            let mirrored = place.mirrored && axis == 0;
            let value = if mirrored { -moved[at] } else { moved[at] };
            moved[at] = (value - heights[axis]) / place.scale;
        }
    }
    let of_pose = POSE_NUMBERS.iter().position(|name| *name == "tile_height");
    if let Some(at) = of_pose {
        moved[N_PARTS * PER_PART + at] *= place.scale;
    }
    moved
}

/// The planes of a tile, with colours from 0 to 1, interpolated between the pixels of the sample.
fn pixels(sample: &Sample, tile: TileShape, place: Place) -> Vec<f32> {
    let [rows, cols] = picture_size(tile);
    let area = tile.height * tile.width;
    let mut planes = vec![0.0; 3 * area];
    let at = |i: usize, n: usize, shift: f32, all: usize| {
        let middle = (n as f32 - 1.0) / 2.0;
        let at = (i as f32 - middle) * place.scale + shift + middle + MARGIN as f32;
        let at = at.clamp(0.0, all as f32 - 1.0);
        let low = (at as usize).min(all - 2);
        (low, at - low as f32)
    };
    let colour = |row: usize, col: usize, channel: usize| {
        f32::from(sample.picture[3 * (row * cols + col) + channel])
    };
    for row in 0..tile.height {
        let (y, v) = at(row, tile.height, place.shift[1], rows);
        for col in 0..tile.width {
            // A mirrored tile is moved in the opposite direction.
            let (from, shift) = if place.mirrored {
                (tile.width - 1 - col, -place.shift[0])
            } else {
                (col, place.shift[0])
            };
            let (x, u) = at(from, tile.width, shift, cols);
            for channel in 0..3 {
                let mix = |y: usize| {
                    let [a, b] = [colour(y, x, channel), colour(y, x + 1, channel)];
                    a + u * (b - a)
                };
                let [a, b] = [mix(y), mix(y + 1)];
                planes[channel * area + row * tile.width + col] = (a + v * (b - a)) / 255.0;
            }
        }
    }
    planes
}

/// Blurs planes with a Gaussian; the border pixels are repeated.
fn blur(planes: &mut [f32], tile: TileShape, deviation: f32) {
    if deviation < 0.1 {
        return;
    }
    let reach = (3.0 * deviation).ceil() as i64;
    let weight = |off: i64| (-0.5 * (off as f32 / deviation).powi(2)).exp();
    let total: f32 = (-reach..=reach).map(weight).sum();
    let weights: Vec<f32> = (-reach..=reach).map(|off| weight(off) / total).collect();
    let mut line = Vec::new();
    let mut pass = |plane: &mut [f32], n: usize, first: usize, step: usize| {
        line.clear();
        line.extend((0..n).map(|at| plane[first + at * step]));
        for i in 0..n {
            let near = |k: usize| (i as i64 + k as i64 - reach).clamp(0, n as i64 - 1) as usize;
            let sum = weights.iter().enumerate().map(|(k, w)| w * line[near(k)]).sum();
            plane[first + i * step] = sum;
        }
    };
    for plane in planes.chunks_exact_mut(tile.height * tile.width) {
        (0..tile.height).for_each(|row| pass(plane, tile.width, row * tile.width, 1));
        (0..tile.width).for_each(|col| pass(plane, tile.height, col, tile.width));
    }
}

/// Normalises colours as the networks need them.
fn normalised(planes: &[f32], tile: TileShape) -> Vec<f32> {
    let Normalisation { mean, deviation } = Normalisation::IMAGENET;
    let area = tile.height * tile.width;
    let value = |(at, value): (usize, &f32)| (value - mean[at / area]) / deviation[at / area];
    planes.iter().enumerate().map(value).collect()
}

#[cfg(test)]
mod tests;
