//! Tests of joining messages, with lists as inputs, and with a clock that the tests set.

use std::cell::{Cell, RefCell};
use std::collections::{BTreeMap, VecDeque};
use std::marker::PhantomData;
use std::rc::Rc;

use messages::{PairPose, Refusal, Sightings, Timing, ViewQuality};
use wire::WireError;

use super::*;
use crate::input::Typed;
use crate::slots::Slots;
use crate::{Account, Port, Receive, Sender, Stamped};

const SESSION: u64 = 7;
const PATIENCE: Duration = Duration::from_nanos(100);

/// A topic backed by a list. Sending a message appends it to the list.
#[derive(Debug)]
struct Topic<M> {
    waiting: Rc<RefCell<VecDeque<M>>>,
    senders: Vec<u128>,
}

impl<M> Clone for Topic<M> {
    fn clone(&self) -> Self {
        Self {
            waiting: Rc::clone(&self.waiting),
            senders: self.senders.clone(),
        }
    }
}

impl<M> Topic<M> {
    fn new() -> Self {
        Self {
            waiting: Rc::default(),
            senders: Vec::new(),
        }
    }

    fn send(&self, message: M) {
        self.waiting.borrow_mut().push_back(message);
    }
}

impl<M> Receive<M> for Topic<M> {
    fn receive(&self) -> Result<Option<M>, ReceiveError> {
        Ok(self.waiting.borrow_mut().pop_front())
    }

    fn senders(&self) -> Vec<u128> {
        self.senders.clone()
    }
}

#[derive(Debug, Default)]
struct Counts {
    received: Cell<u64>,
    dropped: RefCell<BTreeMap<&'static str, u64>>,
    refused: RefCell<Vec<Refusal>>,
}

impl Account for Counts {
    fn received(&self) {
        self.received.set(self.received.get() + 1);
    }

    fn dropped(&self, cause: Cause, n: u64) {
        if n > 0 {
            *self.dropped.borrow_mut().entry(cause.name()).or_default() += n;
        }
    }

    fn refused(&self, cause: Refusal, _: &str, _: &WireError) {
        self.refused.borrow_mut().push(cause);
    }
}

fn stamp(frame: u64, view: u32) -> Stamp {
    Stamp {
        session: SESSION,
        frame,
        captured_at_nanos: 10 * frame,
        view,
        epoch: 0,
    }
}

fn message<M: Stamped + Default>(frame: u64, view: u32) -> M {
    M::default().with(stamp(frame, view), Timing::default())
}

fn input<M: Stamped + 'static>(
    topic: &Topic<M>,
    sender: Sender,
    slots: Slots,
) -> Box<dyn Input<u64>> {
    Box::new(Typed {
        port: Port::new(topic.clone(), sender),
        slots,
        decode: |message: &M| match message.stamp().frame {
            666 => Err(WireError::Mismatch {
                field: "test",
                got: 1,
                expected: 0,
            }),
            frame => Ok(frame),
        },
        senders: Vec::new(),
        message: PhantomData,
    })
}

fn rules(delivery: Delivery) -> Rules {
    Rules {
        delivery,
        patience: PATIENCE,
        skips: None,
    }
}

fn inbox(inputs: Vec<Box<dyn Input<u64>>>, n_slots: usize, rules: Rules) -> Inbox<'static, u64> {
    Inbox::new(inputs, rules, &[], vec![None; n_slots], Duration::ZERO)
}

/// Returns the topics of two views, and a stage that joins them.
fn two_views(rules: Rules) -> ([Topic<Sightings>; 2], Inbox<'static, u64>) {
    let topics = [Topic::new(), Topic::new()];
    let inputs = [0, 1].map(|view| input(&topics[view], Sender::View(view), Slots::one(view)));
    let inbox = inbox(inputs.into(), 2, rules);
    (topics, inbox)
}

/// Polls. Returns the complete frames, and for every slot whether it has a message.
fn frames(inbox: &mut Inbox<'_, u64>, counts: &Counts, now: u64) -> Vec<(u64, Vec<bool>)> {
    let clock = move || now;
    let context = Context::new(SESSION, &clock, counts);
    inbox.poll(&context).unwrap();
    let mut frames = Vec::new();
    while let Some(joined) = inbox.next(&context) {
        frames.push((
            joined.frame,
            joined.items.iter().map(Option::is_some).collect(),
        ));
    }
    frames
}

