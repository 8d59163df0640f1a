//! Joins the messages of several inputs about one frame; the wait is always limited.
//!
//! A frame is complete once every input has sent its message about it, or is no longer expected to. An input is no longer expected to send
//! the message if it has sent a message about a later frame, if its stream has ended, or if it has been silent for too long and counts as
//! down. This module does not read a clock: the caller passes the time, so that every rule can be tested without waiting.

mod cadence;
mod last;

use std::collections::BTreeMap;

pub use cadence::Cadence;
pub use last::Last;

/// The messages of all inputs about one frame.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Joined<T> {
    /// Number of the frame.
    pub frame: u64,
    /// One entry per input; `None` if no message arrived in time.
    pub items: Vec<Option<T>>,
}

/// Outcome of adding a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Push {
    /// The message was accepted, and waits for the messages of the other inputs.
    Taken,
    /// The frame of the message has already been returned, or the input has already sent a message about this frame.
    Late,
    /// Too many frames are pending.
    Full,
}

/// Maximum number of pending frames. More would mean hours of frames, or a sender with wrong frame numbers.
const MAX_PENDING: usize = 1 << 16;
/// Time within which a restarted sender sends its messages about frames that had begun before the restart; after that, it is assumed to
/// have forgotten the other frames.
const TAKEN_UP_NANOS: u64 = 1_000_000_000;

/// Collects messages by frame, and returns frames in order.
#[derive(Debug)]
pub struct Joiner<T> {
    inputs: Vec<Input>,
    pending: BTreeMap<u64, Slot<T>>,
    patience_nanos: u64,
    alive_patience_nanos: u64,
    /// All frames below this number have been returned.
    next_frame: u64,
}

#[derive(Debug, Clone, Copy, Default)]
struct Input {
    last_frame: Option<u64>,
    received_at: Option<u64>,
    alive_at: Option<u64>,
    ended: bool,
    down: bool,
    /// Maximum time for which a frame waits for this input.
    deadline: Option<u64>,
    /// Time at which the sender of the input was restarted.
    restarted_at: Option<u64>,
}

impl Input {
    /// Returns true if the sender of the input was restarted after a frame began, and has since had time to send the messages that it still
    /// has about the frame.
    fn has_forgotten(&self, began_at: u64, now: u64) -> bool {
        self.restarted_at
            .is_some_and(|at| began_at < at && now.saturating_sub(at) >= TAKEN_UP_NANOS)
    }

    /// Returns true if the input has been silent for too long.
    ///
    /// * `patience`: the limit if the sender is not known to be alive, and the limit if it is.
    fn silent_since(&self, began_at: u64, now: u64, patience: [u64; 2]) -> bool {
        let elapsed = |at: u64| now.saturating_sub(at);
        let silence = elapsed(began_at.max(self.received_at.unwrap_or(0)));
        let absence = silence.min(self.alive_at.map_or(u64::MAX, elapsed));
        let is_overdue = self.deadline.is_some_and(|deadline| elapsed(began_at) >= deadline);
        is_overdue || absence >= patience[0] || silence >= patience[1]
    }
}

#[derive(Debug)]
struct Slot<T> {
    items: Vec<Option<T>>,
    began_at: u64,
}

impl<T> Joiner<T> {
    /// Creates a joiner of `n_inputs` inputs.
    ///
    /// * `patience_nanos`: maximum time for which an input may be silent while others wait for it.
    pub fn new(n_inputs: usize, patience_nanos: u64) -> Self {
        Self {
            inputs: vec![Input::default(); n_inputs],
            pending: BTreeMap::new(),
            patience_nanos,
            alive_patience_nanos: patience_nanos,
            next_frame: 0,
        }
    }

    /// Works like [`Self::new`], for lossless delivery. An input whose sender is known to be alive may be silent for ten times as long,
    /// because the sender may still be computing.
    pub fn lossless(n_inputs: usize, patience_nanos: u64) -> Self {
        Self {
            alive_patience_nanos: patience_nanos.saturating_mul(10),
            ..Self::new(n_inputs, patience_nanos)
        }
    }

    /// Makes an input optional: no frame waits for it longer than `deadline_nanos`, even if its sender is alive.
    pub fn set_deadline(&mut self, input: usize, deadline_nanos: u64) {
        if let Some(input) = self.inputs.get_mut(input) {
            input.deadline = Some(deadline_nanos);
        }
    }

    /// Records that the sender of an input was restarted and has forgotten the messages that it had received. Frames that have already
    /// begun wait for the input for one more second.
    pub fn restarted(&mut self, input: usize, now: u64) {
        if let Some(input) = self.inputs.get_mut(input) {
            input.restarted_at = Some(now);
        }
    }

