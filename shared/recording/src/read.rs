//! Reads single messages, each from a chunk that matches its checksum.

use std::io::{self, Read, Seek, SeekFrom};

use crate::chunk::{Chunk, HEAD_BYTES};
use crate::message::PREAMBLE;
use crate::{Entry, Kind, Message, Recording, message};

/// Maximum number of bytes that are reserved in advance for a length that a file states.
const MOST_RESERVED: u64 = 64 << 20;

/// Reason why a recording cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The file is not an MCAP file.
    #[error("this is not an MCAP file")]
    NotMcap,
    /// The file cannot be read.
    #[error("cannot read the recording")]
    Read(#[from] io::Error),
    /// A chunk does not match its checksum, so none of its messages is reliable.
    #[error("the chunk at byte {offset} does not match its checksum")]
    Checksum {
        /// Offset of the chunk in the file, in bytes.
        offset: u64,
    },
    /// A message has changed since the file was scanned.
    #[error("the message at byte {offset} cannot be read")]
    Message {
        /// Offset of the message in the file, in bytes.
        offset: u64,
        /// Cause of the error.
        #[source]
        source: message::Malformed,
    },
}

/// The most recently read chunks of a file. Messages of the same chunk are read and checked together.
#[derive(Debug, Default)]
pub struct Buffer {
    /// Chunks in order of use, the last used one first.
    chunks: [Loaded; 2],
}

#[derive(Debug, Default)]
struct Loaded {
    /// Offset of the chunk, in bytes from the start of the file.
    at: Option<u64>,
    records: Vec<u8>,
    is_sound: bool,
}

impl Buffer {
    /// Returns the chunk at an offset. Reads it from the file if it is not in the buffer.
    fn chunk<R: Read + Seek>(&mut self, input: &mut R, at: u64) -> io::Result<&Loaded> {
        let [first, second] = &self.chunks;
        if first.at != Some(at) {
            let is_here = second.at == Some(at);
            self.chunks.swap(0, 1);
            if !is_here {
                self.chunks[0].load(input, at)?;
            }
        }
        Ok(&self.chunks[0])
    }
}

impl Loaded {
    fn load<R: Read + Seek>(&mut self, input: &mut R, at: u64) -> io::Result<()> {
        (self.at, self.is_sound) = (None, false);
        self.records.clear();
        input.seek(SeekFrom::Start(at))?;
        let mut head = [0; HEAD_BYTES];
        match input.read_exact(&mut head) {
            Err(error) if error.kind() != io::ErrorKind::UnexpectedEof => return Err(error),
            _ => {}
        }
        if let Some(chunk) = Chunk::read(&head) {
            self.records.reserve(chunk.n_bytes.min(MOST_RESERVED) as usize);
            let mut part = input.take(chunk.n_bytes);
            let n = part.read_to_end(&mut self.records)? as u64;
            self.is_sound = n == chunk.n_bytes && crc32fast::hash(&self.records) == chunk.checksum;
        }
        self.at = Some(at);
        Ok(())
    }
}

/// Reads a message, checks the checksum of its chunk, and parses it.
///
/// * `buffer`: keeps the chunk for the next message.
///
/// # Errors
///
/// Returns [`ReadError::Read`], [`ReadError::Checksum`] or [`ReadError::Message`].
pub fn read<'a, R: Read + Seek>(
    input: &mut R,
    kind: Kind,
    entry: &Entry,
    buffer: &'a mut Buffer,
) -> Result<Message<'a>, ReadError> {
    let chunk = buffer.chunk(input, entry.chunk)?;
    let begin = entry.chunk.saturating_add(HEAD_BYTES as u64);
    let begin = entry.offset.checked_sub(begin);
    let data = begin.filter(|_| chunk.is_sound).and_then(|begin| {
        let rest = chunk.records.get(usize::try_from(begin).ok()?..)?;
        rest.get(..usize::try_from(entry.len).ok()?)
    });
    let data = data.ok_or(ReadError::Checksum {
        offset: entry.chunk,
    })?;
    let offset = entry.offset;
    Message::parse(kind, data).map_err(|source| ReadError::Message { offset, source })
}

/// Reads the struct of a message into `buffer`, without its array, and therefore without checking a checksum.
///
/// # Errors
///
/// Returns [`ReadError::Read`] on failure.
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

/// A message that cannot be read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Damaged {
    /// Topic of the message.
    pub topic: String,
    /// Frame of the message.
    pub frame: Option<u64>,
    /// Offset of the message, in bytes from the start of the file.
    pub offset: u64,
    /// Offset of the message's chunk, in bytes from the start of the file. One changed byte in a chunk damages all its messages.
    pub chunk: u64,
}

/// Reads all messages of some topics, and returns those for which [`read`] would fail.
///
/// * `wanted`: function that returns true if a topic has to be checked.
///
/// # Errors
///
/// Fails if the file cannot be read.
pub fn check<R: Read + Seek>(
    input: &mut R,
    recording: &Recording,
    wanted: impl Fn(&str) -> bool,
) -> Result<Vec<Damaged>, ReadError> {
    let tracks = recording.tracks.iter().filter(|track| wanted(track.0));
    let mut all: Vec<_> = tracks
        .flat_map(|(topic, track)| {
            track.entries.iter().map(move |entry| (topic, track.kind, entry))
        })
        .collect();
    all.sort_by_key(|(_, _, entry)| entry.offset);
    let (mut damaged, mut buffer) = (Vec::new(), Buffer::default());
    for (topic, kind, entry) in all {
        match read(input, kind, entry, &mut buffer) {
            Ok(_) => {}
            Err(error @ ReadError::Read(_)) => return Err(error),
            Err(_) => damaged.push(Damaged {
                topic: topic.clone(),
                frame: entry.frame,
                offset: entry.offset,
                chunk: entry.chunk,
            }),
        }
    }
    Ok(damaged)
}
