//! A second person in the picture of a person: beside the first, in front of the first, or behind.

use fastrand::Rng;

use super::person::{Person, Target};
use super::window::{View, colour, view};
use super::{N_JOINTS, Shape};
use crate::networks::parameters::normal;

/// Limbs that cover the body, as pairs of joints of `skeleton::PARSE14`, with their radius as a share of the length of the trunk.
const BODY: [([usize; 2], f32); 15] = [
    ([0, 1], 0.15),
    ([1, 2], 0.2),
    ([3, 4], 0.2),
    ([4, 5], 0.15),
    ([6, 7], 0.14),
    ([7, 8], 0.16),
    ([9, 10], 0.16),
    ([10, 11], 0.14),
    ([12, 13], 0.24),
    ([8, 9], 0.18),
    ([2, 3], 0.2),
    ([2, 8], 0.2),
    ([3, 9], 0.2),
    ([2, 9], 0.2),
    ([3, 8], 0.2),
];
/// Distance between the middles of both people, in heights of the input: from the smallest to the largest.
const APART: [f32; 2] = [0.08, 0.4];
/// Standard deviation of the logarithm of the second person's size relative to the first.
const SIZES: f32 = 0.15;

/// Adds a second person to the input picture of a person. Half of the time, the second person is behind the first.
///
/// The second person is cut out along limbs with the thickness of [`BODY`]; so is the first, if it is in front.
pub(super) fn add_beside(
    rgb: &mut [[f32; 3]],
    (person, place): (&Person, &View),
    (other, shape): (&Person, &Shape),
    rng: &mut Rng,
) {
    let is_left = rng.bool();
    let [least, most] = APART;
    let apart = least + (most - least) * rng.f32();
    let shift = [if is_left { apart } else { -apart }, 0.04 * normal(rng)];
    let scale = (SIZES * normal(rng)).exp();
    let is_behind = rng.bool();
    let Some(from) = view(other, shape, [1.0, 0.0], (scale, shift, rng.bool())) else {
        return;
    };
    let silhouette = Silhouette::new(other, &from);
    let own = is_behind.then(|| Silhouette::new(person, place));
    let [width, height] = place.size;
    for row in 0..height {
        for column in 0..width {
            let at = [column as f32, row as f32];
            let is_hidden = own.as_ref().is_some_and(|own| own.covers(at));
            if silhouette.covers(at) && !is_hidden {
                rgb[row * width + column] = colour(&other.rgb, from.in_picture(at));
            }
        }
    }
}

/// Limbs of a person in the input.
struct Silhouette {
    limbs: Vec<Limb>,
}

/// A limb: everything within a radius of a line, in pixels.
struct Limb {
    from: [f32; 2],
    along: [f32; 2],
    radius: f32,
}

impl Silhouette {
    fn new(person: &Person, view: &View) -> Self {
        let joints: [Option<[f32; 2]>; N_JOINTS] = core::array::from_fn(|joint| {
            let Target { at, weight, .. } = person.targets[joint];
            let is_known = weight > 0.0 && at.iter().all(|side| side.is_finite());
            is_known.then(|| view.in_input(at))
        });
        let [x, y] = person.trunk().map(|side| side / view.step);
        let trunk = x.hypot(y);
        let limbs = BODY.iter().filter_map(|([from, to], radius)| {
            let [from, to] = [joints[*from]?, joints[*to]?];
            let radius = radius * trunk;
            radius.is_finite().then_some(Limb {
                from,
                along: [to[0] - from[0], to[1] - from[1]],
                radius,
            })
        });
        Self {
            limbs: limbs.collect(),
        }
    }

    fn covers(&self, at: [f32; 2]) -> bool {
        self.limbs.iter().any(|limb| {
            let [x, y] = [at[0] - limb.from[0], at[1] - limb.from[1]];
            let [dx, dy] = limb.along;
            let length = (dx * dx + dy * dy).max(1e-6);
            let share = ((dx * x + dy * y) / length).clamp(0.0, 1.0);
            let [x, y] = [x - share * dx, y - share * dy];
            x * x + y * y < limb.radius * limb.radius
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::person::{SIDE, Source};
    use super::*;

    /// A person with one colour, as a cross of limbs.
    fn person(grey: u8) -> Person {
        let place = |x: f32, y: f32| Target {
            at: [x, y],
            or: None,
            weight: 1.0,
            is_marked: true,
        };
        let mut targets = [Target::UNKNOWN; super::super::N_KEYPOINTS];
        let joints = [
            (120.0, 200.0),
            (120.0, 170.0),
            (120.0, 140.0),
            (136.0, 140.0),
            (136.0, 170.0),
            (136.0, 200.0),
            (110.0, 140.0),
            (112.0, 120.0),
            (118.0, 90.0),
            (138.0, 90.0),
            (144.0, 120.0),
            (146.0, 140.0),
            (128.0, 85.0),
            (128.0, 60.0),
        ];
        for (target, (x, y)) in targets.iter_mut().zip(joints) {
            *target = place(x, y);
        }
        Person {
            source: Source::Scene,
            name: String::new(),
            rgb: vec![grey; 3 * SIDE * SIDE],
            targets,
            front: [0.0; 3],
        }
    }

    #[test]
    fn a_second_person_is_added_beside_the_first_and_does_not_hide_a_first_person_in_front() {
        let shape = Shape::default();
        let (first, second) = (person(10), person(200));
        let place = view(&first, &shape, [1.0, 0.0], (1.0, [0.0; 2], false)).unwrap();
        let trunk = [2, 3, 8, 9].map(|joint: usize| {
            let [x, y] = place.in_input(first.targets[joint].at);
            y as usize * shape.width + x as usize
        });
        let [mut n_before, mut n_behind] = [0, 0];
        for seed in 0..64 {
            let mut rgb = vec![[10.0; 3]; shape.width * shape.height];
            let mut rng = Rng::with_seed(seed);
            add_beside(&mut rgb, (&first, &place), (&second, &shape), &mut rng);
            let n_changed = rgb.iter().filter(|colour| colour[0] > 100.0).count();
            assert!(n_changed > 100, "seed {seed}: {n_changed} pixels");
            assert!(n_changed < rgb.len() / 2, "seed {seed}: {n_changed} pixels");
            if trunk.iter().any(|at| rgb[*at][0] > 100.0) {
                n_before += 1;
            } else {
                n_behind += 1;
            }
        }
        assert!(n_before > 2, "{n_before} of 64 cover the trunk");
        assert!(n_behind >= 32, "{n_behind} of 64 leave the trunk visible");
    }
}