#[test]
fn a_frame_is_complete_when_every_input_has_sent() {
    let ([first, second], mut inbox) = two_views(rules(Delivery::Realtime));
    let counts = Counts::default();
    first.send(message(0, 0));
    assert_eq!(frames(&mut inbox, &counts, 0), []);
    second.send(message(0, 1));
    assert_eq!(frames(&mut inbox, &counts, 1), [(0, vec![true, true])]);
    assert_eq!(counts.received.get(), 2);
}

#[test]
fn a_frame_is_complete_at_its_deadline_and_a_later_message_is_counted_as_late() {
    let ([first, second], mut inbox) = two_views(rules(Delivery::Realtime));
    let counts = Counts::default();
    first.send(message(0, 0));
    assert_eq!(frames(&mut inbox, &counts, 0), []);
    assert_eq!(frames(&mut inbox, &counts, 100), [(0, vec![true, false])]);
    second.send(message(0, 1));
    assert_eq!(frames(&mut inbox, &counts, 101), []);
    assert_eq!(*counts.dropped.borrow(), [(Cause::Late.name(), 1)].into());
}

#[test]
fn a_connected_sender_has_more_time_with_lossless_delivery() {
    let connected = Topic {
        senders: vec![1],
        ..Topic::<Sightings>::new()
    };
    let other = Topic::<Sightings>::new();
    let inputs = vec![
        input(&other, Sender::View(0), Slots::one(0)),
        input(&connected, Sender::View(1), Slots::one(1)),
    ];
    let mut inbox = inbox(inputs, 2, rules(Delivery::Lossless));
    let counts = Counts::default();
    other.send(message(0, 0));
    assert_eq!(frames(&mut inbox, &counts, 0), []);
    assert_eq!(frames(&mut inbox, &counts, 999), []);
    assert_eq!(frames(&mut inbox, &counts, 1000), [(0, vec![true, false])]);
}

#[test]
fn messages_of_other_senders_and_undecodable_messages_are_refused() {
    let ([first, _second], mut inbox) = two_views(rules(Delivery::Realtime));
    let counts = Counts::default();
    let mut of_another_session: Sightings = message(0, 0);
    of_another_session.stamp.session = 8;
    first.send(of_another_session);
    first.send(message(0, 1)); // another view's
    first.send(message(666, 0)); // cannot be decoded
    assert_eq!(frames(&mut inbox, &counts, 1000), []);
    assert_eq!(counts.refused.borrow().len(), 3);
    assert_eq!((counts.received.get(), inbox.n_pending()), (0, 0));
}

#[test]
fn the_inbox_is_finished_when_every_input_has_ended_and_every_frame_was_returned() {
    let ([first, second], mut inbox) = two_views(rules(Delivery::Lossless));
    let counts = Counts::default();
    first.send(message(0, 0));
    first.send(Sightings::end(stamp(1, 0)));
    second.send(Sightings::end(stamp(1, 1)));
    let clock = || 0;
    inbox.poll(&Context::new(SESSION, &clock, &counts)).unwrap();
    assert!(!inbox.is_over(0));
    assert_eq!(frames(&mut inbox, &counts, 0), [(0, vec![true, false])]);
    assert!(inbox.is_over(0));
    assert_eq!(inbox.end_stamp(), Some(stamp(1, 1)));
    assert_eq!(counts.received.get(), 1, "the end is not counted");
}

