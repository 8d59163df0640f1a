//! Receives packets over the link. Every packet is checked, decoded in a thread of its view, and then acknowledged.

use std::sync::{Arc, Mutex};

use crate::hosts::{
    Answer, Content, Exchange, Expected, Fingerprint, Head, Hello, Packet, Signal, Welcome,
};
use crossbeam::channel::{Receiver, Sender, bounded};
use deployment::hosts::Carry;
use failure::{ExitKind, Failure, OrFail as _, now_nanos};
use messages::Status;
use recording::{Kind, Message};
use runtime::Service;

use super::remote::Remote;
use crate::job::{Job, Near};
use crate::jpeg;
use crate::link::Link;
use crate::maps::{self, ViewMaps};
use crate::topics::{Topics, host_of};

/// Maximum number of packets of a view that wait to be decoded. A correct host never has this many packets in transit.
const MOST_WAITING: usize = 8;
/// Maximum number of messages that wait to be published.
const MOST_ARRIVED: usize = 256;

/// A decoded message.
pub(super) struct Arrived {
    pub(super) head: Head,
    /// Pixels, or the message as in a recording; empty if there is neither.
    pub(super) body: Vec<u8>,
    /// Maps that came with the poses.
    pub(super) maps: Option<maps::Checked>,
    /// Times at which the message arrived and was decoded.
    pub(super) came_at: u64,
    pub(super) decoded_at: u64,
    /// Number of bytes that were transferred.
    pub(super) n_bytes: usize,
}

impl Arrived {
    pub(super) fn view(&self) -> usize {
        self.head.view as usize
    }

    /// Returns true if the message only accompanies another message of its frame. In this case, only the other message is counted.
    pub(super) fn is_beside(&self) -> bool {
        self.head.content == Content::ViewQuality
    }
}

/// A checked packet that waits to be decoded.
struct Waiting {
    head: Head,
    body: Vec<u8>,
    came_at: u64,
    n_bytes: usize,
}

/// Starts to listen. Returns the receiver of arriving messages.
///
/// * `own`: start of this bridge, and the text with the state of all hosts, which is sent on request.
pub(super) fn listen(
    service: &Service,
    (job, role): (&Job, &Near),
    link: &Arc<Link>,
    remotes: &Arc<Vec<Remote>>,
    own: (u64, Arc<Mutex<String>>),
) -> Result<Receiver<Arrived>, Failure> {
    let topics = Topics::of(&job.address.deployment);
    let (origin, status) = own;
    let welcome = Welcome {
        origin,
        session: service.session(),
    };
    let (sender, arrived) = bounded(MOST_ARRIVED);
    let mut inlets: Vec<Option<Sender<Waiting>>> = Vec::new();
    inlets.resize_with(job.sizes.len(), || None);
    for (index, host) in role.hosts.iter().enumerate() {
        for &view in &host.views {
            let (inlet, waiting) = bounded(MOST_WAITING);
            let decoder = Decoder {
                link: Arc::clone(link),
                remotes: Arc::clone(remotes),
                remote: index,
                down: topics.down(&host.name),
                size: job.sizes.get(view).copied().unwrap_or_default(),
                maps: job.maps.get(view).copied(),
                arrived: sender.clone(),
            };
            let thread = std::thread::Builder::new().name(format!("decode-{view}"));
            let started = thread.spawn(move || decoder.run(&waiting));
            started.or_fail(ExitKind::Run)?;
            if let Some(slot) = inlets.get_mut(view) {
                *slot = Some(inlet);
            }
        }
    }
    let gate = Gate {
        remotes: Arc::clone(remotes),
        sizes: job.sizes.clone(),
        carry: job.carry,
        inlets,
    };
    let subscribed = link.subscribe(&topics.data("*"), move |key, bytes| gate.take(key, bytes));
    subscribed.or_fail(ExitKind::Run)?;
    hear_signals(link, &topics, remotes, origin)?;
    hear_hellos(link, &topics, remotes, (&job.fingerprint, welcome))?;
    let answering = link.answer(&topics.status(), move || {
        let text = status.lock();
        text.map_or_else(|_| Vec::new(), |text| text.clone().into_bytes())
    });
    answering.or_fail(ExitKind::Run)?;
    Ok(arrived)
}

