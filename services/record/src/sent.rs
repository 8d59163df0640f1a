//! Counts lost messages: the difference between reported and received messages.

use std::collections::BTreeMap;

/// The numbers of messages sent and received on one topic.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Sent {
    /// Number of messages reported by the sender, for each of its epochs.
    reported: BTreeMap<u64, u64>,
    n_received: u64,
    /// True if the recording began during the run, so that earlier messages are not missing.
    is_late: bool,
    /// Number of messages sent before the recording.
    n_before: u64,
    /// Number of lost messages that [`Self::lost`] has already returned.
    n_known: u64,
}

impl Sent {
    /// Creates the numbers of a recording that may begin during the run. Messages before the first report are not counted as lost.
    pub(crate) fn late() -> Self {
        Self {
            is_late: true,
            ..Self::default()
        }
    }

    /// Processes a report from the sender.
    ///
    /// * `epoch`: epoch of the sender.
    /// * `n_sent`: number of messages sent in that epoch.
    pub(crate) fn reported(&mut self, epoch: u64, n_sent: u64) {
        if self.is_late && self.reported.is_empty() {
            self.n_before = n_sent.saturating_sub(self.n_received);
        }
        let reported = self.reported.entry(epoch).or_default();
        *reported = n_sent.max(*reported);
    }

    /// Counts a received message.
    pub(crate) fn received(&mut self) {
        self.n_received += 1;
    }

    /// Returns the number of messages lost since the last call.
    ///
    /// Call it when no messages are in flight: a message that was sent but not yet received counts as lost.
    pub(crate) fn lost(&mut self) -> u64 {
        let sent = self.reported.values().copied().fold(0, u64::saturating_add);
        let lost = sent.saturating_sub(self.n_before.saturating_add(self.n_received));
        let new = lost.saturating_sub(self.n_known);
        self.n_known = self.n_known.max(lost);
        new
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_message_that_was_not_received_counts_as_lost_once() {
        let mut sent = Sent::default();
        for _ in 0..7 {
            sent.received();
        }
        sent.reported(0, 9);
        assert_eq!((sent.lost(), sent.lost()), (2, 0));
    }

    #[test]
    fn counts_of_epochs_are_summed_and_an_old_heartbeat_has_no_effect() {
        let mut sent = Sent::default();
        sent.reported(0, 5);
        sent.reported(1, 3);
        sent.reported(0, 4);
        assert_eq!(sent.lost(), 8);
    }

    #[test]
    fn messages_before_a_recording_that_begins_late_are_not_lost() {
        let mut sent = Sent::late();
        sent.received();
        sent.reported(0, 500);
        sent.received();
        sent.reported(0, 503);
        assert_eq!(sent.lost(), 2);
    }

    #[test]
    fn messages_received_before_they_were_reported_are_not_lost() {
        let mut sent = Sent::default();
        sent.received();
        assert_eq!(sent.lost(), 0);
    }
}
