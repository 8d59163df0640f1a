//! What each sender said last, for frames that it was not waited for.

use std::collections::VecDeque;

/// How many words of each sender are kept: one may be ahead of the frame that is asked about.
const KEPT: usize = 4;

/// Keeps the last words of several senders while they are fresh.
#[derive(Debug)]
pub struct Last<T> {
    of_input: Vec<VecDeque<Word<T>>>,
    max_age_nanos: u64,
}

#[derive(Debug)]
struct Word<T> {
    frame: u64,
    captured_at: u64,
    item: T,
}

impl<T> Last<T> {
    /// Begins with nothing.
    ///
    /// * `max_age_nanos`: beyond which a word is not used, from capture to capture.
    pub fn new(n_inputs: usize, max_age_nanos: u64) -> Self {
        Self {
            of_input: (0..n_inputs).map(|_| VecDeque::new()).collect(),
            max_age_nanos,
        }
    }

    /// Keeps what was said about a frame; in any order of frames.
    ///
    /// * `captured_at`: when the frame was captured, nanoseconds.
    pub fn keep(&mut self, input: usize, frame: u64, captured_at: u64, item: T) {
        let Some(words) = self.of_input.get_mut(input) else {
            return;
        };
        let at = words.partition_point(|it| it.frame < frame);
        let word = Word {
            frame,
            captured_at,
            item,
        };
        words.insert(at, word);
        if words.len() > KEPT {
            words.pop_front();
        }
    }

    /// The latest word about this frame or one before it, if it is fresh, and how many frames it is old.
    pub fn of(&self, input: usize, frame: u64, captured_at: u64) -> Option<(u64, &T)> {
        let words = self.of_input.get(input)?;
        let it = words.iter().rev().find(|it| it.frame <= frame)?;
        let age = captured_at.saturating_sub(it.captured_at);
        (age <= self.max_age_nanos).then_some((frame - it.frame, &it.item))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_word_serves_later_frames_while_it_is_fresh() {
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
    fn a_sender_that_is_ahead_does_not_speak_of_earlier_frames() {
        let mut last = Last::new(1, 100);
        last.keep(0, 8, 80, 'c');
        assert_eq!(last.of(0, 7, 70), None);
        last.keep(0, 6, 60, 'a'); // it came late
        assert_eq!(last.of(0, 7, 70), Some((1, &'a')));
        assert_eq!(last.of(0, 9, 90), Some((1, &'c')));
    }

    #[test]
    fn old_words_make_room() {
        let mut last = Last::new(1, 1000);
        for frame in 0..10 {
            last.keep(0, frame, frame, frame);
        }
        assert_eq!(last.of(0, 5, 5), None);
        assert_eq!(last.of(0, 6, 6), Some((0, &6)));
        last.keep(7, 0, 0, 0);
        assert_eq!(last.of(7, 0, 0), None, "nobody");
    }
}
