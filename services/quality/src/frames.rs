//! The frames of a view, held where they lie until their poses come.

use messages::FrameHeader;
use runtime::{Delivery, Failure, Sample, Service, SliceSubscriber};

/// Frames that are held at the same time where the latest wins: three that wait, and one that is taken.
pub const HELD_REALTIME: usize = 4;

/// Frames that wait for their poses.
#[derive(Debug)]
pub(crate) struct Frames {
    subscriber: SliceSubscriber<u8, FrameHeader>,
    held: Vec<Sample<u8, FrameHeader>>,
    session: u64,
    delivery: Delivery,
    frame_step: u64,
}

impl Frames {
    /// * `frame_step`: distance between the frames used, at least 1.
    pub(crate) fn new(
        subscriber: SliceSubscriber<u8, FrameHeader>,
        service: &Service,
        frame_step: u64,
    ) -> Self {
        Self {
            subscriber,
            held: Vec::new(),
            session: service.session(),
            delivery: service.delivery(),
            frame_step: frame_step.max(1),
        }
    }

    /// Takes in what has come: one frame where nothing may be lost, for its sender waits; else all, and
    /// keeps those that are likeliest to be asked for.
    pub(crate) fn listen(&mut self) -> Result<(), Failure> {
        while self.delivery == Delivery::Realtime || self.held.is_empty() {
            match self.subscriber.receive()? {
                Some(it) if it.header().stamp.session == self.session => self.held.push(it),
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
        self.held.retain(|it| it.header().stamp.frame >= frame);
        while self.delivery == Delivery::Lossless && self.held.is_empty() {
            match self.subscriber.receive()? {
                Some(it) => {
                    let stamp = it.header().stamp;
                    if stamp.session == self.session && stamp.frame >= frame {
                        self.held.push(it);
                    }
                }
                None => break,
            }
        }
        Ok(())
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
