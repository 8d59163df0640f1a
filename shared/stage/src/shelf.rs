//! Bulk samples that are held until the frame that needs them arrives.

/// Number of frames that are held at the same time with realtime delivery: three that wait, and one that is being received.
pub const HELD_REALTIME: usize = 4;

/// Maximum distance of a frame number from the current frame, in used frames. A larger distance is a sender's error.
const MAX_AHEAD: u64 = 4096;

/// Samples of one topic with their frame numbers.
#[derive(Debug)]
pub(crate) struct Shelf<S> {
    held: Vec<(u64, S)>,
    capacity: usize,
    frame_step: u64,
}

impl<S> Shelf<S> {
    /// Creates a shelf.
    ///
    /// * `capacity`: number of samples that are held. With a capacity of 1, a sample is received only after the previous one has been
    ///   released; the sender waits until then. With a larger capacity, all samples are received, and those most likely to be needed are
    ///   kept.
    /// * `frame_step`: distance between the used frames.
    pub(crate) fn new(capacity: usize, frame_step: u64) -> Self {
        Self {
            held: Vec::with_capacity(capacity),
            capacity: capacity.max(1),
            frame_step: frame_step.max(1),
        }
    }

    /// Receives waiting samples while there is room.
    ///
    /// * `receive`: returns the oldest waiting sample.
    pub(crate) fn fill<E>(
        &mut self,
        mut receive: impl FnMut() -> Result<Option<(u64, S)>, E>,
    ) -> Result<(), E> {
        while self.capacity > 1 || self.held.is_empty() {
            let Some(sample) = receive()? else {
                return Ok(());
            };
            self.held.push(sample);
            if self.capacity > 1 && self.held.len() == self.capacity {
                let steps: Vec<u64> =
                    self.held.iter().map(|(frame, _)| frame / self.frame_step).collect();
                self.held.remove(least_needed(&steps));
            }
        }
        Ok(())
    }

    /// Releases the samples before `frame`, and receives the samples up to it.
    pub(crate) fn advance<E>(
        &mut self,
        frame: u64,
        mut receive: impl FnMut() -> Result<Option<(u64, S)>, E>,
    ) -> Result<(), E> {
        let wanted = frame..=frame.saturating_add(MAX_AHEAD.saturating_mul(self.frame_step));
        self.held.retain(|(held, _)| wanted.contains(held));
        while self.capacity == 1 && self.held.is_empty() {
            match receive()? {
                Some(sample) if wanted.contains(&sample.0) => self.held.push(sample),
                Some(_) => {}
                None => break,
            }
        }
        Ok(())
    }

    /// Returns the sample of a frame, if it is held.
    pub(crate) fn of(&self, frame: u64) -> Option<&S> {
        let found = self.held.iter().find(|(held, _)| *held == frame);
        found.map(|(_, sample)| sample)
    }

    /// Releases all samples.
    pub(crate) fn clear(&mut self) {
        self.held.clear();
    }
}

/// Returns the index of the frame that is released first. A slow stage processes every n-th frame, where n is a power of two. The released
/// frame is therefore the one whose number is divisible only by the smallest power of two; if there are several such frames, it is the
/// oldest.
fn least_needed(steps: &[u64]) -> usize {
    let keys = steps.iter().enumerate();
    let least = keys.min_by_key(|(_, step)| (step.trailing_zeros(), **step));
    least.map_or(0, |(index, _)| index)
}

#[cfg(test)]
mod tests {
    use std::collections::VecDeque;
    use std::convert::Infallible;

    use super::*;

    /// Returns a topic in which the given frames are waiting.
    fn topic(
        frames: impl IntoIterator<Item = u64>,
    ) -> impl FnMut() -> Result<Option<(u64, char)>, Infallible> {
        let mut waiting: VecDeque<u64> = frames.into_iter().collect();
        move || Ok(waiting.pop_front().map(|frame| (frame, 'x')))
    }

    #[test]
    fn frames_on_larger_strides_are_kept_longest() {
        assert_eq!(least_needed(&[4, 5, 6]), 1);
        assert_eq!(least_needed(&[4, 6, 8]), 1);
        assert_eq!(least_needed(&[3, 4, 5]), 0, "the oldest of odd ones");
        assert_eq!(least_needed(&[0, 8, 12]), 2);
    }

    #[test]
    fn with_capacity_one_a_sample_is_received_after_the_previous_one_is_released() {
        let mut shelf = Shelf::new(1, 1);
        let mut receive = topic(0..5);
        shelf.fill(&mut receive).unwrap();
        shelf.fill(&mut receive).unwrap();
        assert!(shelf.of(0).is_some() && shelf.of(1).is_none());
        shelf.advance(3, &mut receive).unwrap();
        assert!(shelf.of(3).is_some() && shelf.of(0).is_none());
        shelf.advance(4, &mut receive).unwrap();
        shelf.advance(5, &mut receive).unwrap();
        assert!(shelf.of(4).is_none());
    }

    #[test]
    fn with_more_capacity_all_samples_are_received_and_the_most_likely_needed_are_kept() {
        let mut shelf = Shelf::new(4, 1);
        shelf.fill(topic(0..7)).unwrap();
        let held: Vec<u64> = (0..7).filter(|frame| shelf.of(*frame).is_some()).collect();
        assert_eq!(held, [0, 4, 6]);
        shelf.advance(5, topic([])).unwrap();
        assert!(shelf.of(4).is_none() && shelf.of(6).is_some());
    }

    #[test]
    fn a_sample_with_a_frame_number_far_ahead_is_released() {
        let mut shelf = Shelf::new(1, 2);
        shelf.fill(topic([u64::MAX])).unwrap();
        shelf.advance(4, topic([4 + 2 * MAX_AHEAD + 2, 4])).unwrap();
        assert!(shelf.of(4).is_some());
    }
}
