//! Searches a frame, writes its evidence into shared memory, and sends the poses and the evidence.

use std::rc::Rc;

use failure::{ExitKind, Failure, OrFail as _, now_nanos};
use fmp::{FrameTime, Layout, Scope, Tracker};
use kernels::Rgb8View;
use messages::{EvidenceHeader, FrameHeader, Searched, Sightings, Status, Timing};
use pipeline::{ComputedOn, ViewEstimate, ViewStep};
use runtime::metrics::Passage;
use runtime::{Loan, Sample, Service, SlicePublisher};
use stage::{Output, StreamFrame, Turn};
use wire::WireError;

use crate::pose::job::{Job, Step};
use crate::pose::memory::Memory;

/// Poses found in a frame, and the evidence if a process receives it.
pub(crate) struct Found<'a> {
    /// The message, with a header without stamp and times.
    pub(crate) message: Sightings,
    pub(crate) header: EvidenceHeader,
    pub(crate) evidence: Option<Loan<'a, f32, EvidenceHeader>>,
    /// Time that the stage waited for the memory of the evidence, in nanoseconds.
    pub(crate) loan_nanos: u64,
}

/// The result of the filters, and its evidence if a process receives it.
struct Searching<'a> {
    estimate: ViewEstimate,
    evidence: Option<Loan<'a, f32, EvidenceHeader>>,
    loan_nanos: u64,
    searched: Searched,
}

/// The search of one view, and its outputs.
pub(crate) struct View<'a> {
    pub(crate) service: &'a Service,
    pub(crate) job: &'a Job,
    pub(crate) poses: Output<'a, Sightings>,
    pub(crate) evidence: Rc<SlicePublisher<f32, EvidenceHeader>>,
}

