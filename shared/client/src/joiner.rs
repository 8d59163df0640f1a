//! Collects the parts of every frame. Does not read the clock and does not use ports.

use std::collections::BTreeMap;
use std::time::Instant;

use messages::{Sightings, Skeletons, Stamp};

use crate::wish::Wish;

/// Maximum number of frames that may wait for their parts at the same time.
const MOST_PENDING: usize = 32;

/// The parts of one frame.
#[derive(Debug)]
pub(crate) struct Gathered<P> {
    pub(crate) frame: u64,
    pub(crate) captured_at_nanos: u64,
    pub(crate) skeletons: Option<Box<Skeletons>>,
    /// Parts of each requested view.
    pub(crate) views: Vec<Parts<P>>,
    pub(crate) is_complete: bool,
    /// Arrival of the frame's first part.
    since: Instant,
}

/// The parts of one view.
#[derive(Debug)]
pub(crate) struct Parts<P> {
    pub(crate) pose: Option<Box<Sightings>>,
    pub(crate) picture: Option<P>,
}

impl<P> Default for Parts<P> {
    fn default() -> Self {
        Self {
            pose: None,
            picture: None,
        }
    }
}

/// Frames that wait for their parts.
#[derive(Debug)]
pub(crate) struct Joiner<P> {
    wish: Wish,
    n_views: usize,
    pending: BTreeMap<u64, Gathered<P>>,
    /// Number of the next frame that may be given to the caller; earlier frames have passed.
    next: u64,
    /// Number of parts that arrived after their frame had passed, and of frames that were given up.
    pub(crate) n_late: u64,
}

impl<P> Joiner<P> {
    /// * `n_views`: number of requested views.
    pub(crate) fn new(wish: Wish, n_views: usize) -> Self {
        Self {
            wish,
            n_views,
            pending: BTreeMap::new(),
            next: 0,
            n_late: 0,
        }
    }

    pub(crate) fn add_skeletons(&mut self, message: Box<Skeletons>, now: Instant) {
        if let Some(frame) = self.frame(&message.stamp, now) {
            frame.skeletons = Some(message);
        }
    }

    pub(crate) fn add_pose(&mut self, nth: usize, message: Box<Sightings>, now: Instant) {
        let frame = self.frame(&message.stamp, now);
        if let Some(parts) = frame.and_then(|frame| frame.views.get_mut(nth)) {
            parts.pose = Some(message);
        }
    }

    pub(crate) fn add_picture(&mut self, nth: usize, stamp: &Stamp, picture: P, now: Instant) {
        let frame = self.frame(stamp, now);
        if let Some(parts) = frame.and_then(|frame| frame.views.get_mut(nth)) {
            parts.picture = Some(picture);
        }
    }

    /// Gives up all frames that wait.
    pub(crate) fn clear(&mut self) {
        self.n_late += self.pending.len() as u64;
        self.pending.clear();
    }

    /// Returns the entry for the parts of a frame; `None` if the frame has already passed.
    fn frame(&mut self, stamp: &Stamp, now: Instant) -> Option<&mut Gathered<P>> {
        if stamp.frame < self.next {
            self.n_late += 1;
            return None;
        }
        if self.pending.len() >= MOST_PENDING && !self.pending.contains_key(&stamp.frame) {
            self.pending.pop_first();
            self.n_late += 1;
        }
        let n_views = self.n_views;
        let gathered = self.pending.entry(stamp.frame).or_insert_with(|| Gathered {
            frame: stamp.frame,
            captured_at_nanos: stamp.captured_at_nanos,
            skeletons: None,
            views: (0..n_views).map(|_| Parts::default()).collect(),
            is_complete: false,
            since: now,
        });
        gathered.captured_at_nanos = gathered.captured_at_nanos.min(stamp.captured_at_nanos);
        Some(gathered)
    }

    /// Returns, in order, the frames that need not wait any longer. Frames before them stop waiting, too; if skeletons are requested,
    /// frames without a skeleton are given up.
    ///
    /// The skeleton is the last message about a frame. When it arrives, all other parts have arrived or will never arrive.
    pub(crate) fn take(&mut self, now: Instant) -> Vec<Gathered<P>> {
        let last = self
            .pending
            .values()
            .rev()
            .find(|value| self.is_over(value, now))
            .map(|value| value.frame);
        let Some(last) = last else {
            return Vec::new();
        };
        let later = self.pending.split_off(&last.saturating_add(1));
        let done = core::mem::replace(&mut self.pending, later);
        self.next = last.saturating_add(1);
        let mut given = Vec::new();
        for mut it in done.into_values() {
            if self.wish.skeletons && it.skeletons.is_none() {
                self.n_late += 1;
                continue;
            }
            it.is_complete = self.has_views(&it);
            given.push(it);
        }
        given
    }

