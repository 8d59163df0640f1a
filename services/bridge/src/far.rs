//! The bridge of a host with cameras: takes the messages of its views from shared memory, and sends the newest ones to the fusing host.

use core::time::Duration;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use crate::hosts::{Answer, Content, Grid, Head, Hello, Outbox, Packet, Parcel, Signal, VERSION};
use crossbeam::channel::{Receiver as ChannelReceiver, Sender, bounded};
use failure::{ExitKind, Failure, OrFail as _, now_nanos};
use messages::{Cause, EvidenceHeader, FrameHeader, Stamp, Status, Timing, topic};
use recording::{Envelope, Kind, Message};
use runtime::{Service, SliceSubscriber, Waiter, Woken};
use stage::any::Receiver;

use crate::job::{Far, Job};
use crate::join::listed;
use crate::jpeg;
use crate::link::Link;
use crate::maps::{self, ViewMaps};
use crate::topics::Topics;

/// Interval at which the host introduces itself again, because the other host may have been restarted.
const HELLO_EVERY: Duration = Duration::from_millis(500);
/// Interval at which the end of a stream is sent until it is acknowledged.
const END_EVERY: Duration = Duration::from_millis(300);
/// Longest time for which the end of a stream is sent.
const END_PATIENCE: Duration = Duration::from_secs(15);
/// Longest sleep while a message waits for an acknowledgement.
const SHORT: Duration = Duration::from_millis(2);
/// Longest sleep if no message waits for an acknowledgement.
const LONG: Duration = Duration::from_millis(20);
/// Maximum number of acknowledgements that wait to be read.
const MOST_ACKS: usize = 1024;

/// A message that waits to be sent.
#[derive(Debug, Clone)]
enum Item {
    Frame {
        header: FrameHeader,
        rgb: Vec<u8>,
    },
    Message {
        content: Content,
        envelope: Envelope,
        data: Vec<u8>,
        /// Maps of the poses, if maps are sent.
        maps: Vec<u8>,
    },
}

/// Source of the messages of a lane (a topic of a view).
enum Port {
    Frame(SliceSubscriber<u8, FrameHeader>),
    Message(Content, Receiver),
}

/// Evidence of a view, which is sent as Gaussians together with the poses.
struct Evidence {
    port: SliceSubscriber<f32, EvidenceHeader>,
    /// Frame of the newest evidence, and its bytes.
    newest: Option<(u64, Vec<u8>)>,
}

impl Evidence {
    /// Adds the maps of the same frame to the poses of a view. The maps were published before the poses.
    fn add_to(&mut self, item: &mut Item, session: u64) -> Result<(), Failure> {
        while let Some(sample) = self.port.receive()? {
            let header = sample.header();
            if header.stamp.session != session || header.status != Status::OK {
                continue;
            }
            match ViewMaps::pack(header, sample.payload()) {
                Ok(bytes) => self.newest = Some((header.stamp.frame, bytes)),
                Err(error) => tracing::warn!(%error, "the evidence of a frame cannot be sent"),
            }
        }
        if let Item::Message { envelope, maps, .. } = item
            && let Some((frame, bytes)) = &self.newest
            && *frame == envelope.stamp.frame
            && envelope.status == Status::OK
        {
            maps.clone_from(bytes);
        }
        Ok(())
    }
}

/// A lane: one topic of a view.
struct Lane {
    view: usize,
    port: Port,
    /// Maps that are sent with the messages.
    evidence: Option<Evidence>,
    /// End of the stream, once it has been received.
    end: Option<Item>,
    /// Lowest sequence number whose acknowledgement shows that the end of the stream has arrived.
    end_sequence: Option<u64>,
    has_ended: bool,
    end_sent: Option<Instant>,
}

/// An acknowledgement: view, content, sequence.
type Ack = (u32, Content, u64);

