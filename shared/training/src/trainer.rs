//! The stages of training, step by step.

mod checkpoint;
mod collect;
#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex, PoisonError};

use fmp::{Model, ModelError};

use crate::album::{Album, AlbumError};
use crate::dual::{Cost, Effort, Gap, Machine};
use crate::example::Cells;
use crate::filters::{FilterSettings, first_model};
use crate::origin::{Group, Origin, Placed};
use crate::plan::Plan;
use crate::scale::quantile;
use crate::settings::Settings;
use crate::shape::Coordinates;
use crate::symmetry::Symmetry;
use crate::watch::{Event, Step, Watch};

pub use checkpoint::{Checkpoint, CheckpointBytesError, CheckpointError};

/// Reason why a training run failed.
#[derive(Debug, thiserror::Error)]
pub enum TrainError {
    /// The training was stopped.
    #[error("stopped")]
    Stopped,
    /// An image of a person cannot be read.
    #[error("cannot read the image of person {person}")]
    Person {
        /// Number of the person in the album, from 1.
        person: usize,
        /// Error of the album.
        #[source]
        source: AlbumError,
    },
    /// A background image cannot be read.
    #[error("cannot read image {image} of the images without people")]
    Background {
        /// Number of the image in the album, from 1.
        image: usize,
        /// Error of the album.
        #[source]
        source: AlbumError,
    },
    /// There are no background images.
    #[error("there are no images without people: a model cannot be trained on people alone")]
    NoBackgrounds,
    /// The model could not be placed on any person.
    #[error("none of {n_people} people could be placed on any level of the pyramid")]
    NobodyPlaced {
        /// Number of people to train on.
        n_people: usize,
    },
    /// A stored pose is outside its image. The image must have changed since the pose was found.
    #[error("a pose is outside its image: an image has changed since the training began")]
    Moved,
    /// The trained parameters are not a valid model.
    #[error("the result of the training is not a valid model")]
    Model(#[from] ModelError),
}

/// A training run in progress. It is deterministic: the same plan, images and settings give the same model, bit for
/// bit, on any number of threads, and whether or not the training was interrupted between steps.
pub struct Trainer<'a> {
    plan: &'a Plan,
    settings: &'a Settings,
    album: &'a dyn Album,
    watch: &'a dyn Watch,
    at: Coordinates,
    steps: Vec<Step>,
    next: usize,
    machine: Machine<Group, Origin>,
    /// Features of the images without people, kept while examples use them.
    cells: Mutex<BTreeMap<usize, Arc<Cells>>>,
    /// Most recent right pose of every person.
    right: Vec<Option<Placed>>,
    /// The symmetry of the model, if it is symmetric.
    symmetry: Option<Symmetry>,
    v: Vec<f64>,
    threshold: f64,
}

impl std::fmt::Debug for Trainer<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Trainer").field("next", &self.next).finish_non_exhaustive()
    }
}

impl<'a> Trainer<'a> {
    /// Prepares a training run.
    ///
    /// # Errors
    ///
    /// Fails with [`TrainError::NoBackgrounds`].
    pub fn new(
        plan: &'a Plan,
        settings: &'a Settings,
        album: &'a dyn Album,
        watch: &'a dyn Watch,
    ) -> Result<Self, TrainError> {
        if album.n_backgrounds() == 0 {
            return Err(TrainError::NoBackgrounds);
        }
        let at = plan.shape().coordinates();
        Ok(Self {
            machine: Machine::new(at.len(), at.non_negative()),
            steps: steps(settings, album.n_backgrounds()),
            next: 0,
            cells: Mutex::default(),
            right: vec![None; plan.n_people()],
            symmetry: settings.symmetric.then(|| Symmetry::of(plan.shape())).flatten(),
            v: vec![0.0; at.len()],
            threshold: 0.0,
            plan,
            settings,
            album,
            watch,
            at,
        })
    }

    /// All steps of the training.
    pub fn steps(&self) -> &[Step] {
        &self.steps
    }

    /// Number of finished steps.
    pub fn n_done(&self) -> usize {
        self.next
    }

    /// Runs the next step. Returns `false` if there are no more steps.
    ///
    /// # Errors
    ///
    /// See [`TrainError`]; the trainer must not be used afterwards.
    pub fn step(&mut self) -> Result<bool, TrainError> {
        let Some(&step) = self.steps.get(self.next) else {
            return Ok(false);
        };
        let mut random = fastrand::Rng::with_seed(self.seed_of(self.next));
        match step {
            Step::Filters => self.filters()?,
            Step::Place { round } => self.place(round)?,
            Step::Learn { .. } => {
                self.collect(step)?;
                self.learn(&mut random)?;
            }
            Step::Judge => self.judge()?,
        }
        self.next += 1;
        Ok(true)
    }

    /// The current model.
    ///
    /// # Errors
    ///
    /// Fails with [`TrainError::Model`] if the parameters are not a valid model.
    pub fn model(&self) -> Result<Model, TrainError> {
        Ok(self.plan.shape().model(&self.v, self.threshold)?)
    }

    fn seed_of(&self, salt: usize) -> u64 {
        self.settings.seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ salt as u64
    }

    fn effort(&self) -> Effort {
        Effort {
            tolerance: self.settings.tolerance,
            max_passes: MAX_PASSES,
        }
    }

