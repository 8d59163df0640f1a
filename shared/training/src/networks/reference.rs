//! Runs and trains networks in Rust. Every operation is recorded with the data that its gradient needs (reverse-mode differentiation).
//!
//! Batches are computed sample by sample on rayon's current pool. The order of all sums is fixed, so that equal inputs give equal
//! bits for any number of threads.

mod batch;
mod convolution;
mod lists;
mod maps;
mod matrix;
mod ops;
mod record;
#[cfg(test)]
mod tests;

use self::record::Record;
use crate::networks::lesson::{Cost, Lesson, Running, Shown};
use crate::networks::ops::Network;
use crate::networks::parameters::Parameter;

/// Returns the outputs of a network.
pub(crate) fn find(
    network: &impl Network,
    parameters: &[Parameter],
    shown: &Shown,
) -> Vec<Vec<f32>> {
    let mut record = Record::new(network, parameters, shown);
    let outputs = network.run(&mut record);
    let values = outputs.into_iter().map(|output| record.take(output));
    values.collect()
}

/// Returns the gradients of a cost.
///
/// * `learned`: for every parameter, true if its gradient is requested.
/// * `cost`: computes the gradients of the cost from the outputs.
pub(crate) fn learn(
    network: &impl Network,
    running: Running<'_>,
    shown: &Shown,
    cost: &mut Cost<'_>,
) -> Lesson {
    let mut record = Record::new(network, running.parameters, shown).learning(running);
    let outputs = network.run(&mut record);
    let values: Vec<Vec<f32>> = outputs.iter().map(|output| record.take(*output)).collect();
    let gradients = outputs.into_iter().zip(cost(&values)).collect();
    record.backward(gradients)
}
