//! The main loop: reads moments of a deployment and sends datagrams.

use core::net::{Ipv4Addr, Ipv6Addr, SocketAddr};
use core::time::Duration;
use std::io;
use std::net::UdpSocket;
use std::time::Instant;

use crate::{Client, State, Wish};
use failure::{ExitKind, Failure, OrFail as _, Stop};

use crate::publish::frame::Frame;
use crate::publish::json::{json_datagram, json_names};
use crate::publish::osc::osc_datagrams;
use crate::publish::target::{Form, Target};

/// Maximum number of moments that may wait to be sent.
const MOST_WAITING: usize = 64;
/// Longest wait for a moment, so that a stop request is noticed.
const PATIENCE: Duration = Duration::from_millis(100);
/// Interval between messages with the names that the lines omit.
const NAMES: Duration = Duration::from_secs(1);

/// Counts of frames and datagrams that were sent, and of those that were not.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    /// Frames that were published.
    pub frames: u64,
    /// Datagrams that the system accepted.
    pub sent: u64,
    /// Datagrams that the system did not accept: there was no receiver, or no room.
    pub unsent: u64,
    /// Frames that do not fit into a datagram.
    pub too_large: u64,
    /// Frames that are missing between the published ones.
    pub missed: u64,
}

/// Sends the skeletons of a deployment until a stop is requested.
///
/// * `until_end`: true to end when the deployment has ended, instead of waiting for its next run.
///
/// # Errors
///
/// Fails if no socket can be opened, or if the deployment runs but cannot be read.
pub fn run(
    deployment: &str,
    targets: &[Target],
    until_end: bool,
    stop: &Stop,
) -> Result<Counts, Failure> {
    let mut outlets = Vec::new();
    for target in targets {
        outlets.push(Outlet::open(*target).or_fail(ExitKind::Run)?);
    }
    let wish = Wish::skeletons().every_frame(MOST_WAITING);
    let failed = |error: crate::ClientError| {
        let hint = error.hint();
        let failure = Failure::new(ExitKind::Run, error.to_string());
        match hint {
            Some(hint) => failure.with_hint(hint),
            None => failure,
        }
    };
    let mut client = Client::wait_for(deployment, &wish).map_err(failed)?;
    let mut counts = Counts::default();
    let mut was_there = false;
    while !stop.is_requested() {
        let moment = client.next(PATIENCE).map_err(failed)?;
        if let Some(moment) = &moment {
            counts.frames += 1;
            counts.missed += moment.n_missed;
            for person in Frame::people(moment) {
                for outlet in &mut outlets {
                    outlet.send(&person, &mut counts);
                }
            }
        } else {
            let is_there = client.state() == State::Connected;
            if until_end && was_there && !is_there {
                break;
            }
            was_there |= is_there;
        }
    }
    Ok(counts)
}

/// A socket, and the content that is sent through it.
#[derive(Debug)]
struct Outlet {
    socket: UdpSocket,
    form: Form,
    named: Option<Instant>,
    has_warned: bool,
}

impl Outlet {
    fn open(target: Target) -> io::Result<Self> {
        let any: SocketAddr = match target.address {
            SocketAddr::V4(_) => (Ipv4Addr::UNSPECIFIED, 0).into(),
            SocketAddr::V6(_) => (Ipv6Addr::UNSPECIFIED, 0).into(),
        };
        let socket = UdpSocket::bind(any)?;
        socket.connect(target.address)?;
        // The datagram is lost if the queue is full.
        socket.set_nonblocking(true)?;
        Ok(Self {
            socket,
            form: target.form,
            named: None,
            has_warned: false,
        })
    }

    fn send(&mut self, frame: &Frame<'_>, counts: &mut Counts) {
        match self.form {
            Form::Json => self.send_json(frame, counts),
            Form::Osc => {
                for datagram in osc_datagrams(frame) {
                    self.give(&datagram, counts);
                }
            }
        }
    }

    fn send_json(&mut self, frame: &Frame<'_>, counts: &mut Counts) {
        let Some(line) = json_datagram(frame) else {
            counts.too_large += 1;
            if !self.has_warned {
                self.has_warned = true;
                let n_joints = frame.joints.len();
                tracing::warn!(
                    n_joints,
                    "a skeleton was not sent because it does not fit into a datagram"
                );
            }
            return;
        };
        let has_names = line.contains("\"joints\":{");
        let is_due = self.named.is_none_or(|named| named.elapsed() >= NAMES);
        if !has_names
            && is_due
            && let Some(names) = json_names(frame)
        {
            self.named = Some(Instant::now());
            self.give(names.as_bytes(), counts);
        }
        self.give(line.as_bytes(), counts);
    }

    fn give(&self, datagram: &[u8], counts: &mut Counts) {
        match self.socket.send(datagram) {
            Ok(_) => counts.sent += 1,
            Err(error) => {
                counts.unsent += 1;
                tracing::debug!(%error, "a datagram was not sent");
            }
        }
    }
}
