//! Sends bytes on a topic of any message type.

use bytemuck::{Pod, cast_slice_mut, pod_read_unaligned};
use messages::{
    EvidenceHeader, FrameHeader, PairPose, People, PictureHeader, Sightings, Skeletons, Status,
    ViewQuality,
};
use recording::{Envelope, Kind, Message};
use runtime::{
    Bus, Element, Header, Message as PlainMessage, Patience, PortError, Publisher, SendError,
    SlicePublisher,
};

use crate::receivers::Receivers;

/// The sending end of one topic.
#[derive(Debug)]
pub struct Sender {
    kind: Kind,
    port: Port,
}

#[derive(Debug)]
enum Port {
    Frame(SlicePublisher<u8, FrameHeader>),
    Evidence(SlicePublisher<f32, EvidenceHeader>),
    Sightings(Publisher<Sightings>),
    ViewQuality(Publisher<ViewQuality>),
    PairPose(Publisher<PairPose>),
    People(Publisher<People>),
    Skeletons(Publisher<Skeletons>),
    Picture(SlicePublisher<u8, PictureHeader>),
    /// Every process sends its own heartbeats.
    Health,
}

impl Sender {
    /// Publishes a topic.
    ///
    /// # Errors
    ///
    /// Returns a [`PortError`] on failure.
    pub fn open(bus: &Bus, kind: Kind, topic: &str) -> Result<Self, PortError> {
        let port = match kind {
            Kind::Frame => Port::Frame(bus.slice_publisher(topic)?),
            Kind::Evidence => Port::Evidence(bus.slice_publisher(topic)?),
            Kind::Sightings => Port::Sightings(bus.publisher(topic)?),
            Kind::ViewQuality => Port::ViewQuality(bus.publisher(topic)?),
            Kind::PairPose => Port::PairPose(bus.publisher(topic)?),
            Kind::People => Port::People(bus.publisher(topic)?),
            Kind::Skeletons => Port::Skeletons(bus.publisher(topic)?),
            Kind::Picture => Port::Picture(bus.slice_publisher(topic)?),
            Kind::Health => Port::Health,
        };
        Ok(Self { kind, port })
    }

    /// Waits for subscribers, see [`SlicePublisher::wait_for_subscribers`].
    pub fn wait_for_subscribers(&self, n: usize, patience: Patience) -> usize {
        self.receivers().map_or(0, |receiver| receiver.wait_for(n, patience))
    }

    /// Returns the number of subscribed processes.
    pub fn n_connected(&self) -> usize {
        self.receivers().map_or(0, Receivers::n_connected)
    }

    fn receivers(&self) -> Option<&dyn Receivers> {
        match &self.port {
            Port::Frame(port) => Some(port),
            Port::Evidence(port) => Some(port),
            Port::Sightings(port) => Some(port),
            Port::ViewQuality(port) => Some(port),
            Port::PairPose(port) => Some(port),
            Port::People(port) => Some(port),
            Port::Skeletons(port) => Some(port),
            Port::Picture(port) => Some(port),
            Port::Health => None,
        }
    }

    /// Sends a message with the given envelope instead of its own. If the message has no array, it is sent with an array of one element of
    /// value 0.
    ///
    /// # Errors
    ///
    /// Returns a [`SendError`] on failure.
    pub fn send(&self, message: &Message<'_>, envelope: &Envelope) -> Result<(), SendError> {
        let mut head = message.head.to_vec();
        envelope.put(self.kind, &mut head);
        match &self.port {
            Port::Frame(port) => array(port, &head, message.elements),
            Port::Evidence(port) => array(port, &head, message.elements),
            Port::Sightings(port) => plain(port, &head),
            Port::ViewQuality(port) => plain(port, &head),
            Port::PairPose(port) => plain(port, &head),
            Port::People(port) => plain(port, &head),
            Port::Skeletons(port) => {
                let message = Message {
                    head: &head,
                    ..*message
                };
                let skeletons = message.skeletons();
                skeletons.map_or(Ok(()), |skeletons| port.send(&skeletons).map(drop))
            }
            Port::Picture(port) => array(port, &head, message.elements),
            Port::Health => Ok(()),
        }
    }

    /// Sends the end of the stream.
    ///
    /// # Errors
    ///
    /// Returns a [`SendError`] on failure.
    pub fn end(&self, envelope: &Envelope) -> Result<(), SendError> {
        let head = match self.kind {
            Kind::Evidence | Kind::Picture | Kind::Health => return Ok(()),
            kind => vec![0; kind.head_bytes()],
        };
        let end = Envelope {
            status: Status::END,
            ..*envelope
        };
        let message = Message {
            head: &head,
            elements: &[],
        };
        self.send(&message, &end)
    }
}

fn plain<T: PlainMessage + Pod>(port: &Publisher<T>, head: &[u8]) -> Result<(), SendError> {
    let mut message = T::zeroed();
    bytemuck::bytes_of_mut(&mut message).copy_from_slice(head);
    port.send(&message).map(drop)
}

fn array<E: Element + Pod, H: Header + Pod>(
    port: &SlicePublisher<E, H>,
    head: &[u8],
    elements: &[u8],
) -> Result<(), SendError> {
    let n = elements.len() / size_of::<E>();
    let mut loan = port.loan(n.max(1))?;
    let room: &mut [u8] = cast_slice_mut(loan.payload_mut());
    room[elements.len()..].fill(0);
    room[..elements.len()].copy_from_slice(elements);
    *loan.header_mut() = pod_read_unaligned::<H>(head);
    loan.send().map(drop)
}
