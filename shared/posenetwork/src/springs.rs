//! The tree that holds joints together: springs learned from annotated people.

mod turned;

pub use turned::TurnedSprings;

use fmp::{Edge, Filter, Model, ModelError, ModelSpec, N_CHANNELS, PartSpec, Spring, Springs};
use skeleton::{MIRROR, N_PARTS, PARENT, PARSE14, PART_NAMES};

use crate::maps::N_JOINTS;

/// Height of the grid on which springs are measured: cells that the input of a network is high.
pub const WINDOW_CELLS: f64 = 64.0;
/// Side of a cell on the finest level, pixels.
pub const CELL_PX: usize = 2;
/// Levels for each octave.
pub const INTERVAL: usize = 5;

/// How the tree is learned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpringSettings {
    /// Types of every joint: Gaussians of its position about its parent.
    pub n_types: usize,
    /// Least standard deviation, cells.
    pub least_sigma: f64,
    /// Weight of the logarithms of probabilities.
    pub weight: f64,
}

impl Default for SpringSettings {
    fn default() -> Self {
        Self {
            n_types: 6,
            least_sigma: 1.0,
            weight: 0.1,
        }
    }
}

/// The joint of a part, by number in `skeleton::PARSE14`; `None` for a part between joints.
pub fn joint_of(part: usize) -> Option<usize> {
    PARSE14.joints.iter().position(|it| it.parts == [part])
}

/// Whether a model is a tree of springs, whose evidence is the maps of a network.
pub fn is_tree(model: &Model) -> bool {
    let spec = model.spec();
    let is_cell = |it: &Filter| it.rows == 1 && it.cols == 1;
    spec.parts.len() == N_PARTS
        && spec.filters.len() == N_JOINTS + 1
        && spec.filters.iter().all(is_cell)
}

/// A type of a joint: where it lies from its parent, cells.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Gauss {
    mean: [f64; 2],
    sigma: [f64; 2],
}

/// Learns the tree.
///
/// The relative positions of every joint about its parent joint are clustered; every cluster is a type with a Gaussian
/// spring, and types of joint and parent go together as often as they do in the samples (maximum likelihood). Parts between
/// two joints have no evidence: their springs are those of the joint beyond them, shared out so that the chain is worth
/// exactly as much as the one spring.
///
/// * `people`: the 14 joints of `skeleton::PARSE14` of every person, cells: pixels times [`WINDOW_CELLS`] over the height of
///   the person's window.
///
/// # Errors
///
/// [`ModelError`] if there are too few people, or their numbers are not finite.
pub fn learn(
    people: &[[[f64; 2]; N_JOINTS]],
    settings: &SpringSettings,
) -> Result<Model, ModelError> {
    let mut tree = Tree::default();
    for part in 0..N_PARTS {
        tree.add(part, people, settings);
    }
    let filter = Filter {
        rows: 1,
        cols: 1,
        weights: vec![0.0; N_CHANNELS],
    };
    Model::new(ModelSpec {
        name: "springs".to_owned(),
        parts: tree.parts,
        filters: vec![filter; N_JOINTS + 1],
        root_bias: 0.0,
        interval: INTERVAL,
        cell_px: CELL_PX,
        threshold: -1e6,
        mirror: Some(MIRROR.to_vec()),
    })
}

/// The parts so far.
#[derive(Default)]
struct Tree {
    parts: Vec<PartSpec>,
    /// The types of every person, by part.
    types: Vec<Vec<usize>>,
    gauss: Vec<Vec<Gauss>>,
}

impl Tree {
    fn add(&mut self, part: usize, people: &[[[f64; 2]; N_JOINTS]], settings: &SpringSettings) {
        let (gauss, own) = match (chain(part), PARENT[part]) {
            (Some(chain), Some(_)) if chain.nth == 0 => {
                let offset = |person: &[[f64; 2]; N_JOINTS]| {
                    [0, 1].map(|axis| person[chain.to][axis] - person[chain.from][axis])
                };
                let offsets: Vec<[f64; 2]> = people.iter().map(offset).collect();
                cluster(&offsets, settings)
            }
            (Some(_), Some(parent)) => (self.gauss[parent].clone(), self.types[parent].clone()),
            _ => (Vec::new(), vec![0; people.len()]),
        };
        self.parts.push(PartSpec {
            name: PART_NAMES[part].to_owned(),
            filter_of_type: vec![joint_of(part).unwrap_or(N_JOINTS); gauss.len().max(1)],
            edge: self.edge(part, &gauss, &own, settings.weight),
        });
        self.types.push(own);
        self.gauss.push(gauss);
    }

