//! The state of a training run, from which the training continues exactly as if it had not been interrupted.

mod bytes;

use serde::{Deserialize, Serialize};

use super::{TrainError, Trainer};
use crate::album::Album;
use crate::origin::{Origin, Placed};
use crate::plan::Plan;
use crate::settings::Settings;
use crate::watch::Watch;

pub use bytes::CheckpointBytesError;

/// The state of a training run between two steps.
///
/// Examples are stored by their origin, in about a hundred bytes each. Their features are recomputed from the images.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Checkpoint {
    /// Fingerprint of the plan and the settings.
    fingerprint: u64,
    n_done: usize,
    v: Vec<f64>,
    threshold: f64,
    right: Vec<Option<Placed>>,
    examples: Vec<(Origin, f64)>,
}

/// Reason why a training run cannot be resumed from a checkpoint.
#[derive(Debug, thiserror::Error)]
pub enum CheckpointError {
    /// The checkpoint belongs to a different training run.
    #[error(
        "the checkpoint belongs to another training: the people, the images without people, or the settings have changed"
    )]
    Other,
    /// The checkpoint is damaged.
    #[error("the checkpoint contradicts itself: {what}")]
    Damaged {
        /// The fault.
        what: &'static str,
    },
    /// Resuming failed.
    #[error(transparent)]
    Train(#[from] TrainError),
}

impl Checkpoint {
    /// Number of finished steps.
    pub fn n_done(&self) -> usize {
        self.n_done
    }
}

impl<'a> Trainer<'a> {
    /// The state after the last finished step.
    pub fn checkpoint(&self) -> Checkpoint {
        Checkpoint {
            fingerprint: self.fingerprint(),
            n_done: self.next,
            v: self.v.clone(),
            threshold: self.threshold,
            right: self.right.clone(),
            examples: self
                .machine
                .entries()
                .map(|(origin, share)| (origin.clone(), share))
                .collect(),
        }
    }

    /// Resumes from a checkpoint.
    ///
    /// # Errors
    ///
    /// See [`CheckpointError`].
    pub fn resume(
        (plan, settings): (&'a Plan, &'a Settings),
        album: &'a dyn Album,
        watch: &'a dyn Watch,
        checkpoint: Checkpoint,
    ) -> Result<Self, CheckpointError> {
        let mut trainer = Self::new(plan, settings, album, watch)?;
        if checkpoint.fingerprint != trainer.fingerprint() {
            return Err(CheckpointError::Other);
        }
        trainer.fits(&checkpoint)?;
        trainer.next = checkpoint.n_done;
        trainer.v = checkpoint.v;
        trainer.threshold = checkpoint.threshold;
        trainer.right = checkpoint.right;
        let (origins, shares): (Vec<_>, Vec<_>) = checkpoint.examples.into_iter().unzip();
        trainer.add(origins, &mut shares.into_iter())?;
        Ok(trainer)
    }

    fn fits(&self, it: &Checkpoint) -> Result<(), CheckpointError> {
        let damaged = |what| Err(CheckpointError::Damaged { what });
        if it.n_done > self.steps.len() {
            return damaged("more steps are done than the plan has");
        }
        if !it.threshold.is_finite() || !it.v.iter().all(|value| value.is_finite()) {
            return damaged("a number is not finite");
        }
        if it.v.len() != self.v.len() || it.right.len() != self.right.len() {
            return damaged("a list has the wrong length");
        }
        let poses = it.right.iter().flatten();
        let poses = poses.chain(it.examples.iter().map(|example| example.0.pose()));
        if !poses.into_iter().all(|pose| pose.fits(self.plan.shape())) {
            return damaged("a pose has other parts or types than the model");
        }
        let known = |origin: &Origin| match origin {
            Origin::Background { image, .. } => (*image as usize) < self.album.n_backgrounds(),
            Origin::Right { person, .. } | Origin::Mistake { person, .. } => {
                (*person as usize) < self.plan.n_people()
            }
        };
        if !it
            .examples
            .iter()
            .all(|example| known(&example.0) && example.1 >= 0.0 && example.1.is_finite())
        {
            return damaged("an example names a person or an image that does not exist");
        }
        Ok(())
    }

    /// FNV-1a hash of everything that the training depends on, except the pixels.
    fn fingerprint(&self) -> u64 {
        let n_images = self.album.n_backgrounds();
        let text = format!("{:?} {:?} {n_images}", self.settings, self.plan);
        formats::checksum::fnv1a(text.as_bytes())
    }
}
