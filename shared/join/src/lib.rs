//! Brings together what several senders say about one frame, and never waits for ever.
//!
//! A frame is complete once every input has spoken about it, or can no longer do so: it has spoken
//! about a later one, it has ended, or it has been silent for too long and counts as down. Nothing
//! here reads a clock: the caller says what time it is, so every rule is tested without waiting.
#![forbid(unsafe_code)]

mod cadence;
mod last;

use std::collections::BTreeMap;

pub use cadence::Cadence;
pub use last::Last;

/// What was brought together about one frame.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Joined<T> {
    /// Index of the frame.
    pub frame: u64,
    /// One entry per input; `None` where it said nothing in time.
    pub items: Vec<Option<T>>,
}

/// What became of a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Push {
    /// It waits for the others.
    Taken,
    /// Its frame has already been given out, or its input has already spoken about that frame.
    Late,
    /// So many frames wait for others that there is no room for one more.
    Full,
}

/// Most frames that wait at the same time: hours of them, or a sender that counts wrong.
const MOST_PENDING: usize = 1 << 16;

/// Collects messages by frame, in the order of frames.
#[derive(Debug)]
pub struct Joiner<T> {
    inputs: Vec<Input>,
    pending: BTreeMap<u64, Slot<T>>,
    patience_nanos: u64,
    alive_patience_nanos: u64,
    /// Frames below this have been given out.
    next_frame: u64,
}

#[derive(Debug, Clone, Copy, Default)]
struct Input {
    last_frame: Option<u64>,
    heard_at: Option<u64>,
    alive_at: Option<u64>,
    ended: bool,
    down: bool,
    /// How long a frame waits for it at most.
    deadline: Option<u64>,
}

impl Input {
    /// Whether it has been silent for too long; `patience` with nobody there, and with somebody.
    fn silent_since(&self, began_at: u64, now: u64, patience: [u64; 2]) -> bool {
        let elapsed = |at: u64| now.saturating_sub(at);
        let silence = elapsed(began_at.max(self.heard_at.unwrap_or(0)));
        let absence = silence.min(self.alive_at.map_or(u64::MAX, elapsed));
        let is_overdue = self.deadline.is_some_and(|it| elapsed(began_at) >= it);
        is_overdue || absence >= patience[0] || silence >= patience[1]
    }
}

#[derive(Debug)]
struct Slot<T> {
    items: Vec<Option<T>>,
    began_at: u64,
}

impl<T> Joiner<T> {
    /// A joiner of so many inputs.
    ///
    /// * `patience_nanos`: how long an input may be silent while others wait for it.
    pub fn new(n_inputs: usize, patience_nanos: u64) -> Self {
        Self {
            inputs: vec![Input::default(); n_inputs],
            pending: BTreeMap::new(),
            patience_nanos,
            alive_patience_nanos: patience_nanos,
            next_frame: 0,
        }
    }

    /// As [`Self::new`], where nothing may be lost: an input that is known to be alive may take ten times
    /// as long, for it is computing.
    pub fn lossless(n_inputs: usize, patience_nanos: u64) -> Self {
        Self {
            alive_patience_nanos: patience_nanos.saturating_mul(10),
            ..Self::new(n_inputs, patience_nanos)
        }
    }

    /// Says that no frame waits for an input longer than this, however alive its sender is: its words
    /// are welcome and not necessary.
    pub fn hurry(&mut self, input: usize, deadline_nanos: u64) {
        if let Some(it) = self.inputs.get_mut(input) {
            it.deadline = Some(deadline_nanos);
        }
    }

    /// Notes that whoever sends on an input is alive, though it has nothing to say yet.
    pub fn alive(&mut self, input: usize, now: u64) {
        if let Some(it) = self.inputs.get_mut(input) {
            it.alive_at = Some(now);
        }
    }