    fn balanced(&self, v: Vec<f64>) -> Vec<f64> {
        match &self.symmetry {
            Some(symmetry) => symmetry.balance(&v),
            None => v,
        }
    }

    fn go_on(&self) -> Result<(), TrainError> {
        if self.watch.go_on() {
            Ok(())
        } else {
            Err(TrainError::Stopped)
        }
    }

    fn filters(&mut self) -> Result<(), TrainError> {
        let people = self.nearest()?;
        let background = self.windows()?;
        let settings = FilterSettings {
            cost: self.settings.cost,
            positive_weight: self.settings.positive_weight,
            effort: self.effort(),
            seed: self.settings.seed,
        };
        let v = first_model(self.plan.shape(), &people, &background, &settings);
        self.v = self.balanced(v);
        Ok(())
    }

    /// Finds the right poses of all people again, and replaces the examples made from them.
    fn place(&mut self, round: usize) -> Result<(), TrainError> {
        let placed = self.best_placements(round < self.settings.fixed_rounds)?;
        // Most right poses hardly change, so their old shares are good initial values.
        let mut shares = vec![0.0; self.plan.n_people()];
        for (origin, share) in self.machine.entries() {
            if let Origin::Right { person, .. } = origin {
                shares[*person as usize] = share;
            }
        }
        self.machine.retain(|origin| matches!(origin, Origin::Background { .. }));
        self.right = placed.into_iter().map(|placed| placed.map(|placed| placed.0)).collect();
        let people = self.right.iter().zip(shares).enumerate();
        let (origins, shares): (Vec<_>, Vec<_>) = people
            .filter_map(|(person, (pose, share))| {
                let pose = pose.clone()?;
                let person = person as u32;
                Some((Origin::Right { person, pose }, share))
            })
            .unzip();
        self.add(origins, &mut shares.into_iter())
    }

    fn learn(&mut self, random: &mut fastrand::Rng) -> Result<(), TrainError> {
        let (effort, watch) = (self.effort(), self.watch);
        let mut report = |gap: Gap| {
            watch.tell(Event::Gap(gap));
            watch.go_on()
        };
        self.machine.solve(effort, random, &mut report);
        self.go_on()?;
        self.forget();
        self.v = self.balanced(self.machine.solution());
        Ok(())
    }

    /// Memory used by examples and features, in bytes.
    fn bytes(&self) -> usize {
        let cells = self.cells.lock().unwrap_or_else(PoisonError::into_inner);
        self.machine.bytes() + cells.values().map(|value| value.bytes()).sum::<usize>()
    }

    /// Drops wrong poses whose share in the solution is 0, and the features that no remaining example uses.
    fn forget(&mut self) {
        let features = self.bytes() - self.machine.bytes();
        let room = (self.settings.cache_mib << 20).saturating_sub(features);
        // A right pose is kept even if its share is 0: it may be needed later, and nothing would add it again.
        let may_go = |origin: &Origin| !matches!(origin, Origin::Right { .. });
        self.machine.forget(self.settings.room, room, may_go);
        let image = |origin: &Origin| match origin {
            Origin::Background { image, .. } => Some(*image as usize),
            Origin::Right { .. } | Origin::Mistake { .. } => None,
        };
        let shown: BTreeSet<usize> =
            self.machine.entries().filter_map(|entry| image(entry.0)).collect();
        let cells = self.cells.get_mut().unwrap_or_else(PoisonError::into_inner);
        cells.retain(|it, _| shown.contains(it));
    }

    /// Sets the threshold to the fifth percentile of the people's scores (Yang & Ramanan 2013).
    fn judge(&mut self) -> Result<(), TrainError> {
        let placed = self.best_placements(false)?;
        let scores = placed.into_iter().flatten().map(|placed| placed.1);
        self.threshold = quantile(scores.collect(), 0.05);
        Ok(())
    }

    /// Adds examples with their shares in the solution.
    fn add(
        &mut self,
        origins: Vec<Origin>,
        shares: &mut dyn Iterator<Item = f64>,
    ) -> Result<(), TrainError> {
        let made = self.constraints(&origins)?;
        for ((origin, constraint), share) in origins.into_iter().zip(made).zip(shares) {
            let weight = match origin {
                Origin::Right { .. } => self.settings.positive_weight,
                Origin::Mistake { .. } => self.settings.pose_weight,
                Origin::Background { .. } => 1.0,
            };
            let cost = Cost {
                group: origin.group(),
                of_unit: self.settings.cost * weight,
            };
            self.machine.add(cost, origin, constraint, share);
        }
        Ok(())
    }
}

/// Maximum number of passes for one solution.
const MAX_PASSES: usize = 200;

fn steps(settings: &Settings, n_backgrounds: usize) -> Vec<Step> {
    let n_batches = n_backgrounds.div_ceil(settings.batch.max(1));
    let mut steps = vec![Step::Filters];
    for round in 0..settings.fixed_rounds + settings.latent_rounds {
        steps.push(Step::Place { round });
        for pass in 0..settings.passes {
            steps.extend((0..n_batches).map(|batch| Step::Learn { round, pass, batch }));
        }
    }
    steps.push(Step::Judge);
    steps
}
