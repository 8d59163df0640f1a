//! Receives a topic of any message type as bytes.

use bytemuck::{bytes_of, cast_slice};
use messages::{
    EvidenceHeader, FrameHeader, Health, PairPose, People, PictureHeader, Sightings, Skeletons,
    Status, ViewQuality,
};
use recording::{Envelope, Kind, encode, split_skeletons};
use runtime::{Bus, PortError, ReceiveError, SliceSubscriber, Subscriber, Waiter};

/// A message as bytes, with the fields that describe it.
#[derive(Debug)]
pub struct Received {
    /// Session of the message.
    pub session: u64,
    /// Frame of the message; 0 for heartbeats.
    pub frame: u64,
    /// Time at which the message was sent, in nanoseconds; 0 if unknown.
    pub sent_at: u64,
    /// States whether the message carries a result and, if not, why. Heartbeats always carry a result.
    pub status: Status,
    /// Only for heartbeats and for pictures of cameras, which are numbered: the epoch (number of restarts) of the process, and the number
    /// of messages that it has sent in this epoch.
    pub life: Option<[u64; 2]>,
    /// Only for poses of a view: true if evidence was sent with them.
    pub has_evidence: bool,
    /// The message in the form in which it is written to a recording; `None` if there is no room for it.
    pub data: Option<Vec<u8>>,
}

/// The receiving end of one topic.
#[derive(Debug)]
pub struct Receiver {
    kind: Kind,
    port: Port,
    /// True if arrays are omitted.
    heads_only: bool,
}

#[derive(Debug)]
enum Port {
    Frame(SliceSubscriber<u8, FrameHeader>),
    Evidence(SliceSubscriber<f32, EvidenceHeader>),
    Sightings(Subscriber<Sightings>),
    ViewQuality(Subscriber<ViewQuality>),
    PairPose(Subscriber<PairPose>),
    People(Subscriber<People>),
    Skeletons(Subscriber<Skeletons>),
    Health(Subscriber<Health>),
    Picture(SliceSubscriber<u8, PictureHeader>),
}

impl Receiver {
    /// Subscribes to a topic.
    ///
    /// * `heads_only`: omits arrays.
    ///
    /// # Errors
    ///
    /// Returns a [`PortError`] on failure.
    pub fn open(
        bus: &Bus,
        kind: Kind,
        topic: &str,
        waiter: &mut Waiter,
        heads_only: bool,
    ) -> Result<Self, PortError> {
        let port = match kind {
            Kind::Frame => Port::Frame(bus.slice_subscriber(topic, waiter)?),
            Kind::Evidence => Port::Evidence(bus.slice_subscriber(topic, waiter)?),
            Kind::Sightings => Port::Sightings(bus.subscriber(topic, waiter)?),
            Kind::ViewQuality => Port::ViewQuality(bus.subscriber(topic, waiter)?),
            Kind::PairPose => Port::PairPose(bus.subscriber(topic, waiter)?),
            Kind::People => Port::People(bus.subscriber(topic, waiter)?),
            Kind::Skeletons => Port::Skeletons(bus.subscriber(topic, waiter)?),
            Kind::Health => Port::Health(bus.subscriber(topic, waiter)?),
            Kind::Picture => Port::Picture(bus.slice_subscriber(topic, waiter)?),
        };
        Ok(Self {
            kind,
            port,
            heads_only,
        })
    }

    /// Returns the kind of the messages.
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// Returns the oldest waiting message.
    ///
    /// * `room`: function that returns true if there is room for the given number of bytes.
    ///
    /// # Errors
    ///
    /// Returns a [`ReceiveError`] on failure.
    pub fn receive(
        &self,
        room: impl FnOnce(usize) -> bool,
    ) -> Result<Option<Received>, ReceiveError> {
        let of = |head: &[u8], elements: &[u8]| Some(self.received(head, elements, room));
        Ok(match &self.port {
            Port::Frame(port) => port
                .receive()?
                .and_then(|sample| of(bytes_of(sample.header()), sample.payload())),
            Port::Evidence(port) => port
                .receive()?
                .and_then(|sample| of(bytes_of(sample.header()), cast_slice(sample.payload()))),
            Port::Sightings(port) => port.receive()?.and_then(|pose| {
                let received = of(bytes_of(&pose), &[])?;
                Some(Received {
                    has_evidence: pose.evidence_bytes > 0,
                    ..received
                })
            }),
            Port::ViewQuality(port) => {
                port.receive()?.and_then(|message| of(bytes_of(&message), &[]))
            }
            Port::PairPose(port) => port.receive()?.and_then(|message| of(bytes_of(&message), &[])),
            Port::People(port) => port.receive()?.and_then(|message| of(bytes_of(&message), &[])),
            Port::Skeletons(port) => {
                let received = port.receive_by(|skeletons| {
                    let [head, people] = split_skeletons(skeletons);
                    of(head, people)
                })?;
                received.flatten()
            }
            Port::Picture(port) => port.receive()?.and_then(|sample| {
                let head = sample.header();
                let received = of(bytes_of(head), sample.payload())?;
                // At the end of the pictures, the frame number is their total number.
                let is_one = head.status != Status::END;
                let n_sent = head.stamp.frame.saturating_add(u64::from(is_one));
                Some(Received {
                    life: Some([u64::from(head.stamp.epoch), n_sent]),
                    ..received
                })
            }),
            Port::Health(port) => port.receive()?.and_then(|heartbeat| {
                let received = of(bytes_of(&heartbeat), &[])?;
                Some(Received {
                    session: heartbeat.session,
                    sent_at: heartbeat.at_nanos,
                    life: Some([u64::from(heartbeat.epoch), heartbeat.n_sent]),
                    ..received
                })
            }),
        })
    }

    fn received(&self, head: &[u8], elements: &[u8], room: impl FnOnce(usize) -> bool) -> Received {
        let elements = if self.heads_only { &[] } else { elements };
        let envelope = Envelope::of(self.kind, head);
        let n_bytes = head.len() + elements.len();
        let data = room(n_bytes).then(|| {
            let mut data = Vec::with_capacity(n_bytes + 8);
            encode(self.kind, head, elements, &mut data);
            data
        });
        Received {
            session: envelope.map_or(0, |envelope| envelope.stamp.session),
            frame: envelope.map_or(0, |envelope| envelope.stamp.frame),
            sent_at: envelope.map_or(0, |envelope| envelope.timing.sent_at_nanos),
            status: envelope.map_or(Status::OK, |envelope| envelope.status),
            life: None,
            has_evidence: false,
            data,
        }
    }
}
