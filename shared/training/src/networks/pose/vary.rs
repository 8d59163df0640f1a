//! Randomly varied pictures of a person as inputs, and the keypoints in them.

use fastrand::Rng;

use super::beside::add_beside;
use super::network::{N_KEYPOINTS, STRIDE, Shape};
use super::person::{Person, SIDE, Target};
use super::settings::Vary;
use super::window::{View, colour, pixels, view};
use super::{MIRROR, exchange_sides};
use crate::networks::parameters::normal;

/// Value subtracted from a colour before it is divided by [`DEVIATION`].
pub const MEAN: f32 = 110.0;
/// Value by which a colour is divided after [`MEAN`] is subtracted.
pub const DEVIATION: f32 = 60.0;
/// Shift of a window in which nobody is in the middle, in heights of the window: from the smallest to the largest. Half the width of the
/// window is 0.4 heights.
const ASIDE: [f32; 2] = [0.42, 0.6];
/// Random values are limited to this number of standard deviations.
const MOST: f32 = 2.5;

/// An input of the network, and the true outputs.
#[derive(Debug, Clone, PartialEq)]
pub struct NetworkSample {
    /// Input picture, `[3, height, width]`.
    pub picture: Vec<f32>,
    /// Heat of every keypoint, 0 to 1: `[keypoints, rows, columns]`.
    pub maps: Vec<f32>,
    /// Weight of the map of every keypoint.
    pub weights: [f32; N_KEYPOINTS],
    /// Direction of the trunk: components towards the right of the picture and towards the camera. Its length is the certainty.
    pub front: [f32; 2],
    /// Positions of the keypoints, in cells; NaN if a position is not certain.
    pub places: [[f32; 2]; N_KEYPOINTS],
}

impl NetworkSample {
    /// Changes the truth to that of a window in which nobody is in the middle: no map has heat.
    fn forget_person(&mut self) {
        self.maps.fill(0.0);
        self.weights = [1.0; N_KEYPOINTS];
        self.front = [0.0; 2];
        self.places = [[f32::NAN; 2]; N_KEYPOINTS];
    }
}

/// A sample as the network normally gets it: the person, cut out along the box around the joints, without random variation.
pub fn plain(person: &Person, shape: &Shape) -> Option<NetworkSample> {
    let view = view(person, shape, [1.0, 0.0], (1.0, [0.0; 2], false))?;
    Some(sample(person, shape, &view, &pixels(person, &view)))
}

/// A randomly varied sample of a person.
///
/// * `other`: another person, who may be beside this one, or cover parts of this one.
pub fn varied(
    person: &Person,
    other: &Person,
    (shape, vary): (&Shape, &Vary),
    rng: &mut Rng,
) -> Option<NetworkSample> {
    let lean = lean(person);
    let degrees = if rng.f32() < vary.upright {
        vary.turn_upright * normal(rng) - lean.to_degrees()
    } else {
        vary.turn * normal(rng)
    };
    let angle = degrees.to_radians();
    let scale = (vary.scale * normal(rng).clamp(-MOST, MOST)).exp();
    let mut shift = [0; 2].map(|_| vary.shift * normal(rng).clamp(-MOST, MOST));
    let is_empty = rng.f32() < vary.empty;
    if is_empty {
        let [least, most] = ASIDE;
        shift[0] = (least + (most - least) * rng.f32()) * if rng.bool() { 1.0 } else { -1.0 };
    }
    let is_mirrored = rng.bool();
    let view = view(
        person,
        shape,
        [angle.cos(), angle.sin()],
        (scale, shift, is_mirrored),
    )?;
    let mut rgb = pixels(person, &view);
    if rng.f32() < vary.beside {
        add_beside(&mut rgb, (person, &view), (other, shape), rng);
    }
    if rng.f32() < vary.covered {
        cover(&mut rgb, other, view.size, rng);
    }
    if rng.f32() < vary.coarse {
        coarsen(&mut rgb, view.size, rng.usize(2..=3));
    }
    recolour(&mut rgb, vary.grey, rng);
    let mut sample = sample(person, shape, &view, &rgb);
    if is_empty {
        sample.forget_person();
    }
    Some(sample)
}

/// The angle between the trunk and upright, clockwise in the picture, in radians; 0 if the trunk is unknown.
fn lean(person: &Person) -> f32 {
    let [x, y] = person.trunk();
    let angle = x.atan2(-y);
    if angle.is_finite() { angle } else { 0.0 }
}

/// Covers a rectangle with one colour, or with a part of another person.
fn cover(rgb: &mut [[f32; 3]], other: &Person, [width, height]: [usize; 2], rng: &mut Rng) {
    let sides = [
        rng.usize(width / 8..=width / 3),
        rng.usize(height / 8..=height / 3),
    ];
    let corner = [
        rng.usize(0..width - sides[0]),
        rng.usize(0..height - sides[1]),
    ];
    let one_colour: [f32; 3] = [0; 3].map(|_| rng.f32() * 255.0);
    let is_other = rng.bool();
    let from = [0; 2].map(|_| rng.usize(SIDE / 4..SIDE / 2) as f32);
    for row in 0..sides[1] {
        for column in 0..sides[0] {
            let at = (corner[1] + row) * width + corner[0] + column;
            rgb[at] = if is_other {
                colour(&other.rgb, [from[0] + column as f32, from[1] + row as f32])
            } else {
                one_colour
            };
        }
    }
}

