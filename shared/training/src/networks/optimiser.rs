//! Parameters in training, and the steps that change them.

use serde::{Deserialize, Serialize};

use crate::networks::lesson::Lesson;
use crate::networks::parameters::{Parameter, Role};

/// Decay of the running means of gradients and of their squares (`AdamW`: Loshchilov and Hutter 2019).
const DECAYS: [f32; 2] = [0.9, 0.999];
/// Value added to the root of the mean square of a gradient.
const EPSILON: f32 = 1e-8;
/// Share of a running statistic that is replaced with the value of every new batch.
const MOMENTUM_OF_STATISTICS: f32 = 0.05;

/// Step lengths that rise and then fall to 0 as a cosine (Loshchilov and Hutter 2017).
#[derive(Debug, Clone, Copy)]
pub(crate) struct Schedule {
    /// Number of steps.
    pub(crate) steps: usize,
    /// Share of the steps, counted from the first, in which the step length rises.
    pub(crate) rising: f32,
    /// Length of the longest step.
    pub(crate) longest: f32,
}

impl Schedule {
    /// Returns the length of a step.
    pub(crate) fn length(&self, nth: usize) -> f32 {
        let done = (nth as f32 + 0.5) / self.steps as f32;
        if done < self.rising {
            return self.longest * done / self.rising;
        }
        let falling = (done - self.rising) / (1.0 - self.rising);
        self.longest * 0.5 * (1.0 + (core::f32::consts::PI * falling).cos())
    }
}

/// The direction of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Rule {
    /// Opposite to the gradient, plus a share of the last step.
    Momentum(f32),
    /// Opposite to the mean gradient, divided by the root of the mean squared gradient (`AdamW`).
    Adam,
}

/// Settings of one step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Rule for the direction.
    pub rule: Rule,
    /// Length of the step.
    pub rate: f32,
    /// Weight decay: the share of every weight that a step subtracts, before multiplication by the rate.
    pub decay: f32,
    /// Largest length of the gradient: a longer gradient is scaled down to this length (gradient clipping).
    pub longest: f32,
    /// Share of the running mean of the parameters that is replaced in every step.
    pub averaged: f32,
}

/// The state that training changes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Memory {
    pub(crate) parameters: Vec<Parameter>,
    /// Running mean of the parameters over the last steps.
    pub(crate) averages: Vec<Parameter>,
    /// The last step, or the running mean of the gradients; empty before the first step.
    first: Vec<Vec<f32>>,
    /// The running mean of the squared gradients; empty if no step has needed it.
    second: Vec<Vec<f32>>,
    /// Number of finished steps.
    steps: u64,
}

impl Memory {
    /// The state before the first step.
    pub(crate) fn new(parameters: Vec<Parameter>) -> Self {
        let nothing = vec![Vec::new(); parameters.len()];
        Self {
            averages: parameters.clone(),
            first: nothing.clone(),
            second: nothing,
            parameters,
            steps: 0,
        }
    }

    /// Restarts from the averaged parameters.
    #[must_use]
    pub(crate) fn restarted(self) -> Self {
        Self::new(self.averages)
    }

    /// Changes the parameters, unless the gradient is not finite.
    pub(crate) fn change(&mut self, lesson: &Lesson, step: Step) {
        let all = lesson.gradients.iter().flatten().flatten();
        let squared: f64 = all.map(|value| f64::from(*value).powi(2)).sum();
        let length = squared.sqrt() as f32;
        if !length.is_finite() {
            return;
        }
        let shorten = (step.longest / length).min(1.0);
        self.steps += 1;
        for (at, gradient) in lesson.gradients.iter().enumerate() {
            if let Some(gradient) = gradient {
                self.change_one(at, (gradient, shorten), step);
            }
        }
        for seen in &lesson.statistics {
            for (at, seen) in [(seen.at, &seen.mean), (seen.at + 1, &seen.variance)] {
                let values = self.parameters[at].values.iter_mut();
                for (value, seen) in values.zip(seen) {
                    *value += MOMENTUM_OF_STATISTICS * (seen - *value);
                }
                self.average(at, step.averaged);
            }
        }
    }

    fn change_one(&mut self, at: usize, (gradient, shorten): (&[f32], f32), step: Step) {
        let parameter = &mut self.parameters[at];
        let decay = match parameter.role {
            Role::Weight => step.decay,
            Role::Bias | Role::Fixed => 0.0,
        };
        self.first[at].resize(gradient.len(), 0.0);
        let values = parameter.values.iter_mut().zip(&mut self.first[at]);
        match step.rule {
            Rule::Momentum(share) => {
                for ((value, speed), gradient) in values.zip(gradient) {
                    let gradient = gradient * shorten + decay * *value;
                    *speed = share * *speed - step.rate * gradient;
                    *value += *speed;
                }
            }
            Rule::Adam => {
                self.second[at].resize(gradient.len(), 0.0);
                let nth = self.steps.min(1_000_000) as i32;
                let [first, second] = DECAYS.map(|decay| 1.0 - decay.powi(nth));
                let keep = 1.0 - step.rate * decay;
                let values = values.zip(&mut self.second[at]);
                for (((value, mean), square), gradient) in values.zip(gradient) {
                    let gradient = gradient * shorten;
                    *mean += (1.0 - DECAYS[0]) * (gradient - *mean);
                    *square += (1.0 - DECAYS[1]) * (gradient * gradient - *square);
                    let direction = (*mean / first) / ((*square / second).sqrt() + EPSILON);
                    *value = *value * keep - step.rate * direction;
                }
            }
        }
        self.average(at, step.averaged);
    }

    fn average(&mut self, at: usize, share: f32) {
        let (averages, values) = (&mut self.averages[at].values, &self.parameters[at].values);
        if share >= 1.0 {
            averages.clone_from(values);
            return;
        }
        for (average, value) in averages.iter_mut().zip(values) {
            *average += share * (value - *average);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn memory() -> Memory {
        let parameter = |role| Parameter {
            name: "layer".to_owned(),
            dims: vec![2],
            role,
            values: vec![1.0, -1.0],
        };
        Memory::new(vec![parameter(Role::Weight), parameter(Role::Bias)])
    }

    const STEP: Step = Step {
        rule: Rule::Momentum(0.5),
        rate: 0.1,
        decay: 0.1,
        longest: 1.0,
        averaged: 1.0,
    };

    #[test]
    fn a_long_gradient_is_shortened_and_only_weights_decay() {
        let mut memory = memory();
        let lesson = Lesson {
            gradients: vec![Some(vec![3.0, 0.0]), Some(vec![0.0, 4.0])],
            statistics: Vec::new(),
        };
        memory.change(&lesson, STEP);
        let expected = [[1.0 - 0.1 * (0.6 + 0.1), -1.0 + 0.1 * 0.1], [1.0, -1.08]];
        for (parameter, expected) in memory.parameters.iter().zip(expected) {
            for (value, expected) in parameter.values.iter().zip(expected) {
                assert!((value - expected).abs() < 1e-6, "{value}, {expected}");
            }
        }
        assert_eq!(memory.averages, memory.parameters);
    }

    #[test]
    fn a_gradient_that_is_not_finite_changes_nothing() {
        for rule in [Rule::Momentum(0.9), Rule::Adam] {
            let mut changed = memory();
            let lesson = Lesson {
                gradients: vec![Some(vec![f32::NAN, 0.0]), None],
                statistics: Vec::new(),
            };
            changed.change(&lesson, Step { rule, ..STEP });
            assert_eq!(changed, memory());
        }
    }
}