    /// Records that the sender of an input is alive, although it has sent no message.
    pub fn alive(&mut self, input: usize, now: u64) {
        if let Some(input) = self.inputs.get_mut(input) {
            input.alive_at = Some(now);
        }
    }

    /// Adds a message.
    ///
    /// * `input`: index of the input. If there is no such input, the result is [`Push::Late`].
    /// * `now`: nanoseconds of a clock that never goes back.
    pub fn push(&mut self, input: usize, frame: u64, item: T, now: u64) -> Push {
        let n = self.inputs.len();
        let Some(state) = self.inputs.get_mut(input) else {
            return Push::Late;
        };
        state.received_at = Some(now);
        state.down = false;
        // The number is set even if it is lower than before: after one wrong frame number far ahead, later frames then wait for this input
        // again.
        state.last_frame = Some(frame);
        if frame < self.next_frame {
            return Push::Late;
        }
        if self.pending.len() >= MAX_PENDING && !self.pending.contains_key(&frame) {
            return Push::Full;
        }
        let slot = self.pending.entry(frame).or_insert_with(|| Slot {
            items: (0..n).map(|_| None).collect(),
            began_at: now,
        });
        if slot.items[input].is_some() {
            return Push::Late;
        }
        slot.items[input] = Some(item);
        Push::Taken
    }

    /// Records the end of an input's stream.
    pub fn end(&mut self, input: usize) {
        if let Some(input) = self.inputs.get_mut(input) {
            input.ended = true;
        }
    }

    /// Returns the earliest pending frame, if it is complete.
    ///
    /// Call this until it returns `None`, because several frames may have become complete at once. While an input is down, frames do not
    /// wait for it.
    pub fn next(&mut self, now: u64) -> Option<Joined<T>> {
        let (&frame, slot) = self.pending.first_key_value()?;
        let patience = [self.patience_nanos, self.alive_patience_nanos];
        for (input, item) in self.inputs.iter_mut().zip(&slot.items) {
            let is_past = input.last_frame.is_some_and(|last| last > frame);
            let is_past = is_past || input.has_forgotten(slot.began_at, now);
            if item.is_some() || input.ended || input.down || is_past {
                continue;
            }
            if input.silent_since(slot.began_at, now, patience) {
                input.down = true;
            } else {
                return None;
            }
        }
        let (frame, slot) = self.pending.pop_first()?;
        self.next_frame = frame.saturating_add(1);
        Some(Joined {
            frame,
            items: slot.items,
        })
    }

    /// Returns the latest complete frame for which `wants` returns true, and the number of skipped frames.
    ///
    /// * `wants`: function that returns true if a frame has to be processed.
    pub fn latest(
        &mut self,
        now: u64,
        wants: impl Fn(&Joined<T>) -> bool,
    ) -> (Option<Joined<T>>, u64) {
        let mut latest = None;
        let mut n_skipped = 0;
        while let Some(later) = self.next(now) {
            let has_skipped = if wants(&later) {
                latest.replace(later).is_some()
            } else {
                true
            };
            n_skipped += u64::from(has_skipped);
        }
        (latest, n_skipped)
    }

    /// Returns true if frames do not wait for an input because it has been silent for too long.
    pub fn is_down(&self, input: usize) -> bool {
        self.inputs.get(input).is_some_and(|input| input.down)
    }

    /// Returns the number of frames that wait for a message.
    pub fn n_pending(&self) -> usize {
        self.pending.len()
    }

