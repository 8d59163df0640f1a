//! Reading a recording: where every message lies, up to the last whole record.
//!
//! Reads the file from its beginning, record by record, and passes over what messages hold; so it
//! needs no index at the end, and a file that was cut off anywhere is read like any other.

use std::collections::BTreeMap;
use std::io::{self, Read, Seek, SeekFrom};

use crate::cursor::{Cursor, Stop};
use crate::mcap::{CHUNK_HEAD_BYTES, Fields, MAGIC, MESSAGE_HEAD_BYTES, RECORD_HEAD_BYTES, op};
use crate::{About, AboutError, Entry, Extent, Kind, Message, Recording, Track};
use crate::{about, count, message};

/// Longest record that is not a message or a chunk, bytes.
const MAX_RECORD_BYTES: u64 = 16 << 20;
/// Most topics.
const MAX_TOPICS: usize = 1024;
/// A recording cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// It is something else.
    #[error("this is not an MCAP file")]
    NotMcap,
    /// The file cannot be read.
    #[error("cannot read the recording")]
    Read(#[from] io::Error),
    /// A message is no longer what it was when the file was scanned.
    #[error("the message at byte {offset} cannot be read")]
    Message {
        /// Where it begins.
        offset: u64,
        /// Why.
        #[source]
        source: message::Malformed,
    },
}

/// Finds every message of a file. Whatever the file holds, it takes memory only for messages that
/// are there, 32 bytes each.
///
/// # Errors
///
/// [`ReadError::NotMcap`], [`ReadError::Read`]. A file that is cut off or damaged is no error: see
/// [`Extent`].
pub fn scan<R: Read + Seek>(input: &mut R) -> Result<Recording, ReadError> {
    let mut scan = Scan {
        cursor: Cursor::new(input)?,
        recording: Recording {
            about: Err(AboutError::Missing("settings")),
            tracks: BTreeMap::new(),
            counts: BTreeMap::new(),
            extent: Extent {
                file_bytes: 0,
                whole_bytes: 0,
                is_complete: false,
                damage: None,
                n_malformed: 0,
            },
        },
        channels: BTreeMap::new(),
    };
    scan.recording.extent.file_bytes = scan.cursor.end();
    match scan.cursor.array::<{ MAGIC.len() }>() {
        Ok(magic) if magic == *MAGIC => {}
        Err(Stop::Io(error)) => return Err(error.into()),
        _ => return Err(ReadError::NotMcap),
    }
    match scan.records() {
        Ok(is_complete) => scan.recording.extent.is_complete = is_complete,
        Err(Stop::Cut) => {}
        Err(Stop::Damaged(what)) => scan.recording.extent.damage = Some(what),
        Err(Stop::Io(error)) => return Err(error.into()),
    }
    Ok(scan.recording)
}

/// Reads a message into `buffer` and takes it apart.
///
/// # Errors
///
/// [`ReadError::Read`], [`ReadError::Message`].
pub fn read<'a, R: Read + Seek>(
    input: &mut R,
    kind: Kind,
    entry: &Entry,
    buffer: &'a mut Vec<u8>,
) -> Result<Message<'a>, ReadError> {
    input.seek(SeekFrom::Start(entry.offset))?;
    buffer.resize(entry.len as usize, 0);
    input.read_exact(buffer)?;
    Message::parse(kind, buffer).map_err(|source| ReadError::Message {
        offset: entry.offset,
        source,
    })
}

struct Scan<'a, R: Read + Seek> {
    cursor: Cursor<'a, R>,
    recording: Recording,
    /// Names of the topics that are known.
    channels: BTreeMap<u16, Option<String>>,
}