impl View<'_> {
    /// Searches a frame, and sends the poses that were found.
    pub(crate) fn process(&self, frame: StreamFrame, memory: &mut Memory) -> Result<(), Failure> {
        let StreamFrame { nth, sample, turn } = frame;
        let outcome = self.solve(&sample, nth, memory)?;
        let skew_nanos = sample.header().skew_nanos;
        // The frame is released before the process waits for any receiver.
        drop(sample);
        let message = match &outcome {
            Ok(found) => found.message,
            Err(status) => Sightings {
                status: *status,
                ..Sightings::default()
            },
        };
        let message = Sightings {
            skew_nanos,
            ..message
        };
        let solved = now_nanos();
        let loan_nanos = outcome.as_ref().map_or(0, |found| found.loan_nanos);
        // The evidence is sent first, because a receiver of the candidates may rely on it.
        if let Ok(found) = outcome
            && let Some(loan) = found.evidence
        {
            send_evidence(&turn, &found.header, loan)?;
            let n_bytes = message.evidence_bytes;
            self.service.health().sent_evidence(n_bytes);
        }
        let sent_at = self.poses.send(&turn, self.job.view, message)?;
        let computing = solved - turn.received_at();
        self.service.health().passed(&Passage {
            waiting: turn.waited(),
            computing: computing.saturating_sub(loan_nanos),
            publishing: now_nanos() - solved + loan_nanos,
            since_capture: Some(sent_at.saturating_sub(turn.stamp().captured_at_nanos)),
        });
        Ok(())
    }

    /// Returns the candidates with their evidence, or the reason why there are none.
    fn solve(
        &self,
        sample: &Sample<u8, FrameHeader>,
        nth: u64,
        memory: &mut Memory,
    ) -> Result<Result<Found<'_>, Status>, Failure> {
        let header = sample.header();
        if header.status != Status::OK {
            return Ok(Err(header.status));
        }
        let expected = self.job.step.size();
        let size = [header.width as usize, header.height as usize];
        let image = match Rgb8View::new(size[0], size[1], sample.payload()) {
            Ok(image) if size == expected => image,
            _ => {
                tracing::warn!(?size, ?expected, "a frame has the wrong size");
                return Ok(Err(Status::BAD_INPUT));
            }
        };
        let rate = self.job.frame_rate_hz;
        let at = FrameTime {
            frame: nth,
            seconds: rate.map(|rate| header.stamp.frame as f64 / rate),
        };
        match (&self.job.step, memory) {
            (Step::Filters(step), Memory::Filters(tracker, responses)) => {
                self.search(step, (image, at), (tracker, responses)).map(Ok)
            }
            (Step::Network(step), Memory::Network(state)) => {
                self.look(step, (image, header.stamp), state)
            }
            (Step::Keypoints(keypoints), Memory::Keypoints(state)) => {
                self.take(keypoints, header.stamp, state)
            }
            _ => Ok(Err(Status::BAD_INPUT)),
        }
    }

    /// Searches a frame with the filters, near the last pose or in full.
    fn search(
        &self,
        step: &ViewStep,
        (image, at): (Rgb8View<'_>, FrameTime),
        (tracker, responses): (&mut Tracker, &mut Vec<f32>),
    ) -> Result<Found<'_>, Failure> {
        let layout = step.layout();
        let scope = tracker.scope(layout, at);
        let mut found = self.find(step, (image, scope), responses)?;
        if step.needs_full_search(tracker, &found.estimate) {
            // The result of the first search holds memory for evidence, which is released before the second search.
            drop(found);
            found = self.find(step, (image, Scope::whole(layout)), responses)?;
        }
        step.update(tracker, at, &found.estimate);
        if found.estimate.computed_on == ComputedOn::ProcessorForGpu {
            self.service.health().without_gpu();
        }
        found.message(layout).or_fail(ExitKind::Run)
    }

    /// Searches a frame. If a process receives the responses, they are written directly into shared memory.
    fn find(
        &self,
        step: &ViewStep,
        (image, scope): (Rgb8View<'_>, Scope),
        responses: &mut Vec<f32>,
    ) -> Result<Searching<'_>, Failure> {
        let searched = if scope == Scope::whole(step.layout()) {
            Searched::FULL
        } else {
            Searched::TRACKED
        };
        let n_values = step.layout().n_values(&scope);
        let (loan_nanos, mut loan) = self.loan(n_values)?;
        let estimate = if let Some(loan) = &mut loan {
            step.run(image, scope, loan.payload_mut())
        } else {
            responses.resize(responses.len().max(n_values), 0.0);
            step.run(image, scope, responses)
        };
        let is_there = !estimate.candidates.is_empty();
        Ok(Searching {
            evidence: loan.filter(|_| is_there),
            estimate,
            loan_nanos,
            searched,
        })
    }

    /// Returns memory for the evidence of a frame, and the time that the stage waited for it. Returns `None` if no process receives
    /// evidence.
    pub(crate) fn loan(
        &self,
        n_values: usize,
    ) -> Result<(u64, Option<Loan<'_, f32, EvidenceHeader>>), Failure> {
        if self.job.n_evidence_consumers == 0 {
            return Ok((0, None));
        }
        let begin = now_nanos();
        let loan = self.evidence.loan(n_values)?;
        Ok((now_nanos() - begin, Some(loan)))
    }
}

impl<'a> Searching<'a> {
    /// Returns the message with candidates, search mode, and size of the evidence.
    fn message(self, layout: &Layout) -> Result<Found<'a>, WireError> {
        let estimate = &self.estimate;
        let mut message = wire::candidates_to_message(&estimate.candidates, layout.image_size)?;
        wire::local_to_message(&mut message, &estimate.local)?;
        wire::front_to_message(&mut message, &estimate.front)?;
        let n_values = match &self.evidence {
            Some(_) => layout.n_values(&estimate.scope),
            None => 0,
        };
        let (levels, bounds) = (&estimate.levels, &estimate.bounds);
        Ok(Found {
            message: Sightings {
                searched: self.searched,
                evidence_bytes: (n_values * size_of::<f32>()) as u64,
                ..message
            },
            header: wire::evidence_to_message(levels, bounds, &estimate.scope, layout)?,
            evidence: self.evidence,
            loan_nanos: self.loan_nanos,
        })
    }
}

fn send_evidence(
    turn: &Turn,
    header: &EvidenceHeader,
    mut loan: Loan<'_, f32, EvidenceHeader>,
) -> Result<(), Failure> {
    *loan.header_mut() = EvidenceHeader {
        stamp: *turn.stamp(),
        timing: Timing {
            received_at_nanos: turn.received_at(),
            sent_at_nanos: now_nanos(),
        },
        ..*header
    };
    loan.send()?;
    Ok(())
}
