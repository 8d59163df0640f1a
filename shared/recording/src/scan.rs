//! Scans a recording for the positions of all messages, up to the last complete record.
//!
//! Reads the file from its start, using the record before each chunk that lists its messages, and skips the
//! contents of messages. So it needs no index at the end, and truncated files are read like complete ones.
//! After damage it searches for the next valid record.

use std::io::{self, Read, Seek, SeekFrom};

use crate::checks::{Checks, TAG};
use crate::contents::Contents;
use crate::cursor::{Cursor, Stop};
use crate::mcap::{MAGIC, MAX_RECORD_BYTES, RECORD_HEAD_BYTES, metadata, op};
use crate::message::PREAMBLE;
use crate::seal::unseal;
use crate::{Checked, Entry, Kind, Message, Recording, about, chunk, message, older};

/// Block size of the search, bytes.
const WINDOW_BYTES: u64 = 1 << 16;
/// Most false starts of records in a search.
const MOST_FALSE_STARTS: u32 = 10_000;

/// A recording cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// It is another kind of file.
    #[error("this is not an MCAP file")]
    NotMcap,
    /// The file cannot be read.
    #[error("cannot read the recording")]
    Read(#[from] io::Error),
    /// A message does not match its checksum.
    #[error("the message at byte {offset} is not what its checksum says")]
    Checksum {
        /// Its offset in the file, bytes.
        offset: u64,
    },
    /// A message has changed since the file was scanned.
    #[error("the message at byte {offset} cannot be read")]
    Message {
        /// Its offset in the file, bytes.
        offset: u64,
        /// Why.
        #[source]
        source: message::Malformed,
    },
}

/// Finds every message of a file. For any file content it takes memory only for existing messages, 56 bytes
/// each. Contents of messages are not read: see [`read`] and [`check`].
///
/// # Errors
///
/// [`ReadError::NotMcap`], [`ReadError::Read`]. A truncated or damaged file is not an error: see
/// [`Extent`](crate::Extent).
pub fn scan<R: Read + Seek>(input: &mut R) -> Result<Recording, ReadError> {
    let mut cursor = Cursor::new(input)?;
    match cursor.array::<{ MAGIC.len() }>() {
        Ok(magic) if magic == *MAGIC => {}
        Err(Stop::Io(error)) => return Err(error.into()),
        _ => return Err(ReadError::NotMcap),
    }
    let mut scan = Scan {
        found: Contents::new(cursor.end(), Checked::Messages),
        cursor,
        is_older: false,
        n_false_starts: 0,
    };
    scan.records()?;
    if scan.is_older {
        scan.cursor.go(MAGIC.len() as u64)?;
        return Ok(older::scan(&mut scan.cursor)?);
    }
    Ok(scan.found.finish())
}

/// Reads a message into `buffer`, compares its checksum, and takes it apart.
///
/// # Errors
///
/// [`ReadError::Read`], [`ReadError::Checksum`], [`ReadError::Message`].
pub fn read<'a, R: Read + Seek>(
    input: &mut R,
    kind: Kind,
    entry: &Entry,
    buffer: &'a mut Vec<u8>,
) -> Result<Message<'a>, ReadError> {
    let offset = entry.offset;
    input.seek(SeekFrom::Start(offset))?;
    buffer.resize(entry.len as usize, 0);
    input.read_exact(buffer)?;
    if entry
        .checksum
        .is_some_and(|it| it != crc32fast::hash(buffer))
    {
        return Err(ReadError::Checksum { offset });
    }
    Message::parse(kind, buffer).map_err(|source| ReadError::Message { offset, source })
}

/// Reads the struct of a message into `buffer`, without its array, and so without its checksum.
///
/// # Errors
///
/// [`ReadError::Read`].
pub fn read_head<'a, R: Read + Seek>(
    input: &mut R,
    kind: Kind,
    entry: &Entry,
    buffer: &'a mut Vec<u8>,
) -> Result<&'a [u8], ReadError> {
    input.seek(SeekFrom::Start(entry.offset + PREAMBLE.len() as u64))?;
    buffer.resize(kind.head_bytes(), 0);
    input.read_exact(buffer)?;
    Ok(buffer)
}

/// A damaged message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Damaged {
    /// Its topic.
    pub topic: String,
    /// Its frame.
    pub frame: Option<u64>,
    /// Its offset, bytes from the start of the file.
    pub offset: u64,
}

/// Reads all messages of some topics, and returns those that [`read`] would refuse.
///
/// * `wanted`: whether a topic is checked.
///
/// # Errors
///
/// If the file cannot be read.
pub fn check<R: Read + Seek>(
    input: &mut R,
    recording: &Recording,
    wanted: impl Fn(&str) -> bool,
) -> Result<Vec<Damaged>, ReadError> {
    let tracks = recording.tracks.iter().filter(|it| wanted(it.0));
    let mut all: Vec<_> = tracks
        .flat_map(|(topic, track)| track.entries.iter().map(move |it| (topic, track.kind, it)))
        .collect();
    all.sort_by_key(|it| it.2.offset);
    let (mut damaged, mut buffer) = (Vec::new(), Vec::new());
    for (topic, kind, entry) in all {
        match read(input, kind, entry, &mut buffer) {
            Ok(_) => {}
            Err(error @ ReadError::Read(_)) => return Err(error),
            Err(_) => damaged.push(Damaged {
                topic: topic.clone(),
                frame: entry.frame,
                offset: entry.offset,
            }),
        }
    }
    Ok(damaged)
}