#[test]
fn the_messages_and_the_end_of_a_worker_count_for_its_pairs() {
    let topics = [Topic::<PairPose>::new(), Topic::new()];
    let inputs = [0, 1].map(|worker| {
        let slots = Slots {
            first: worker,
            end: 3,
            step: 2,
            base: Some(0),
        };
        let n_workers = 2;
        input(&topics[worker], Sender::Worker { worker, n_workers }, slots)
    });
    let mut inbox = inbox(inputs.into(), 3, rules(Delivery::Lossless));
    let counts = Counts::default();
    topics[0].send(message(0, 0));
    topics[0].send(message(0, 2));
    topics[1].send(message(0, 2)); // not its pair
    assert_eq!(frames(&mut inbox, &counts, 0), []);
    assert_eq!(counts.refused.borrow().len(), 1);
    topics[1].send(PairPose::end(stamp(0, 0)));
    assert_eq!(
        frames(&mut inbox, &counts, 1),
        [(0, vec![true, false, true])]
    );
    topics[0].send(PairPose::end(stamp(0, 0)));
    assert_eq!(frames(&mut inbox, &counts, 2), []);
    assert!(inbox.is_over(2));
}

/// Returns a view's poses and its expected errors, which are optional, with a deadline of 30 ns and a maximum age of 25 ns.
fn with_errors(delivery: Delivery) -> (Topic<Sightings>, Topic<ViewQuality>, Inbox<'static, u64>) {
    let (poses, errors) = (Topic::new(), Topic::new());
    let inputs = vec![
        input(&poses, Sender::View(0), Slots::one(0)),
        input(&errors, Sender::View(0), Slots::one(1)),
    ];
    let optional = [Optional {
        slot: 1,
        deadline: Duration::from_nanos(30),
    }];
    let remember: Vec<Copier<u64>> = vec![None, Some(u64::clone)];
    let max_age = Duration::from_nanos(25);
    let inbox = Inbox::new(inputs, rules(delivery), &optional, remember, max_age);
    (poses, errors, inbox)
}

#[test]
fn no_frame_waits_for_an_optional_message_past_its_deadline_and_the_last_one_is_used_while_fresh() {
    let (poses, errors, mut inbox) = with_errors(Delivery::Realtime);
    let counts = Counts::default();
    errors.send(message(0, 0));
    poses.send(message(0, 0));
    assert_eq!(frames(&mut inbox, &counts, 0), [(0, vec![true, true])]);
    poses.send(message(1, 0));
    assert_eq!(frames(&mut inbox, &counts, 10), []);
    assert_eq!(frames(&mut inbox, &counts, 40), [(1, vec![true, false])]);
    assert_eq!(inbox.last().of(1, 2, 20), Some((2, &0)));
    assert_eq!(inbox.last().of(1, 3, 30), None, "too old");
    // The message is too late for its own frame, but in time for the next one.
    errors.send(message(1, 0));
    assert_eq!(frames(&mut inbox, &counts, 41), []);
    assert_eq!(inbox.last().of(1, 3, 30), Some((2, &1)));
}

#[test]
fn with_lossless_delivery_frames_wait_for_optional_messages() {
    let (poses, _errors, mut inbox) = with_errors(Delivery::Lossless);
    let counts = Counts::default();
    poses.send(message(0, 0));
    assert_eq!(frames(&mut inbox, &counts, 0), []);
    assert_eq!(frames(&mut inbox, &counts, 99), []);
    assert_eq!(frames(&mut inbox, &counts, 100), [(0, vec![true, false])]);
}

#[test]
fn a_slow_stage_skips_to_the_latest_frame_only_if_frames_may_be_lost() {
    for (delivery, expected) in [(Delivery::Realtime, 1), (Delivery::Lossless, 5)] {
        let skipping = Rules {
            skips: Some(2),
            ..rules(delivery)
        };
        let ([first, second], mut inbox) = two_views(skipping);
        let counts = Counts::default();
        for frame in (0..10).step_by(2) {
            first.send(message(frame, 0));
            second.send(message(frame, 1));
        }
        let got = frames(&mut inbox, &counts, 0);
        assert_eq!(got.len(), expected);
        assert_eq!(got.last(), Some(&(8, vec![true, true])));
        let skipped = counts.dropped.borrow().get(Cause::Busy.name()).copied();
        assert_eq!(skipped.unwrap_or(0), 5 - expected as u64);
    }
}

#[test]
fn messages_after_the_end_of_stream_are_discarded() {
    let ([first, _second], inbox) = two_views(rules(Delivery::Lossless));
    first.send(message(0, 0));
    inbox.drain().unwrap();
    assert!(first.waiting.borrow().is_empty());
}
