//! A training run: steps over samples, regular evaluations on held-out samples, and a state that can be saved.

use core::fmt::Debug;

use serde::{Deserialize, Serialize, de::DeserializeOwned};

use crate::networks::checkpoint::{CHECKPOINT, StoreError, unwrap, wrap};
use crate::networks::compute::Computer;
use crate::networks::lesson::{Running, Shown};
use crate::networks::onnx::{self, Document};
use crate::networks::ops::Network;
use crate::networks::optimiser::{Memory, Step};
use crate::networks::order;
use crate::networks::parameters::Parameter;
use crate::networks::settings::{Backend, Precision};

/// A batch of samples.
#[derive(Debug)]
pub struct Batch<N, T> {
    /// The network, for the input size of this step.
    pub network: N,
    /// Inputs of the network.
    pub shown: Shown,
    /// True outputs of the network.
    pub truth: T,
}

/// The cost of a batch.
#[derive(Debug)]
pub struct Costed<C> {
    /// Cost of the batch.
    pub cost: C,
    /// Gradients of the cost with respect to the outputs of the network.
    pub gradients: Vec<Vec<f32>>,
}

/// The next pass of a training run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Plan {
    /// Number of steps.
    pub steps: usize,
    /// True if the network is evaluated after the pass.
    pub is_judged: bool,
}

/// Values that a training run reports and saves.
pub trait Kept: Copy + Debug + PartialEq + Serialize + DeserializeOwned {}

impl<T: Copy + Debug + PartialEq + Serialize + DeserializeOwned> Kept for T {}

/// Samples, true outputs, cost and steps of a training run: everything that differs between training tasks.
///
/// All data of a step depend only on the number of the step.
pub trait Task: Sync {
    /// Type of the network.
    type Network: Network;
    /// The truth of a batch.
    type Truth;
    /// The cost of a batch.
    type Cost: Kept;
    /// Measures of the network's quality.
    type Score: Kept;

    /// Name of the samples in messages, for example `people`.
    const LEARNED_FROM: &'static str;

    /// Hash of everything that the result depends on.
    fn stamp(&self) -> u64;
    /// Returns the network for the input size at which it is used.
    fn network(&self) -> Self::Network;
    /// Returns the precision of the maps between layers.
    fn precision(&self) -> Precision {
        Precision::F32
    }
    /// Returns the initial parameters.
    fn begin(&self) -> Vec<Parameter>;
    /// Returns the seed of all random numbers.
    fn seed(&self) -> u64;
    /// Returns the number of steps of the whole training.
    fn n_steps(&self) -> usize;
    /// Returns the next pass, given the numbers of steps and passes that are finished.
    fn plan(&self, steps: usize, passes: usize) -> Plan;
    /// Returns true if the training restarts from the averaged parameters at a step.
    fn restarts(&self, _nth: usize) -> bool {
        false
    }
    /// Returns, for every parameter, true if the step trains it.
    fn learned(&self, nth: usize, parameters: &[Parameter]) -> Vec<bool>;
    /// Returns how a step changes the parameters.
    fn step(&self, nth: usize) -> Step;
    /// Returns the samples of a step.
    fn batch(&self, nth: usize) -> Batch<Self::Network, Self::Truth>;
    /// Returns the cost of the network's outputs at a step.
    fn cost(&self, nth: usize, truth: &Self::Truth, outputs: &[Vec<f32>]) -> Costed<Self::Cost>;
    /// Returns the mean of the costs of several steps, each given with its number of samples.
    fn mean(&self, costs: &[(usize, Self::Cost)]) -> Self::Cost;
    /// Evaluates a network on held-out samples.
    fn score(&self, find: &dyn Fn(&Shown) -> Vec<Vec<f32>>) -> Self::Score;
    /// Returns the value by which the best pass is chosen; lower is better. Returns `None` if the network of the last pass is used instead.
    fn rank(&self, _score: &Self::Score) -> Option<f32> {
        None
    }
    /// Returns true if the training should end early.
    ///
    /// * `since`: number of passes since the best one.
    fn is_enough(&self, _since: usize) -> bool {
        false
    }
}

/// The results of one pass of a training run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Pass<C, S> {
    /// Number of finished steps after the pass.
    pub step: usize,
    /// Mean cost of the steps.
    pub cost: C,
    /// Result of the evaluation on held-out samples, if there was one.
    pub score: Option<S>,
}

/// The best network so far.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Best {
    /// Number of the best pass.
    pass: usize,
    rank: f32,
    parameters: Vec<Parameter>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct State<C, S> {
    /// Hash of everything that the result depends on.
    stamp: u64,
    memory: Memory,
    step: usize,
    passes: Vec<Pass<C, S>>,
    best: Option<Best>,
}

/// Reason why a training run cannot start or resume.
#[derive(Debug, thiserror::Error)]
pub enum TrainError {
    /// The bytes are not a checkpoint, or were changed.
    #[error("the checkpoint cannot be used")]
    Checkpoint(#[from] StoreError),
    /// The checkpoint belongs to a different training run.
    #[error(
        "the checkpoint belongs to a training with other {learned_from} or settings, or from another network"
    )]
    Other {
        /// Name of the samples, such as `people`.
        learned_from: &'static str,
    },
    /// The settings choose a precision that only `LibTorch` supports.
    #[error("precision is \"bf16\", which needs the backend libtorch")]
    Precision,
}

/// A training run in progress.
#[derive(Debug)]
pub struct Trainer<T: Task> {
    task: T,
    computer: Computer,
    state: State<T::Cost, T::Score>,
}

