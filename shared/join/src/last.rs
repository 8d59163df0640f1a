//! The last message of each sender, for frames that are not to wait for this sender.

use std::collections::VecDeque;

/// Number of messages kept per sender; a sender may be ahead of the frame that is being joined.
const KEPT: usize = 4;

/// Keeps the last messages of several senders for a limited time.
#[derive(Debug)]
pub struct Last<T> {
    of_input: Vec<VecDeque<Entry<T>>>,
    max_age_nanos: u64,
}

#[derive(Debug)]
struct Entry<T> {
    frame: u64,
    captured_at: u64,
    item: T,
}

impl<T> Last<T> {
    /// Starts without messages.
    ///
    /// * `max_age_nanos`: the largest difference in capture time between a frame and a message used
    ///   for it.
    pub fn new(n_inputs: usize, max_age_nanos: u64) -> Self {
        Self {
            of_input: (0..n_inputs).map(|_| VecDeque::new()).collect(),
            max_age_nanos,
        }
    }

    /// Stores a message about a frame; frames may come in any order.
    ///
    /// * `captured_at`: when the frame was captured, nanoseconds.
    pub fn keep(&mut self, input: usize, frame: u64, captured_at: u64, item: T) {
        let Some(entries) = self.of_input.get_mut(input) else {
            return;
        };
        let at = entries.partition_point(|entry| entry.frame < frame);
        let entry = Entry {
            frame,
            captured_at,
            item,
        };
        entries.insert(at, entry);
        if entries.len() > KEPT {
            entries.pop_front();
        }
    }

    /// The latest stored message about this frame or an earlier one, if it is recent enough, and
    /// its age in frames.
    pub fn of(&self, input: usize, frame: u64, captured_at: u64) -> Option<(u64, &T)> {
        let entries = self.of_input.get(input)?;
        let entry = entries.iter().rev().find(|entry| entry.frame <= frame)?;
        let age = captured_at.saturating_sub(entry.captured_at);
        (age <= self.max_age_nanos).then_some((frame - entry.frame, &entry.item))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_message_is_used_for_later_frames_until_it_is_too_old() {
        let mut last = Last::new(2, 100);
        assert_eq!(last.of(0, 5, 50), None);
        last.keep(0, 3, 30, 'a');
        last.keep(0, 4, 40, 'b');
        assert_eq!(last.of(0, 4, 40), Some((0, &'b')));
        assert_eq!(last.of(0, 6, 140), Some((2, &'b')));
        assert_eq!(last.of(0, 7, 141), None, "too old");
        assert_eq!(last.of(1, 4, 40), None, "another sender");
    }

    #[test]
    fn a_message_is_not_used_for_earlier_frames() {
        let mut last = Last::new(1, 100);
        last.keep(0, 8, 80, 'c');
        assert_eq!(last.of(0, 7, 70), None);
        last.keep(0, 6, 60, 'a'); // arrives late
        assert_eq!(last.of(0, 7, 70), Some((1, &'a')));
        assert_eq!(last.of(0, 9, 90), Some((1, &'c')));
    }

    #[test]
    fn old_messages_are_dropped() {
        let mut last = Last::new(1, 1000);
        for frame in 0..10 {
            last.keep(0, frame, frame, frame);
        }
        assert_eq!(last.of(0, 5, 5), None);
        assert_eq!(last.of(0, 6, 6), Some((0, &6)));
        last.keep(7, 0, 0, 0);
        assert_eq!(last.of(7, 0, 0), None, "no such input");
    }
}
