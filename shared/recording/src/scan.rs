//! Scans a recording for the positions of all messages, up to the last complete chunk.
//!
//! The scan reads the file from its start, and skips the contents of messages. It needs no index at the end of the file, so the file of a
//! killed run is read like a complete file. After a damaged position, it searches for the next chunk. By contrast, the reader of the crate
//! `mcap` reads every byte, and stops at the first wrong byte.

use std::io::{self, Read, Seek};

use mcap::MAGIC;
use mcap::records::{Record, op};

use crate::chunk::{
    Chunk, FRAME_END, HEAD_BYTES, MESSAGE_HEAD_BYTES, MessageHead, RECORD_HEAD_BYTES,
};
use crate::contents::Contents;
use crate::cursor::{Cursor, Stop};
use crate::seal::unseal;
use crate::{ReadError, Recording, about};

/// Block size of the search, in bytes.
const WINDOW_BYTES: u64 = 1 << 16;
/// Maximum length of a record that is not a message or a chunk, in bytes.
const MAX_RECORD_BYTES: u64 = 16 << 20;
/// Maximum number of positions in a search that look like the start of a record but are not.
const MOST_FALSE_STARTS: u32 = 10_000;
/// Number of bytes of a metadata record before the text of its name.
const NAME_AT: usize = RECORD_HEAD_BYTES as usize + 4;
/// Maximum number of topics.
const MOST_TOPICS: usize = 1024;

/// Finds every message of a file.
///
/// Regardless of the file's content, it needs memory only for messages that exist, 56 bytes each. Contents of messages are not read: see
/// [`read`](crate::read()) and [`check`](crate::check).
///
/// # Errors
///
/// Returns [`ReadError::NotMcap`] or [`ReadError::Read`]. A truncated or damaged file is not an error: see
/// [`Extent`](crate::Extent).
pub fn scan<R: Read + Seek>(input: &mut R) -> Result<Recording, ReadError> {
    let mut cursor = Cursor::new(input)?;
    match cursor.array::<{ MAGIC.len() }>() {
        Ok(magic) if magic == MAGIC => {}
        Err(Stop::Io(error)) => return Err(error.into()),
        _ => return Err(ReadError::NotMcap),
    }
    let mut scan = Scan {
        found: Contents::new(cursor.end()),
        cursor,
        n_false_starts: 0,
    };
    scan.records()?;
    Ok(scan.found.finish())
}

struct Scan<'a, R: Read + Seek> {
    cursor: Cursor<'a, R>,
    found: Contents,
    n_false_starts: u32,
}

