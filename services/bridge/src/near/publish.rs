//! Writes messages from other hosts into the shared memory of this host.

use crate::hosts::{Content, Estimate, Head};
use deployment::hosts::Carry;
use failure::{ExitKind, Failure, OrFail as _, now_nanos};
use messages::{EvidenceHeader, FrameHeader, Stamp, Status, Timing, topic};
use recording::{Envelope, Kind, Message};
use runtime::{Patience, Service, SlicePublisher};
use stage::any::Sender;

use super::listen::{Arrived, kind_of};
use crate::job::Job;
use crate::maps::{Checked, ViewMaps};

/// The topics of a view.
pub(super) struct Publisher {
    view: usize,
    port: Port,
}

enum Port {
    Frame(Box<SlicePublisher<u8, FrameHeader>>),
    Pose {
        pose: Box<Sender>,
        quality: Option<Box<Sender>>,
        evidence: Option<Box<SlicePublisher<f32, EvidenceHeader>>>,
    },
}

fn send_maps(
    port: &SlicePublisher<f32, EvidenceHeader>,
    maps: &Checked,
    (stamp, timing): (Stamp, Timing),
) -> Result<(), Failure> {
    let mut loan = port.loan(maps.n_values())?;
    let header = maps.fill(loan.payload_mut());
    *loan.header_mut() = EvidenceHeader {
        stamp,
        timing,
        ..header
    };
    loan.send()?;
    Ok(())
}

/// The times of a message by this host's clock, in nanoseconds. No time is in the future, whatever the error of the other clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Times {
    captured_at: u64,
    received_at: u64,
    sent_at: u64,
    /// Time from the nominal time of the frame until the picture was taken.
    skew: i64,
}

impl Times {
    /// Converts the times of a message.
    ///
    /// * `instant`: frame time that the sending host assigned, converted to this host's clock.
    /// * `due`: nominal time of the frame on this host.
    pub(super) fn of(head: &Head, clock: &Estimate, instant: u64, due: u64) -> Self {
        let now = now_nanos();
        let ours = |nanos: u64| clock.ours(nanos).min(now);
        Self {
            captured_at: ours(head.captured_at_nanos),
            received_at: ours(head.received_at_nanos),
            sent_at: ours(head.sent_at_nanos),
            skew: head
                .skew_nanos
                .saturating_add(instant.cast_signed().wrapping_sub(due.cast_signed())),
        }
    }
}

impl Publisher {
    pub(super) fn open(service: &Service, job: &Job, view: usize) -> Result<Self, Failure> {
        let bus = service.bus();
        let port = match job.carry {
            Carry::Frames => Port::Frame(Box::new(bus.slice_publisher(&topic::frame(view))?)),
            Carry::Poses => {
                let quality = || Sender::open(bus, Kind::ViewQuality, &topic::view_quality(view));
                let evidence = |_: &ViewMaps| bus.slice_publisher(&topic::evidence(view));
                Port::Pose {
                    evidence: job.maps.get(view).map(evidence).transpose()?.map(Box::new),
                    pose: Box::new(Sender::open(bus, Kind::Sightings, &topic::sightings(view))?),
                    quality: job.has_quality.then(quality).transpose()?.map(Box::new),
                }
            }
        };
        Ok(Self { view, port })
    }

    /// Waits for the receivers of the view.
    pub(super) fn wait_for_receivers(&self, expected: usize, patience: Patience) {
        let n = match &self.port {
            Port::Frame(port) => port.wait_for_subscribers(expected, patience),
            Port::Pose { pose, .. } => pose.wait_for_subscribers(expected, patience),
        };
        if n < expected {
            tracing::warn!(
                view = self.view,
                n,
                expected,
                "starting before all receivers are connected"
            );
        }
    }

    pub(super) fn n_connected(&self) -> usize {
        match &self.port {
            Port::Frame(port) => port.n_connected(),
            Port::Pose { pose, .. } => pose.n_connected(),
        }
    }

    fn stamp(&self, service: &Service, frame: u64, captured_at_nanos: u64) -> Stamp {
        Stamp {
            session: service.session(),
            frame,
            captured_at_nanos,
            view: self.view as u32,
            epoch: service.epoch(),
        }
    }