/// Sends the messages of this host's views, until they end or a stop is requested.
pub(crate) fn run(service: &Service, job: &Job, role: &Far) -> Result<(), Failure> {
    let mut waiter = service.bus().waiter();
    let lanes = lanes(service, job, role, &mut waiter)?;
    let link = Arc::new(Link::open(&job.address).or_fail(ExitKind::Run)?);
    let origin = fastrand::u64(..);
    let (acks, answer) = listen(&link, job, origin)?;
    let outbox = Outbox::new(lanes.len());
    let mut it = Sending {
        service,
        job,
        role,
        grid: job.grid(service.session()),
        link,
        origin,
        lanes,
        outbox,
        acks,
    };
    let hello = Hello {
        version: VERSION,
        host: job.address.host.clone(),
        origin,
        fingerprint: job.fingerprint.clone(),
    };
    let topic = Topics::of(&job.address.deployment).hello(&job.address.host);
    let mut introduced = None::<Instant>;
    let mut ended = None::<Instant>;
    loop {
        let limit = if it.outbox.is_empty() { LONG } else { SHORT };
        if waiter.wait(limit)? == Woken::Stop {
            return Ok(());
        }
        if introduced.is_none_or(|at| at.elapsed() > HELLO_EVERY) {
            it.link.send(&topic, hello.to_bytes(), true);
            introduced = Some(Instant::now());
        }
        check(&answer)?;
        it.receive()?;
        it.acknowledge();
        it.repeat_ends();
        it.send_all();
        if it.lanes.iter().all(|lane| lane.end.is_some()) {
            let since = ended.get_or_insert_with(Instant::now).elapsed();
            if it.lanes.iter().all(|lane| lane.has_ended) || since > END_PATIENCE {
                break;
            }
        }
    }
    service.health().finished();
    while waiter.wait(Duration::from_millis(50))? != Woken::Stop {}
    Ok(())
}

/// Fails if the other host has refused this host.
fn check(answer: &Mutex<Option<Answer>>) -> Result<(), Failure> {
    let answer = answer.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(Answer::Refused(why)) = answer.as_ref() {
        let message = format!("the fusing host does not accept this host: {}", listed(why));
        return Err(Failure::new(ExitKind::Config, message));
    }
    Ok(())
}

fn lanes(
    service: &Service,
    job: &Job,
    role: &Far,
    waiter: &mut Waiter,
) -> Result<Vec<Lane>, Failure> {
    let mut lanes = Vec::new();
    let bus = service.bus();
    for &view in &role.views {
        let mut add = |port, evidence| {
            lanes.push(Lane {
                view,
                port,
                evidence,
                end: None,
                end_sequence: None,
                has_ended: false,
                end_sent: None,
            });
        };
        match job.carry {
            deployment::hosts::Carry::Frames => {
                let port = bus.slice_subscriber(&topic::frame(view), waiter)?;
                add(Port::Frame(port), None);
            }
            deployment::hosts::Carry::Poses => {
                let name = topic::sightings(view);
                let port = Receiver::open(bus, Kind::Sightings, &name, waiter, false)?;
                let evidence = job.maps.get(view).map(|_| {
                    let port = bus.slice_subscriber(&topic::evidence(view), waiter)?;
                    Ok::<_, Failure>(Evidence { port, newest: None })
                });
                add(
                    Port::Message(Content::Sightings, port),
                    evidence.transpose()?,
                );
                if job.has_quality {
                    let name = topic::view_quality(view);
                    let port = Receiver::open(bus, Kind::ViewQuality, &name, waiter, false)?;
                    add(Port::Message(Content::ViewQuality, port), None);
                }
            }
        }
    }
    Ok(lanes)
}

type Listening = (ChannelReceiver<Ack>, Arc<Mutex<Option<Answer>>>);