/// Lowers the resolution: averages squares of pixels, and interpolates between their centres.
pub(in crate::networks) fn coarsen(
    rgb: &mut [[f32; 3]],
    [width, height]: [usize; 2],
    factor: usize,
) {
    let [columns, rows] = [width / factor, height / factor];
    let mut small = vec![[0.0f32; 3]; columns * rows];
    let share = 1.0 / (factor * factor) as f32;
    for row in 0..rows * factor {
        for column in 0..columns * factor {
            let to = &mut small[row / factor * columns + column / factor];
            for (to, from) in to.iter_mut().zip(rgb[row * width + column]) {
                *to += share * from;
            }
        }
    }
    let place = |at: usize, n: usize| {
        let at = ((at as f32 + 0.5) / factor as f32 - 0.5).clamp(0.0, (n - 1) as f32);
        let first = (at as usize).min(n.saturating_sub(2));
        (first, at - first as f32, (first + 1).min(n - 1))
    };
    for row in 0..height {
        let (top, below, bottom) = place(row, rows);
        for column in 0..width {
            let (left, beyond, right) = place(column, columns);
            let at = |row: usize, column: usize| small[row * columns + column];
            let to = &mut rgb[row * width + column];
            for (channel, to) in to.iter_mut().enumerate() {
                let between = |row: usize| {
                    let [a, b] = [at(row, left)[channel], at(row, right)[channel]];
                    a + beyond * (b - a)
                };
                let [a, b] = [between(top), between(bottom)];
                *to = a + below * (b - a);
            }
        }
    }
}

/// Changes contrast, brightness and colours, and adds noise.
///
/// * `grey`: share of pictures that lose their colours.
pub(in crate::networks) fn recolour(rgb: &mut [[f32; 3]], grey: f32, rng: &mut Rng) {
    let contrast = (0.2 * normal(rng)).exp();
    let brightness = 15.0 * normal(rng);
    let tint: [f32; 3] = [0; 3].map(|_| 8.0 * normal(rng));
    let is_grey = rng.f32() < grey;
    let noise = if rng.f32() < 0.3 {
        10.0 * rng.f32()
    } else {
        0.0
    };
    for colour in rgb {
        if is_grey {
            *colour = [colour.iter().sum::<f32>() / 3.0; 3];
        }
        for (value, tint) in colour.iter_mut().zip(tint) {
            // Uniform noise with the requested standard deviation.
            let noise = noise * 3.46 * (rng.f32() - 0.5);
            let changed = (*value - MEAN) * contrast + MEAN + brightness + tint + noise;
            *value = changed.clamp(0.0, 255.0);
        }
    }
}

fn sample(person: &Person, shape: &Shape, view: &View, rgb: &[[f32; 3]]) -> NetworkSample {
    let picture =
        (0..3).flat_map(|channel| rgb.iter().map(move |pixel| (pixel[channel] - MEAN) / DEVIATION));
    let picture = picture.collect();
    let targets = if view.is_mirrored {
        exchange_sides(&person.targets)
    } else {
        person.targets
    };
    let [columns, rows] = shape.cells();
    let in_cells = |at: [f32; 2]| {
        let half = 0.5 * (STRIDE - 1) as f32;
        view.in_input(at).map(|side| (side - half) / STRIDE as f32)
    };
    let is_inside = |[x, y]: [f32; 2]| {
        (-0.5..columns as f32 - 0.5).contains(&x) && (-0.5..rows as f32 - 0.5).contains(&y)
    };
    let mut maps = Vec::with_capacity(N_KEYPOINTS * columns * rows);
    let mut weights = [0.0; N_KEYPOINTS];
    let mut places = [[f32::NAN; 2]; N_KEYPOINTS];
    for (joint, target) in targets.iter().enumerate() {
        let at = in_cells(target.at);
        let or = target.or.map(in_cells);
        let is_known = target.weight > 0.0 && at.iter().all(|side| side.is_finite());
        if is_known {
            weights[joint] = target.weight;
            if is_inside(at) && target.is_marked && or.is_none() {
                places[joint] = at;
            }
        }
        let Some(known) = is_known.then_some([Some(at), or]) else {
            maps.resize(maps.len() + columns * rows, 0.0);
            continue;
        };
        let known: Vec<[f32; 2]> = known.into_iter().flatten().collect();
        let share = 1.0 / known.len() as f32;
        let heats = |axis: usize, n: usize| -> Vec<Vec<f32>> {
            let of = |at: &[f32; 2]| {
                let heat = |cell: usize| (-0.5 * (at[axis] - cell as f32).powi(2)).exp();
                (0..n).map(heat).collect()
            };
            known.iter().map(of).collect()
        };
        let [across, down] = [heats(0, columns), heats(1, rows)];
        for row in 0..rows {
            for column in 0..columns {
                let each = across.iter().zip(&down);
                let sum: f32 = each.map(|(across, down)| across[column] * down[row]).sum();
                maps.push(share * sum);
            }
        }
    }
    NetworkSample {
        picture,
        maps,
        weights,
        front: front(person.front, view),
        places,
    }
}

/// The direction in the rotated and mirrored picture.
fn front([x, y, towards]: [f32; 3], view: &View) -> [f32; 2] {
    let [cosine, sine] = view.turn;
    let x = cosine * x - sine * y;
    [if view.is_mirrored { -x } else { x }, towards]
}

/// Checks that `MIRROR` is its own inverse.
const _: () = {
    let mut joint = 0;
    while joint < N_KEYPOINTS {
        assert!(MIRROR[MIRROR[joint]] == joint, "pairs");
        joint += 1;
    }
};

impl Target {
    /// An unknown keypoint.
    pub const UNKNOWN: Self = Self {
        at: [f32::NAN; 2],
        or: None,
        weight: 0.0,
        is_marked: false,
    };
}
