//! Symmetrises the model, so that both sides of the body have mirrored parameters.

use fmp::N_CHANNELS;
use kernels::MIRRORED_CHANNEL;

use crate::shape::{Coordinates, Shape};

/// For every parameter, its index in the mirror image and its sign.
///
/// The training set contains the mirror image of each person, so the best model is its own mirror image. An approximate model is not
/// symmetric. The mean of a model and its mirror image has at most the same cost, since the objective is convex.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Symmetry {
    mirrored: Vec<(u32, f64)>,
}

impl Symmetry {
    /// Finds the symmetry of a shape whose types are mirrored as by [`cluster`](crate::types::cluster).
    /// Returns `None` if the types are not mirrored or the shape has no mirror.
    pub(crate) fn of(shape: &Shape) -> Option<Self> {
        let mirror = shape.mirror.as_deref()?;
        let of = |part: usize, k: usize| {
            if mirror[part] == part {
                pair_of(k, shape.n_types(part))
            } else {
                k
            }
        };
        let fits = |part: usize| {
            let (own, other) = (&shape.anchors[part], &shape.anchors[mirror[part]]);
            let flipped =
                |(k, it): (usize, &[i32; 2])| other.get(of(part, k)) == Some(&[-it[0], it[1]]);
            own.len() == other.len() && own.iter().enumerate().all(flipped)
        };
        if !(0..shape.n_parts()).all(fits) {
            return None;
        }
        let at = shape.coordinates();
        let plain = (0..at.len()).map(|i| (i as u32, 1.0));
        let mut mirrored: Vec<(u32, f64)> = plain.collect();
        for part in 0..shape.n_parts() {
            for k in 0..shape.n_types(part) {
                let (own, their) = ((part, k), (mirror[part], of(part, k)));
                filters((&at, shape.side), &mut mirrored, own, their);
                springs(&at, &mut mirrored, own, their);
                let parent = shape.parents[part];
                for of_parent in 0..parent.map_or(0, |parent| shape.n_types(parent)) {
                    let parent = parent.unwrap_or_default();
                    let to = at.bias(their.0, of(parent, of_parent), their.1);
                    mirrored[at.bias(part, of_parent, k)].0 = to as u32;
                }
            }
        }
        Some(Self { mirrored })
    }

    /// Returns the mean of a parameter vector and its mirror image.
    pub(crate) fn balance(&self, v: &[f64]) -> Vec<f64> {
        let theirs = self.mirrored.iter().map(|&(at, sign)| sign * v[at as usize]);
        v.iter().zip(theirs).map(|(own, theirs)| 0.5 * (own + theirs)).collect()
    }
}

/// A part and one of its types.
type Typed = (usize, usize);

fn filters(
    (at, side): (&Coordinates, usize),
    mirrored: &mut [(u32, f64)],
    own: Typed,
    their: Typed,
) {
    let [from, to] = [own, their].map(|(part, k)| at.filter(part, k));
    for cell in 0..side * side {
        let (row, col) = (cell / side, cell % side);
        let flipped = row * side + side - 1 - col;
        for (channel, its) in MIRRORED_CHANNEL.iter().enumerate() {
            let to = to + flipped * N_CHANNELS + its;
            mirrored[from + cell * N_CHANNELS + channel].0 = to as u32;
        }
    }
}

fn springs(at: &Coordinates, mirrored: &mut [(u32, f64)], own: Typed, their: Typed) {
    for (axis, sign) in [-1.0, 1.0].into_iter().enumerate() {
        let [from, to] = [own, their].map(|(part, k)| at.quadratic(part, k) + axis);
        mirrored[from].0 = to as u32;
        let [from, to] = [own, their].map(|(part, k)| at.linear(part, k) + axis);
        mirrored[from] = (to as u32, sign);
    }
}

/// The mirror image of a type of a part in the middle. These types come in pairs, unless there is only one.
fn pair_of(k: usize, n_types: usize) -> usize {
    if n_types == 1 { k } else { k ^ 1 }
}

#[cfg(test)]
mod tests {
    use fmp::{Placement, Pose};
    use kernels::FeatureMap;
    use proptest::prelude::*;

    use super::*;
    use crate::example::Example;

    const SIDES: [usize; 4] = [0, 1, 3, 2];
    const COLS: usize = 9;
    const ROWS: usize = 8;

