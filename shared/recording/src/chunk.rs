//! Reads a chunk as in standard MCAP: its checksum, and its records.

use std::io::{Read, Seek};

use crate::Entry;
use crate::contents::Contents;
use crate::cursor::{Cursor, Stop};
use crate::mcap::{CHUNK_HEAD_BYTES, MESSAGE_HEAD_BYTES, RECORD_HEAD_BYTES, op};

/// Reads the messages of a chunk; a damaged one is skipped. A truncated chunk cannot be checked: its complete
/// records are read.
///
/// * `record`: called for its records that are not messages.
pub(crate) fn take<R: Read + Seek>(
    cursor: &mut Cursor<'_, R>,
    found: &mut Contents,
    len: u64,
    mut record: impl FnMut(&mut Cursor<'_, R>, &mut Contents, u8, u64) -> Result<(), Stop>,
) -> Result<(), Stop> {
    let begin = cursor.at();
    cursor.skip(8 + 8 + 8)?;
    let checksum = u32::from_le_bytes(cursor.array()?);
    let n_name = u64::from(u32::from_le_bytes(cursor.array()?));
    if n_name > 0 {
        return Err(Stop::Damaged("a compressed chunk, which is not supported"));
    }
    let records = u64::from_le_bytes(cursor.array()?);
    if len.checked_sub(CHUNK_HEAD_BYTES) != Some(records) {
        return Err(Stop::Damaged("a chunk whose lengths contradict each other"));
    }
    let end = cursor.at().checked_add(records).ok_or(Stop::Cut)?;
    if checksum != 0 && end <= cursor.end() && cursor.checksum(records)? != checksum {
        found.damaged(begin, "a chunk that is not what its checksum says");
        return cursor.skip(records);
    }
    while cursor.at() < end {
        found.extent.whole_bytes = cursor.at();
        let room = end - cursor.at();
        let (op, len) = cursor.record_head()?;
        if room < RECORD_HEAD_BYTES || room - RECORD_HEAD_BYTES < len {
            return Err(Stop::Damaged("a record that is longer than its chunk"));
        }
        match op {
            op::CHUNK => return Err(Stop::Damaged("a chunk within a chunk")),
            op::MESSAGE => message(cursor, found, len)?,
            _ => record(cursor, found, op, len)?,
        }
    }
    Ok(())
}

/// Reads a message.
pub(crate) fn message<R: Read + Seek>(
    cursor: &mut Cursor<'_, R>,
    found: &mut Contents,
    len: u64,
) -> Result<(), Stop> {
    let Some(n_data) = len.checked_sub(MESSAGE_HEAD_BYTES) else {
        return Err(Stop::Damaged("a message shorter than its head"));
    };
    let channel = u16::from_le_bytes(cursor.array()?);
    let nth = u32::from_le_bytes(cursor.array()?);
    let entry = Entry {
        log_time: u64::from_le_bytes(cursor.array()?),
        publish_time: u64::from_le_bytes(cursor.array()?),
        offset: cursor.at(),
        len: n_data,
        ..Entry::default()
    };
    cursor.skip(n_data)?;
    found.message(channel, nth.into(), entry);
    Ok(())
}
