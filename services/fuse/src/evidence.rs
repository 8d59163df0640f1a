//! The response maps of the views a worker reads, one frame of each held where it lies.

use messages::{EvidenceHeader, topic};
use multiview::ViewPlan;
use runtime::{Failure, Sample, Service, SliceSubscriber, Waiter};
use wire::EvidenceView;

/// The evidence of one view.
#[derive(Debug)]
pub(crate) struct Evidence {
    subscriber: SliceSubscriber<f32, EvidenceHeader>,
    held: Option<Sample<f32, EvidenceHeader>>,
    session: u64,
}

impl Evidence {
    pub(crate) fn open(
        service: &Service,
        view: usize,
        waiter: &mut Waiter,
    ) -> Result<Self, Failure> {
        let topic = topic::evidence(view);
        Ok(Self {
            subscriber: service.bus().slice_subscriber(&topic, waiter)?,
            held: None,
            session: service.session(),
        })
    }

    /// Takes what there is if nothing is held; its sender waits until it has been heard once.
    pub(crate) fn listen(&mut self) -> Result<(), Failure> {
        if self.held.is_none() {
            self.held = self.subscriber.receive()?;
        }
        Ok(())
    }

    /// Gives back what is older than `frame`, and takes what there is up to it.
    pub(crate) fn advance(&mut self, frame: u64) -> Result<(), Failure> {
        let is_old = |it: &Sample<f32, EvidenceHeader>, session| {
            it.header().stamp.session != session || it.header().stamp.frame < frame
        };
        while self.held.as_ref().is_none_or(|it| is_old(it, self.session)) {
            self.held = None;
            match self.subscriber.receive()? {
                Some(sample) => self.held = Some(sample),
                None => return Ok(()),
            }
        }
        Ok(())
    }

    /// The evidence of exactly this frame, if it is there and well formed.
    pub(crate) fn of<'a>(&'a self, frame: u64, plan: &'a ViewPlan) -> Option<EvidenceView<'a>> {
        let sample = self.held.as_ref()?;
        if sample.header().stamp.frame != frame {
            return None;
        }
        let read = wire::evidence_from_message(sample.header(), sample.payload(), plan.layout());
        match read {
            Ok(evidence) => Some(evidence),
            Err(error) => {
                tracing::warn!(frame, %error, "unreadable evidence");
                None
            }
        }
    }
}
