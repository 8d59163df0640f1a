//! The record of what was computed, and the way back through it.

use fastrand::Rng;
use rayon::prelude::*;

use super::matrix::add_to;
use crate::networks::lesson::{Lesson, Running, Shown, Statistics};
use crate::networks::ops::{Dims, Network};
use crate::networks::parameters::Parameter;

/// The number of a value in the record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct At(usize);

/// Gives the gradients of what a value was computed from, from its own.
pub(super) type Back<'a> = Box<dyn Fn(&Record<'a>, &[f32], &mut Gradients) + 'a>;

struct Value<'a> {
    /// Without the batch.
    dims: Dims,
    values: Vec<f32>,
    /// Nothing for values through which nothing is learned.
    back: Option<Back<'a>>,
}

/// The values that were computed of a batch.
pub(super) struct Record<'a> {
    pub(super) n: usize,
    pub(super) parameters: &'a [Parameter],
    /// Empty outside training.
    learned: &'a [bool],
    /// Nothing outside training.
    pub(super) dice: Option<Rng>,
    inputs: Vec<(&'static str, Dims, &'a [f32])>,
    values: Vec<Value<'a>>,
    /// Number of the next parameter.
    next: usize,
    pub(super) statistics: Vec<Statistics>,
}

/// Gradients on the way back.
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

    /// The same for training.
    pub(super) fn learning(self, running: Running<'a>) -> Self {
        Self {
            learned: running.learned,
            dice: Some(running.dice),
            ..self
        }
    }

    /// Sizes and numbers of an input.
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
            "parameters in the order of the layers"
        );
        at
    }

    /// The numbers of a parameter.
    pub(super) fn of_parameter(&self, at: usize) -> &'a [f32] {
        &self.parameters[at].values
    }

    /// Returns true if the gradient of one of some parameters is wanted.
    pub(super) fn learns(&self, parameters: &[usize]) -> bool {
        let is_learned = |at: &usize| self.learned.get(*at).copied().unwrap_or(false);
        parameters.iter().any(is_learned)
    }

    /// Returns true if something is learned through a value.
    pub(super) fn leads(&self, At(at): At) -> bool {
        self.values[at].back.is_some()
    }

    /// Sizes of a value, without the batch.
    pub(super) fn dims(&self, At(at): At) -> &[usize] {
        &self.values[at].dims
    }

    /// Channels and cells of a map.
    pub(super) fn channels(&self, at: At) -> [usize; 2] {
        let dims = self.dims(at);
        [dims[0], dims[1..].iter().product()]
    }

    /// Numbers of one sample of a value.
    pub(super) fn size(&self, at: At) -> usize {
        self.dims(at).iter().product()
    }

    /// The numbers of a value.
    pub(super) fn values(&self, At(at): At) -> &[f32] {
        &self.values[at].values
    }

    /// A copy of the numbers of a value.
    pub(super) fn take(&self, at: At) -> Vec<f32> {
        self.values(at).to_vec()
    }

    /// Records a value.
    pub(super) fn record(&mut self, dims: Dims, values: Vec<f32>, back: Option<Back<'a>>) -> At {
        self.values.push(Value { dims, values, back });
        At(self.values.len() - 1)
    }

    /// Records a value that was computed from another one alone.
    ///
    /// * `back`: the gradient of the other one, from that of the value.
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

    /// The way back: from the gradients of outputs to those of parameters.
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

/// Computes numbers sample by sample.
///
/// * `size`: numbers of a sample.
/// * `compute`: writes those of the sample of a number; they are 0 before.
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

/// Computes a number from every pair of numbers of two lists.
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