/// Answers requests for the time at once. Stores acknowledgements and the last answer.
fn listen(link: &Arc<Link>, job: &Job, origin: u64) -> Result<Listening, Failure> {
    let topics = Topics::of(&job.address.deployment);
    let host = &job.address.host;
    let (sender, acks): (Sender<Ack>, _) = bounded(MOST_ACKS);
    let up = topics.up(host);
    let back = Arc::downgrade(link);
    let on_signal = move |_: &str, bytes: &[u8]| {
        let received_at = now_nanos();
        match Signal::parse(bytes) {
            Ok(Signal::Ping { asked_at, .. }) => {
                let pong = Signal::Pong {
                    origin,
                    asked_at,
                    received_at,
                    answered_at: now_nanos(),
                };
                if let Some(link) = back.upgrade() {
                    link.send(&up, pong.to_bytes().to_vec(), true);
                }
            }
            Ok(Signal::Ack {
                origin: of,
                view,
                content,
                sequence,
            }) if of == origin => {
                // If there is no space for an acknowledgement, it is dropped, and its message later counts as lost.
                let _is_kept = sender.try_send((view, content, sequence)).is_ok();
            }
            Ok(_) => {}
            Err(error) => tracing::debug!(%error, "a message from the fusing host cannot be read"),
        }
    };
    let subscribed = link.subscribe(&topics.down(host), on_signal);
    subscribed.or_fail(ExitKind::Run)?;
    let answer = Arc::new(Mutex::new(None));
    let keep = Arc::clone(&answer);
    let on_answer = move |_: &str, bytes: &[u8]| match Answer::parse(bytes) {
        Ok(it) => *keep.lock().unwrap_or_else(PoisonError::into_inner) = Some(it),
        Err(error) => tracing::debug!(%error, "a message from the fusing host cannot be read"),
    };
    let subscribed = link.subscribe(&topics.answer(host), on_answer);
    subscribed.or_fail(ExitKind::Run)?;
    Ok((acks, answer))
}

struct Sending<'a> {
    service: &'a Service,
    job: &'a Job,
    role: &'a Far,
    grid: Grid,
    link: Arc<Link>,
    origin: u64,
    lanes: Vec<Lane>,
    outbox: Outbox<Item>,
    acks: ChannelReceiver<Ack>,
}

