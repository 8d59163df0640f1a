//! The initial filters: a separate linear support vector machine for every part and type.

use rayon::prelude::*;

use crate::dual::{Constraint, Cost, Effort, Machine};
use crate::example::Example;
use crate::shape::{Coordinates, Shape};
use crate::sparse::Sparse;

/// Settings for training the initial filters.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FilterSettings {
    /// Cost per unit by which a negative window misses its margin.
    pub cost: f64,
    /// Cost per unit by which a positive window misses its margin, as a multiple of the cost of a negative window.
    pub positive_weight: f64,
    /// Stopping criterion for the training of each machine.
    pub effort: Effort,
    /// Seed of the random order of steps.
    pub seed: u64,
}

/// Trains a filter for every type of every part, and combines them into an initial model.
///
/// The biases of the machines become the biases of the types. All springs have the least stiffness. Filters
/// and biases are divided by the number of parts, so that a person scores about 1.
///
/// * `people`: examples of all people, each part with its type.
/// * `background`: features of windows without people, each as large as a filter.
pub(crate) fn first_model(
    shape: &Shape,
    people: &[Example],
    background: &[Vec<f32>],
    settings: &FilterSettings,
) -> Vec<f64> {
    let at = shape.coordinates();
    let all: Vec<(usize, usize)> = (0..shape.n_parts())
        .flat_map(|part| (0..shape.n_types(part)).map(move |mixture| (part, mixture)))
        .collect();
    let trained: Vec<Vec<f64>> = all
        .par_iter()
        .map(|&(part, mixture)| one(&at, at.filter(part, mixture), people, background, settings))
        .collect();
    let mut v = vec![0.0; at.len()];
    let share = 1.0 / shape.n_parts() as f64;
    for ((part, mixture), machine) in all.into_iter().zip(trained) {
        let first = at.filter(part, mixture);
        for (v, it) in v[first..first + at.filter_len()].iter_mut().zip(&machine) {
            *v = share * it;
        }
        let bias = share * BIAS * machine[at.filter_len()];
        if let Some(parent) = shape.parents[part] {
            for parent_type in 0..shape.n_types(parent) {
                v[at.bias(part, parent_type, mixture)] = bias;
            }
        } else {
            let (root, value) = at.root();
            v[root] += bias / (f64::from(value) * shape.n_types(part) as f64);
        }
    }
    v
}

/// Value of the feature for a machine's bias. A large value means little regularisation.
const BIAS: f64 = 10.0;

/// Trains one filter and its bias. The features of its windows begin at `first` in the people's vectors.
fn one(
    at: &Coordinates,
    first: usize,
    people: &[Example],
    background: &[Vec<f32>],
    settings: &FilterSettings,
) -> Vec<f64> {
    let n = at.filter_len();
    let mut machine = Machine::new(n + 1, 0..0);
    let windows = people.iter().filter_map(|person| person.features.run(first));
    let windows = windows.map(|window| (window, settings.positive_weight, 1.0));
    let background = background.iter().map(|background| (background.clone(), 1.0, -1.0));
    for (group, (window, weight, sign)) in windows.chain(background).enumerate() {
        let cost = Cost {
            group,
            of_unit: settings.cost * weight,
        };
        let x = Sparse::new([(0, window), (n, vec![BIAS as f32])]);
        let x = if sign < 0.0 { x.negated() } else { x };
        let demand = Constraint { x, margin: 1.0 };
        machine.add(cost, (), demand, 0.0);
    }
    let mut random = fastrand::Rng::with_seed(settings.seed ^ first as u64);
    machine.solve(settings.effort, &mut random, &mut |_| true);
    machine.solution()
}