/// Checks packets.
struct Gate {
    remotes: Arc<Vec<Remote>>,
    sizes: Vec<[u32; 2]>,
    carry: Carry,
    /// Queues of packets, by view.
    inlets: Vec<Option<Sender<Waiting>>>,
}

impl Gate {
    fn take(&self, key: &str, bytes: &[u8]) {
        let came_at = now_nanos();
        let name = host_of(key);
        let Some(remote) = self.remotes.iter().find(|remote| remote.name == name) else {
            tracing::debug!(
                key,
                "a message came from a host that is not in the deployment"
            );
            return;
        };
        let expected = Expected {
            views: &remote.views,
            sizes: &self.sizes,
            // A JPEG of a frame is not larger than its pixels and tables.
            max_body: self.most_body(),
        };
        let packet = match Packet::parse(bytes, &expected) {
            Ok(packet) => packet,
            Err(error) => return remote.malformed(&error),
        };
        let crosses = match packet.head.content {
            Content::Frame => self.carry == Carry::Frames,
            Content::Sightings | Content::ViewQuality => self.carry == Carry::Poses,
        };
        if !crosses {
            return remote
                .malformed(&"the host sends messages that `link.carry` excludes on this host; set the same value on all hosts");
        }
        let mut state = remote.state();
        if state.welcomed != Some(packet.head.origin) {
            state.n_unknown += 1;
            return;
        }
        state.n_packets += 1;
        state.n_bytes += bytes.len() as u64;
        drop(state);
        remote.heard(came_at);
        let waiting = Waiting {
            head: packet.head,
            body: packet.body.to_vec(),
            came_at,
            n_bytes: bytes.len(),
        };
        let inlet = self.inlets.get(packet.head.view as usize);
        let inlet = inlet.and_then(Option::as_ref);
        if inlet.is_none_or(|inlet| inlet.try_send(waiting).is_err()) {
            remote.state().n_no_room += 1;
        }
    }

    fn most_body(&self) -> usize {
        const TABLES: usize = 1 << 16;
        let pixels = self.sizes.iter().map(|size| (size[0] * size[1] * 3) as usize);
        pixels.max().unwrap_or(0) + TABLES
    }
}

/// Decodes the packets of one view.
struct Decoder {
    link: Arc<Link>,
    remotes: Arc<Vec<Remote>>,
    remote: usize,
    /// Name under which acknowledgements are sent.
    down: String,
    size: [u32; 2],
    /// Properties of the view's maps, if they are sent.
    maps: Option<ViewMaps>,
    arrived: Sender<Arrived>,
}

impl Decoder {
    fn run(&self, waiting: &Receiver<Waiting>) {
        while let Ok(it) = waiting.recv() {
            let ack = Signal::Ack {
                origin: it.head.origin,
                view: it.head.view,
                content: it.head.content,
                sequence: it.head.sequence,
            };
            let arrived = self.decode(it);
            // The packet is acknowledged only now, so that the other host does not send faster than this host decodes.
            self.link.send(&self.down, ack.to_bytes().to_vec(), true);
            if let Some(arrived) = arrived
                && self.arrived.send(arrived).is_err()
            {
                return;
            }
        }
    }

    fn decode(&self, it: Waiting) -> Option<Arrived> {
        let remote = &self.remotes[self.remote];
        let mut checked = None;
        let body = match it.head.content {
            Content::Frame if it.head.status == Status::OK => {
                let pixels = jpeg::decode(&it.body, self.size);
                if pixels.is_none() {
                    remote.malformed(&"the JPEG is damaged, or has the wrong size");
                }
                pixels?
            }
            Content::Frame => Vec::new(),
            Content::Sightings => {
                let Some((poses, maps)) = maps::split(&it.body) else {
                    remote.malformed(&"the poses are truncated");
                    return None;
                };
                let maps = self.check(maps);
                checked = maps.inspect_err(|error| remote.malformed(error)).ok()?;
                self.message(Kind::Sightings, poses)?
            }
            Content::ViewQuality => self.message(Kind::ViewQuality, it.body)?,
        };
        Some(Arrived {
            head: it.head,
            body,
            maps: checked,
            came_at: it.came_at,
            decoded_at: now_nanos(),
            n_bytes: it.n_bytes,
        })
    }

