//! The frames of a view, held where they lie until their poses come.

use messages::FrameHeader;
use runtime::{Delivery, Failure, Sample, Service, SliceSubscriber, now_nanos};

/// Frames that are held at the same time where the latest wins: three that wait, and one that is taken.
pub const HELD_REALTIME: usize = 4;
/// So far ahead of the poses is nobody but who counts wrong, frames of the footage that are used.
const FAR: u64 = 4096;

/// Frames that wait for their poses.
#[derive(Debug)]
pub(crate) struct Frames<'a> {
    subscriber: SliceSubscriber<u8, FrameHeader>,
    held: Vec<Sample<u8, FrameHeader>>,
    service: &'a Service,
    view: usize,
    frame_step: u64,
}

impl<'a> Frames<'a> {
    /// * `frame_step`: distance between the frames used, at least 1.
    pub(crate) fn new(
        subscriber: SliceSubscriber<u8, FrameHeader>,
        service: &'a Service,
        view: usize,
        frame_step: u64,
    ) -> Self {
        Self {
            subscriber,
            held: Vec::new(),
            service,
            view,
            frame_step: frame_step.max(1),
        }
    }

    /// Takes in what has come: one frame where nothing may be lost, for its sender waits; else all, and
    /// keeps those that are likeliest to be asked for.
    pub(crate) fn listen(&mut self) -> Result<(), Failure> {
        while self.service.delivery() == Delivery::Realtime || self.held.is_empty() {
            match self.subscriber.receive()? {
                Some(it) if self.is_ours(&it) => self.held.push(it),
                Some(_) => {}
                None => break,
            }
            if self.held.len() == HELD_REALTIME {
                let nth = |it: &Sample<u8, FrameHeader>| it.header().stamp.frame / self.frame_step;
                let held: Vec<u64> = self.held.iter().map(nth).collect();
                self.held.remove(least_wanted(&held));
            }
        }
        Ok(())
    }

    /// Gives back what is older than a frame, and takes what there is up to it.
    pub(crate) fn advance(&mut self, frame: u64) -> Result<(), Failure> {
        let wanted = frame..=frame.saturating_add(FAR.saturating_mul(self.frame_step));
        let is_wanted = |it: &Sample<_, FrameHeader>| wanted.contains(&it.header().stamp.frame);
        self.held.retain(is_wanted);
        while self.service.delivery() == Delivery::Lossless && self.held.is_empty() {
            match self.subscriber.receive()? {
                Some(it) => {
                    if is_wanted(&it) && self.is_ours(&it) {
                        self.held.push(it);
                    }
                }
                None => break,
            }
        }
        Ok(())
    }

    /// Whether a frame is one of this view and run; counts it if it is not.
    fn is_ours(&self, frame: &Sample<u8, FrameHeader>) -> bool {
        let expected = wire::Expected {
            session: self.service.session(),
            view: self.view,
            now_nanos: now_nanos(),
        };
        let checked = wire::check_frame(frame.header(), frame.payload().len(), &expected);
        if let Err(error) = &checked {
            self.service
                .health()
                .refuse(error.refusal(), "frame", error);
        }
        checked.is_ok()
    }

    /// A frame, if it is there.
    pub(crate) fn of(&self, frame: u64) -> Option<&Sample<u8, FrameHeader>> {
        self.held.iter().find(|it| it.header().stamp.frame == frame)
    }
}

/// Which of several frames goes first: poses are those of every n-th frame, n a power of two, so the one
/// that is divided by the smallest power, and of these the oldest.
fn least_wanted(nth: &[u64]) -> usize {
    let keys = nth.iter().enumerate();
    let least = keys.min_by_key(|it| (it.1.trailing_zeros(), *it.1));
    least.map_or(0, |it| it.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_frames_of_every_stride_are_kept_longest() {
        assert_eq!(least_wanted(&[4, 5, 6]), 1);
        assert_eq!(least_wanted(&[4, 6, 8]), 1);
        assert_eq!(least_wanted(&[3, 4, 5]), 0, "the oldest of odd ones");
        assert_eq!(least_wanted(&[0, 8, 12]), 2);
    }
}