impl<T: Task> Trainer<T> {
    /// Prepares a training run, from the start or from a checkpoint.
    ///
    /// * `checkpoint`: bytes of [`Self::checkpoint`].
    ///
    /// # Errors
    ///
    /// Fails with [`TrainError`].
    pub fn new(task: T, backend: Backend, checkpoint: Option<&[u8]>) -> Result<Self, TrainError> {
        let computer = Computer {
            backend,
            precision: task.precision(),
        };
        if computer.precision == Precision::Bf16 && backend == Backend::BuiltIn {
            return Err(TrainError::Precision);
        }
        let stamp = task.stamp();
        let state = if let Some(bytes) = checkpoint {
            let state: State<T::Cost, T::Score> = unwrap(CHECKPOINT, bytes)?;
            if state.stamp != stamp {
                let learned_from = T::LEARNED_FROM;
                return Err(TrainError::Other { learned_from });
            }
            state
        } else {
            State {
                stamp,
                memory: Memory::new(task.begin()),
                step: 0,
                passes: Vec::new(),
                best: None,
            }
        };
        Ok(Self {
            task,
            computer,
            state,
        })
    }

    /// The task of the training.
    pub fn task(&self) -> &T {
        &self.task
    }

    /// Number of finished steps.
    pub fn step(&self) -> usize {
        self.state.step
    }

    /// The results of the passes so far.
    pub fn passes(&self) -> &[Pass<T::Cost, T::Score>] {
        &self.state.passes
    }

    /// Number of the best pass, if the task keeps the network of the best pass.
    pub fn best(&self) -> Option<usize> {
        self.state.best.as_ref().map(|best| best.pass)
    }

    /// Returns true if the training has finished.
    pub fn is_done(&self) -> bool {
        let since = self.best().map_or(0, |best| self.passes().len() - 1 - best);
        self.step() >= self.task.n_steps() || self.task.is_enough(since)
    }

    /// The parameters after the last step.
    pub fn parameters(&self) -> &[Parameter] {
        &self.state.memory.parameters
    }

    /// The parameters of the resulting network: the parameters of the best pass, or the mean over the last steps.
    pub fn trained(&self) -> &[Parameter] {
        let best = self.state.best.as_ref();
        best.map_or(&self.state.memory.averages, |best| &best.parameters)
    }

    /// The state of the training as bytes.
    ///
    /// # Errors
    ///
    /// Fails with [`StoreError::Encode`].
    pub fn checkpoint(&self) -> Result<Vec<u8>, StoreError> {
        wrap(CHECKPOINT, &self.state)
    }

    /// Runs the next pass.
    ///
    /// * `go_on`: called before every step with the number of finished steps; `false` aborts the pass.
    /// * Returns true if the pass was finished. Otherwise, nothing has changed.
    pub fn pass(&mut self, go_on: &mut dyn FnMut(usize) -> bool) -> bool {
        let plan = self.task.plan(self.state.step, self.state.passes.len());
        self.run(plan, go_on)
    }

    /// Runs the steps of a given plan.
    ///
    /// * See [`Self::pass`].
    pub fn run(&mut self, plan: Plan, go_on: &mut dyn FnMut(usize) -> bool) -> bool {
        let from = self.state.step;
        let until = (from + plan.steps).min(self.task.n_steps());
        let mut memory = self.state.memory.clone();
        let mut costs = Vec::new();
        for nth in from..until {
            if !go_on(nth) {
                return false;
            }
            if self.task.restarts(nth) {
                memory = memory.restarted();
            }
            costs.extend(self.learn(&mut memory, nth));
        }
        let score = plan.is_judged.then(|| self.score(&memory.averages));
        let rank = score.and_then(|score| self.task.rank(&score));
        let best = self.state.best.as_ref().map(|best| best.rank);
        if let Some(rank) = rank.filter(|rank| best.is_none_or(|best| *rank < best)) {
            self.state.best = Some(Best {
                pass: self.state.passes.len(),
                rank,
                parameters: memory.averages.clone(),
            });
        }
        self.state.memory = memory;
        self.state.step = until;
        self.state.passes.push(Pass {
            step: until,
            cost: self.task.mean(&costs),
            score,
        });
        true
    }

    /// Runs one step. Returns the number of samples and their cost, computed before the step changes the parameters.
    fn learn(&self, memory: &mut Memory, nth: usize) -> Option<(usize, T::Cost)> {
        let Batch {
            network,
            shown,
            truth,
        } = self.task.batch(nth);
        let learned = self.task.learned(nth, &memory.parameters);
        let running = Running {
            parameters: &memory.parameters,
            learned: &learned,
            dice: order::dice(nth, !self.task.seed()),
        };
        let mut cost = None;
        let lesson = self.computer.learn(&network, running, &shown, &mut |outputs| {
            let costed = self.task.cost(nth, &truth, outputs);
            cost = Some((shown.n, costed.cost));
            costed.gradients
        });
        memory.change(&lesson, self.task.step(nth));
        cost
    }

    fn score(&self, parameters: &[Parameter]) -> T::Score {
        let network = self.task.network();
        let find = |shown: &Shown| self.computer.find(&network, parameters, shown);
        self.task.score(&find)
    }

    /// Returns the outputs of the trained network.
    pub fn find(&self, shown: &Shown) -> Vec<Vec<f32>> {
        let network = self.task.network();
        self.computer.find(&network, self.trained(), shown)
    }

    /// The trained network as an ONNX file.
    pub fn file(&self, document: Document) -> Vec<u8> {
        onnx::write(&self.task.network(), self.trained(), document)
    }
}
