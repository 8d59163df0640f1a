//! The record of a computation, and the backward pass through it.

use fastrand::Rng;
use rayon::prelude::*;

use super::matrix::add_to;
use crate::networks::lesson::{Lesson, Running, Shown, Statistics};
use crate::networks::ops::{Dims, Network};
use crate::networks::parameters::Parameter;

/// Index of a value in the record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct At(usize);

/// Computes the gradients of the inputs of a value from the gradient of the value.
pub(super) type Back<'a> = Box<dyn Fn(&Record<'a>, &[f32], &mut Gradients) + 'a>;

struct Value<'a> {
    /// Dimensions, without the dimension of the batch.
    dims: Dims,
    values: Vec<f32>,
    /// Backward pass; `None` for values that have no gradient.
    back: Option<Back<'a>>,
}

/// The values computed for a batch.
pub(super) struct Record<'a> {
    pub(super) n: usize,
    pub(super) parameters: &'a [Parameter],
    /// For each parameter, true if it is trained; empty outside training.
    learned: &'a [bool],
    /// Random generator for training; `None` otherwise.
    pub(super) dice: Option<Rng>,
    inputs: Vec<(&'static str, Dims, &'a [f32])>,
    values: Vec<Value<'a>>,
    /// Index of the next parameter.
    next: usize,
    pub(super) statistics: Vec<Statistics>,
}

/// Gradients in the backward pass.
#[derive(Debug)]
pub(super) struct Gradients {
    of_values: Vec<Option<Vec<f32>>>,
    of_parameters: Vec<Option<Vec<f32>>>,
}

impl Gradients {
    /// Adds to the gradient of a value.
    pub(super) fn add(&mut self, At(at): At, gradient: Vec<f32>) {
        match &mut self.of_values[at] {
            Some(sum) => sum
                .par_chunks_mut(1 << 16)
                .zip(gradient.par_chunks(1 << 16))
                .for_each(|(sum, gradient)| add_to(sum, gradient)),
            nothing => *nothing = Some(gradient),
        }
    }

    /// Sets the gradient of a parameter.
    pub(super) fn of_parameter(&mut self, at: usize, gradient: Vec<f32>) {
        self.of_parameters[at] = Some(gradient);
    }
}

impl<'a> Record<'a> {
    pub(super) fn new(
        network: &impl Network,
        parameters: &'a [Parameter],
        shown: &'a Shown,
    ) -> Self {
        let inputs = network.inputs().into_iter().zip(&shown.inputs);
        Self {
            n: shown.n,
            parameters,
            learned: &[],
            dice: None,
            inputs: inputs.map(|((name, dims), values)| (name, dims, values.as_slice())).collect(),
            values: Vec::new(),
            next: 0,
            statistics: Vec::new(),
        }
    }

    /// The same record, prepared for training.
    pub(super) fn learning(self, running: Running<'a>) -> Self {
        Self {
            learned: running.learned,
            dice: Some(running.dice),
            ..self
        }
    }

    /// Dimensions and values of an input.
    pub(super) fn shown(&self, name: &str) -> (Dims, Vec<f32>) {
        let found = self.inputs.iter().find(|input| input.0 == name);
        found.map_or_else(Default::default, |(_, dims, values)| {
            (dims.clone(), values.to_vec())
        })
    }

    /// Takes the next parameters of a layer.
    pub(super) fn parameters<const N: usize>(
        &mut self,
        name: &str,
        roles: [&str; N],
    ) -> [usize; N] {
        roles.map(|role| self.parameter(&format!("{name}.{role}")))
    }

    /// Takes the next parameter.
    pub(super) fn parameter(&mut self, name: &str) -> usize {
        let at = self.next;
        self.next += 1;
        assert_eq!(
            self.parameters[at].name, name,
            "parameters must be in the order of the layers"
        );
        at
    }

