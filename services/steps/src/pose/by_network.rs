//! Searches a frame with a network that finds keypoints.

use failure::{ExitKind, Failure, OrFail as _, now_nanos, processor_nanos};
use kernels::Rgb8View;
use messages::{Searched, Sightings, Stamp, Status};
use pipeline::{NetworkMemory, NetworkStep, Spent};
use posenetwork::{MapGrid, PersonMaps};

use crate::pose::memory::NetworkState;
use crate::pose::view::{Found, View};

impl View<'_> {
    /// Searches a frame. If the network fails, the frame is refused, with a warning the first time.
    pub(crate) fn look(
        &self,
        step: &NetworkStep,
        (image, stamp): (Rgb8View<'_>, Stamp),
        state: &mut NetworkState,
    ) -> Result<Result<Found<'_>, Status>, Failure> {
        state.begin(stamp.frame, self.job);
        let began = [processor_nanos(), now_nanos()];
        let result = step.look(image, &mut state.memory);
        if let Some(budget) = &mut state.budget {
            let ended = [processor_nanos(), now_nanos()];
            let [processor_s, clock_s] =
                [0, 1].map(|clock| (ended[clock] - began[clock]) as f64 * 1e-9);
            budget.spent(&Spent {
                n_looks: state.memory.n_looks(),
                processor_s,
                clock_s,
                n_frames: state.memory.n_frames(),
            });
        }
        if let Err(error) = result {
            if !state.has_failed {
                let error = failure::wording::in_one_line(&error);
                tracing::warn!(frame = stamp.frame, error, "the network failed on a frame");
                state.has_failed = true;
            }
            return Ok(Err(Status::BAD_INPUT));
        }
        let found = self.seen(step, &mut state.memory)?;
        state.sees(found.is_ok(), &stamp);
        Ok(found)
    }

    /// Returns the people of a searched frame, with their maps.
    pub(crate) fn seen(
        &self,
        step: &NetworkStep,
        memory: &mut NetworkMemory,
    ) -> Result<Result<Found<'_>, Status>, Failure> {
        let people = step.sightings(memory);
        if people.is_empty() {
            return Ok(Err(Status::NO_DETECTION));
        }
        let maps: Vec<PersonMaps<'_>> = step.evidence(memory).collect();
        let grids: Vec<MapGrid> = maps.iter().map(|maps| *maps.grid()).collect();
        let header = wire::maps_to_message(&grids, step.size()).or_fail(ExitKind::Run)?;
        let n_values = wire::n_values(&grids);
        let (loan_nanos, mut loan) = self.loan(n_values)?;
        let mut evidence_bytes = 0;
        if let Some(loan) = &mut loan {
            let mut left = loan.payload_mut();
            for maps in &maps {
                let (own, others) = left.split_at_mut(maps.values().len());
                own.copy_from_slice(maps.values());
                left = others;
            }
            evidence_bytes = (n_values * size_of::<f32>()) as u64;
        }
        let message = wire::sightings_to_message(&people, self.job.n_extras, step.size());
        Ok(Ok(Found {
            message: Sightings {
                searched: if memory.has_searched() {
                    Searched::FULL
                } else {
                    Searched::TRACKED
                },
                evidence_bytes,
                ..message.or_fail(ExitKind::Run)?
            },
            header,
            evidence: loan,
            loan_nanos,
        }))
    }
}
