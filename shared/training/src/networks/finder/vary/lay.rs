//! Random placement of pictures over each other.

use super::layer::{Layer, boxes};
use super::{Around, Picture, Rng, Shape, Vary};
use crate::networks::parameters::normal;

/// Aspect ratios of camera pictures: width divided by height.
const ASPECTS: [f32; 6] = [4.0 / 3.0, 16.0 / 9.0, 1.0, 3.0 / 4.0, 9.0 / 16.0, 4.0 / 3.0];
/// Largest enlargement: pixels of the sample per pixel of a picture.
const MOST_ENLARGED: f32 = 3.0;
/// Share of pasted people who are placed close to another person.
const CLOSE: f32 = 0.5;

/// A picture, and pictures pasted over it.
pub(super) fn layers<'a>(
    picture: &'a Picture,
    others: &'a [Picture],
    (shape, vary): (&Shape, &Vary),
    rng: &mut Rng,
) -> Vec<Layer<'a>> {
    let side = shape.side as f32;
    let aspect = ASPECTS[rng.usize(0..ASPECTS.len())];
    let frame = [side * aspect.min(1.0), side / aspect.max(1.0)];
    let mut layers = Vec::new();
    if rng.f32() < vary.single {
        if rng.bool() {
            layers.push(cover(&others[rng.usize(0..others.len())], frame, rng));
        }
        layers.push(scaled(picture, frame, vary, rng));
        return layers;
    }
    layers.push(cover(picture, frame, rng));
    for _ in 0..rng.usize(1..=vary.most_pasted) {
        let other = &others[rng.usize(0..others.len())];
        let beside = boxes(&layers);
        layers.extend(pasted(other, (frame, &beside), vary, rng));
    }
    layers
}

/// The window of a picture that fills a frame at the top-left corner of the sample: left, top, right, bottom.
fn window(frame: [f32; 2]) -> [f32; 4] {
    [-0.5, -0.5, frame[0] - 0.5, frame[1] - 0.5]
}

/// A random height in the sample, uniform in its logarithm.
fn height(frame: [f32; 2], most: f32, vary: &Vary, rng: &mut Rng) -> f32 {
    let [low, high] =
        [vary.least_height, vary.most_height.min(most)].map(|share| share.max(1e-3).ln());
    frame[1] * (low + (high - low).max(0.0) * rng.f32()).exp()
}

/// A random person of a picture.
fn somebody(picture: &Picture, rng: &mut Rng) -> Option<Around> {
    let people = picture.people.iter().filter(|person| person.counts);
    let people: Vec<&Around> = people.collect();
    let nth = rng.usize(0..people.len().max(1));
    people.get(nth).map(|person| **person)
}

/// A layer that puts a point of the picture at a point of the sample. It shows all of the picture that is within the limits.
fn layer<'a>(
    picture: &'a Picture,
    [at, to]: [[f32; 2]; 2],
    (step, limits): (f32, [f32; 4]),
    rng: &mut Rng,
) -> Layer<'a> {
    let is_mirrored = rng.bool();
    let across = if is_mirrored { -step } else { step };
    let from = [at[0] - to[0] * across, at[1] - to[1] * step];
    let mut layer = Layer {
        picture,
        from,
        step,
        is_mirrored,
        window: limits,
        is_round: false,
    };
    let [width, height] = picture.size.map(|side| side as f32 - 0.5);
    let whole = Around {
        outline: [-0.5, -0.5, width, height],
        counts: true,
    };
    layer.window = layer.in_sample(&whole).cut(limits).outline;
    layer
}

/// A random part of a picture that fills the frame.
fn cover<'a>(picture: &'a Picture, frame: [f32; 2], rng: &mut Rng) -> Layer<'a> {
    let size = picture.size.map(|side| side as f32);
    let step = (size[0] / frame[0]).min(size[1] / frame[1]) / (1.0 + 0.6 * rng.f32());
    let at = [0, 1].map(|axis| {
        let half = 0.5 * frame[axis] * step;
        half + (size[axis] - 2.0 * half).max(0.0) * rng.f32() - 0.5
    });
    let to = frame.map(|side| 0.5 * side - 0.5);
    layer(picture, [at, to], (step, window(frame)), rng)
}

/// A picture scaled to a random height of one person.
fn scaled<'a>(picture: &'a Picture, frame: [f32; 2], vary: &Vary, rng: &mut Rng) -> Layer<'a> {
    let Some(person) = somebody(picture, rng) else {
        return cover(picture, frame, rng);
    };
    let [left, top, right, bottom] = person.outline;
    let step = (bottom - top) / height(frame, f32::INFINITY, vary, rng);
    let step = step.max(1.0 / MOST_ENLARGED);
    let at = [f32::midpoint(left, right), f32::midpoint(top, bottom)];
    let to = frame.map(|side| side * (0.15 + 0.7 * rng.f32()));
    layer(picture, [at, to], (step, window(frame)), rng)
}

/// A part of a picture, with or without a person.
///
/// * `beside`: people already in the sample.
fn pasted<'a>(
    picture: &'a Picture,
    (frame, beside): ([f32; 2], &[Around]),
    vary: &Vary,
    rng: &mut Rng,
) -> Option<Layer<'a>> {
    let person = somebody(picture, rng);
    let is_person = person.is_some();
    let size = picture.size.map(|side| side as f32);
    let person = person.unwrap_or_else(|| Around {
        outline: [
            0.3 * size[0] * rng.f32(),
            0.0,
            size[0] * (0.5 + 0.5 * rng.f32()),
            size[1],
        ],
        counts: false,
    });
    let [left, top, right, bottom] = person.outline;
    let near = beside.get(rng.usize(0..beside.len().max(1)));
    let near = near.filter(|near| near.counts && is_person && rng.f32() < CLOSE);
    let (tall, to) = if let Some(near) = near {
        let [left, top, right, bottom] = near.outline;
        let tall = (bottom - top) * (0.2 * normal(rng)).exp();
        let aside = (right - left) * (0.3 + 0.7 * rng.f32());
        let x = f32::midpoint(left, right) + if rng.bool() { aside } else { -aside };
        (tall, [x, bottom - tall * (0.5 + 0.15 * normal(rng))])
    } else {
        let tall = height(frame, 0.9, vary, rng);
        (tall, frame.map(|side| side * rng.f32()))
    };
    let step = ((bottom - top) / tall.max(8.0)).max(1.0 / MOST_ENLARGED);
    let is_tight = rng.bool();
    let margin = if is_tight { 0.04 } else { 0.4 * rng.f32() } * (bottom - top) / step;
    let [half_width, half_height] =
        [right - left, bottom - top].map(|side| 0.5 * side / step + margin);
    let [x, y] = to;
    let limits = Around {
        outline: [
            x - half_width,
            y - half_height,
            x + half_width,
            y + half_height,
        ],
        counts: true,
    };
    let limits = limits.cut(window(frame));
    if limits.area() < 16.0 {
        return None;
    }
    let at = [f32::midpoint(left, right), f32::midpoint(top, bottom)];
    let laid = layer(picture, [at, to], (step, limits.outline), rng);
    Some(Layer {
        is_round: is_tight && is_person,
        ..laid
    })
}
