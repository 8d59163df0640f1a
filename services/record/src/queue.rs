//! What waits to be written: bounded by its bytes; what does not fit is counted.

use core::time::Duration;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use crossbeam::channel::{Receiver, RecvTimeoutError, Sender, bounded};
use recording::Entry;

/// Messages that may wait, however small.
const MOST_MESSAGES: usize = 1 << 14;

/// A message on its way to the file.
#[derive(Debug)]
pub(crate) struct Item {
    /// The number of its topic.
    pub topic: usize,
    /// When it came and was sent.
    pub entry: Entry,
    /// What goes into the file.
    pub data: Vec<u8>,
}

#[derive(Debug)]
struct Shared {
    n_bytes: AtomicU64,
    n_items: AtomicU64,
    /// The file cannot be written any more.
    is_broken: AtomicBool,
    lost: Vec<AtomicU64>,
}

impl Shared {
    fn came(&self, n_bytes: usize) {
        self.n_bytes.fetch_add(n_bytes as u64, Ordering::AcqRel);
        self.n_items.fetch_add(1, Ordering::AcqRel);
    }

    fn went(&self, n_bytes: usize) {
        self.n_bytes.fetch_sub(n_bytes as u64, Ordering::AcqRel);
        self.n_items.fetch_sub(1, Ordering::AcqRel);
    }

    fn lost(&self, topic: usize, n: u64) {
        if let Some(it) = self.lost.get(topic) {
            it.fetch_add(n, Ordering::Relaxed);
        }
    }
}

/// The sending end.
#[derive(Debug)]
pub(crate) struct Inlet {
    sender: Sender<Item>,
    shared: Arc<Shared>,
    most_bytes: u64,
}

/// The receiving end, of the writing thread.
#[derive(Debug)]
pub(crate) struct Outlet {
    receiver: Receiver<Item>,
    shared: Arc<Shared>,
}

/// Makes a queue.
///
/// * `most_bytes`: that may wait; one message may be larger, alone.
pub(crate) fn queue(n_topics: usize, most_bytes: u64) -> (Inlet, Outlet) {
    let (sender, receiver) = bounded(MOST_MESSAGES);
    let shared = Arc::new(Shared {
        n_bytes: AtomicU64::new(0),
        n_items: AtomicU64::new(0),
        is_broken: AtomicBool::new(false),
        lost: (0..n_topics).map(|_| AtomicU64::new(0)).collect(),
    });
    let inlet = Inlet {
        sender,
        shared: Arc::clone(&shared),
        most_bytes,
    };
    (inlet, Outlet { receiver, shared })
}

impl Inlet {
    /// Whether a message of so many bytes may come in.
    pub(crate) fn has_room(&self, n_bytes: usize) -> bool {
        let waiting = self.shared.n_bytes.load(Ordering::Acquire);
        let n_items = self.shared.n_items.load(Ordering::Acquire);
        !self.is_broken()
            && n_items < MOST_MESSAGES as u64
            && (waiting == 0 || waiting + n_bytes as u64 <= self.most_bytes)
    }

    /// Whether the file cannot be written any more.
    pub(crate) fn is_broken(&self) -> bool {
        self.shared.is_broken.load(Ordering::Acquire)
    }

    /// Hands a message on; `false` if there is no room, and then it is counted.
    pub(crate) fn push(&self, item: Item) -> bool {
        let (topic, n_bytes) = (item.topic, item.data.len());
        self.shared.came(n_bytes);
        let taken = self.sender.try_send(item).is_ok();
        if !taken {
            self.shared.went(n_bytes);
            self.lost(topic, 1);
        }
        taken
    }

    /// Counts messages that were not kept.
    pub(crate) fn lost(&self, topic: usize, n: u64) {
        self.shared.lost(topic, n);
    }

    /// Messages of a topic that were not kept.
    pub(crate) fn n_lost(&self, topic: usize) -> u64 {
        let it = self.shared.lost.get(topic);
        it.map_or(0, |it| it.load(Ordering::Relaxed))
    }
}

impl Outlet {
    /// The next message; none after `limit`. An error once all is written and no more will come.
    pub(crate) fn next(&self, limit: Duration) -> Result<Option<Item>, ()> {
        match self.receiver.recv_timeout(limit) {
            Ok(item) => Ok(Some(item)),
            Err(RecvTimeoutError::Timeout) => Ok(None),
            Err(RecvTimeoutError::Disconnected) => Err(()),
        }
    }

    /// Makes room: a message has been written.
    pub(crate) fn written(&self, item: &Item) {
        self.shared.went(item.data.len());
    }

    /// Makes room: a message cannot be written, and no other will be.
    pub(crate) fn lose(&self, item: &Item) {
        self.shared.is_broken.store(true, Ordering::Release);
        self.shared.went(item.data.len());
        self.shared.lost(item.topic, 1);
    }

    /// Messages of every topic that were not kept.
    pub(crate) fn lost(&self) -> Vec<u64> {
        let lost = self.shared.lost.iter();
        lost.map(|it| it.load(Ordering::Relaxed)).collect()
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
    fn bytes_that_wait_are_bounded_and_come_free_as_they_are_written() {
        let (inlet, outlet) = queue(1, 100);
        assert!(inlet.has_room(1_000_000), "alone, any message may come");
        assert!(inlet.push(item(0, 60)));
        assert!(inlet.has_room(40) && !inlet.has_room(41));
        let it = outlet.next(Duration::ZERO).unwrap().unwrap();
        assert!(!inlet.has_room(41), "it is not written yet");
        outlet.written(&it);
        assert!(inlet.has_room(101));
    }

    #[test]
    fn what_does_not_fit_is_counted_for_its_topic() {
        let (inlet, outlet) = queue(2, u64::MAX);
        let n = MOST_MESSAGES + 3;
        let n_kept = (0..n).filter(|_| inlet.push(item(1, 1))).count();
        assert!(!inlet.has_room(0));
        assert_eq!(n_kept, MOST_MESSAGES);
        assert_eq!(outlet.lost(), [0, 3]);
    }

    #[test]
    fn once_the_file_cannot_be_written_there_is_no_room_and_what_waits_is_counted() {
        let (inlet, outlet) = queue(2, 100);
        assert!(inlet.push(item(0, 1)) && inlet.push(item(1, 1)));
        outlet.lose(&outlet.next(Duration::ZERO).unwrap().unwrap());
        assert!(!inlet.has_room(0) && inlet.is_broken());
        outlet.lose(&outlet.next(Duration::ZERO).unwrap().unwrap());
        assert_eq!((outlet.lost(), inlet.n_lost(1)), (vec![1, 1], 1));
    }

    #[test]
    fn the_end_comes_after_the_last() {
        let (inlet, outlet) = queue(1, 100);
        assert!(inlet.push(item(0, 1)));
        drop(inlet);
        assert!(outlet.next(Duration::ZERO).unwrap().is_some());
        outlet.next(Duration::ZERO).unwrap_err();
    }
}