struct Scan<'a, R: Read + Seek> {
    cursor: Cursor<'a, R>,
    found: Contents,
    is_older: bool,
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
            // A damaged length may look like the end of the file.
            let whole = self.found.extent.whole_bytes;
            let is_found = self.go_to_next(begin + 1)?;
            if let Some(what) =
                what.or_else(|| is_found.then_some("a record that cannot be so long"))
            {
                self.found.damaged(begin, what);
            }
            if !is_found {
                self.found.extent.whole_bytes = whole;
                return Ok(());
            }
        }
    }

    /// Reads a record; returns whether it was the last.
    fn record(&mut self) -> Result<bool, Stop> {
        let begin = self.cursor.at();
        let (op, len) = self.cursor.record_head()?;
        match op {
            op::CHECKS if len <= MAX_RECORD_BYTES => {
                let body = self.cursor.bytes(len)?;
                match Checks::read(&body) {
                    Some(checks) => self.take(checks)?,
                    // The chunk has a checksum as well.
                    None => self.found.damaged(begin, "what says where messages lie"),
                }
            }
            op::METADATA if len <= MAX_RECORD_BYTES => {
                let body = self.cursor.bytes(len)?;
                let (name, map) =
                    metadata(&body).ok_or(Stop::Damaged("a record that contradicts itself"))?;
                if name == about::NAME && about::is_older(&map) {
                    self.is_older = true;
                    return Ok(true);
                }
                let map = unseal(&name, map);
                let map = map.ok_or(Stop::Damaged("what is said about the run"))?;
                self.found.metadata(&name, map);
            }
            op::CHUNK => chunk::take(
                &mut self.cursor,
                &mut self.found,
                len,
                |cursor, _, _, len| cursor.skip(len),
            )?,
            op::HEADER | op::SCHEMA | op::CHANNEL | op::MESSAGE_INDEX | op::ATTACHMENT => {
                self.cursor.skip(len)?;
            }
            op::DATA_END if len == 4 => {
                self.cursor.skip(len)?;
                self.end()?;
                return Ok(true);
            }
            _ => return Err(Stop::Damaged("a record that no recording has")),
        }
        Ok(false)
    }

    /// Takes the messages of a chunk from its list, and skips the chunk.
    fn take(&mut self, checks: Checks) -> Result<(), Stop> {
        let base = self.cursor.at();
        let [begin, end, next] = checks.ends;
        for (channel, nth, entry) in checks.messages {
            let last = [begin, entry.offset, entry.len];
            let last = last.iter().try_fold(0_u64, |sum, it| sum.checked_add(*it));
            let last = last.filter(|it| *it <= end);
            let last = last.ok_or(Stop::Damaged("a message beyond its chunk"))?;
            let last = base.checked_add(last).ok_or(Stop::Cut)?;
            if last > self.cursor.end() {
                return Err(Stop::Cut);
            }
            self.found.extent.whole_bytes = last;
            let offset = base + begin + entry.offset;
            self.found.message(channel, nth, Entry { offset, ..entry });
        }
        self.cursor.skip(next)
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

    /// Moves to the next valid record; `false` if there is none.
    fn go_to_next(&mut self, mut from: u64) -> io::Result<bool> {
        let (least, overlap) = (from, TAG.len() as u64 - 1);
        while from + overlap < self.cursor.end() {
            self.cursor.go(from)?;
            let n = WINDOW_BYTES.min(self.cursor.end() - from);
            let Some(window) = or_io(self.cursor.bytes(n))? else {
                return Ok(false);
            };
            for (nth, it) in (from..).zip(window.windows(TAG.len())) {
                let before = match it {
                    it if it == TAG => RECORD_HEAD_BYTES,
                    it if it == about::NAME.as_bytes() => RECORD_HEAD_BYTES + 4,
                    _ => continue,
                };
                let Some(begin) = nth.checked_sub(before) else {
                    continue;
                };
                if begin < least {
                    continue;
                }
                if self.is_sound(begin)? {
                    self.cursor.go(begin)?;
                    return Ok(true);
                }
                self.n_false_starts += 1;
                if self.n_false_starts > MOST_FALSE_STARTS {
                    return Ok(false);
                }
            }
            from += n - overlap.min(n - 1);
        }
        Ok(false)
    }

    /// Whether a valid record starts here.
    fn is_sound(&mut self, begin: u64) -> io::Result<bool> {
        self.cursor.go(begin)?;
        let Some((op, len)) = or_io(self.cursor.record_head())? else {
            return Ok(false);
        };
        if len > MAX_RECORD_BYTES {
            return Ok(false);
        }
        let Some(body) = or_io(self.cursor.bytes(len))? else {
            return Ok(false);
        };
        Ok(match op {
            op::CHECKS => Checks::read(&body).is_some(),
            op::METADATA => metadata(&body).is_some_and(|(name, map)| unseal(&name, map).is_some()),
            _ => false,
        })
    }
}

/// None if the file is truncated or the content invalid.
fn or_io<T>(it: Result<T, Stop>) -> io::Result<Option<T>> {
    match it {
        Ok(it) => Ok(Some(it)),
        Err(Stop::Io(error)) => Err(error),
        Err(_) => Ok(None),
    }
}
