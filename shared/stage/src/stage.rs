//! A stage: its inputs and outputs, and the loop that joins frames.

use core::fmt;
use core::marker::PhantomData;
use core::time::Duration;
use std::rc::Rc;

use crate::join::Joined;
use failure::{Failure, now_nanos};
use messages::{EvidenceHeader, FrameHeader, PairPose, People, Stamp, topic};
use runtime::{
    Delivery, Element, Message, Service, SlicePublisher, Subscriber, WaitError, Waiter, Woken,
};
use wire::WireError;

use crate::held::Bulk;
use crate::inbox::{Inbox, Optional, Rules};
use crate::input::{Input, Typed};
use crate::joins::Copier;
use crate::message::BulkHeader;
use crate::output::{EndStamp, Outgoing};
use crate::shelf::{HELD_REALTIME, Shelf};
use crate::slots::Slots;
use crate::{Context, Frame, Held, Item, Output, Port, Sender, Stamped, Turn};

/// Interval at which deadlines are checked while no message arrives.
const TICK: Duration = Duration::from_millis(20);

/// The inputs and outputs of a process, and its loop.
///
/// * `T`: content of a message for the service; an enum if inputs differ.
pub struct Stage<'a, T> {
    pub(crate) service: &'a Service,
    pub(crate) waiter: Waiter,
    patience: Duration,
    inputs: Vec<Box<dyn Input<T> + 'a>>,
    remember: Vec<Copier<T>>,
    optional: Vec<Optional>,
    max_age: Duration,
    held: Vec<Rc<dyn Bulk>>,
    outgoing: Vec<Outgoing>,
    skips: Option<u64>,
}

impl<T> fmt::Debug for Stage<'_, T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Stage")
            .field("n_inputs", &self.inputs.len())
            .field("n_outputs", &self.outgoing.len())
            .finish_non_exhaustive()
    }
}