impl Sending<'_> {
    /// Receives all waiting messages from shared memory.
    fn receive(&mut self) -> Result<(), Failure> {
        let session = self.service.session();
        let health = self.service.health();
        for (index, lane) in self.lanes.iter_mut().enumerate() {
            while let Some((of, status, mut item)) = next(&lane.port)? {
                if of != session {
                    continue;
                }
                health.received(1);
                if let Some(evidence) = &mut lane.evidence {
                    evidence.add_to(&mut item, session)?;
                }
                if status == Status::END {
                    lane.end = Some(item);
                } else {
                    self.outbox.offer(index, item);
                }
            }
        }
        Ok(())
    }

    fn acknowledge(&mut self) {
        while let Ok((view, content, sequence)) = self.acks.try_recv() {
            let is_meant =
                |lane: &Lane| lane.view == view as usize && content_of(&lane.port) == content;
            let Some(index) = self.lanes.iter().position(is_meant) else {
                continue;
            };
            self.outbox.acknowledge(index, sequence, now_nanos());
            let lane = &mut self.lanes[index];
            lane.has_ended |= lane.end_sequence.is_some_and(|end| sequence >= end);
        }
    }

    /// Sends the ends of streams repeatedly until they are acknowledged.
    fn repeat_ends(&mut self) {
        for (index, lane) in self.lanes.iter_mut().enumerate() {
            let is_due = lane.end_sent.is_none_or(|at| at.elapsed() > END_EVERY);
            let Some(end) = lane.end.as_ref().filter(|_| is_due && !lane.has_ended) else {
                continue;
            };
            // The end must not be sent before the last frame, because the end would overtake the frame.
            if lane.end_sent.is_some()
                || self.outbox.sent(index).n_offered == 0
                || self.outbox.n_waiting() == 0
            {
                self.outbox.offer(index, end.clone());
                lane.end_sent = Some(Instant::now());
            }
        }
    }

    fn send_all(&mut self) {
        while let Some(parcel) = self.outbox.next(now_nanos()) {
            self.send(&parcel);
        }
    }

    fn send(&mut self, parcel: &Parcel<Item>) {
        let lane = &mut self.lanes[parcel.lane];
        let (envelope, content) = parts(&parcel.item);
        if envelope.status == Status::END {
            lane.end_sequence.get_or_insert(parcel.sequence);
        }
        let encoded;
        let (body, size, n_dropped, skew_nanos) = match &parcel.item {
            Item::Frame { header, rgb } if header.status == Status::OK => {
                let size = [header.width, header.height];
                match jpeg::encode(rgb, size, self.role.jpeg_quality) {
                    Ok(jpeg) => encoded = jpeg,
                    Err(error) => {
                        tracing::warn!(%error, view = lane.view, "a frame cannot be encoded as JPEG");
                        self.service.health().dropped(Cause::Malformed, 1);
                        return;
                    }
                }
                (&encoded[..], size, header.n_dropped, header.skew_nanos)
            }
            Item::Frame { header, .. } => (&[][..], [0; 2], header.n_dropped, 0),
            Item::Message {
                content: Content::Sightings,
                data,
                maps,
                ..
            } => {
                encoded = maps::join(data, maps);
                (&encoded[..], [0; 2], 0, 0)
            }
            Item::Message { data, .. } => (&data[..], [0; 2], 0, 0),
        };
        let stamp = envelope.stamp;
        let head = Head {
            content,
            view: lane.view as u32,
            status: envelope.status,
            origin: self.origin,
            sequence: parcel.sequence,
            frame: stamp.frame,
            instant_nanos: self.grid.at(self.job.nth(stamp.frame)),
            captured_at_nanos: stamp.captured_at_nanos,
            received_at_nanos: envelope.timing.received_at_nanos,
            sent_at_nanos: envelope.timing.sent_at_nanos,
            packed_at_nanos: now_nanos(),
            skew_nanos,
            n_dropped,
            n_overtaken: parcel.n_overtaken,
            size,
        };
        let address = &self.job.address;
        let topic = Topics::of(&address.deployment).data(&address.host);
        self.link.send(&topic, Packet { head, body }.to_bytes(), false);
        self.service.health().sent(stamp.frame);
    }
}

fn content_of(port: &Port) -> Content {
    match port {
        Port::Frame(_) => Content::Frame,
        Port::Message(content, _) => *content,
    }
}

fn parts(item: &Item) -> (Envelope, Content) {
    match item {
        Item::Frame { header, .. } => {
            let envelope = Envelope {
                stamp: header.stamp,
                timing: header.timing,
                status: header.status,
            };
            (envelope, Content::Frame)
        }
        Item::Message {
            content, envelope, ..
        } => (*envelope, *content),
    }
}

/// Returns the next message of a topic, with its session and status.
fn next(port: &Port) -> Result<Option<(u64, Status, Item)>, Failure> {
    match port {
        Port::Frame(port) => Ok(port.receive()?.map(|sample| {
            let header = *sample.header();
            let has_picture = header.status == Status::OK;
            let rgb = if has_picture {
                sample.payload().to_vec()
            } else {
                Vec::new()
            };
            (
                header.stamp.session,
                header.status,
                Item::Frame { header, rgb },
            )
        })),
        Port::Message(content, port) => {
            let Some(received) = port.receive(|_| true)? else {
                return Ok(None);
            };
            let data = received.data.unwrap_or_default();
            let message = Message::parse(port.kind(), &data).ok();
            let envelope = message.and_then(|message| Envelope::of(port.kind(), message.head));
            let envelope = envelope.unwrap_or(Envelope {
                stamp: Stamp::default(),
                timing: Timing::default(),
                status: received.status,
            });
            let content = *content;
            let item = Item::Message {
                content,
                envelope,
                data,
                maps: Vec::new(),
            };
            Ok(Some((received.session, received.status, item)))
        }
    }
}
