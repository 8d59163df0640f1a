//! Receives a topic of any kind as bytes.

use bytemuck::{bytes_of, cast_slice};
use messages::{
    EvidenceHeader, FrameHeader, Health, PairPose, Pose3d, Status, ViewPose, ViewQuality,
};
use recording::{Envelope, Kind, encode};
use runtime::{Bus, PortError, ReceiveError, SliceSubscriber, Subscriber, Waiter};

/// A message as bytes, and what its envelope tells.
#[derive(Debug)]
pub struct Received {
    /// Its session.
    pub session: u64,
    /// Its frame; 0 for heartbeats.
    pub frame: u64,
    /// When it was sent.
    pub sent_at: u64,
    /// Whether it carries a result; heartbeats always do.
    pub status: Status,
    /// Heartbeats: the epoch of the process, and how many messages it has sent in it.
    pub life: Option<[u64; 2]>,
    /// Poses: whether evidence was sent with them.
    pub has_evidence: bool,
    /// The message as it is written into a recording; none if there was no room for it.
    pub data: Option<Vec<u8>>,
}

/// The receiving end of one topic.
#[derive(Debug)]
pub struct Receiver {
    kind: Kind,
    port: Port,
    /// Arrays are omitted.
    heads_only: bool,
}

#[derive(Debug)]
enum Port {
    Frame(SliceSubscriber<u8, FrameHeader>),
    Evidence(SliceSubscriber<f32, EvidenceHeader>),
    ViewPose(Subscriber<ViewPose>),
    ViewQuality(Subscriber<ViewQuality>),
    PairPose(Subscriber<PairPose>),
    Pose3d(Subscriber<Pose3d>),
    Health(Subscriber<Health>),
}

impl Receiver {
    /// Subscribes to a topic.
    ///
    /// * `heads_only`: omits arrays.
    ///
    /// # Errors
    ///
    /// [`PortError`].
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
            Kind::ViewPose => Port::ViewPose(bus.subscriber(topic, waiter)?),
            Kind::ViewQuality => Port::ViewQuality(bus.subscriber(topic, waiter)?),
            Kind::PairPose => Port::PairPose(bus.subscriber(topic, waiter)?),
            Kind::Pose3d => Port::Pose3d(bus.subscriber(topic, waiter)?),
            Kind::Health => Port::Health(bus.subscriber(topic, waiter)?),
        };
        Ok(Self {
            kind,
            port,
            heads_only,
        })
    }

    /// The kind of its messages.
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// Takes the oldest message that waits, if one does.
    ///
    /// * `room`: whether there is room for so many bytes.
    ///
    /// # Errors
    ///
    /// [`ReceiveError`].
    pub fn receive(
        &self,
        room: impl FnOnce(usize) -> bool,
    ) -> Result<Option<Received>, ReceiveError> {
        let of = |head: &[u8], elements: &[u8]| Some(self.received(head, elements, room));
        Ok(match &self.port {
            Port::Frame(it) => it
                .receive()?
                .and_then(|it| of(bytes_of(it.header()), it.payload())),
            Port::Evidence(it) => it
                .receive()?
                .and_then(|it| of(bytes_of(it.header()), cast_slice(it.payload()))),
            Port::ViewPose(it) => it.receive()?.and_then(|it| {
                let received = of(bytes_of(&it), &[])?;
                Some(Received {
                    has_evidence: it.evidence_bytes > 0,
                    ..received
                })
            }),
            Port::ViewQuality(it) => it.receive()?.and_then(|it| of(bytes_of(&it), &[])),
            Port::PairPose(it) => it.receive()?.and_then(|it| of(bytes_of(&it), &[])),
            Port::Pose3d(it) => it.receive()?.and_then(|it| of(bytes_of(&it), &[])),
            Port::Health(it) => it.receive()?.and_then(|it| {
                let received = of(bytes_of(&it), &[])?;
                Some(Received {
                    session: it.session,
                    sent_at: it.at_nanos,
                    life: Some([u64::from(it.epoch), it.n_sent]),
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
            session: envelope.map_or(0, |it| it.stamp.session),
            frame: envelope.map_or(0, |it| it.stamp.frame),
            sent_at: envelope.map_or(0, |it| it.timing.sent_at_nanos),
            status: envelope.map_or(Status::OK, |it| it.status),
            life: None,
            has_evidence: false,
            data,
        }
    }
}