impl<R: Read + Seek> Scan<'_, R> {
    /// Reads all records; whether the file ends as it should.
    fn records(&mut self) -> Result<bool, Stop> {
        loop {
            self.note_place();
            let (op, len) = self.record_head()?;
            match op {
                op::CHUNK => self.chunk(len)?,
                op::DATA_END => {
                    self.cursor.skip(len)?;
                    self.note_place();
                    let is_complete = self.cursor.ends_with(MAGIC)?;
                    if is_complete {
                        self.note_place();
                    }
                    return Ok(is_complete);
                }
                _ => self.record(op, len)?,
            }
        }
    }

    /// Everything before here is whole.
    fn note_place(&mut self) {
        self.recording.extent.whole_bytes = self.cursor.at();
    }

    fn record_head(&mut self) -> Result<(u8, u64), Stop> {
        let [op] = self.cursor.array()?;
        Ok((op, u64::from_le_bytes(self.cursor.array()?)))
    }

    /// The records of a chunk, as far as it is there.
    fn chunk(&mut self, len: u64) -> Result<(), Stop> {
        self.cursor.skip(8 + 8 + 8 + 4)?;
        let n_name = u64::from(u32::from_le_bytes(self.cursor.array()?));
        if n_name > 0 {
            return Err(Stop::Damaged("a compressed chunk, which is not supported"));
        }
        let records = u64::from_le_bytes(self.cursor.array()?);
        if len.checked_sub(CHUNK_HEAD_BYTES) != Some(records) {
            return Err(Stop::Damaged("a chunk whose lengths contradict each other"));
        }
        let end = self.cursor.at().checked_add(records).ok_or(Stop::Cut)?;
        while self.cursor.at() < end {
            self.note_place();
            let room = end - self.cursor.at();
            let (op, len) = self.record_head()?;
            if room < RECORD_HEAD_BYTES || room - RECORD_HEAD_BYTES < len {
                return Err(Stop::Damaged("a record that is longer than its chunk"));
            }
            if op == op::CHUNK {
                return Err(Stop::Damaged("a chunk within a chunk"));
            }
            self.record(op, len)?;
        }
        Ok(())
    }

    fn record(&mut self, op: u8, len: u64) -> Result<(), Stop> {
        match op {
            op::MESSAGE => self.message(len),
            op::CHANNEL | op::METADATA if len <= MAX_RECORD_BYTES => {
                let body = self.cursor.bytes(len)?;
                let mut fields = Fields(&body);
                let known = if op == op::CHANNEL {
                    self.channel(&mut fields)
                } else {
                    self.metadata(&mut fields)
                };
                known.unwrap_or(Err(Stop::Damaged("a record that contradicts itself")))
            }
            op::CHANNEL | op::METADATA => Err(Stop::Damaged("a record beyond all measure")),
            _ => self.cursor.skip(len),
        }
    }

    /// None if the fields are not those of a channel.
    fn channel(&mut self, fields: &mut Fields<'_>) -> Option<Result<(), Stop>> {
        let (id, _schema) = (fields.u16()?, fields.u16()?);
        let (topic, encoding) = (fields.text()?, fields.text()?);
        Some(self.add(id, topic, &encoding))
    }

    fn add(&mut self, id: u16, topic: String, encoding: &str) -> Result<(), Stop> {
        if self.channels.len() >= MAX_TOPICS {
            return Err(Stop::Damaged("more topics than any deployment has"));
        }
        let kind = Kind::of_topic(&topic).filter(|_| encoding == "cdr");
        let known = kind.map(|_| topic.clone());
        if *self.channels.entry(id).or_insert_with(|| known.clone()) != known {
            return Err(Stop::Damaged("two topics with one number"));
        }
        if let Some(kind) = kind {
            let empty = || Track {
                kind,
                entries: Vec::new(),
            };
            self.recording.tracks.entry(topic).or_insert_with(empty);
        }
        Ok(())
    }

    /// None if the fields are not those of metadata.
    fn metadata(&mut self, fields: &mut Fields<'_>) -> Option<Result<(), Stop>> {
        let (name, map) = (fields.text()?, fields.map()?);
        match name.as_str() {
            about::NAME if self.recording.about.is_err() => {
                self.recording.about = About::from_map(&map);
            }
            count::NAME => {
                let counts = map.into_iter();
                let counts = counts.filter_map(|(topic, it)| Some((topic, it.parse().ok()?)));
                self.recording.counts = counts.collect();
            }
            _ => {}
        }
        Some(Ok(()))
    }

    fn message(&mut self, len: u64) -> Result<(), Stop> {
        let Some(n_data) = len.checked_sub(MESSAGE_HEAD_BYTES) else {
            return Err(Stop::Damaged("a message shorter than its head"));
        };
        let channel = u16::from_le_bytes(self.cursor.array()?);
        self.cursor.skip(4)?;
        let log_time = u64::from_le_bytes(self.cursor.array()?);
        let publish_time = u64::from_le_bytes(self.cursor.array()?);
        let entry = Entry {
            log_time,
            publish_time,
            offset: self.cursor.at(),
            len: n_data,
        };
        self.cursor.skip(n_data)?;
        let Some(topic) = self.channels.get(&channel) else {
            return Err(Stop::Damaged(
                "a message of a topic that was not introduced",
            ));
        };
        let track = topic
            .as_ref()
            .and_then(|it| self.recording.tracks.get_mut(it));
        match track {
            None => {}
            Some(track) if message::check_length(track.kind, n_data).is_ok() => {
                track.entries.push(entry);
            }
            Some(_) => self.recording.extent.n_malformed += 1,
        }
        Ok(())
    }
}
