//! The response maps of the views a worker reads, one frame of each held where it lies.

use messages::{EvidenceHeader, topic};
use multiview::ViewPlan;
use runtime::{Failure, Sample, Service, SliceSubscriber, Waiter, now_nanos};
use wire::EvidenceView;

/// So far ahead of the poses is nobody but who counts wrong, frames of the footage that are used.
const FAR: u64 = 4096;

/// The evidence of one view.
#[derive(Debug)]
pub(crate) struct Evidence<'a> {
    subscriber: SliceSubscriber<f32, EvidenceHeader>,
    held: Option<Sample<f32, EvidenceHeader>>,
    service: &'a Service,
    view: usize,
    frame_step: u64,
}

impl<'a> Evidence<'a> {
    pub(crate) fn open(
        service: &'a Service,
        view: usize,
        frame_step: u64,
        waiter: &mut Waiter,
    ) -> Result<Self, Failure> {
        let topic = topic::evidence(view);
        Ok(Self {
            subscriber: service.bus().slice_subscriber(&topic, waiter)?,
            held: None,
            service,
            view,
            frame_step,
        })
    }

    /// Takes what there is if nothing is held; its sender waits until it has been heard once.
    pub(crate) fn listen(&mut self) -> Result<(), Failure> {
        if self.held.is_none() {
            self.held = self.take()?;
        }
        Ok(())
    }

    /// The next evidence of this view and run; what is not is counted.
    fn take(&self) -> Result<Option<Sample<f32, EvidenceHeader>>, Failure> {
        while let Some(sample) = self.subscriber.receive()? {
            let header = sample.header();
            let expected = wire::Expected {
                session: self.service.session(),
                view: self.view,
                now_nanos: now_nanos(),
            };
            match expected.check(&header.stamp, &header.timing) {
                Ok(()) => return Ok(Some(sample)),
                Err(error) => self.refuse(&error),
            }
        }
        Ok(None)
    }

    fn refuse(&self, error: &wire::WireError) {
        let health = self.service.health();
        health.refuse(error.refusal(), "evidence", error);
    }

    /// Gives back what is older than `frame`, and takes what there is up to it.
    pub(crate) fn advance(&mut self, frame: u64) -> Result<(), Failure> {
        let wanted = frame..=frame.saturating_add(FAR.saturating_mul(self.frame_step));
        let is_wanted =
            |it: &Sample<f32, EvidenceHeader>| wanted.contains(&it.header().stamp.frame);
        while !self.held.as_ref().is_some_and(is_wanted) {
            self.held = None;
            match self.take()? {
                Some(sample) => self.held = Some(sample),
                None => return Ok(()),
            }
        }
        Ok(())
    }

    /// The evidence of exactly this frame, if it is there and well formed.
    pub(crate) fn of<'b>(&'b self, frame: u64, plan: &'b ViewPlan) -> Option<EvidenceView<'b>> {
        let sample = self.held.as_ref()?;
        if sample.header().stamp.frame != frame {
            return None;
        }
        let read = wire::evidence_from_message(sample.header(), sample.payload(), plan.layout());
        match read {
            Ok(evidence) => Some(evidence),
            Err(error) => {
                self.refuse(&error);
                None
            }
        }
    }
}
