//! How many messages were sent that never came: what their senders report, less what came.

use std::collections::BTreeMap;

/// What was sent and what came of one topic.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Sent {
    /// By epoch of the sender.
    reported: BTreeMap<u64, u64>,
    n_came: u64,
    /// Of these lost, what was counted before.
    n_known: u64,
}

impl Sent {
    /// Takes a report of the sender.
    ///
    /// * `epoch`: of the sender.
    /// * `n_sent`: what it has sent in that epoch.
    pub(crate) fn reported(&mut self, epoch: u64, n_sent: u64) {
        let reported = self.reported.entry(epoch).or_default();
        *reported = n_sent.max(*reported);
    }

    /// One came.
    pub(crate) fn came(&mut self) {
        self.n_came += 1;
    }

    /// How many have been lost since the last time this was asked.
    ///
    /// Ask where nothing is on its way any more: what was sent and has not come yet looks lost.
    pub(crate) fn lost(&mut self) -> u64 {
        let sent = self.reported.values().copied().fold(0, u64::saturating_add);
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
        sent.reported(0, 9);
        assert_eq!((sent.lost(), sent.lost()), (2, 0));
    }

    #[test]
    fn epochs_add_up_and_an_old_heartbeat_changes_nothing() {
        let mut sent = Sent::default();
        sent.reported(0, 5);
        sent.reported(1, 3);
        sent.reported(0, 4);
        assert_eq!(sent.lost(), 8);
    }

    #[test]
    fn what_came_before_its_sender_reported_it_is_not_lost() {
        let mut sent = Sent::default();
        sent.came();
        assert_eq!(sent.lost(), 0);
    }
}
