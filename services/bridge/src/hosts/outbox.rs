//! Messages that wait to be sent to another host. In every lane (topic of a view), only the newest message waits, and only a few are in
//! transit.

use std::collections::VecDeque;

/// Maximum number of parcels (numbered messages) of a lane that were sent and not acknowledged.
const MOST_ON_WAY: usize = 3;
/// Time without an acknowledgement after which a parcel counts as lost, in nanoseconds.
const LOST_AFTER: u64 = 1_500_000_000;

/// A message to be sent next.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Parcel<T> {
    /// Index of the lane.
    pub lane: usize,
    /// Number of the parcel in its lane, counted from 0.
    pub sequence: u64,
    /// Number of parcels in the lane that were overtaken by newer parcels before they were sent.
    pub n_overtaken: u64,
    /// Content of the message.
    pub item: T,
}

/// Counts of the parcels of a lane.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Sent {
    /// Number of parcels offered.
    pub n_offered: u64,
    /// Number of parcels that were overtaken by newer parcels before they were sent.
    pub n_overtaken: u64,
    /// Number of parcels passed to the link.
    pub n_sent: u64,
    /// Number of parcels that the other host acknowledged.
    pub n_acknowledged: u64,
    /// Number of parcels that were sent but never acknowledged.
    pub n_lost: u64,
}

/// The lanes to one other host. The caller passes the time, so no clock is read.
#[derive(Debug)]
pub struct Outbox<T> {
    lanes: Vec<Lane<T>>,
}

#[derive(Debug)]
struct Lane<T> {
    waiting: Option<T>,
    /// Sequences and send times of the parcels that are under way.
    on_way: VecDeque<(u64, u64)>,
    sent: Sent,
}

impl<T> Outbox<T> {
    /// Creates empty lanes.
    pub fn new(n_lanes: usize) -> Self {
        let lane = || Lane {
            waiting: None,
            on_way: VecDeque::with_capacity(MOST_ON_WAY),
            sent: Sent::default(),
        };
        Self {
            lanes: (0..n_lanes).map(|_| lane()).collect(),
        }
    }

    /// Puts a message into a lane. It replaces a message that waits there, which counts as overtaken.
    pub fn offer(&mut self, lane: usize, item: T) {
        if let Some(lane) = self.lanes.get_mut(lane) {
            lane.sent.n_offered += 1;
            if lane.waiting.replace(item).is_some() {
                lane.sent.n_overtaken += 1;
            }
        }
    }

    /// Returns the next parcel to send, from the lane with the fewest parcels under way. The parcel counts as sent.
    pub fn next(&mut self, now_nanos: u64) -> Option<Parcel<T>> {
        for lane in &mut self.lanes {
            lane.forget_lost(now_nanos);
        }
        let ready = self.lanes.iter_mut().enumerate();
        let ready = ready.filter(|(_, candidate)| {
            candidate.waiting.is_some() && candidate.on_way.len() < MOST_ON_WAY
        });
        let (index, lane) = ready.min_by_key(|(_, candidate)| candidate.on_way.len())?;
        let item = lane.waiting.take()?;
        let sequence = lane.sent.n_sent;
        lane.sent.n_sent += 1;
        lane.on_way.push_back((sequence, now_nanos));
        Some(Parcel {
            lane: index,
            sequence,
            n_overtaken: lane.sent.n_overtaken,
            item,
        })
    }

    /// Records that a parcel has arrived. Because the link keeps the order, earlier parcels of the same lane that were not acknowledged are
    /// lost.
    ///
    /// Returns the time since it was sent, in nanoseconds; `None` if it was not under way.
    pub fn acknowledge(&mut self, lane: usize, sequence: u64, now_nanos: u64) -> Option<u64> {
        let lane = self.lanes.get_mut(lane)?;
        let at = lane.on_way.iter().position(|parcel| parcel.0 == sequence)?;
        let (_, sent_at) = lane.on_way[at];
        lane.on_way.drain(..=at);
        lane.sent.n_acknowledged += 1;
        lane.sent.n_lost += at as u64;
        Some(now_nanos.saturating_sub(sent_at))
    }

    /// Returns the counts of the parcels of a lane.
    pub fn sent(&self, lane: usize) -> Sent {
        self.lanes.get(lane).map_or_else(Sent::default, |lane| lane.sent)
    }

    /// Returns the number of lanes in which a message waits.
    pub fn n_waiting(&self) -> usize {
        self.lanes.iter().filter(|lane| lane.waiting.is_some()).count()
    }

    /// Returns true if no message waits or is under way.
    pub fn is_empty(&self) -> bool {
        self.lanes.iter().all(|lane| lane.waiting.is_none() && lane.on_way.is_empty())
    }
}

impl<T> Lane<T> {
    fn forget_lost(&mut self, now_nanos: u64) {
        while let Some((_, sent_at)) = self.on_way.front()
            && now_nanos.saturating_sub(*sent_at) > LOST_AFTER
        {
            self.on_way.pop_front();
            self.sent.n_lost += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    #[test]
    fn a_newer_message_replaces_the_waiting_one_and_the_replaced_one_is_counted() {
        let mut outbox = Outbox::new(1);
        for item in 0..10 {
            outbox.offer(0, item);
        }
        let parcel = outbox.next(0).unwrap();
        assert_eq!(
            (parcel.item, parcel.sequence, parcel.n_overtaken),
            (9, 0, 9)
        );
        assert_eq!(outbox.next(0), None);
    }

    #[test]
    fn a_link_without_acknowledgements_holds_few_parcels_and_sends_more_after_a_timeout() {
        let mut outbox = Outbox::new(2);
        let mut n_sent = 0;
        for ms in 0..10_000 {
            outbox.offer((ms % 2) as usize, ms);
            while outbox.next(ms * MS).is_some() {
                n_sent += 1;
            }
        }
        // Three parcels of each lane are sent at a time, every one and a half seconds.
        assert!((36..=42).contains(&n_sent), "{n_sent}");
        for lane in 0..2 {
            let it = outbox.sent(lane);
            let held = u64::from(outbox.lanes[lane].waiting.is_some());
            assert_eq!(it.n_offered, 5000);
            assert_eq!(it.n_offered, it.n_overtaken + it.n_sent + held);
            assert!(it.n_sent - it.n_lost <= MOST_ON_WAY as u64);
        }
    }

    #[test]
    fn an_acknowledgement_frees_space_and_reports_the_earlier_losses() {
        let mut outbox = Outbox::new(1);
        for item in 0..3 {
            outbox.offer(0, item);
            assert!(outbox.next(item).is_some());
        }
        outbox.offer(0, 3);
        assert_eq!(outbox.next(3), None, "all on their way");
        assert_eq!(outbox.acknowledge(0, 1, 9), Some(8));
        assert_eq!(outbox.acknowledge(0, 1, 9), None, "twice");
        assert_eq!(outbox.acknowledge(0, 99, 9), None);
        assert_eq!(outbox.acknowledge(7, 0, 9), None);
        let it = outbox.sent(0);
        assert_eq!((it.n_acknowledged, it.n_lost), (1, 1));
        assert_eq!(outbox.next(9).unwrap().sequence, 3);
        assert!(!outbox.is_empty());
        assert_eq!(outbox.acknowledge(0, 3, 10), Some(1));
        assert!(outbox.is_empty());
    }
}
