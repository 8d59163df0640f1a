//! Bulk data (large arrays) that a stage reads in shared memory.

use core::fmt;
use std::cell::{Ref, RefCell};
use std::rc::Rc;

use runtime::{Element, ReceiveError, Sample, SliceSubscriber};
use wire::{Expected, WireError};

use crate::Context;
use crate::message::BulkHeader;
use crate::shelf::Shelf;

/// Checks a sample against the expected values of its topic.
pub(crate) type CheckSample<E, H> = fn(&Sample<E, H>, &Expected) -> Result<(), WireError>;

/// The samples of one view. Each is held until its frame has been processed.
pub struct Held<E: Element, H: BulkHeader> {
    inner: Rc<Inner<E, H>>,
}

impl<E: Element, H: BulkHeader> fmt::Debug for Held<E, H> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Held").field("view", &self.inner.view).finish_non_exhaustive()
    }
}

struct Inner<E: Element, H: BulkHeader> {
    subscriber: SliceSubscriber<E, H>,
    view: usize,
    check: CheckSample<E, H>,
    shelf: RefCell<Shelf<Sample<E, H>>>,
}

/// The oldest waiting sample with its frame number.
type Received<E, H> = Result<Option<(u64, Sample<E, H>)>, ReceiveError>;

/// Bulk inputs of any type.
pub(crate) trait Bulk {
    fn fill(&self, context: &Context<'_>) -> Result<(), ReceiveError>;
    fn advance(&self, frame: u64, context: &Context<'_>) -> Result<(), ReceiveError>;
    /// Releases and discards all samples.
    fn drain(&self) -> Result<(), ReceiveError>;
}

impl<E: Element, H: BulkHeader> Held<E, H> {
    pub(crate) fn new(
        subscriber: SliceSubscriber<E, H>,
        view: usize,
        shelf: Shelf<Sample<E, H>>,
        check: CheckSample<E, H>,
    ) -> Self {
        Self {
            inner: Rc::new(Inner {
                subscriber,
                view,
                check,
                shelf: RefCell::new(shelf),
            }),
        }
    }

    pub(crate) fn bulk(&self) -> Rc<dyn Bulk>
    where
        E: 'static,
        H: 'static,
    {
        Rc::clone(&self.inner) as Rc<dyn Bulk>
    }

    /// Returns the sample of a frame, if it is held.
    pub fn of(&self, frame: u64) -> Option<Ref<'_, Sample<E, H>>> {
        Ref::filter_map(self.inner.shelf.borrow(), |shelf| shelf.of(frame)).ok()
    }
}

impl<E: Element, H: BulkHeader> Inner<E, H> {
    /// Returns the oldest waiting sample of this view and session. Other samples are counted.
    fn receive(&self, context: &Context<'_>) -> Received<E, H> {
        while let Some(sample) = self.subscriber.receive()? {
            match (self.check)(&sample, &context.expected(self.view)) {
                Ok(()) => return Ok(Some((sample.header().stamp().frame, sample))),
                Err(error) => context.count_refused(H::NAME, &error),
            }
        }
        Ok(None)
    }
}

impl<E: Element, H: BulkHeader> Bulk for Inner<E, H> {
    fn fill(&self, context: &Context<'_>) -> Result<(), ReceiveError> {
        self.shelf.borrow_mut().fill(|| self.receive(context))
    }

    fn advance(&self, frame: u64, context: &Context<'_>) -> Result<(), ReceiveError> {
        let mut shelf = self.shelf.borrow_mut();
        shelf.advance(frame, || self.receive(context))
    }

    fn drain(&self) -> Result<(), ReceiveError> {
        self.shelf.borrow_mut().clear();
        while self.subscriber.receive()?.is_some() {}
        Ok(())
    }
}