    /// Publishes a message for a frame.
    pub(super) fn send(
        &self,
        service: &Service,
        frame: u64,
        arrived: &Arrived,
        times: &Times,
    ) -> Result<(), Failure> {
        let status = arrived.head.status;
        let stamp = self.stamp(service, frame, times.captured_at);
        let timing = Timing {
            received_at_nanos: times.received_at,
            sent_at_nanos: times.sent_at,
        };
        match &self.port {
            Port::Frame(port) => {
                let pixels = &arrived.body;
                let mut loan = port.loan(pixels.len().max(1))?;
                let room = loan.payload_mut();
                if pixels.is_empty() {
                    room.fill(0);
                } else {
                    room.copy_from_slice(pixels);
                }
                let [width, height] = arrived.head.size;
                *loan.header_mut() = FrameHeader {
                    stamp,
                    timing,
                    width,
                    height,
                    status,
                    n_dropped: arrived.head.n_dropped,
                    skew_nanos: times.skew,
                    ..FrameHeader::default()
                };
                loan.send()?;
            }
            Port::Pose {
                pose,
                quality,
                evidence,
            } => {
                // The evidence is sent first, because a receiver of the candidates may rely on it.
                if let (Some(evidence), Some(maps)) = (evidence, &arrived.maps) {
                    send_maps(evidence, maps, (stamp, timing))?;
                }
                let kind = kind_of(arrived.head.content).unwrap_or(Kind::Sightings);
                let message = Message::parse(kind, &arrived.body).or_fail(ExitKind::Run)?;
                let envelope = Envelope {
                    stamp,
                    timing,
                    status,
                };
                let port = if arrived.head.content == Content::ViewQuality {
                    quality.as_deref()
                } else {
                    Some(&**pose)
                };
                if let Some(port) = port {
                    port.send(&message, &envelope)?;
                }
            }
        }
        Ok(())
    }

    /// Sends the reason why a frame has no message, or the end of the stream.
    pub(super) fn send_nothing(
        &self,
        service: &Service,
        frame: u64,
        status: Status,
    ) -> Result<(), Failure> {
        let now = now_nanos();
        let stamp = self.stamp(service, frame, now);
        let timing = Timing {
            received_at_nanos: now,
            sent_at_nanos: now,
        };
        match &self.port {
            Port::Frame(port) => {
                let mut loan = port.loan(1)?;
                loan.payload_mut().fill(0);
                *loan.header_mut() = FrameHeader {
                    stamp,
                    timing,
                    status,
                    ..FrameHeader::default()
                };
                loan.send()?;
            }
            Port::Pose { pose, quality, .. } => {
                let envelope = Envelope {
                    stamp,
                    timing,
                    status,
                };
                let nothing = |port: &Sender, kind: Kind| {
                    let head = vec![0; kind.head_bytes()];
                    let elements = &[][..];
                    port.send(
                        &Message {
                            head: &head,
                            elements,
                        },
                        &envelope,
                    )
                };
                nothing(pose, Kind::Sightings)?;
                if let Some(port) = quality.as_deref().filter(|_| status == Status::END) {
                    nothing(port, Kind::ViewQuality)?;
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use crate::hosts::{Clock, Exchange};

    use super::*;

    #[test]
    fn received_times_are_converted_to_the_local_clock_and_never_lie_in_the_future() {
        let now = now_nanos();
        let mut clock = Clock::default();
        let ahead = 7_000_000_000_000;
        let exchange = Exchange {
            asked_at: now,
            received_at: now + ahead + 50,
            answered_at: now + ahead + 60,
            heard_at: now + 110,
        };
        clock.add(exchange).unwrap();
        let clock = clock.estimate(now).unwrap();
        let head = Head {
            content: Content::Frame,
            view: 0,
            status: Status::OK,
            origin: 0,
            sequence: 0,
            frame: 0,
            instant_nanos: now + ahead - 500,
            captured_at_nanos: now + ahead - 400,
            received_at_nanos: now + ahead - 300,
            sent_at_nanos: u64::MAX,
            packed_at_nanos: 0,
            skew_nanos: 100,
            n_dropped: 0,
            n_overtaken: 0,
            size: [0; 2],
        };
        let instant = clock.ours(head.instant_nanos);
        let got = Times::of(&head, &clock, instant, instant - 20);
        assert_eq!(got.captured_at, now - 400);
        assert_eq!(got.received_at, now - 300);
        assert!(got.sent_at <= now_nanos());
        assert_eq!(got.skew, 120);
    }
}