impl<'a, T: 'a> Stage<'a, T> {
    /// Creates a stage without inputs and outputs.
    ///
    /// * `patience`: maximum time for which an input may be silent while others wait for it, and for which the stage waits for receivers.
    pub fn new(service: &'a Service, patience: Duration) -> Self {
        Self {
            service,
            waiter: service.bus().waiter(),
            patience,
            inputs: Vec::new(),
            remember: Vec::new(),
            optional: Vec::new(),
            max_age: Duration::ZERO,
            held: Vec::new(),
            outgoing: Vec::new(),
            skips: None,
        }
    }

    /// Allows the stage to skip frames if it cannot keep up with realtime delivery.
    ///
    /// * `frame_step`: distance between the used frames.
    pub fn skip_when_behind(&mut self, frame_step: u64) {
        self.skips = Some(frame_step.max(1));
    }

    /// Adds the topic of a view, for which every frame waits. Returns its slot.
    ///
    /// * `decode`: decodes a message. A message with an error is dropped, counted and logged.
    ///
    /// # Errors
    ///
    /// Returns errors of the transport.
    pub fn view_input<M: Message + Stamped>(
        &mut self,
        topic: &str,
        view: usize,
        decode: impl FnMut(&M) -> Result<T, WireError> + 'a,
    ) -> Result<usize, Failure> {
        let slot = self.slots(1);
        self.add(topic, Sender::View(view), Slots::one(slot), decode)?;
        Ok(slot)
    }

    /// Adds the topic of a view whose messages are optional. With realtime delivery, no frame waits for them longer than `deadline`. After
    /// that, the last value is used unless it is too old ([`Frame::latest`]).
    ///
    /// * `max_age`: maximum difference of capture times at which a value is used; the same for all optional inputs.
    ///
    /// # Errors
    ///
    /// Returns errors of the transport.
    pub fn optional_input<M: Message + Stamped>(
        &mut self,
        topic: &str,
        view: usize,
        [deadline, max_age]: [Duration; 2],
        decode: impl FnMut(&M) -> Result<T, WireError> + 'a,
    ) -> Result<usize, Failure>
    where
        T: Clone,
    {
        let slot = self.view_input(topic, view, decode)?;
        self.remember[slot] = Some(T::clone);
        self.optional.push(Optional { slot, deadline });
        self.max_age = max_age;
        Ok(slot)
    }

    /// Adds the topics of all fusion workers, with one slot for each pair, in the order of the pairs. The pairs are assigned to the workers
    /// in turn, and each worker sends messages for its own pairs. Returns the slot of the first pair.
    ///
    /// # Errors
    ///
    /// Returns errors of the transport.
    pub fn pair_inputs(
        &mut self,
        n_workers: usize,
        n_pairs: usize,
        decode: impl FnMut(&PairPose) -> Result<T, WireError> + Clone + 'a,
    ) -> Result<usize, Failure> {
        let base = self.slots(n_pairs);
        for worker in 0..n_workers {
            let slots = Slots {
                first: base + worker,
                end: base + n_pairs,
                step: n_workers,
                base: Some(base),
            };
            let sender = Sender::Worker { worker, n_workers };
            self.add(&topic::pair_pose(worker), sender, slots, decode.clone())?;
        }
        Ok(base)
    }

    /// Adds the topic of the people in every frame, for which every frame waits. Returns its slot.
    ///
    /// # Errors
    ///
    /// Returns errors of the transport.
    pub fn people_input(
        &mut self,
        decode: impl FnMut(&People) -> Result<T, WireError> + 'a,
    ) -> Result<usize, Failure> {
        let slot = self.slots(1);
        self.add(&topic::people(), Sender::All, Slots::one(slot), decode)?;
        Ok(slot)
    }

    fn slots(&mut self, n: usize) -> usize {
        let first = self.remember.len();
        self.remember.resize_with(first + n, || None);
        first
    }

    fn add<M: Message + Stamped>(
        &mut self,
        topic: &str,
        sender: Sender,
        slots: Slots,
        decode: impl FnMut(&M) -> Result<T, WireError> + 'a,
    ) -> Result<(), Failure> {
        let port = Port::<Subscriber<M>>::open(self.service, &mut self.waiter, topic, sender)?;
        self.inputs.push(Box::new(Typed {
            port,
            slots,
            decode,
            senders: Vec::new(),
            message: PhantomData,
        }));
        Ok(())
    }

    /// Holds the evidence of a view in shared memory, for one frame at a time. The evidence is released when its frame has been processed.
    ///
    /// * `frame_step`: distance between the used frames.
    ///
    /// # Errors
    ///
    /// Returns errors of the transport.
    pub fn hold_evidence(
        &mut self,
        view: usize,
        frame_step: u64,
    ) -> Result<Held<f32, EvidenceHeader>, Failure> {
        let topic = topic::evidence(view);
        let subscriber = self.service.bus().slice_subscriber(&topic, &mut self.waiter)?;
        let shelf = Shelf::new(1, frame_step);
        let held = Held::<f32, EvidenceHeader>::new(subscriber, view, shelf, |sample, expected| {
            expected.check(&sample.header().stamp, &sample.header().timing)
        });
        self.held.push(held.bulk());
        Ok(held)
    }

    /// Holds the frames of a view in shared memory: one with lossless delivery, otherwise up to [`HELD_REALTIME`].
    ///
    /// # Errors
    ///
    /// Returns errors of the transport.
    pub fn hold_frames(
        &mut self,
        view: usize,
        frame_step: u64,
    ) -> Result<Held<u8, FrameHeader>, Failure> {
        let topic = topic::frame(view);
        let subscriber = self.service.bus().slice_subscriber(&topic, &mut self.waiter)?;
        let capacity = match self.service.delivery() {
            Delivery::Lossless => 1,
            Delivery::Realtime => HELD_REALTIME,
        };
        let shelf = Shelf::new(capacity, frame_step);
        let held = Held::<u8, FrameHeader>::new(subscriber, view, shelf, |sample, expected| {
            wire::check_frame(sample.header(), sample.payload().len(), expected)
        });
        self.held.push(held.bulk());
        Ok(held)
    }

    /// Adds a topic about all views that the stage publishes.
    ///
    /// * `n_receivers`: number of processes that subscribe to it.
    ///
    /// # Errors
    ///
    /// Returns errors of the transport.
    pub fn output<M: Message + Stamped>(
        &mut self,
        topic: &str,
        n_receivers: usize,
    ) -> Result<Output<'a, M>, Failure> {
        self.publish(topic, n_receivers, EndStamp::Session)
    }

    /// Adds a topic about one view. The end of its stream has the stamp of the input's end.
    ///
    /// # Errors
    ///
    /// Returns errors of the transport.
    pub fn view_output<M: Message + Stamped>(
        &mut self,
        topic: &str,
        n_receivers: usize,
    ) -> Result<Output<'a, M>, Failure> {
        self.publish(topic, n_receivers, EndStamp::Input)
    }

    fn publish<M: Message + Stamped>(
        &mut self,
        topic: &str,
        n_receivers: usize,
        end_stamp: EndStamp,
    ) -> Result<Output<'a, M>, Failure> {
        let publisher = Rc::new(self.service.bus().publisher::<M>(topic)?);
        self.outgoing.push(Outgoing::messages(&publisher, n_receivers, end_stamp));
        Ok(Output::new(self.service, publisher))
    }

    /// Adds a topic of arrays that the stage publishes.
    ///
    /// # Errors
    ///
    /// Returns errors of the transport.
    pub fn bulk_output<E: Element, H: BulkHeader>(
        &mut self,
        topic: &str,
        n_receivers: usize,
    ) -> Result<Rc<SlicePublisher<E, H>>, Failure> {
        let publisher = Rc::new(self.service.bus().slice_publisher(topic)?);
        self.outgoing.push(Outgoing::arrays(&publisher, n_receivers));
        Ok(publisher)
    }

    /// Waits until the receivers of all outputs are connected, or until the time limit has passed.
    pub fn wait_for_receivers(&self) {
        let patience = self.service.patience_at_start(self.patience);
        for output in &self.outgoing {
            let [n, expected] = output.wait(patience);
            if n < expected {
                tracing::warn!(
                    n,
                    expected,
                    "starting although some receivers are not connected"
                );
            }
        }
        tracing::info!("begins");
    }

    /// Processes every frame until all inputs have ended or a stop is requested. Then sends the end of the stream.
    ///
    /// * `step`: processes the messages of one frame, and sends its results.
    ///
    /// # Errors
    ///
    /// Returns errors of the transport and of `step`.
    pub fn run(
        mut self,
        mut step: impl FnMut(&mut Frame<'_, T>) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        let context = Context::of(self.service);
        self.wait_for_receivers();
        let rules = Rules {
            delivery: self.service.delivery(),
            patience: self.patience,
            skips: self.skips,
        };
        let inputs = core::mem::take(&mut self.inputs);
        let remember = core::mem::take(&mut self.remember);
        let mut inbox = Inbox::new(inputs, rules, &self.optional, remember, self.max_age);
        while self.waiter.wait(TICK)? != Woken::Stop {
            self.receive(&mut inbox, &context)?;
            while let Some(joined) = inbox.next(&context) {
                self.process(&mut inbox, joined, &context, &mut step)?;
                if self.service.stop().is_requested() {
                    return Ok(());
                }
                self.receive(&mut inbox, &context)?;
            }
            if inbox.is_over(now_nanos()) {
                return self.end(&inbox);
            }
        }
        Ok(())
    }

    fn receive(&self, inbox: &mut Inbox<'_, T>, context: &Context<'_>) -> Result<(), Failure> {
        for held in &self.held {
            held.fill(context)?;
        }
        inbox.poll(context)?;
        self.service.health().waits(inbox.n_pending());
        Ok(())
    }

    fn process(
        &self,
        inbox: &mut Inbox<'_, T>,
        joined: Joined<Item<T>>,
        context: &Context<'_>,
        step: &mut impl FnMut(&mut Frame<'_, T>) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        let Joined { frame, items } = joined;
        let received_at = now_nanos();
        self.service.health().queued(inbox.n_pending());
        // While this frame is processed, the process is not idle, however long it takes.
        self.service.health().waits(inbox.n_pending() + 1);
        self.service.progress().tick();
        for held in &self.held {
            held.fill(context)?;
            held.advance(frame, context)?;
        }
        let received = || items.iter().flatten();
        let captured = received().map(|item| item.stamp.captured_at_nanos).min();
        let stamp = Stamp {
            session: self.service.session(),
            frame,
            captured_at_nanos: captured.unwrap_or(0),
            view: 0,
            epoch: self.service.epoch(),
        };
        let last_sent_at = received().map(|item| item.timing.sent_at_nanos).max();
        step(&mut Frame {
            number: frame,
            turn: Turn::new(stamp, received_at, last_sent_at),
            items,
            last: inbox.last(),
        })?;
        // Makes room for the next sample, even if its sender died before it sent the matching message.
        for held in &self.held {
            held.advance(frame.saturating_add(1), context)?;
        }
        inbox.processed(&stamp, now_nanos() - received_at);
        Ok(())
    }

    fn end(self, inbox: &Inbox<'_, T>) -> Result<(), Failure> {
        let session = self.service.session();
        self.linger(
            || -> Result<(), Failure> {
                for output in &self.outgoing {
                    output.end(inbox.end_stamp(), session)?;
                }
                Ok(())
            },
            || {
                // An input that counts as down may send again, and its sender must not have to wait for room here.
                let drained = self.held.iter().try_for_each(|held| held.drain());
                drained.and_then(|()| inbox.drain())
            },
        )
    }

    /// Sends the end of the stream, and sends it again to every restarted receiver, until a stop is requested.
    ///
    /// * `send_end`: sends the end of the stream on all outputs.
    ///
    /// # Errors
    ///
    /// Returns errors of the transport and of `send_end`.
    pub fn end_with(
        &self,
        n_connected: impl Fn() -> usize,
        mut send_end: impl FnMut() -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        send_end()?;
        self.service.health().finished();
        self.waiter.linger(n_connected, send_end)
    }

    pub(crate) fn linger(
        &self,
        send_end: impl FnMut() -> Result<(), Failure>,
        drain: impl Fn() -> Result<(), runtime::ReceiveError>,
    ) -> Result<(), Failure> {
        let n_connected = || {
            if let Err(error) = drain() {
                tracing::debug!(%error, "cannot discard messages after the end");
            }
            let outputs = self.outgoing.iter();
            outputs.map(Outgoing::n_connected).sum()
        };
        self.end_with(n_connected, send_end)
    }

    /// Waits until a message arrives or some time has passed.
    ///
    /// # Errors
    ///
    /// Returns a [`WaitError`] on failure.
    pub fn wait(&self, limit: Duration) -> Result<Woken, WaitError> {
        self.waiter.wait(limit)
    }

    pub(crate) fn send_ends(&self, of_input: Stamp) -> Result<(), Failure> {
        for output in &self.outgoing {
            output.end(Some(of_input), self.service.session())?;
        }
        Ok(())
    }
}