impl<R: Read + Seek> Scan<'_, R> {
    /// Reads all valid records.
    fn records(&mut self) -> io::Result<()> {
        loop {
            let begin = self.cursor.at();
            self.found.extent.whole_bytes = begin;
            let what = match self.record() {
                Ok(false) => continue,
                Ok(true) => return Ok(()),
                Err(Stop::Io(error)) => return Err(error),
                Err(Stop::Damaged(what)) => Some(what),
                Err(Stop::Cut) => None,
            };
            // A damaged length can make a record seem to extend beyond the end of the file.
            let whole = self.found.extent.whole_bytes;
            let is_found = self.go_to_next(begin + 1)?;
            if let Some(what) =
                what.or_else(|| is_found.then_some("a record with an impossible length"))
            {
                self.found.damaged(begin, what);
            }
            if !is_found {
                self.found.extent.whole_bytes = whole;
                return Ok(());
            }
        }
    }

    /// Reads a record. Returns true if it was the last one.
    fn record(&mut self) -> Result<bool, Stop> {
        let begin = self.cursor.at();
        let (op, len) = self.cursor.record_head()?;
        match op {
            op::CHUNK => self.chunk(begin)?,
            op::METADATA if len <= MAX_RECORD_BYTES => {
                let body = self.cursor.bytes(len)?;
                self.metadata(&body).ok_or(Stop::Damaged("the description of the run"))?;
            }
            op::HEADER | op::SCHEMA | op::CHANNEL | op::MESSAGE_INDEX | op::ATTACHMENT => {
                self.cursor.skip(len)?;
            }
            op::DATA_END if len == 4 => {
                self.cursor.skip(len)?;
                self.end()?;
                return Ok(true);
            }
            _ => return Err(Stop::Damaged("a record of an unknown type")),
        }
        Ok(false)
    }

    /// Reads the metadata of the run. Returns `None` if it is damaged.
    fn metadata(&mut self, body: &[u8]) -> Option<()> {
        let Ok(Record::Metadata(said)) = mcap::parse_record(op::METADATA, body) else {
            return None;
        };
        let map = unseal(&said.name, said.metadata)?;
        self.found.metadata(&said.name, map);
        Some(())
    }

    /// Finds the messages of a chunk. A chunk whose content contradicts itself is left out as a whole.
    fn chunk(&mut self, begin: u64) -> Result<(), Stop> {
        self.cursor.go(begin).map_err(Stop::Io)?;
        let head = self.cursor.array::<HEAD_BYTES>()?;
        let chunk = Chunk::read(&head);
        let chunk = chunk.ok_or(Stop::Damaged(
            "a chunk that is compressed or has contradictory lengths",
        ))?;
        let end = self.cursor.at().checked_add(chunk.n_bytes);
        let end = end.filter(|end| *end <= self.cursor.end());
        let end = end.ok_or(Stop::Cut)?;
        let mut messages = Vec::new();
        match self.messages(begin, end, &mut messages) {
            Ok(()) => {
                for message in messages {
                    self.found.message(&message);
                }
            }
            Err(Stop::Damaged(what)) => self.found.damaged(begin, what),
            Err(stop) => return Err(stop),
        }
        self.cursor.go(end).map_err(Stop::Io)?;
        self.found.extent.whole_bytes = end;
        Ok(())
    }

    fn messages(
        &mut self,
        begin: u64,
        end: u64,
        messages: &mut Vec<MessageHead>,
    ) -> Result<(), Stop> {
        let damaged = Stop::Damaged("a chunk with a length different from that of its records");
        while self.cursor.at() < end {
            let room = end - self.cursor.at();
            if room < RECORD_HEAD_BYTES {
                return Err(damaged);
            }
            let (op, len) = self.cursor.record_head()?;
            if room - RECORD_HEAD_BYTES < len {
                return Err(damaged);
            }
            let next = self.cursor.at() + len;
            match op {
                op::MESSAGE if len >= MESSAGE_HEAD_BYTES => {
                    let mut message = MessageHead::read(&self.cursor.array()?);
                    message.entry.chunk = begin;
                    message.entry.offset = self.cursor.at();
                    message.entry.len = len - MESSAGE_HEAD_BYTES;
                    // The names of the topics may appear only at the end of the file; only then is it known which messages have a frame.
                    if message.entry.len >= FRAME_END as u64 {
                        let head = self.cursor.array::<FRAME_END>()?;
                        let frame = head.last_chunk().copied();
                        message.entry.frame = frame.map(u64::from_le_bytes);
                    }
                    messages.push(message);
                }
                op::CHANNEL if len <= MAX_RECORD_BYTES => {
                    let body = self.cursor.bytes(len)?;
                    if let Ok(Record::Channel(channel)) = mcap::parse_record(op, &body)
                        && self.found.channels.len() < MOST_TOPICS
                    {
                        let name = Some(channel.topic);
                        self.found.channels.entry(channel.id).or_insert(name);
                    }
                }
                op::SCHEMA => {}
                _ => return Err(Stop::Damaged("a chunk with a record of an unknown type")),
            }
            self.cursor.skip(next - self.cursor.at())?;
        }
        Ok(())
    }

    /// Reads the end of the file: an index for other programs, and its checksum.
    fn end(&mut self) -> Result<(), Stop> {
        let begin = self.cursor.at();
        let extent = &mut self.found.extent;
        extent.whole_bytes = begin;
        if !self.cursor.ends_with(MAGIC)? {
            return Ok(());
        }
        extent.whole_bytes = self.cursor.at();
        extent.is_complete = true;
        let n = self.cursor.at() - begin;
        let Some(n) = n.checked_sub((MAGIC.len() + size_of::<u32>()) as u64) else {
            return Err(Stop::Damaged("an end without an index"));
        };
        self.cursor.go(begin).map_err(Stop::Io)?;
        let got = self.cursor.checksum(n)?;
        self.cursor.skip(n)?;
        let expected = u32::from_le_bytes(self.cursor.array()?);
        if got != expected {
            let what = "the index for other programs, which is not needed here";
            self.found.damaged(begin, what);
        }
        Ok(())
    }

    /// Moves to the next chunk or metadata record. Returns false if there are no more.
    fn go_to_next(&mut self, mut from: u64) -> io::Result<bool> {
        let overlap = HEAD_BYTES as u64 - 1;
        while from < self.cursor.end() {
            self.cursor.go(from)?;
            let n = (WINDOW_BYTES + overlap).min(self.cursor.end() - from);
            let Some(window) = or_io(self.cursor.bytes(n))? else {
                return Ok(false);
            };
            for at in 0..window.len().min(WINDOW_BYTES as usize) {
                let begin = from + at as u64;
                let is_sound = match window[at] {
                    op::CHUNK => self.is_chunk(&window[at..], begin),
                    op::METADATA if is_ours(&window[at..]) => {
                        self.n_false_starts += 1;
                        self.is_metadata(begin)?
                    }
                    _ => false,
                };
                if is_sound {
                    self.cursor.go(begin)?;
                    return Ok(true);
                }
                if self.n_false_starts > MOST_FALSE_STARTS {
                    return Ok(false);
                }
            }
            from += WINDOW_BYTES;
        }
        Ok(false)
    }

    /// Returns true if the head of a complete chunk begins here. To be accepted, three of its lengths must agree.
    fn is_chunk(&self, bytes: &[u8], begin: u64) -> bool {
        let chunk = bytes.first_chunk().and_then(Chunk::read);
        let head = begin + HEAD_BYTES as u64;
        chunk.is_some_and(|chunk| head + chunk.n_bytes <= self.cursor.end())
    }

    /// Returns true if an undamaged metadata record begins here.
    fn is_metadata(&mut self, begin: u64) -> io::Result<bool> {
        self.cursor.go(begin)?;
        let Some((_, len)) = or_io(self.cursor.record_head())? else {
            return Ok(false);
        };
        if len > MAX_RECORD_BYTES {
            return Ok(false);
        }
        let Some(body) = or_io(self.cursor.bytes(len))? else {
            return Ok(false);
        };
        let read = mcap::parse_record(op::METADATA, &body);
        Ok(match read {
            Ok(Record::Metadata(said)) => unseal(&said.name, said.metadata).is_some(),
            _ => false,
        })
    }
}

/// Returns true if a metadata record as written by this program may begin here.
fn is_ours(bytes: &[u8]) -> bool {
    let name = bytes.get(NAME_AT..);
    name.is_some_and(|name| name.starts_with(about::NAME.as_bytes()))
}

/// Returns `None` if the file is truncated or its content is invalid.
fn or_io<T>(it: Result<T, Stop>) -> io::Result<Option<T>> {
    match it {
        Ok(it) => Ok(Some(it)),
        Err(Stop::Io(error)) => Err(error),
        Err(_) => Ok(None),
    }
}