    fn edge(&self, part: usize, gauss: &[Gauss], own: &[usize], weight: f64) -> Option<Edge> {
        let (chain, parent) = (chain(part)?, PARENT[part]?);
        let springs = gauss.iter().map(|it| spring(it, chain.n, weight));
        let (springs, shifts): (Vec<Spring>, Vec<f64>) = springs.unzip();
        let inside = |of_parent: usize| -> Vec<f64> {
            let same = shifts.iter().enumerate();
            same.map(|(own, shift)| {
                if own == of_parent {
                    *shift
                } else {
                    f64::NEG_INFINITY
                }
            })
            .collect()
        };
        let first = |of_parent: usize| -> Vec<f64> {
            let both = own.iter().zip(&self.types[parent]);
            let with = both.filter(|it| *it.1 == of_parent).map(|it| *it.0);
            let mut counts = vec![0.5; gauss.len()];
            for own in with {
                counts[own] += 1.0;
            }
            let sum: f64 = counts.iter().sum();
            let each = counts.iter().zip(gauss).zip(&shifts);
            each.map(|((count, it), shift)| {
                let area = core::f64::consts::TAU * it.sigma[0] * it.sigma[1];
                weight * ((count / sum).ln() - area.ln()) + shift
            })
            .collect()
        };
        let of_parents = 0..self.parts[parent].filter_of_type.len();
        Some(Edge {
            parent,
            bias: if chain.nth == 0 {
                of_parents.map(first).collect()
            } else {
                of_parents.map(inside).collect()
            },
            springs: Springs::PerChildType(springs),
        })
    }
}

/// The parts from one joint to the next.
struct Chain {
    /// Joints.
    from: usize,
    to: usize,
    /// Which spring of the chain a part has, and how many there are.
    nth: usize,
    n: usize,
}

fn chain(part: usize) -> Option<Chain> {
    let mut nth = 0;
    let mut above = PARENT[part]?;
    let from = loop {
        if let Some(joint) = joint_of(above) {
            break joint;
        }
        (nth, above) = (nth + 1, PARENT[above]?);
    };
    let mut below = part;
    let mut n = nth + 1;
    let to = loop {
        if let Some(joint) = joint_of(below) {
            break joint;
        }
        below = (0..N_PARTS).find(|it| PARENT[*it] == Some(below))?;
        n += 1;
    };
    Some(Chain { from, to, nth, n })
}

/// One of `n` springs in a chain that are worth as much as one, and what it adds to the bias.
///
/// Springs of stiffness `n k` whose rest lengths add up to the mean: the best places between cost `k (d - mean)^2`.
fn spring(of: &Gauss, n: usize, weight: f64) -> (Spring, f64) {
    let share = 1.0 / n as f64;
    let axis = |axis: usize| {
        let mean = of.mean[axis] * share;
        let anchor = mean.round();
        let k = weight * n as f64 / (2.0 * of.sigma[axis].powi(2));
        let rest = mean - anchor;
        // With the child at `v` and the parent at `p`, `d = p + anchor - v`, and `v - p - mean = -(d + rest)`.
        (k, 2.0 * k * rest, anchor as i32, -k * rest * rest)
    };
    let (x, y) = (axis(0), axis(1));
    let spring = Spring {
        w: [x.0, x.1, y.0, y.1],
        anchor: [x.2, y.2],
    };
    (spring, x.3 + y.3)
}

/// Clusters positions (k-means from spread-out starts), and the cluster of each.
fn cluster(offsets: &[[f64; 2]], settings: &SpringSettings) -> (Vec<Gauss>, Vec<usize>) {
    let n = settings.n_types.min(offsets.len()).max(1);
    let squared = |a: &[f64; 2], b: &[f64; 2]| (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2);
    let nearest = |means: &[[f64; 2]], it: &[f64; 2]| {
        let mut best = (0, f64::INFINITY);
        for (nth, mean) in means.iter().enumerate() {
            let distance = squared(mean, it);
            if distance < best.1 {
                best = (nth, distance);
            }
        }
        best
    };
    let mean_of = |chosen: &[[f64; 2]]| {
        let sum = chosen
            .iter()
            .fold([0.0; 2], |sum, it| [sum[0] + it[0], sum[1] + it[1]]);
        sum.map(|it| it / chosen.len().max(1) as f64)
    };
    // Every start is the position that is farthest from the starts before it, of nine tenths that are not outliers.
    let mut means = vec![mean_of(offsets)];
    while means.len() < n {
        let mut far: Vec<(f64, usize)> = offsets
            .iter()
            .enumerate()
            .map(|(nth, it)| (nearest(&means, it).1, nth))
            .collect();
        far.sort_by(|a, b| a.0.total_cmp(&b.0));
        means.push(offsets[far[(far.len() * 9 / 10).min(far.len() - 1)].1]);
    }
    let mut own = vec![0; offsets.len()];
    for _ in 0..50 {
        for (own, it) in own.iter_mut().zip(offsets) {
            *own = nearest(&means, it).0;
        }
        for (nth, mean) in means.iter_mut().enumerate() {
            let chosen: Vec<[f64; 2]> = members(offsets, &own, nth);
            if !chosen.is_empty() {
                *mean = mean_of(&chosen);
            }
        }
    }
    let gauss = |nth: usize| {
        let chosen = members(offsets, &own, nth);
        let mean = means[nth];
        let sigma = [0, 1].map(|axis| {
            let sum: f64 = chosen
                .iter()
                .map(|it| (it[axis] - mean[axis]).powi(2))
                .sum();
            (sum / chosen.len().max(1) as f64)
                .sqrt()
                .max(settings.least_sigma)
        });
        Gauss { mean, sigma }
    };
    ((0..n).map(gauss).collect(), own)
}