    /// Takes a message.
    ///
    /// * `input`: who sends, below the number of inputs; another is ignored as late.
    /// * `now`: nanoseconds of a clock that never goes back.
    pub fn push(&mut self, input: usize, frame: u64, item: T, now: u64) -> Push {
        let n = self.inputs.len();
        let Some(it) = self.inputs.get_mut(input) else {
            return Push::Late;
        };
        it.heard_at = Some(now);
        it.down = false;
        // Not the largest: who once spoke of a frame far ahead is waited for again once it counts right.
        it.last_frame = Some(frame);
        if frame < self.next_frame {
            return Push::Late;
        }
        if self.pending.len() >= MOST_PENDING && !self.pending.contains_key(&frame) {
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

    /// Notes that an input will say no more.
    pub fn end(&mut self, input: usize) {
        if let Some(it) = self.inputs.get_mut(input) {
            it.ended = true;
        }
    }

    /// The earliest frame, if nothing more is to be expected for it.
    ///
    /// Call it until it gives `None`: several frames may have become complete at once. An input that
    /// is given up on is not waited for again until it speaks.
    pub fn next(&mut self, now: u64) -> Option<Joined<T>> {
        let (&frame, slot) = self.pending.first_key_value()?;
        let patience = [self.patience_nanos, self.alive_patience_nanos];
        for (it, item) in self.inputs.iter_mut().zip(&slot.items) {
            let past = it.ended || it.down || it.last_frame.is_some_and(|last| last > frame);
            if item.is_some() || past {
                continue;
            }
            if it.silent_since(slot.began_at, now, patience) {
                it.down = true;
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

    /// The latest complete frame that is wanted, and how many others were passed over.
    ///
    /// * `wants`: whether a frame is one of those that are taken.
    pub fn latest(
        &mut self,
        now: u64,
        wants: impl Fn(&Joined<T>) -> bool,
    ) -> (Option<Joined<T>>, u64) {
        let mut latest = None;
        let mut n_passed = 0;
        while let Some(later) = self.next(now) {
            let passed = if wants(&later) {
                latest.replace(later).is_some()
            } else {
                true
            };
            n_passed += u64::from(passed);
        }
        (latest, n_passed)
    }

    /// Inputs that are not waited for because they fell silent.
    pub fn is_down(&self, input: usize) -> bool {
        self.inputs.get(input).is_some_and(|it| it.down)
    }

    /// Frames that wait for somebody.
    pub fn n_pending(&self) -> usize {
        self.pending.len()
    }

    /// Whether there is nothing more to come: all inputs have ended, or one has and the others have
    /// been silent for too long, and every frame was given out.
    pub fn is_over(&self, now: u64) -> bool {
        let patience = [self.patience_nanos, self.alive_patience_nanos];
        let silent = |it: &Input| {
            it.heard_at
                .is_some_and(|at| it.silent_since(at, now, patience))
        };
        self.pending.is_empty()
            && self.inputs.iter().any(|it| it.ended)
            && self
                .inputs
                .iter()
                .all(|it| it.ended || it.down || silent(it))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn frames<T>(joiner: &mut Joiner<T>, now: u64) -> Vec<(u64, Vec<bool>)> {
        std::iter::from_fn(|| joiner.next(now))
            .map(|it| (it.frame, it.items.iter().map(Option::is_some).collect()))
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
    fn who_once_counted_wrong_is_waited_for_again() {
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
    fn who_speaks_of_ever_more_frames_fills_no_memory() {
        let mut joiner = Joiner::new(2, 100);
        for frame in 0..MOST_PENDING as u64 {
            assert_eq!(joiner.push(1, frame, (), 0), Push::Taken);
        }
        assert_eq!(joiner.push(1, 1 << 20, (), 0), Push::Full);
        assert_eq!(joiner.push(0, 5, (), 0), Push::Taken, "a frame that waits");
        assert_eq!(joiner.n_pending(), MOST_PENDING);
    }

    #[test]
    fn an_input_that_has_gone_on_is_not_waited_for() {
        let mut joiner = Joiner::new(2, 100);
        joiner.push(0, 0, (), 0);
        joiner.push(1, 1, (), 0);
        assert_eq!(frames(&mut joiner, 0), [(0, vec![true, false])]);
    }

    #[test]
    fn a_silent_input_is_down_until_it_speaks() {
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
    fn an_input_that_is_slow_but_alive_is_waited_for() {
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
    fn an_input_that_is_there_may_take_longer() {
        let mut joiner = Joiner::lossless(2, 100);
        joiner.push(0, 0, (), 0);
        for now in (0..1000).step_by(50) {
            joiner.alive(1, now);
            assert_eq!(frames(&mut joiner, now), []);
        }
        assert_eq!(frames(&mut joiner, 1000), [(0, vec![true, false])]);
    }

    #[test]
    fn no_frame_waits_for_a_welcome_word_past_its_deadline() {
        let mut joiner = Joiner::lossless(2, 1000);
        joiner.hurry(1, 30);
        joiner.push(0, 0, 'a', 0);
        joiner.alive(1, 29);
        assert_eq!(frames(&mut joiner, 29), []);
        joiner.alive(1, 30);
        assert_eq!(frames(&mut joiner, 30), [(0, vec![true, false])]);
        // It is not waited for again until it speaks, though it speaks too late.
        joiner.push(0, 1, 'b', 40);
        assert_eq!(frames(&mut joiner, 40), [(1, vec![true, false])]);
        assert_eq!(joiner.push(1, 0, 'c', 45), Push::Late);
        joiner.push(0, 2, 'd', 50);
        assert_eq!(frames(&mut joiner, 79), []);
        assert_eq!(frames(&mut joiner, 80), [(2, vec![true, false])]);
    }

    #[test]
    fn an_input_that_has_gone_is_given_the_short_patience() {
        let mut joiner = Joiner::lossless(2, 100);
        joiner.push(0, 0, (), 0);
        joiner.alive(1, 50);
        assert_eq!(frames(&mut joiner, 149), []);
        assert_eq!(frames(&mut joiner, 150), [(0, vec![true, false])]);
    }

    #[test]
    fn what_comes_after_its_frame_is_late() {
        let mut joiner = Joiner::new(2, 100);
        joiner.push(0, 5, (), 0);
        joiner.push(1, 6, (), 0);
        assert_eq!(frames(&mut joiner, 0), [(5, vec![true, false])]);
        assert_eq!(joiner.push(1, 5, (), 1), Push::Late);
        assert_eq!(joiner.push(1, 6, (), 1), Push::Late);
        assert_eq!(joiner.push(7, 9, (), 1), Push::Late);
    }

    #[test]
    fn the_latest_frame_passes_over_earlier_ones() {
        let mut joiner = Joiner::new(1, 100);
        for frame in 0..3 {
            joiner.push(0, frame, frame, 0);
        }
        let (got, n_passed) = joiner.latest(0, |_| true);
        assert_eq!((got.unwrap().frame, n_passed), (2, 2));
    }

    #[test]
    fn frames_that_are_not_wanted_are_passed_over() {
        let mut joiner = Joiner::new(1, 100);
        for frame in 0..5 {
            joiner.push(0, frame, frame, 0);
        }
        let (got, n_passed) = joiner.latest(0, |it| it.frame == 3);
        assert_eq!((got.unwrap().frame, n_passed), (3, 4));
        joiner.push(0, 5, 5, 0);
        assert_eq!(joiner.latest(0, |_| false), (None, 1));
    }

    #[test]
    fn it_is_over_when_all_have_ended_and_all_is_given_out() {
        let mut joiner = Joiner::new(2, 100);
        joiner.push(0, 0, (), 0);
        joiner.end(0);
        joiner.end(1);
        assert!(!joiner.is_over(0));
        assert_eq!(frames(&mut joiner, 0).len(), 1);
        assert!(joiner.is_over(0));
    }

    #[test]
    fn an_input_that_died_before_its_end_does_not_keep_it_going() {
        let mut joiner = Joiner::new(2, 100);
        joiner.push(0, 0, (), 0);
        joiner.push(1, 0, (), 0);
        assert_eq!(frames(&mut joiner, 0).len(), 1);
        joiner.end(0);
        assert!(!joiner.is_over(99));
        assert!(joiner.is_over(100));
    }

    #[test]
    fn nothing_is_over_before_anybody_has_ended() {
        let mut joiner: Joiner<()> = Joiner::new(2, 100);
        assert!(!joiner.is_over(u64::MAX));
        joiner.push(0, 0, (), 0);
        assert_eq!(frames(&mut joiner, 1000).len(), 1);
        assert!(!joiner.is_over(u64::MAX));
    }

    proptest! {
        #[test]
        fn every_message_is_given_out_once_or_called_late_in_the_order_of_frames(
            events in prop::collection::vec((0_usize..3, 0_u64..8, 0_u64..40), 0..60),
        ) {
            let mut joiner = Joiner::new(3, 50);
            let (mut now, mut taken, mut given, mut last) = (0, 0, 0, None);
            let mut drain = |joiner: &mut Joiner<u64>, now: u64| {
                while let Some(it) = joiner.next(now) {
                    assert!(last < Some(it.frame), "in order");
                    last = Some(it.frame);
                    assert!(it.items.iter().flatten().all(|item| *item == it.frame));
                    given += it.items.iter().flatten().count();
                }
            };
            for (input, frame, pause) in events {
                now += pause;
                taken += usize::from(joiner.push(input, frame, frame, now) == Push::Taken);
                drain(&mut joiner, now);
            }
            drain(&mut joiner, now + 1000);
            prop_assert_eq!(joiner.n_pending(), 0);
            prop_assert_eq!(given, taken);
        }
    }
}
