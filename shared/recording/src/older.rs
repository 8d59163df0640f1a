//! Reads a recording of format 1 record by record; only its chunks have checksums.

use std::io::{Read, Seek};

use crate::contents::Contents;
use crate::cursor::{Cursor, Stop};
use crate::mcap::{Fields, MAGIC, MAX_RECORD_BYTES, metadata, op};
use crate::{Checked, Kind, Recording, chunk};

/// Most topics.
const MAX_TOPICS: usize = 1024;

/// Finds every message, up to the first invalid record. The cursor is behind the file's magic.
pub(crate) fn scan<R: Read + Seek>(
    cursor: &mut Cursor<'_, R>,
) -> Result<Recording, std::io::Error> {
    let mut found = Contents::new(cursor.end(), Checked::Chunks);
    match records(cursor, &mut found) {
        Ok(is_complete) => found.extent.is_complete = is_complete,
        Err(Stop::Cut) => {}
        Err(Stop::Damaged(what)) => found.damaged(cursor.at(), what),
        Err(Stop::Io(error)) => return Err(error),
    }
    Ok(found.finish())
}

/// Reads all records; returns whether the file is complete.
fn records<R: Read + Seek>(cursor: &mut Cursor<'_, R>, found: &mut Contents) -> Result<bool, Stop> {
    loop {
        found.extent.whole_bytes = cursor.at();
        let (op, len) = cursor.record_head()?;
        match op {
            op::CHUNK => chunk::take(cursor, found, len, record)?,
            op::MESSAGE => chunk::message(cursor, found, len)?,
            op::DATA_END => {
                cursor.skip(len)?;
                found.extent.whole_bytes = cursor.at();
                let is_complete = cursor.ends_with(MAGIC)?;
                if is_complete {
                    found.extent.whole_bytes = cursor.at();
                }
                return Ok(is_complete);
            }
            _ => record(cursor, found, op, len)?,
        }
    }
}

fn record<R: Read + Seek>(
    cursor: &mut Cursor<'_, R>,
    found: &mut Contents,
    op: u8,
    len: u64,
) -> Result<(), Stop> {
    match op {
        op::CHANNEL | op::METADATA if len <= MAX_RECORD_BYTES => {
            let body = cursor.bytes(len)?;
            let known = if op == op::CHANNEL {
                channel(&mut Fields(&body), found)
            } else {
                metadata(&body).map(|(name, map)| {
                    found.metadata(&name, map);
                    Ok(())
                })
            };
            known.unwrap_or(Err(Stop::Damaged("a record that contradicts itself")))
        }
        op::CHANNEL | op::METADATA => Err(Stop::Damaged("a record beyond all measure")),
        _ => cursor.skip(len),
    }
}

/// None if the fields are not those of a channel.
fn channel(fields: &mut Fields<'_>, found: &mut Contents) -> Option<Result<(), Stop>> {
    let (id, _schema) = (fields.u16()?, fields.u16()?);
    let (topic, encoding) = (fields.text()?, fields.text()?);
    if found.channels.len() >= MAX_TOPICS {
        let what = "more topics than any deployment has";
        return Some(Err(Stop::Damaged(what)));
    }
    let known = Kind::of_topic(&topic).filter(|_| encoding == "cdr");
    let known = known.map(|_| topic);
    if *found.channels.entry(id).or_insert_with(|| known.clone()) != known {
        return Some(Err(Stop::Damaged("two topics with one number")));
    }
    Some(Ok(()))
}
