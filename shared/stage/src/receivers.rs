//! The receivers of a topic, as its sender sees them, for any message type.

use runtime::{Element, Header, Message, Patience, Publisher, SlicePublisher};

/// The receivers of one topic.
pub(crate) trait Receivers {
    /// Waits until `n` receivers are connected; see [`SlicePublisher::wait_for_subscribers`].
    fn wait_for(&self, n: usize, patience: Patience) -> usize;
    /// Returns the number of connected receivers.
    fn n_connected(&self) -> usize;
}

impl<M: Message> Receivers for Publisher<M> {
    fn wait_for(&self, n: usize, patience: Patience) -> usize {
        self.wait_for_subscribers(n, patience)
    }

    fn n_connected(&self) -> usize {
        self.n_connected()
    }
}

impl<E: Element, H: Header> Receivers for SlicePublisher<E, H> {
    fn wait_for(&self, n: usize, patience: Patience) -> usize {
        self.wait_for_subscribers(n, patience)
    }

    fn n_connected(&self) -> usize {
        self.n_connected()
    }
}
