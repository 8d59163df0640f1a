//! Short messages between two hosts: times, and acknowledgements.

use formats::checksum::fnv1a;

use crate::hosts::VERSION;
use crate::hosts::packet::Content;

const MAGIC: [u8; 4] = *b"PXHS";
const BYTES: usize = 56;

/// A short message between two bridges. All times are by the clock of the host that wrote the message, in nanoseconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Signal {
    /// Asks for the time of the other host.
    Ping {
        /// Start time of the bridge that sent the question.
        origin: u64,
        /// Time at which the question was sent.
        asked_at: u64,
    },
    /// Answers a [`Self::Ping`].
    Pong {
        /// Start time of the bridge that sent the answer.
        origin: u64,
        /// Time at which the question was sent, copied from the question.
        asked_at: u64,
        /// Time at which the question arrived.
        received_at: u64,
        /// Time at which the answer was sent.
        answered_at: u64,
    },
    /// Acknowledges a packet.
    Ack {
        /// Start time of the bridge that sent the packet.
        origin: u64,
        /// View of the packet.
        view: u32,
        /// Content of the packet.
        content: Content,
        /// Sequence of the packet.
        sequence: u64,
    },
}

/// Error for bytes that are not a signal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the message of {len} bytes is not a signal of version {VERSION}")]
pub struct SignalError {
    /// Number of bytes.
    pub len: usize,
}

impl Signal {
    /// Returns the signal as bytes.
    pub fn to_bytes(self) -> [u8; BYTES] {
        let (code, extra, numbers) = match self {
            Self::Ping { origin, asked_at } => (1_u8, 0, [origin, asked_at, 0, 0]),
            Self::Pong {
                origin,
                asked_at,
                received_at,
                answered_at,
            } => (2, 0, [origin, asked_at, received_at, answered_at]),
            Self::Ack {
                origin,
                view,
                content,
                sequence,
            } => (3, content as u8, [origin, u64::from(view), sequence, 0]),
        };
        let mut bytes = [0; BYTES];
        bytes[..4].copy_from_slice(&MAGIC);
        bytes[4..6].copy_from_slice(&VERSION.to_le_bytes());
        bytes[6] = code;
        bytes[7] = extra;
        for (nth, number) in numbers.into_iter().enumerate() {
            bytes[8 + 8 * nth..16 + 8 * nth].copy_from_slice(&number.to_le_bytes());
        }
        let hash = fnv1a(&bytes[..BYTES - 8]);
        bytes[BYTES - 8..].copy_from_slice(&hash.to_le_bytes());
        bytes
    }

    /// Parses a signal.
    ///
    /// # Errors
    ///
    /// Fails with [`SignalError`] if the bytes are not a signal.
    pub fn parse(bytes: &[u8]) -> Result<Self, SignalError> {
        let error = SignalError { len: bytes.len() };
        let whole: &[u8; BYTES] = bytes.try_into().map_err(|_odd| error)?;
        let number = |at: usize| {
            let mut eight = [0; 8];
            eight.copy_from_slice(&whole[at..at + 8]);
            u64::from_le_bytes(eight)
        };
        let is_sound = whole[..4] == MAGIC
            && whole[4..6] == VERSION.to_le_bytes()
            && number(BYTES - 8) == fnv1a(&whole[..BYTES - 8]);
        if !is_sound {
            return Err(error);
        }
        let [origin, second, third, fourth] = [8, 16, 24, 32].map(number);
        let signal = match whole[6] {
            1 => Self::Ping {
                origin,
                asked_at: second,
            },
            2 => Self::Pong {
                origin,
                asked_at: second,
                received_at: third,
                answered_at: fourth,
            },
            3 => Self::Ack {
                origin,
                view: u32::try_from(second).map_err(|_large| error)?,
                content: match whole[7] {
                    0 => Content::Frame,
                    1 => Content::Sightings,
                    2 => Content::ViewQuality,
                    _ => return Err(error),
                },
                sequence: third,
            },
            _ => return Err(error),
        };
        // Unused bytes must be zero.
        (signal.to_bytes() == *whole).then_some(signal).ok_or(error)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all() -> [Signal; 3] {
        [
            Signal::Ping {
                origin: 3,
                asked_at: 7,
            },
            Signal::Pong {
                origin: 4,
                asked_at: 7,
                received_at: 8,
                answered_at: 9,
            },
            Signal::Ack {
                origin: 4,
                view: 2,
                content: Content::Sightings,
                sequence: 11,
            },
        ]
    }

    #[test]
    fn signals_survive_a_round_trip_and_every_changed_byte_is_detected() {
        for it in all() {
            let bytes = it.to_bytes();
            assert_eq!(Signal::parse(&bytes), Ok(it));
            for at in 0..bytes.len() {
                let mut changed = bytes;
                changed[at] ^= 1;
                assert!(Signal::parse(&changed).is_err(), "{it:?} {at}");
                Signal::parse(&bytes[..at]).unwrap_err();
            }
        }
    }
}
