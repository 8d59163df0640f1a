//! How many messages were sent that never came here: what their senders say they sent, less what came.

use std::collections::BTreeMap;

/// What was sent and what came of one topic.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Sent {
    /// By life of the sender.
    said: BTreeMap<u64, u64>,
    n_came: u64,
    /// Of these lost, what was counted before.
    n_known: u64,
}

impl Sent {
    /// Hears from the sender.
    ///
    /// * `life`: how often it has been restarted.
    /// * `n_sent`: what it has sent since.
    pub(crate) fn said(&mut self, life: u64, n_sent: u64) {
        let said = self.said.entry(life).or_default();
        *said = n_sent.max(*said);
    }

    /// One came.
    pub(crate) fn came(&mut self) {
        self.n_came += 1;
    }

    /// How many have been lost since the last time this was asked.
    ///
    /// Ask where nothing is on its way any more: what was sent and has not come yet looks lost.
    pub(crate) fn lost(&mut self) -> u64 {
        let sent = self.said.values().copied().fold(0, u64::saturating_add);
        let lost = sent.saturating_sub(self.n_came);
        let new = lost.saturating_sub(self.n_known);
        self.n_known = self.n_known.max(lost);
        new
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_sent_and_did_not_come_is_lost_once() {
        let mut sent = Sent::default();
        for _ in 0..7 {
            sent.came();
        }
        sent.said(0, 9);
        assert_eq!((sent.lost(), sent.lost()), (2, 0));
    }

    #[test]
    fn lives_add_up_and_an_old_sign_of_life_takes_nothing_back() {
        let mut sent = Sent::default();
        sent.said(0, 5);
        sent.said(1, 3);
        sent.said(0, 4);
        assert_eq!(sent.lost(), 8);
    }

    #[test]
    fn what_came_before_its_sender_said_so_is_not_lost() {
        let mut sent = Sent::default();
        sent.came();
        assert_eq!(sent.lost(), 0);
    }
}
