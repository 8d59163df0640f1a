//! The loop of a stage with one stream of frames, each of which is processed when it arrives.

use failure::{Failure, now_nanos};
use messages::{Cause, FrameHeader, Stamp, Status, topic};
use runtime::{Delivery, Place, Sample, SliceSubscriber, Woken};

use crate::intake::{Intake, Past};
use crate::stage::Stage;
use crate::{Context, Turn};

/// The used frames of a view.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Range {
    /// Number of the first used frame.
    pub start: u64,
    /// Distance between used frames.
    pub step: u64,
}

/// A frame of a stream.
#[derive(Debug)]
pub struct StreamFrame {
    /// Position of the frame among the used frames, counted from 0.
    pub nth: u64,
    /// Pixels and header, in shared memory.
    pub sample: Sample<u8, FrameHeader>,
    /// Stamp and times for the messages to send.
    pub turn: Turn,
}

impl Stage<'_, ()> {
    /// Processes the frames of a view until the footage ends or a stop is requested. Then sends the end of the stream.
    ///
    /// With realtime delivery, frames are skipped and counted if there is no time for them. A restarted process counts the frames that were
    /// lost since its previous epoch.
    ///
    /// # Errors
    ///
    /// Returns errors of the transport and of `step`.
    pub fn run_stream(
        mut self,
        view: usize,
        range: Range,
        mut step: impl FnMut(StreamFrame) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        let service = self.service;
        let context = Context::of(service);
        let bus = service.bus();
        let frames: SliceSubscriber<u8, FrameHeader> =
            bus.slice_subscriber(&topic::frame(view), &mut self.waiter)?;
        self.wait_for_receivers();
        let mut place = Place::of(bus);
        let past = place.noted().filter(|_| service.epoch() > 0);
        let past = past.map(Past::from_numbers).unwrap_or_default();
        let mut intake = Intake::new(service.delivery(), [range.start, range.step], past);
        while self.waiter.wait(core::time::Duration::from_millis(100))? != Woken::Stop {
            while let Some(sample) = match service.delivery() {
                Delivery::Lossless => frames.receive()?,
                Delivery::Realtime => frames.latest()?,
            } {
                let header = *sample.header();
                let expected = context.expected(view);
                if let Err(error) = wire::check_frame(&header, sample.payload().len(), &expected) {
                    context.refuse_end("frame", &header.stamp, header.status, &error)?;
                    continue;
                }
                let is_end = header.status == Status::END;
                if !is_end && !intake.takes(&header) {
                    continue;
                }
                let n_lost = intake.n_lost_before(&header);
                service.health().dropped(Cause::Busy, n_lost);
                if is_end {
                    drop(sample);
                    return self.end_stream(header.stamp, &frames);
                }
                service.health().received(1);
                let begin = now_nanos();
                step(StreamFrame {
                    nth: intake.nth(header.stamp.frame),
                    turn: self.turn_of(&header, begin),
                    sample,
                })?;
                intake.processed(&header, now_nanos() - begin);
                if let Err(error) = place.note(intake.past().numbers()) {
                    tracing::debug!(%error, "cannot save the progress of this view");
                }
                if service.stop().is_requested() {
                    return Ok(());
                }
            }
        }
        Ok(())
    }

    fn turn_of(&self, header: &FrameHeader, received_at: u64) -> Turn {
        let stamp = Stamp {
            epoch: self.service.epoch(),
            ..header.stamp
        };
        Turn::new(stamp, received_at, Some(header.timing.sent_at_nanos))
    }

    fn end_stream(
        &self,
        stamp: Stamp,
        frames: &SliceSubscriber<u8, FrameHeader>,
    ) -> Result<(), Failure> {
        let drain = || {
            while frames.receive()?.is_some() {}
            Ok(())
        };
        self.linger(|| self.send_ends(stamp), drain)
    }
}