fn members(offsets: &[[f64; 2]], own: &[usize], nth: usize) -> Vec<[f64; 2]> {
    let both = offsets.iter().zip(own);
    both.filter(|it| *it.1 == nth).map(|it| *it.0).collect()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use fmp::{Layout, Responses, Scope, Solver};

    use super::*;

    /// People who stand, each a little different.
    pub(super) fn people() -> Vec<[[f64; 2]; N_JOINTS]> {
        let standing = [
            [10.0, 60.0],
            [10.0, 48.0],
            [10.0, 36.0],
            [16.0, 36.0],
            [16.0, 48.0],
            [16.0, 60.0],
            [4.0, 36.0],
            [5.0, 26.0],
            [8.0, 16.0],
            [18.0, 16.0],
            [21.0, 26.0],
            [22.0, 36.0],
            [13.0, 14.0],
            [13.0, 6.0],
        ];
        let moved = |nth: usize| {
            let mut person = standing;
            for (joint, at) in person.iter_mut().enumerate() {
                at[0] += ((nth * 7 + joint * 3) % 5) as f64 - 2.0;
                at[1] += ((nth * 5 + joint * 2) % 3) as f64 - 1.0;
            }
            person
        };
        (0..60).map(moved).collect()
    }

    #[test]
    fn every_part_between_joints_has_a_chain_of_springs_from_joint_to_joint() {
        let lengths: Vec<usize> = (0..N_PARTS).filter_map(chain).map(|it| it.n).collect();
        assert_eq!(
            lengths.iter().filter(|it| **it == 1).count(),
            3,
            "neck and shoulders"
        );
        assert_eq!(
            lengths.iter().filter(|it| **it == 2).count(),
            16,
            "arms and legs"
        );
        assert_eq!(lengths.iter().filter(|it| **it == 3).count(), 6, "trunk");
    }

    #[test]
    fn a_chain_is_worth_as_much_as_the_spring_that_it_replaces() {
        let of = Gauss {
            mean: [7.3, -11.8],
            sigma: [1.7, 2.4],
        };
        for n in 1..=3 {
            let (spring, shift) = spring(&of, n, 0.7);
            // The best way to share an offset out is evenly, to a fraction of a cell.
            for offset in [[6.0, -12.0], [9.0, -3.0]] {
                let step = offset.map(|it: f64| it / n as f64);
                let d = [0, 1].map(|axis| f64::from(spring.anchor[axis]) - step[axis]);
                let [a, b, c, e] = spring.w;
                let one = a * d[0] * d[0] + b * d[0] + c * d[1] * d[1] + e * d[1] - shift;
                let z = [0, 1].map(|axis: usize| (offset[axis] - of.mean[axis]) / of.sigma[axis]);
                let whole = 0.7 * 0.5 * (z[0] * z[0] + z[1] * z[1]);
                assert!((one * n as f64 - whole).abs() < 1e-9, "{n}: {one} {whole}");
            }
        }
    }

    #[test]
    fn a_joint_that_nothing_shows_is_where_such_people_have_it() {
        let people = people();
        let model = Arc::new(learn(&people, &SpringSettings::default()).unwrap());
        let layout = Layout::new(&model, 128, 160).unwrap();
        let scope = Scope::new(&layout, 0..1, Scope::whole(&layout).region()).unwrap();
        let mut values = vec![0.0; layout.n_values(&scope)];
        let window = layout.window(&scope, 0);
        let area = window.rows * window.cols;
        let truth = people[3];
        let hidden = 6;
        for joint in (0..N_JOINTS).filter(|it| *it != hidden) {
            let map = &mut values[joint * area..(joint + 1) * area];
            map.fill(-4.0);
            map[(truth[joint][1] as usize + 8) * window.cols + truth[joint][0] as usize + 8] = 0.0;
        }
        let evidence = Responses::within(&layout, &values, &[0], scope);
        let pose = Solver::new(Arc::clone(&model))
            .best(&evidence, None)
            .unwrap();
        for (joint, truth) in truth.iter().enumerate() {
            let part = PARSE14.joints[joint].parts[0];
            let at = [f64::from(pose.parts[part].x), f64::from(pose.parts[part].y)];
            let off = [0, 1].map(|axis| (at[axis] - 8.0 - truth[axis]).abs());
            let most = if joint == hidden { 5.0 } else { 0.5 };
            assert!(off.iter().all(|it| *it <= most), "{joint}: {off:?}");
        }
    }

    #[test]
    fn people_who_are_nowhere_are_refused() {
        let mut people = people();
        people[5][3] = [f64::NAN; 2];
        let refused = learn(&people, &SpringSettings::default()).unwrap_err();
        assert!(refused.to_string().contains("NaN"), "{refused}");
    }
}
