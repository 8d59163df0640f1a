//! The subscribers of a topic for which its publisher does not wait.

use std::sync::{Arc, Mutex, PoisonError};

use iceoryx2::prelude::{CallbackProgression, PortFactory as _};

use crate::erased::Messages;
use crate::subscriber::onlooker;

/// The onlookers of a topic. They are shared with the handler that decides what to do if a receiver has no room.
#[derive(Debug, Clone, Default)]
pub(crate) struct Onlookers {
    ids: Arc<Mutex<Vec<u128>>>,
}

impl Onlookers {
    /// Updates the list of onlookers. An onlooker that connects later has an empty queue, so that the next message fits.
    pub(crate) fn update(&self, messages: &Messages) {
        let name = onlooker();
        let mut ids = self.ids.lock().unwrap_or_else(PoisonError::into_inner);
        ids.clear();
        messages.dynamic_config().list_subscribers(|details| {
            if details.subscriber_name == name {
                ids.push(details.subscriber_id.value());
            }
            CallbackProgression::Continue
        });
    }

    /// Returns true if a subscriber is an onlooker.
    pub(crate) fn contain(&self, subscriber: u128) -> bool {
        let ids = self.ids.lock().unwrap_or_else(PoisonError::into_inner);
        ids.contains(&subscriber)
    }
}

/// Returns the number of subscribers that are not onlookers.
pub(crate) fn n_waited_for(messages: &Messages) -> usize {
    let name = onlooker();
    let mut n = 0;
    messages.dynamic_config().list_subscribers(|details| {
        n += usize::from(details.subscriber_name != name);
        CallbackProgression::Continue
    });
    n
}
