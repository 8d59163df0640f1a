//! An input of a stage: receives messages, checks them, decodes each once, and passes them to the joiner.

use messages::Status;
use runtime::ReceiveError;
use wire::WireError;

use crate::joins::Joins;
use crate::slots::Slots;
use crate::{Context, Item, Port, Receive, Stamped};

/// An input of any message type.
pub(crate) trait Input<T> {
    /// Receives all waiting messages.
    fn poll(&mut self, context: &Context<'_>, joins: &mut Joins<T>) -> Result<(), ReceiveError>;
    /// Discards all waiting messages.
    fn drain(&self) -> Result<(), ReceiveError>;
}

pub(crate) struct Typed<M, R, D> {
    pub(crate) port: Port<R>,
    pub(crate) slots: Slots,
    pub(crate) decode: D,
    /// Ports that were able to send at the last check.
    pub(crate) senders: Vec<u128>,
    pub(crate) message: core::marker::PhantomData<fn() -> M>,
}

impl<M, T, R, D> Input<T> for Typed<M, R, D>
where
    M: Stamped,
    R: Receive<M>,
    D: FnMut(&M) -> Result<T, WireError>,
{
    fn poll(&mut self, context: &Context<'_>, joins: &mut Joins<T>) -> Result<(), ReceiveError> {
        let senders = self.port.senders();
        let now = context.now();
        if !senders.is_empty() {
            self.slots.all().for_each(|slot| joins.alive(slot, now));
        }
        let is_new = |sender: &u128| !self.senders.contains(sender);
        let is_restarted = !self.senders.is_empty() && senders.iter().any(is_new);
        if is_restarted && self.port.forgets() {
            self.slots.all().for_each(|slot| joins.restarted(slot, now));
        }
        if !senders.is_empty() {
            self.senders = senders;
        }
        while let Some(message) = self.port.receive(context)? {
            let stamp = *message.stamp();
            if message.status() == Status::END {
                joins.end(self.slots, stamp);
                continue;
            }
            match (self.decode)(&message) {
                Err(error) => context.refuse(&message, &error)?,
                Ok(value) => {
                    let timing = *message.timing();
                    let item = Item {
                        stamp,
                        timing,
                        value,
                    };
                    let slot = self.slots.of(stamp.view as usize);
                    joins.take(slot, item, message.status(), context);
                }
            }
        }
        Ok(())
    }

    fn drain(&self) -> Result<(), ReceiveError> {
        self.port.drain()
    }
}
