//! Records of the MCAP format, version 0 (mcap.dev/spec): opcodes and fields.

use std::collections::BTreeMap;

/// The magic bytes at the start and the end of a file.
pub(crate) const MAGIC: &[u8; 8] = b"\x89MCAP0\r\n";

/// Opcodes of records.
pub(crate) mod op {
    pub(crate) const HEADER: u8 = 0x01;
    pub(crate) const FOOTER: u8 = 0x02;
    pub(crate) const SCHEMA: u8 = 0x03;
    pub(crate) const CHANNEL: u8 = 0x04;
    pub(crate) const MESSAGE: u8 = 0x05;
    pub(crate) const CHUNK: u8 = 0x06;
    pub(crate) const MESSAGE_INDEX: u8 = 0x07;
    pub(crate) const CHUNK_INDEX: u8 = 0x08;
    pub(crate) const ATTACHMENT: u8 = 0x09;
    pub(crate) const STATISTICS: u8 = 0x0b;
    pub(crate) const METADATA: u8 = 0x0c;
    pub(crate) const METADATA_INDEX: u8 = 0x0d;
    pub(crate) const DATA_END: u8 = 0x0f;
    /// A private record of this program; others skip it.
    pub(crate) const CHECKS: u8 = 0x80;
}

/// Bytes of the head of a record: opcode and length.
pub(crate) const RECORD_HEAD_BYTES: u64 = 1 + 8;
/// Bytes of the head of a message.
pub(crate) const MESSAGE_HEAD_BYTES: u64 = 2 + 4 + 8 + 8;
/// Bytes of the head of an uncompressed chunk.
pub(crate) const CHUNK_HEAD_BYTES: u64 = 8 + 8 + 8 + 4 + 4 + 8;
/// Longest record that is not a message or a chunk, bytes.
pub(crate) const MAX_RECORD_BYTES: u64 = 16 << 20;

/// The fields of a record, one after the other.
#[derive(Debug, Default)]
pub(crate) struct Body(Vec<u8>);

impl Body {
    /// Fields that were put together elsewhere.
    pub(crate) fn of(fields: Vec<u8>) -> Self {
        Self(fields)
    }

    pub(crate) fn fields(&self) -> &[u8] {
        &self.0
    }

    pub(crate) fn u16(mut self, it: u16) -> Self {
        self.0.extend_from_slice(&it.to_le_bytes());
        self
    }

    pub(crate) fn u32(mut self, it: u32) -> Self {
        self.0.extend_from_slice(&it.to_le_bytes());
        self
    }

    pub(crate) fn u64(mut self, it: u64) -> Self {
        self.0.extend_from_slice(&it.to_le_bytes());
        self
    }

    /// With its length before it, 32 bits.
    pub(crate) fn bytes(mut self, it: &[u8]) -> Self {
        self = self.u32(it.len() as u32);
        self.0.extend_from_slice(it);
        self
    }

    pub(crate) fn map(self, it: &BTreeMap<String, String>) -> Self {
        let entries = it.iter();
        let inner = entries.fold(Self::default(), |body, (key, value)| {
            body.bytes(key.as_bytes()).bytes(value.as_bytes())
        });
        self.bytes(&inner.0)
    }

    /// Numbers by the numbers of channels.
    pub(crate) fn by_channel(self, entries: impl Iterator<Item = (u16, u64)>) -> Self {
        let inner = entries.fold(Self::default(), |body, (key, value)| {
            body.u16(key).u64(value)
        });
        self.bytes(&inner.0)
    }

    /// Appends the record to `out`.
    pub(crate) fn finish(self, op: u8, out: &mut Vec<u8>) {
        out.push(op);
        out.extend_from_slice(&(self.0.len() as u64).to_le_bytes());
        out.extend_from_slice(&self.0);
    }
}

/// The remaining fields of a record; reading returns none if they are too short.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Fields<'a>(pub &'a [u8]);

impl<'a> Fields<'a> {
    pub(crate) fn take(&mut self, n: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(n)?;
        self.0 = rest;
        Some(taken)
    }

    pub(crate) fn u16(&mut self) -> Option<u16> {
        Some(u16::from_le_bytes(self.take(2)?.try_into().ok()?))
    }

    pub(crate) fn u32(&mut self) -> Option<u32> {
        Some(u32::from_le_bytes(self.take(4)?.try_into().ok()?))
    }

    pub(crate) fn u64(&mut self) -> Option<u64> {
        Some(u64::from_le_bytes(self.take(8)?.try_into().ok()?))
    }

    pub(crate) fn text(&mut self) -> Option<String> {
        let n = self.u32()?;
        let bytes = self.take(n as usize)?;
        String::from_utf8(bytes.to_vec()).ok()
    }

    pub(crate) fn map(&mut self) -> Option<BTreeMap<String, String>> {
        let n = self.u32()?;
        let mut inner = Self(self.take(n as usize)?);
        let mut map = BTreeMap::new();
        while !inner.0.is_empty() {
            map.insert(inner.text()?, inner.text()?);
        }
        Some(map)
    }
}

/// Name and entries of metadata; none if the fields are invalid.
pub(crate) fn metadata(body: &[u8]) -> Option<(String, BTreeMap<String, String>)> {
    let mut fields = Fields(body);
    Some((fields.text()?, fields.map()?))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn fields_survive_a_round_trip(
            number: u16,
            text: String,
            map in prop::collection::btree_map(any::<String>(), any::<String>(), 0..4),
            cut in 0_usize..4,
        ) {
            let mut record = Vec::new();
            let body = Body::default().u16(number).bytes(text.as_bytes()).map(&map);
            body.finish(op::METADATA, &mut record);
            let (head, body) = record.split_at(RECORD_HEAD_BYTES as usize);
            prop_assert_eq!(head[0], op::METADATA);
            prop_assert_eq!(&head[1..], &(body.len() as u64).to_le_bytes());
            let mut fields = Fields(body);
            prop_assert_eq!(fields.u16(), Some(number));
            prop_assert_eq!(fields.text(), Some(text));
            prop_assert_eq!(fields.map(), Some(map));
            prop_assert!(fields.0.is_empty());
            let mut short = Fields(&body[..body.len().saturating_sub(cut + 1)]);
            let all = (short.u16(), short.text(), short.map());
            prop_assert!(all.2.is_none());
        }

        #[test]
        fn any_bytes_are_read_or_refused(bytes: Vec<u8>) {
            let mut fields = Fields(&bytes);
            let _map = fields.map();
            let _text = fields.text();
        }
    }
}