    /// Checks a message and returns it as in a recording.
    fn message(&self, kind: Kind, bytes: Vec<u8>) -> Option<Vec<u8>> {
        let parsed = Message::parse(kind, &bytes).map(|_| ());
        let parsed = parsed.inspect_err(|error| self.remotes[self.remote].malformed(error));
        parsed.ok().map(|()| bytes)
    }

    /// Reads the maps after poses; `None` if there are no maps.
    fn check(&self, bytes: &[u8]) -> Result<Option<maps::Checked>, String> {
        match &self.maps {
            _ if bytes.is_empty() => Ok(None),
            Some(maps) => maps.unpack(bytes).map(Some).map_err(|error| error.to_string()),
            None => Err(format!(
                "the poses are followed by {} bytes, but this deployment sends no maps",
                bytes.len()
            )),
        }
    }
}

/// Returns the kind of message in a recording; `None` for frames.
pub(super) fn kind_of(content: Content) -> Option<Kind> {
    match content {
        Content::Frame => None,
        Content::Sightings => Some(Kind::Sightings),
        Content::ViewQuality => Some(Kind::ViewQuality),
    }
}

/// Receives answers to requests for the time, and requests from hosts that start.
fn hear_signals(
    link: &Arc<Link>,
    topics: &Topics,
    remotes: &Arc<Vec<Remote>>,
    origin: u64,
) -> Result<(), Failure> {
    let (remotes, own, back) = (Arc::clone(remotes), topics.clone(), Arc::downgrade(link));
    let heard = link.subscribe(&topics.up("*"), move |key, bytes| {
        let heard_at = now_nanos();
        let name = host_of(key);
        let Some(remote) = remotes.iter().find(|remote| remote.name == name) else {
            return;
        };
        match Signal::parse(bytes) {
            Ok(Signal::Ping { asked_at, .. }) => {
                let pong = Signal::Pong {
                    origin,
                    asked_at,
                    received_at: heard_at,
                    answered_at: now_nanos(),
                };
                if let Some(link) = back.upgrade() {
                    link.send(&own.down(name), pong.to_bytes().to_vec(), true);
                }
            }
            Ok(Signal::Pong {
                origin: of,
                asked_at,
                received_at,
                answered_at,
            }) => {
                // Only answers of the accepted bridge are used, because answers of earlier bridges may refer to another clock.
                if remote.state().welcomed == Some(of) {
                    remote.exchanged(Exchange {
                        asked_at,
                        received_at,
                        answered_at,
                        heard_at,
                    });
                }
            }
            Ok(Signal::Ack { .. }) => {}
            Err(error) => remote.malformed(&error),
        }
    });
    heard.or_fail(ExitKind::Run)
}

/// Accepts hosts into the run, or refuses them.
fn hear_hellos(
    link: &Arc<Link>,
    topics: &Topics,
    remotes: &Arc<Vec<Remote>>,
    (fingerprint, welcome): (&Fingerprint, Welcome),
) -> Result<(), Failure> {
    let (remotes, own, back) = (Arc::clone(remotes), topics.clone(), Arc::downgrade(link));
    let fingerprint = fingerprint.clone();
    let heard = link.subscribe(&topics.hello("*"), move |key, bytes| {
        let Ok(hello) = Hello::parse(bytes) else {
            tracing::debug!(key, "the introduction of a host cannot be read");
            return;
        };
        let name = host_of(key);
        let remote = remotes.iter().find(|remote| remote.name == name && remote.name == hello.host);
        let answer = hello.answer(remote.is_some(), &fingerprint, welcome);
        match (remote, &answer) {
            (Some(remote), Answer::Welcome(_)) => remote.welcomed(hello.origin, now_nanos()),
            (Some(remote), Answer::Refused(why)) => remote.refused(why),
            (None, _) => tracing::warn!(
                name,
                "a host is not accepted, because it is not in the deployment"
            ),
        }
        if let Some(link) = back.upgrade() {
            link.send(&own.answer(name), answer.to_bytes(), true);
        }
    });
    heard.or_fail(ExitKind::Run)
}