    fn is_over(&self, it: &Gathered<P>, now: Instant) -> bool {
        if self.wish.skeletons {
            return it.skeletons.is_some();
        }
        self.has_views(it) || now.saturating_duration_since(it.since) >= self.wish.patience
    }

    fn has_views(&self, it: &Gathered<P>) -> bool {
        let (poses, pictures) = (self.wish.poses, self.wish.pictures);
        it.views
            .iter()
            .all(|view| (!poses || view.pose.is_some()) && (!pictures || view.picture.is_some()))
    }
}

#[cfg(test)]
mod tests {
    use core::time::Duration;

    use bytemuck::Zeroable as _;
    use proptest::prelude::*;

    use super::*;
    use crate::check::tests::skeletons;

    fn stamp(frame: u64) -> Stamp {
        Stamp {
            session: 7,
            frame,
            captured_at_nanos: 1000 * frame,
            ..Stamp::default()
        }
    }

    fn pose(frame: u64) -> Box<Sightings> {
        let mut message = Sightings::zeroed();
        message.stamp = stamp(frame);
        Box::new(message)
    }

    #[test]
    fn a_skeleton_completes_its_frame() {
        let now = Instant::now();
        let mut joiner = Joiner::new(Wish::skeletons().with_poses().with_pictures(), 2);
        for frame in [4, 5] {
            joiner.add_pose(0, pose(frame), now);
            joiner.add_picture(0, &stamp(frame), 'a', now);
        }
        joiner.add_pose(1, pose(5), now);
        joiner.add_picture(1, &stamp(5), 'b', now);
        assert_eq!(joiner.take(now).len(), 0, "no skeleton");
        joiner.add_skeletons(Box::new(skeletons(5)), now);
        let given = joiner.take(now);
        // Frame 4 has no skeleton, and will not have one.
        assert_eq!(given.len(), 1);
        assert!(given[0].is_complete);
        assert_eq!(given[0].views[1].picture, Some('b'));
        joiner.add_skeletons(Box::new(skeletons(4)), now);
        assert_eq!(joiner.take(now).len(), 0, "too late");
        assert_eq!(joiner.n_late, 2);
        // The skeleton message states that a view is missing.
        joiner.add_pose(1, pose(6), now);
        joiner.add_skeletons(Box::new(skeletons(6)), now);
        let given = joiner.take(now);
        assert!(!given[0].is_complete && given[0].views[0].pose.is_none());
    }

    #[test]
    fn without_skeletons_a_frame_waits_a_limited_time_for_its_views() {
        let now = Instant::now();
        let mut joiner = Joiner::<()>::new(Wish::views().with_poses(), 2);
        joiner.add_pose(0, pose(1), now);
        assert_eq!(joiner.take(now).len(), 0);
        joiner.add_pose(0, pose(2), now);
        joiner.add_pose(1, pose(2), now);
        let frames: Vec<_> = joiner
            .take(now)
            .iter()
            .map(|joiner| (joiner.frame, joiner.is_complete))
            .collect();
        assert_eq!(frames, [(1, false), (2, true)]);
        joiner.add_pose(0, pose(3), now);
        let later = now + Duration::from_secs(1);
        let frames: Vec<_> = joiner
            .take(later)
            .iter()
            .map(|joiner| (joiner.frame, joiner.is_complete))
            .collect();
        assert_eq!(frames, [(3, false)]);
    }

    proptest! {
        #[test]
        fn frames_are_returned_once_in_order_and_the_queue_is_bounded(
            parts in prop::collection::vec((0_u64..200, 0_usize..3), 1..400),
            with_skeletons in any::<bool>(),
        ) {
            let now = Instant::now();
            let wish = if with_skeletons { Wish::skeletons() } else { Wish::views() };
            let mut joiner = Joiner::<()>::new(wish.with_poses(), 2);
            let mut frames = Vec::new();
            for (frame, part) in parts {
                match part {
                    2 => joiner.add_skeletons(Box::new(skeletons(frame)), now),
                    nth => joiner.add_pose(nth, pose(frame), now),
                }
                frames.extend(joiner.take(now).iter().map(|joiner| joiner.frame));
                prop_assert!(joiner.pending.len() <= MOST_PENDING);
            }
            prop_assert!(frames.is_sorted_by(|a, b| a < b), "{frames:?}");
        }
    }
}
