//! The queue of messages to be written. Its size in bytes is limited; messages that do not fit are counted.

use core::time::Duration;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use crossbeam::channel::{Receiver, RecvTimeoutError, Sender, bounded};
use recording::Entry;

/// Maximum number of messages in the queue, of any size.
const MAX_MESSAGES: usize = 1 << 14;

/// A message on its way to the file.
#[derive(Debug)]
pub(crate) struct Item {
    /// Index of the topic.
    pub topic: usize,
    /// Times at which the message was received and sent.
    pub entry: Entry,
    /// The bytes to be written.
    pub data: Vec<u8>,
}

#[derive(Debug)]
struct Shared {
    n_bytes: AtomicU64,
    n_items: AtomicU64,
    /// True if the file can no longer be written.
    is_broken: AtomicBool,
    lost: Vec<AtomicU64>,
}

impl Shared {
    fn add(&self, n_bytes: usize) {
        self.n_bytes.fetch_add(n_bytes as u64, Ordering::AcqRel);
        self.n_items.fetch_add(1, Ordering::AcqRel);
    }

    fn remove(&self, n_bytes: usize) {
        self.n_bytes.fetch_sub(n_bytes as u64, Ordering::AcqRel);
        self.n_items.fetch_sub(1, Ordering::AcqRel);
    }

    fn lost(&self, topic: usize, n: u64) {
        if let Some(count) = self.lost.get(topic) {
            count.fetch_add(n, Ordering::Relaxed);
        }
    }
}

/// The sending end of the queue.
#[derive(Debug)]
pub(crate) struct Inlet {
    sender: Sender<Item>,
    shared: Arc<Shared>,
    max_bytes: u64,
}

/// The receiving end of the queue, for the writing thread.
#[derive(Debug)]
pub(crate) struct Outlet {
    receiver: Receiver<Item>,
    shared: Arc<Shared>,
}

/// Creates a queue.
///
/// * `max_bytes`: limit on the total size. A single larger message is accepted if the queue is empty.
pub(crate) fn queue(n_topics: usize, max_bytes: u64) -> (Inlet, Outlet) {
    let (sender, receiver) = bounded(MAX_MESSAGES);
    let shared = Arc::new(Shared {
        n_bytes: AtomicU64::new(0),
        n_items: AtomicU64::new(0),
        is_broken: AtomicBool::new(false),
        lost: (0..n_topics).map(|_| AtomicU64::new(0)).collect(),
    });
    let inlet = Inlet {
        sender,
        shared: Arc::clone(&shared),
        max_bytes,
    };
    (inlet, Outlet { receiver, shared })
}

impl Inlet {
    /// Returns true if there is space for a message of `n_bytes`.
    pub(crate) fn has_room(&self, n_bytes: usize) -> bool {
        let waiting = self.shared.n_bytes.load(Ordering::Acquire);
        let n_items = self.shared.n_items.load(Ordering::Acquire);
        !self.is_broken()
            && n_items < MAX_MESSAGES as u64
            && (waiting == 0 || waiting + n_bytes as u64 <= self.max_bytes)
    }

    /// Returns true if the file can no longer be written.
    pub(crate) fn is_broken(&self) -> bool {
        self.shared.is_broken.load(Ordering::Acquire)
    }

    /// Adds a message. If there is no space, counts the message as lost and returns `false`.
    pub(crate) fn push(&self, item: Item) -> bool {
        let (topic, n_bytes) = (item.topic, item.data.len());
        self.shared.add(n_bytes);
        let is_added = self.sender.try_send(item).is_ok();
        if !is_added {
            self.shared.remove(n_bytes);
            self.lost(topic, 1);
        }
        is_added
    }

    /// Counts lost messages.
    pub(crate) fn lost(&self, topic: usize, n: u64) {
        self.shared.lost(topic, n);
    }

    /// Returns the number of lost messages of a topic.
    pub(crate) fn n_lost(&self, topic: usize) -> u64 {
        let count = self.shared.lost.get(topic);
        count.map_or(0, |count| count.load(Ordering::Relaxed))
    }
}

impl Outlet {
    /// Returns the next message, or `None` after `limit`. Returns an error when the queue is empty and closed.
    pub(crate) fn next(&self, limit: Duration) -> Result<Option<Item>, ()> {
        match self.receiver.recv_timeout(limit) {
            Ok(item) => Ok(Some(item)),
            Err(RecvTimeoutError::Timeout) => Ok(None),
            Err(RecvTimeoutError::Disconnected) => Err(()),
        }
    }

    /// Frees the space of a message that has been written.
    pub(crate) fn written(&self, item: &Item) {
        self.shared.remove(item.data.len());
    }

    /// Frees the space of a message that could not be written. No more messages will be written.
    pub(crate) fn lose(&self, item: &Item) {
        self.shared.is_broken.store(true, Ordering::Release);
        self.shared.remove(item.data.len());
        self.shared.lost(item.topic, 1);
    }

    /// Returns the numbers of lost messages by topic.
    pub(crate) fn lost(&self) -> Vec<u64> {
        let lost = self.shared.lost.iter();
        lost.map(|count| count.load(Ordering::Relaxed)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn item(topic: usize, n_bytes: usize) -> Item {
        Item {
            topic,
            entry: Entry::default(),
            data: vec![0; n_bytes],
        }
    }

    #[test]
    fn the_bytes_in_the_queue_are_bounded_until_they_are_written() {
        let (inlet, outlet) = queue(1, 100);
        assert!(
            inlet.has_room(1_000_000),
            "a single message may be of any size"
        );
        assert!(inlet.push(item(0, 60)));
        assert!(inlet.has_room(40) && !inlet.has_room(41));
        let item = outlet.next(Duration::ZERO).unwrap().unwrap();
        assert!(!inlet.has_room(41), "it is not written yet");
        outlet.written(&item);
        assert!(inlet.has_room(101));
    }

    #[test]
    fn messages_that_do_not_fit_are_counted_by_topic() {
        let (inlet, outlet) = queue(2, u64::MAX);
        let n = MAX_MESSAGES + 3;
        let n_kept = (0..n).filter(|_| inlet.push(item(1, 1))).count();
        assert!(!inlet.has_room(0));
        assert_eq!(n_kept, MAX_MESSAGES);
        assert_eq!(outlet.lost(), [0, 3]);
    }

    #[test]
    fn after_a_write_error_there_is_no_room_and_waiting_messages_are_counted() {
        let (inlet, outlet) = queue(2, 100);
        assert!(inlet.push(item(0, 1)) && inlet.push(item(1, 1)));
        outlet.lose(&outlet.next(Duration::ZERO).unwrap().unwrap());
        assert!(!inlet.has_room(0) && inlet.is_broken());
        outlet.lose(&outlet.next(Duration::ZERO).unwrap().unwrap());
        assert_eq!((outlet.lost(), inlet.n_lost(1)), (vec![1, 1], 1));
    }

    #[test]
    fn a_closed_queue_ends_after_its_last_message() {
        let (inlet, outlet) = queue(1, 100);
        assert!(inlet.push(item(0, 1)));
        drop(inlet);
        assert!(outlet.next(Duration::ZERO).unwrap().is_some());
        outlet.next(Duration::ZERO).unwrap_err();
    }
}
