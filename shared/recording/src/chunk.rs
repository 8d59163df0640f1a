//! The head of an uncompressed chunk, and the heads of its messages.

use crate::Entry;
use crate::message::PREAMBLE;

/// Size of the head of a record, in bytes: opcode and length.
pub(crate) const RECORD_HEAD_BYTES: u64 = 1 + 8;
/// Number of bytes before the records of a chunk: the head of the record, times, length, checksum, compression, length.
pub(crate) const HEAD_BYTES: usize = 1 + 8 + 8 + 8 + 8 + 4 + 4 + 8;
/// Maximum size of a chunk that is read, in bytes.
const MOST_BYTES: u64 = 1 << 30;
/// Number of bytes of a message before its data.
pub(crate) const MESSAGE_HEAD_BYTES: u64 = 2 + 4 + 8 + 8;

/// Size and checksum of the records of a chunk.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Chunk {
    /// Size of the chunk's records, in bytes.
    pub(crate) n_bytes: u64,
    /// Checksum of the records.
    pub(crate) checksum: u32,
}

impl Chunk {
    /// Reads the head of a chunk. Returns `None` if it is not the head of an uncompressed chunk, or if its lengths contradict each other.
    pub(crate) fn read(head: &[u8; HEAD_BYTES]) -> Option<Self> {
        let number = |at: usize| -> Option<u64> {
            Some(u64::from_le_bytes(*head.get(at..)?.first_chunk()?))
        };
        let short = |at: usize| -> Option<u32> {
            Some(u32::from_le_bytes(*head.get(at..)?.first_chunk()?))
        };
        let n_bytes = number(41)?;
        let rest = HEAD_BYTES as u64 - RECORD_HEAD_BYTES;
        let agrees = head[0] == mcap::records::op::CHUNK
            && number(25)? == n_bytes
            && Some(number(1)?) == n_bytes.checked_add(rest)
            && short(37)? == 0
            && n_bytes <= MOST_BYTES;
        agrees.then_some(Self {
            n_bytes,
            checksum: short(33)?,
        })
    }
}

/// The head of a message: its channel, and its number among the messages of its topic.
pub(crate) struct MessageHead {
    pub(crate) channel: u16,
    pub(crate) nth: u64,
    /// Entry of the message, without its position.
    pub(crate) entry: Entry,
}

impl MessageHead {
    pub(crate) fn read(head: &[u8; MESSAGE_HEAD_BYTES as usize]) -> Self {
        let [c0, c1, n0, n1, n2, n3, times @ ..] = head;
        let (times, _) = times.as_chunks::<8>();
        let time = |nth: usize| times.get(nth).map_or(0, |bytes| u64::from_le_bytes(*bytes));
        Self {
            channel: u16::from_le_bytes([*c0, *c1]),
            nth: u32::from_le_bytes([*n0, *n1, *n2, *n3]).into(),
            entry: Entry {
                log_time: time(0),
                publish_time: time(1),
                ..Entry::default()
            },
        }
    }
}

/// Number of bytes from the beginning of a message to the end of its frame number. They are the preamble of CDR, the session and the frame.
pub(crate) const FRAME_END: usize = PREAMBLE.len() + 8 + 8;