    /// Returns true if no more frames will follow. This is the case if all frames were returned, at least one input has ended, and each
    /// other input has ended or been silent for too long.
    pub fn is_over(&self, now: u64) -> bool {
        let patience = [self.patience_nanos, self.alive_patience_nanos];
        let is_silent = |input: &Input| {
            input.received_at.is_some_and(|at| input.silent_since(at, now, patience))
        };
        self.pending.is_empty()
            && self.inputs.iter().any(|input| input.ended)
            && self.inputs.iter().all(|input| input.ended || input.down || is_silent(input))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn frames<T>(joiner: &mut Joiner<T>, now: u64) -> Vec<(u64, Vec<bool>)> {
        std::iter::from_fn(|| joiner.next(now))
            .map(|joined| {
                let is_there = joined.items.iter().map(Option::is_some).collect();
                (joined.frame, is_there)
            })
            .collect()
    }

    #[test]
    fn a_frame_waits_for_every_input() {
        let mut joiner = Joiner::new(2, 100);
        joiner.push(0, 0, 'a', 0);
        assert_eq!(frames(&mut joiner, 50), []);
        joiner.push(1, 0, 'b', 60);
        let got = joiner.next(60).unwrap();
        assert_eq!(got.items, [Some('a'), Some('b')]);
    }

    #[test]
    fn after_one_wrong_frame_number_frames_wait_for_the_input_again() {
        let mut joiner = Joiner::new(2, 100);
        joiner.push(1, u64::MAX, (), 0);
        joiner.push(0, 0, (), 0);
        assert_eq!(frames(&mut joiner, 0), [(0, vec![true, false])]);
        joiner.push(1, 1, (), 10);
        joiner.push(0, 2, (), 10);
        assert_eq!(frames(&mut joiner, 10), [(1, vec![false, true])]);
        joiner.push(1, 2, (), 20);
        assert_eq!(frames(&mut joiner, 20), [(2, vec![true, true])]);
        joiner.end(0);
        joiner.end(1);
        assert_eq!(frames(&mut joiner, 30), [(u64::MAX, vec![false, true])]);
        assert!(joiner.is_over(30));
    }

    #[test]
    fn the_number_of_pending_frames_is_bounded() {
        let mut joiner = Joiner::new(2, 100);
        for frame in 0..MAX_PENDING as u64 {
            assert_eq!(joiner.push(1, frame, (), 0), Push::Taken);
        }
        assert_eq!(joiner.push(1, 1 << 20, (), 0), Push::Full);
        assert_eq!(joiner.push(0, 5, (), 0), Push::Taken, "a pending frame");
        assert_eq!(joiner.n_pending(), MAX_PENDING);
    }

    #[test]
    fn a_frame_does_not_wait_for_an_input_that_is_past_it() {
        let mut joiner = Joiner::new(2, 100);
        joiner.push(0, 0, (), 0);
        joiner.push(1, 1, (), 0);
        assert_eq!(frames(&mut joiner, 0), [(0, vec![true, false])]);
    }

    #[test]
    fn no_frame_waits_for_a_silent_input_until_it_sends_again() {
        let mut joiner = Joiner::new(2, 100);
        joiner.push(0, 0, (), 10);
        assert_eq!(frames(&mut joiner, 109), []);
        assert_eq!(frames(&mut joiner, 110), [(0, vec![true, false])]);
        assert!(joiner.is_down(1));
        joiner.push(0, 1, (), 120);
        assert_eq!(frames(&mut joiner, 120), [(1, vec![true, false])]);
        joiner.push(1, 2, (), 130);
        assert!(!joiner.is_down(1));
        assert_eq!(frames(&mut joiner, 130), []);
    }

    #[test]
    fn a_frame_waits_for_a_slow_input_that_still_sends() {
        let mut joiner = Joiner::new(2, 100);
        for frame in 0..4 {
            joiner.push(0, frame, (), 0);
        }
        for frame in 0..4 {
            let now = 90 * (frame + 1);
            assert_eq!(frames(&mut joiner, now), []);
            joiner.push(1, frame, (), now);
            assert_eq!(frames(&mut joiner, now), [(frame, vec![true, true])]);
        }
    }

    #[test]
    fn a_lossless_join_waits_longer_for_a_living_sender() {
        let mut joiner = Joiner::lossless(2, 100);
        joiner.push(0, 0, (), 0);
        for now in (0..1000).step_by(50) {
            joiner.alive(1, now);
            assert_eq!(frames(&mut joiner, now), []);
        }
        assert_eq!(frames(&mut joiner, 1000), [(0, vec![true, false])]);
    }

    #[test]
    fn no_frame_waits_for_an_optional_input_past_its_deadline() {
        let mut joiner = Joiner::lossless(2, 1000);
        joiner.set_deadline(1, 30);
        joiner.push(0, 0, 'a', 0);
        joiner.alive(1, 29);
        assert_eq!(frames(&mut joiner, 29), []);
        joiner.alive(1, 30);
        assert_eq!(frames(&mut joiner, 30), [(0, vec![true, false])]);
        // Frames do not wait for the input until it sends again; a late message is enough.
        joiner.push(0, 1, 'b', 40);
        assert_eq!(frames(&mut joiner, 40), [(1, vec![true, false])]);
        assert_eq!(joiner.push(1, 0, 'c', 45), Push::Late);
        joiner.push(0, 2, 'd', 50);
        assert_eq!(frames(&mut joiner, 79), []);
        assert_eq!(frames(&mut joiner, 80), [(2, vec![true, false])]);
    }

    #[test]
    fn a_lossless_join_waits_less_long_without_a_living_sender() {
        let mut joiner = Joiner::lossless(2, 100);
        joiner.push(0, 0, (), 0);
        joiner.alive(1, 50);
        assert_eq!(frames(&mut joiner, 149), []);
        assert_eq!(frames(&mut joiner, 150), [(0, vec![true, false])]);
    }

    #[test]
    fn a_message_about_a_returned_frame_is_late() {
        let mut joiner = Joiner::new(2, 100);
        joiner.push(0, 5, (), 0);
        joiner.push(1, 6, (), 0);
        assert_eq!(frames(&mut joiner, 0), [(5, vec![true, false])]);
        assert_eq!(joiner.push(1, 5, (), 1), Push::Late);
        assert_eq!(joiner.push(1, 6, (), 1), Push::Late);
        assert_eq!(joiner.push(7, 9, (), 1), Push::Late);
    }

    #[test]
    fn no_frame_waits_for_messages_lost_by_a_restarted_sender() {
        let mut joiner = Joiner::lossless(2, 100 * TAKEN_UP_NANOS);
        joiner.push(0, 0, (), 10);
        joiner.push(0, 1, (), 20);
        joiner.restarted(1, 50);
        joiner.push(0, 2, (), 60);
        assert_eq!(frames(&mut joiner, 49 + TAKEN_UP_NANOS), []);
        let both = [(0, vec![true, false]), (1, vec![true, false])];
        assert_eq!(frames(&mut joiner, 50 + TAKEN_UP_NANOS), both);
        joiner.push(1, 2, (), 51 + TAKEN_UP_NANOS);
        let got = frames(&mut joiner, 51 + TAKEN_UP_NANOS);
        assert_eq!(got, [(2, vec![true, true])]);
    }

    #[test]
    fn latest_skips_earlier_frames() {
        let mut joiner = Joiner::new(1, 100);
        for frame in 0..3 {
            joiner.push(0, frame, frame, 0);
        }
        let (got, n_skipped) = joiner.latest(0, |_| true);
        assert_eq!((got.unwrap().frame, n_skipped), (2, 2));
    }

    #[test]
    fn latest_skips_frames_that_are_not_wanted() {
        let mut joiner = Joiner::new(1, 100);
        for frame in 0..5 {
            joiner.push(0, frame, frame, 0);
        }
        let (got, n_skipped) = joiner.latest(0, |joined| joined.frame == 3);
        assert_eq!((got.unwrap().frame, n_skipped), (3, 4));
        joiner.push(0, 5, 5, 0);
        assert_eq!(joiner.latest(0, |_| false), (None, 1));
    }

    #[test]
    fn the_join_is_finished_when_all_inputs_have_ended_and_all_frames_are_returned() {
        let mut joiner = Joiner::new(2, 100);
        joiner.push(0, 0, (), 0);
        joiner.end(0);
        joiner.end(1);
        assert!(!joiner.is_over(0));
        assert_eq!(frames(&mut joiner, 0).len(), 1);
        assert!(joiner.is_over(0));
    }

    #[test]
    fn an_input_that_fell_silent_before_its_end_does_not_prevent_the_end() {
        let mut joiner = Joiner::new(2, 100);
        joiner.push(0, 0, (), 0);
        joiner.push(1, 0, (), 0);
        assert_eq!(frames(&mut joiner, 0).len(), 1);
        joiner.end(0);
        assert!(!joiner.is_over(99));
        assert!(joiner.is_over(100));
    }

    #[test]
    fn the_join_is_not_finished_before_an_input_has_ended() {
        let mut joiner: Joiner<()> = Joiner::new(2, 100);
        assert!(!joiner.is_over(u64::MAX));
        joiner.push(0, 0, (), 0);
        assert_eq!(frames(&mut joiner, 1000).len(), 1);
        assert!(!joiner.is_over(u64::MAX));
    }

    proptest! {
        #[test]
        fn every_accepted_message_is_returned_once_in_frame_order(
            events in prop::collection::vec((0_usize..3, 0_u64..8, 0_u64..40), 0..60),
        ) {
            let mut joiner = Joiner::new(3, 50);
            let (mut now, mut taken, mut returned, mut last) = (0, 0, 0, None);
            let mut drain = |joiner: &mut Joiner<u64>, now: u64| {
                while let Some(joined) = joiner.next(now) {
                    assert!(last < Some(joined.frame), "in order");
                    last = Some(joined.frame);
                    assert!(joined.items.iter().flatten().all(|item| *item == joined.frame));
                    returned += joined.items.iter().flatten().count();
                }
            };
            for (input, frame, pause) in events {
                now += pause;
                taken += usize::from(joiner.push(input, frame, frame, now) == Push::Taken);
                drain(&mut joiner, now);
            }
            drain(&mut joiner, now + 1000);
            prop_assert_eq!(joiner.n_pending(), 0);
            prop_assert_eq!(returned, taken);
        }
    }
}
