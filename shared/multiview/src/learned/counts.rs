//! Co-occurrence counts of the types of a part in two views.

use std::sync::Arc;

use crate::{Compatibility, TypeTables};
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

/// Co-occurrences of part types in pairs of views.
///
/// There is one row-major matrix `[type in first view][type in second view]` for every part `i` of the first view. The part of the
/// second view is the one that shows the same limb.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Counts {
    /// Counts for two views that see the person from the same side.
    pub same: Vec<Vec<u32>>,
    /// Counts for two views on opposite sides of the person, so that left and right are swapped.
    pub exchanged: Vec<Vec<u32>>,
}

/// The value of the appearance term for two types.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Appearance {
    /// Joint probability: the paper's `p(a, b)`.
    Joint,
    /// Lift over chance: `ln(p(a, b) / (p(a) p(b)))`.
    Lift,
}

/// The number of types of every part, and the part on the other side of the body.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Shape {
    /// Number of types of every part.
    pub n_types: Vec<usize>,
    /// For every part, the part on the other side; the parts themselves if the model has no sides.
    pub mirror: Vec<usize>,
}

impl Shape {
    /// Returns the part of the second view that shows the same limb as `part` of the first view.
    pub(crate) fn partner(&self, part: usize, exchanged: bool) -> usize {
        if exchanged { self.mirror[part] } else { part }
    }

    fn sizes(&self, exchanged: bool) -> impl Iterator<Item = [usize; 2]> + '_ {
        let size = move |part: usize| {
            let partner = self.partner(part, exchanged);
            [self.n_types[part], self.n_types[partner]]
        };
        (0..self.n_types.len()).map(size)
    }
}

impl Counts {
    /// Creates empty counts.
    pub fn new(shape: &Shape) -> Self {
        let empty = |exchanged| {
            let sizes = shape.sizes(exchanged);
            sizes.map(|[rows, cols]| vec![0; rows * cols]).collect()
        };
        Self {
            same: empty(false),
            exchanged: empty(true),
        }
    }

    /// Counts one part of one pair of views.
    ///
    /// * `types`: types of the part in the first view, and of its partner in the second.
    ///
    /// # Panics
    ///
    /// If the part or one of the types is out of range for the shape.
    pub fn add(&mut self, shape: &Shape, part: usize, types: [usize; 2], exchanged: bool) {
        let n = shape.n_types[shape.partner(part, exchanged)];
        let cells = &mut self.of_mut(exchanged)[part];
        let cell = &mut cells[types[0] * n + types[1]];
        *cell = cell.saturating_add(1);
    }

    /// Returns the number of co-occurrences over all parts.
    pub fn total(&self) -> u64 {
        let both = self.same.iter().chain(&self.exchanged).flatten();
        both.map(|count| u64::from(*count)).sum()
    }

    /// Returns true if there is a matrix of the right size for every part.
    pub(crate) fn fits(&self, shape: &Shape) -> bool {
        [false, true].into_iter().all(|exchanged| {
            let cells = self.of(exchanged).iter().map(Vec::len);
            cells.eq(shape.sizes(exchanged).map(|size| size[0] * size[1]))
        })
    }

    pub(crate) fn of(&self, exchanged: bool) -> &[Vec<u32>] {
        if exchanged {
            &self.exchanged
        } else {
            &self.same
        }
    }

    fn of_mut(&mut self, exchanged: bool) -> &mut [Vec<u32>] {
        if exchanged {
            &mut self.exchanged
        } else {
            &mut self.same
        }
    }

    /// Returns `p(type in first view, type in second view)` for every part.
    ///
    /// To the counts, `weight` observations of independent types are added, so that rare pairs of types and rare angles have little
    /// influence.
    ///
    /// * `marginals`: frequency of every type of every part; see [`marginals`].
    pub fn joint(
        &self,
        shape: &Shape,
        marginals: &[Vec<f64>],
        weight: f64,
        exchanged: bool,
    ) -> Vec<DMatrix<f64>> {
        let sizes = shape.sizes(exchanged).enumerate();
        let matrix = |(part, [rows, cols]): (usize, [usize; 2])| {
            let cells = &self.of(exchanged)[part];
            let n: f64 = cells.iter().map(|cell| f64::from(*cell)).sum();
            let partner = shape.partner(part, exchanged);
            DMatrix::from_fn(rows, cols, |a, b| {
                let by_chance = marginals[part][a] * marginals[partner][b];
                (f64::from(cells[a * cols + b]) + weight * by_chance) / (n + weight)
            })
        };
        sizes.map(matrix).collect()
    }

    /// Returns the tables of a pair of views.
    pub fn tables(
        &self,
        shape: &Shape,
        marginals: &[Vec<f64>],
        weight: f64,
        appearance: Appearance,
    ) -> TypeTables {
        let [same, exchanged] =
            [false, true].map(|exchanged| self.joint(shape, marginals, weight, exchanged));
        let valued = |joint: &[DMatrix<f64>]| {
            Arc::new(Compatibility::of(match appearance {
                Appearance::Joint => joint.to_vec(),
                Appearance::Lift => joint.iter().map(lift).collect(),
            }))
        };
        let joint = Compatibility::of(same.clone());
        TypeTables {
            conditional: [&joint, &joint.transposed()].map(|table| Arc::new(table.conditional())),
            joint: valued(&same),
            exchanged: Some(valued(&exchanged)),
        }
    }
}

/// Returns the lift of each pair of types: the logarithm of its frequency over the frequency for independent types.
fn lift(joint: &DMatrix<f64>) -> DMatrix<f64> {
    let (rows, cols) = (joint.column_sum(), joint.row_sum());
    DMatrix::from_fn(joint.nrows(), joint.ncols(), |a, b| {
        let by_chance = rows[a] * cols[b];
        if by_chance > 0.0 && joint[(a, b)] > 0.0 {
            (joint[(a, b)] / by_chance).ln()
        } else {
            0.0
        }
    })
}

/// Returns the frequency of every type of every part over all counts. One extra observation of each type is added.
pub fn marginals(shape: &Shape, all: &[&Counts]) -> Vec<Vec<f64>> {
    let mut sums: Vec<Vec<f64>> = shape.n_types.iter().map(|&n| vec![1.0; n]).collect();
    for counts in all {
        for exchanged in [false, true] {
            for (part, cells) in counts.of(exchanged).iter().enumerate() {
                let partner = shape.partner(part, exchanged);
                let cols = shape.n_types[partner];
                for (cell, n) in cells.iter().enumerate() {
                    sums[part][cell / cols] += f64::from(*n);
                    sums[partner][cell % cols] += f64::from(*n);
                }
            }
        }
    }
    for types in &mut sums {
        let sum: f64 = types.iter().sum();
        for it in types.iter_mut() {
            *it /= sum;
        }
    }
    sums
}
