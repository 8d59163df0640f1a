//! The receiving process of the transport benchmark: receives messages, and measures their latency.

use std::ffi::OsString;
use std::process::ExitCode;
use std::time::Duration;

use failure::{Failure, now_nanos};
use messages::{FrameHeader, Status, topic};
use runtime::{Launch, Mapped, Sample, Service, Woken, mapped_at, run_service};
use serde::{Deserialize, Serialize};
use terminal::output;

use crate::spread::Spread;

/// Number of messages that are sent before the measured messages.
pub(super) const WARM_UP: u64 = 64;
/// Number of messages, from the first, whose locations are recorded.
pub(super) const N_PLACED: u64 = 32;

/// Location of a message: file and offset. If the location is the same in two processes, both access the same bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Spot {
    /// The number of the message.
    pub message: u64,
    /// The inode of the file.
    pub inode: u64,
    /// The offset in the file, in bytes.
    pub offset: u64,
}

impl Spot {
    /// Returns the location of a message; `None` if it is not in shared memory.
    pub(super) fn of(message: u64, payload: &[u8]) -> Option<Self> {
        let Mapped { inode, offset, .. } = mapped_at(payload).ok()??;
        Some(Self {
            message,
            inode,
            offset,
        })
    }
}

/// Report of the receiver at the end of a series.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct ReceiverReport {
    /// Number of measured messages that were received.
    pub received: u64,
    /// Number of messages with wrong content.
    pub broken: u64,
    /// Time from just before sending to just after receiving, in microseconds.
    pub hop_us: Option<Spread>,
    /// Locations of the first messages.
    pub spots: Vec<Spot>,
    /// Bytes copied by the receiver's ports.
    pub copied_bytes: u64,
}

/// Runs the receiving process of [`transport()`](super::transport()).
///
/// * `arguments`: the launch arguments from the sending process.
///
/// # Errors
///
/// Fails if the arguments are invalid.
pub fn receive(arguments: &[OsString]) -> Result<ExitCode, Failure> {
    let (launch, _) = Launch::from_args(arguments.iter().cloned())?;
    Ok(run_service(launch, receive_all))
}

fn receive_all(service: &Service) -> Result<(), Failure> {
    let bus = service.bus();
    let mut waiter = bus.waiter();
    let port = bus.slice_subscriber::<u8, FrameHeader>(&topic::frame(0), &mut waiter)?;
    let mut report = ReceiverReport::default();
    let mut hops = Vec::new();
    while waiter.wait(Duration::from_millis(100))? != Woken::Stop {
        while let Some(sample) = port.receive()? {
            let received_at = now_nanos();
            let header = sample.header();
            if header.status == Status::END {
                report.hop_us = Spread::of(hops);
                report.copied_bytes = bus.copies().bytes();
                return output::json(&report);
            }
            report.inspect(&sample);
            if header.stamp.frame >= WARM_UP {
                report.received += 1;
                let nanos = received_at.saturating_sub(header.timing.sent_at_nanos);
                hops.push(nanos as f64 / 1e3);
            }
        }
    }
    Ok(())
}

impl ReceiverReport {
    fn inspect(&mut self, sample: &Sample<u8, FrameHeader>) {
        let (message, payload) = (sample.header().stamp.frame, sample.payload());
        if message < N_PLACED {
            self.spots.extend(Spot::of(message, payload));
        }
        self.broken += u64::from(!is_of(message, payload));
    }
}

/// Writes the content of a message: its number at both ends, and the low byte of the number in between.
pub(super) fn write(message: u64, payload: &mut [u8]) {
    payload.fill(message as u8);
    let number = message.to_le_bytes();
    if let Some(begin) = payload.first_chunk_mut() {
        *begin = number;
    }
    if let Some(end) = payload.last_chunk_mut() {
        *end = number;
    }
}

/// Returns true if a payload is the content of a message. Checks both ends and one byte in the middle.
fn is_of(message: u64, payload: &[u8]) -> bool {
    let number = message.to_le_bytes();
    let is_whole = payload.len() < 24 || payload[payload.len() / 2] == message as u8;
    payload.first_chunk() == Some(&number) && payload.last_chunk() == Some(&number) && is_whole
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wrong_or_torn_message_is_detected() {
        for len in [16, 24, 64, 1000] {
            let mut payload = vec![0; len];
            write(0x0102_0304, &mut payload);
            assert!(is_of(0x0102_0304, &payload), "{len}");
            assert!(!is_of(0x0102_0305, &payload), "{len}");
            for at in [0, len - 1] {
                let mut torn = payload.clone();
                torn[at] ^= 1;
                assert!(!is_of(0x0102_0304, &torn), "{len} {at}");
            }
        }
        assert!(!is_of(0, &[]));
    }

    #[test]
    fn memory_that_is_not_shared_has_no_shared_memory_location() {
        assert_eq!(Spot::of(3, &[0; 5000]), None);
    }
}