    /// The numbers of a parameter.
    pub(super) fn of_parameter(&self, at: usize) -> &'a [f32] {
        &self.parameters[at].values
    }

    /// Returns true if the gradient of at least one of the parameters is requested.
    pub(super) fn learns(&self, parameters: &[usize]) -> bool {
        let is_learned = |at: &usize| self.learned.get(*at).copied().unwrap_or(false);
        parameters.iter().any(is_learned)
    }

    /// Returns true if a value depends on a trained parameter.
    pub(super) fn leads(&self, At(at): At) -> bool {
        self.values[at].back.is_some()
    }

    /// Dimensions of a value, without the batch.
    pub(super) fn dims(&self, At(at): At) -> &[usize] {
        &self.values[at].dims
    }

    /// Numbers of channels and cells of a map.
    pub(super) fn channels(&self, at: At) -> [usize; 2] {
        let dims = self.dims(at);
        [dims[0], dims[1..].iter().product()]
    }

    /// Number of values per sample.
    pub(super) fn size(&self, at: At) -> usize {
        self.dims(at).iter().product()
    }

    /// The numbers of a recorded value.
    pub(super) fn values(&self, At(at): At) -> &[f32] {
        &self.values[at].values
    }

    /// A copy of the numbers of a recorded value.
    pub(super) fn take(&self, at: At) -> Vec<f32> {
        self.values(at).to_vec()
    }

    /// Records a value.
    pub(super) fn record(&mut self, dims: Dims, values: Vec<f32>, back: Option<Back<'a>>) -> At {
        self.values.push(Value { dims, values, back });
        At(self.values.len() - 1)
    }

    /// Records a value that was computed from one other value.
    ///
    /// * `back`: computes the gradient of the other value from that of the recorded value.
    pub(super) fn derived(
        &mut self,
        from: At,
        (dims, values): (Dims, Vec<f32>),
        back: impl Fn(&Self, &[f32]) -> Vec<f32> + 'a,
    ) -> At {
        let back: Option<Back<'a>> = self.leads(from).then(|| {
            let back: Back<'a> =
                Box::new(move |record, gradient, all| all.add(from, back(record, gradient)));
            back
        });
        self.record(dims, values, back)
    }

    /// The backward pass: from the gradients of the outputs to those of the parameters.
    pub(super) fn backward(self, outputs: Vec<(At, Vec<f32>)>) -> Lesson {
        let mut all = Gradients {
            of_values: vec![None; self.values.len()],
            of_parameters: vec![None; self.parameters.len()],
        };
        for (output, gradient) in outputs {
            all.add(output, gradient);
        }
        for at in (0..self.values.len()).rev() {
            let gradient = all.of_values[at].take();
            if let (Some(gradient), Some(back)) = (gradient, &self.values[at].back) {
                back(&self, &gradient, &mut all);
            }
        }
        Lesson {
            gradients: all.of_parameters,
            statistics: self.statistics,
        }
    }
}

/// Computes values sample by sample.
///
/// * `size`: number of values per sample.
/// * `compute`: writes the values of the sample with a given index; they are initially 0.
pub(super) fn by_sample(
    n: usize,
    size: usize,
    compute: impl Fn(usize, &mut [f32]) + Sync,
) -> Vec<f32> {
    let mut all = vec![0.0; n * size];
    let samples = all.par_chunks_exact_mut(size).enumerate();
    samples.for_each(|(at, values)| compute(at, values));
    all
}

/// Computes a value from every pair of corresponding values in two lists.
pub(super) fn each(a: &[f32], b: &[f32], compute: impl Fn(f32, f32) -> f32 + Sync) -> Vec<f32> {
    const AT_ONCE: usize = 1 << 14;
    let mut all = vec![0.0; a.len()];
    all.par_chunks_mut(AT_ONCE)
        .zip(a.par_chunks(AT_ONCE).zip(b.par_chunks(AT_ONCE)))
        .for_each(|(to, (a, b))| {
            for (to, (a, b)) in to.iter_mut().zip(a.iter().zip(b)) {
                *to = compute(*a, *b);
            }
        });
    all
}
