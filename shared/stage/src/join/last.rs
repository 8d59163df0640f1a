//! The last messages of each input, for frames that did not wait for the input.

use std::collections::VecDeque;

/// Number of messages that are kept for each input. It is more than one because an input may be ahead of the frame that is being processed.
const KEPT: usize = 4;

/// Keeps the last messages of several inputs until they are too old.
#[derive(Debug)]
pub struct Last<T> {
    of_input: Vec<VecDeque<Message<T>>>,
    max_age_nanos: u64,
}

#[derive(Debug)]
struct Message<T> {
    frame: u64,
    captured_at: u64,
    item: T,
}

impl<T> Last<T> {
    /// Creates an empty store.
    ///
    /// * `max_age_nanos`: maximum difference of capture times at which a message is used for a later frame.
    pub fn new(n_inputs: usize, max_age_nanos: u64) -> Self {
        Self {
            of_input: (0..n_inputs).map(|_| VecDeque::new()).collect(),
            max_age_nanos,
        }
    }

    /// Keeps the message of an input about a frame. Frames may arrive in any order.
    ///
    /// * `captured_at`: time at which the frame was captured, in nanoseconds.
    pub fn keep(&mut self, input: usize, frame: u64, captured_at: u64, item: T) {
        let Some(messages) = self.of_input.get_mut(input) else {
            return;
        };
        let at = messages.partition_point(|message| message.frame < frame);
        let message = Message {
            frame,
            captured_at,
            item,
        };
        messages.insert(at, message);
        if messages.len() > KEPT {
            messages.pop_front();
        }
    }

    /// Returns the latest message about this frame or an earlier one, with its age in frames, unless it is too old.
    pub fn of(&self, input: usize, frame: u64, captured_at: u64) -> Option<(u64, &T)> {
        let messages = self.of_input.get(input)?;
        let latest = messages.iter().rev().find(|message| message.frame <= frame)?;
        let age = captured_at.saturating_sub(latest.captured_at);
        (age <= self.max_age_nanos).then_some((frame - latest.frame, &latest.item))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_message_is_used_for_later_frames_while_it_is_fresh() {
        let mut last = Last::new(2, 100);
        assert_eq!(last.of(0, 5, 50), None);
        last.keep(0, 3, 30, 'a');
        last.keep(0, 4, 40, 'b');
        assert_eq!(last.of(0, 4, 40), Some((0, &'b')));
        assert_eq!(last.of(0, 6, 140), Some((2, &'b')));
        assert_eq!(last.of(0, 7, 141), None, "too old");
        assert_eq!(last.of(1, 4, 40), None, "another input");
    }

    #[test]
    fn a_message_is_not_used_for_earlier_frames() {
        let mut last = Last::new(1, 100);
        last.keep(0, 8, 80, 'c');
        assert_eq!(last.of(0, 7, 70), None);
        last.keep(0, 6, 60, 'a'); // out of order
        assert_eq!(last.of(0, 7, 70), Some((1, &'a')));
        assert_eq!(last.of(0, 9, 90), Some((1, &'c')));
    }

    #[test]
    fn the_oldest_messages_are_discarded() {
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