    /// A shape with a head, a trunk, and an arm on each side.
    fn shape() -> Shape {
        Shape {
            name: "small".to_owned(),
            part_names: ["head", "trunk", "right", "left"].map(str::to_owned).to_vec(),
            parents: vec![None, Some(0), Some(1), Some(1)],
            mirror: Some(SIDES.to_vec()),
            anchors: vec![
                vec![[0, 0]],
                vec![[1, 3], [-1, 3]],
                vec![[-2, 1], [-1, 2], [0, -2]],
                vec![[2, 1], [1, 2], [0, -2]],
            ],
            side: 3,
            cell_px: 4,
            interval: 4,
        }
    }

    fn numbers(n: usize, seed: u64) -> Vec<f64> {
        let mut random = fastrand::Rng::with_seed(seed);
        (0..n).map(|_| random.f64() - 0.5).collect()
    }

    fn score(v: &[f64], cells: &[f32], pose: &Pose) -> f64 {
        let map = FeatureMap {
            rows: ROWS,
            cols: COLS,
            cells,
        };
        let (shape, v) = (
            shape(),
            v.iter().map(|value| *value as f32).collect::<Vec<_>>(),
        );
        let example = Example::of(&shape, &shape.coordinates(), &map, pose);
        example.features.dot(&v) + example.fixed
    }

    fn pose(parts: Vec<(u16, u16, u8)>) -> Pose {
        let part = |(x, y, mixture)| Placement { x, y, mixture };
        Pose {
            score: 0.0,
            level: 0,
            parts: parts.into_iter().map(part).collect(),
        }
    }

    fn mirrored_pose(it: &Pose) -> Pose {
        let shape = shape();
        let part = |part: usize| {
            let Placement { x, y, mixture } = it.parts[SIDES[part]];
            let k = usize::from(mixture);
            let in_pairs = SIDES[part] == part;
            let k = if in_pairs {
                pair_of(k, shape.n_types(part))
            } else {
                k
            };
            (COLS as u16 - 3 - x, y, k as u8)
        };
        pose((0..4).map(part).collect())
    }

    fn mirrored_cells(cells: &[f32]) -> Vec<f32> {
        let mut to = vec![0.0; cells.len()];
        for (at, cell) in cells.chunks_exact(N_CHANNELS).enumerate() {
            let there = at / COLS * COLS + COLS - 1 - at % COLS;
            for (value, channel) in cell.iter().zip(MIRRORED_CHANNEL) {
                to[there * N_CHANNELS + channel] = *value;
            }
        }
        to
    }

    proptest! {
        #[test]
        fn a_balanced_model_gives_a_pose_and_its_mirror_image_the_same_score(
            places in prop::collection::vec((0..7_u16, 0..6_u16, 0..6_u8), 4),
            seed in any::<u64>(),
        ) {
            let shape = shape();
            let symmetry = Symmetry::of(&shape).unwrap();
            let v = symmetry.balance(&numbers(shape.coordinates().len(), seed));
            let cells: Vec<f32> = numbers(ROWS * COLS * N_CHANNELS, !seed)
                .into_iter()
                .map(|number| number as f32)
                .collect();
            let typed = |(part, (x, y, k)): (usize, (u16, u16, u8))| {
                (x, y, k % shape.n_types(part) as u8)
            };
            let plain = pose(places.into_iter().enumerate().map(typed).collect());
            let [here, there] = [
                score(&v, &cells, &plain),
                score(&v, &mirrored_cells(&cells), &mirrored_pose(&plain)),
            ];
            prop_assert!((here - there).abs() < 1e-4 * (1.0 + here.abs()), "{} {}", here, there);
        }

        #[test]
        fn balancing_twice_changes_nothing(seed in any::<u64>()) {
            let shape = shape();
            let symmetry = Symmetry::of(&shape).unwrap();
            let once = symmetry.balance(&numbers(shape.coordinates().len(), seed));
            prop_assert_eq!(symmetry.balance(&once), once);
        }
    }

    #[test]
    fn a_tree_with_different_sides_has_no_symmetry() {
        let mut other = shape();
        other.anchors[3][0] = [3, 1];
        assert_eq!(Symmetry::of(&other), None);
        let mut without = shape();
        without.mirror = None;
        assert_eq!(Symmetry::of(&without), None);
    }
}
