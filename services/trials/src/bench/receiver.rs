//! The receiving process of a series of messages: takes in what is sent, and says how long it was on its way.

use std::ffi::OsString;
use std::process::ExitCode;
use std::time::Duration;

use launch::output;
use messages::{FrameHeader, Status, topic};
use runtime::{Failure, Launch, Mapped, Sample, Service, Woken, mapped_at, now_nanos, run_service};
use serde::{Deserialize, Serialize};

use crate::spread::Spread;

/// Messages before those that are measured: the first few of them are looked at closely.
pub(super) const WARM_UP: u64 = 64;
/// Of these, how many are asked where they lie.
pub(super) const N_PLACED: u64 = 32;

/// Where the bytes of a message lie: file and place in it. The same numbers in two processes are the same bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Spot {
    /// Which message.
    pub message: u64,
    /// Number of the file.
    pub inode: u64,
    /// Bytes from its begin.
    pub offset: u64,
}

impl Spot {
    /// Of a message, if it lies in shared memory.
    pub(super) fn of(message: u64, payload: &[u8]) -> Option<Self> {
        let Mapped { inode, offset, .. } = mapped_at(payload).ok()??;
        Some(Self {
            message,
            inode,
            offset,
        })
    }
}

/// What a receiver has to say in the end.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct Heard {
    /// Messages that were received of those that are measured.
    pub received: u64,
    /// Of these, with another content than was sent.
    pub broken: u64,
    /// From just before sending to just after receiving, microseconds.
    pub hop_us: Option<Spread>,
    /// Where the first messages lay.
    pub spots: Vec<Spot>,
    /// Bytes that the receiver's ports copied.
    pub copied_bytes: u64,
}

/// Becomes the receiving process of [`transport()`](super::transport()).
///
/// * `arguments`: what that process says about the deployment.
///
/// # Errors
///
/// The arguments are not those of a process.
pub fn receive(arguments: &[OsString]) -> Result<ExitCode, Failure> {
    let (launch, _) = Launch::from_args(arguments.iter().cloned())?;
    Ok(run_service(launch, hear))
}

fn hear(service: &Service) -> Result<(), Failure> {
    let bus = service.bus();
    let mut waiter = bus.waiter();
    let port = bus.slice_subscriber::<u8, FrameHeader>(&topic::frame(0), &mut waiter)?;
    let mut heard = Heard::default();
    let mut hops = Vec::new();
    while waiter.wait(Duration::from_millis(100))? != Woken::Stop {
        while let Some(sample) = port.receive()? {
            let received_at = now_nanos();
            let header = sample.header();
            if header.status == Status::END {
                heard.hop_us = Spread::of(hops);
                heard.copied_bytes = bus.copies().bytes();
                return output::json(&heard);
            }
            heard.look_closely(&sample);
            if header.stamp.frame >= WARM_UP {
                heard.received += 1;
                let nanos = received_at.saturating_sub(header.timing.sent_at_nanos);
                hops.push(nanos as f64 / 1e3);
            }
        }
    }
    Ok(())
}

impl Heard {
    fn look_closely(&mut self, sample: &Sample<u8, FrameHeader>) {
        let (message, payload) = (sample.header().stamp.frame, sample.payload());
        if message < N_PLACED {
            self.spots.extend(Spot::of(message, payload));
        }
        self.broken += u64::from(!is_of(message, payload));
    }
}

/// Writes a message where it will be read: its number at both ends, and a byte of it between.
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

/// Whether a payload is what was written of a message, as far as a look at its ends and its middle tells.
fn is_of(message: u64, payload: &[u8]) -> bool {
    let number = message.to_le_bytes();
    let is_whole = payload.len() < 24 || payload[payload.len() / 2] == message as u8;
    payload.first_chunk() == Some(&number) && payload.last_chunk() == Some(&number) && is_whole
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_is_known_by_its_content() {
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
    fn what_lies_in_no_shared_memory_has_no_spot() {
        assert_eq!(Spot::of(3, &[0; 5000]), None);
    }
}
