//! The record before every chunk: position and checksum of each of its messages.
//!
//! MCAP has one checksum per chunk, so that one changed byte would lose all its messages. This private record
//! has a checksum for every message and one for itself. So a reader gets the messages of a chunk, and the
//! position of the next record, from checked bytes only.

use crate::Entry;
use crate::mcap::{Body, Fields, op};

/// Its first bytes, by which it is found after damage.
pub(crate) const TAG: &[u8; 8] = b"pxchecks";

/// The messages of the chunk that follows.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Checks {
    /// Bytes from its own end to where the chunk's records begin, to their end, and to the next record that is
    /// neither the chunk nor one of its indexes.
    pub(crate) ends: [u64; 3],
    /// Channel, index among the messages of its topic, and entry; its offset counts from the start of the
    /// chunk's records.
    pub(crate) messages: Vec<(u16, u64, Entry)>,
}

impl Checks {
    /// Appends the record to `out`.
    pub(crate) fn finish(&self, out: &mut Vec<u8>) {
        let mut inner = TAG.to_vec();
        for it in self.ends.iter().chain([&(self.messages.len() as u64)]) {
            inner.extend_from_slice(&it.to_le_bytes());
        }
        for (channel, nth, it) in &self.messages {
            inner.extend_from_slice(&channel.to_le_bytes());
            let frame = it.frame.unwrap_or(u64::MAX);
            for number in [*nth, frame, it.log_time, it.publish_time, it.offset, it.len] {
                inner.extend_from_slice(&number.to_le_bytes());
            }
            inner.extend_from_slice(&it.checksum.unwrap_or_default().to_le_bytes());
        }
        let checksum = crc32fast::hash(&inner);
        Body::of(inner).u32(checksum).finish(op::CHECKS, out);
    }

    /// Reads the fields of a record; none if they are damaged.
    pub(crate) fn read(body: &[u8]) -> Option<Self> {
        let (inner, checksum) = body.split_last_chunk::<4>()?;
        let mut fields = Fields(inner);
        if fields.take(TAG.len())? != TAG || crc32fast::hash(inner) != u32::from_le_bytes(*checksum)
        {
            return None;
        }
        let ends = [fields.u64()?, fields.u64()?, fields.u64()?];
        let n = fields.u64()?;
        let mut messages = Vec::new();
        for _ in 0..n {
            let (channel, nth) = (fields.u16()?, fields.u64()?);
            let entry = Entry {
                frame: Some(fields.u64()?).filter(|it| *it != u64::MAX),
                log_time: fields.u64()?,
                publish_time: fields.u64()?,
                offset: fields.u64()?,
                len: fields.u64()?,
                checksum: Some(fields.u32()?),
            };
            messages.push((channel, nth, entry));
        }
        let is_in_order = ends[0] <= ends[1] && ends[1] <= ends[2];
        (fields.0.is_empty() && is_in_order).then_some(Self { ends, messages })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::mcap::RECORD_HEAD_BYTES;

    proptest! {
        #[test]
        fn a_record_survives_a_round_trip_and_a_changed_one_is_refused(
            messages in prop::collection::vec(any::<(u16, u64, Option<u32>, [u64; 4], u32)>(), 0..5),
            at in any::<prop::sample::Index>(), change in 1_u8..,
        ) {
            let messages = messages.into_iter().map(|(channel, nth, frame, it, checksum)| {
                let [log_time, publish_time, offset, len] = it;
                let (frame, checksum) = (frame.map(u64::from), Some(checksum));
                (channel, nth, Entry { log_time, publish_time, offset, len, frame, checksum })
            });
            let checks = Checks { ends: [1, 5, 7], messages: messages.collect() };
            let mut record = Vec::new();
            checks.finish(&mut record);
            let mut body = record.split_off(RECORD_HEAD_BYTES as usize);
            prop_assert_eq!(Checks::read(&body), Some(checks));
            let at = at.index(body.len());
            body[at] ^= change;
            prop_assert_eq!(Checks::read(&body), None);
        }
    }
}
