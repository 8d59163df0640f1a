//! What all views say about a frame.

use messages::{PairPose, Stamp};
use pipeline::Answer;
use wire::{EvidenceView, WireError};

/// What all views say about a frame.
pub(crate) struct Seen<'a> {
    pub(crate) stamp: Stamp,
    pub(crate) answers: Vec<Option<Answer>>,
    /// How many frames old the expected errors of every view are.
    pub(crate) sigma_ages: Vec<u64>,
    pub(crate) evidence: Vec<Option<EvidenceView<'a>>>,
}

impl Seen<'_> {
    /// Bit `v` is set if view `v` delivered a pose in time.
    pub(crate) fn views_present(&self) -> u32 {
        let present = (0..self.answers.len()).filter(|it| self.answers[*it].is_some());
        present.fold(0, |mask, view| mask | 1_u32 << view)
    }

    /// Adds what was expected of the two views of a message.
    pub(crate) fn expect(&self, message: &mut PairPose) -> Result<(), WireError> {
        for side in 0..2 {
            let view = message.views[side] as usize;
            let sigma_px = self.answers[view].as_ref().map(|it| it.sigma_px.as_ref());
            if let Some(sigma_px) = sigma_px.flatten() {
                wire::sigma_to_pair(message, side, self.sigma_ages[view], sigma_px)?;
            }
        }
        Ok(())
    }
}
