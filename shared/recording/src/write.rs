//! Writing a recording: append only, so that what has been written stays whatever comes after.
//!
//! Not by the crate `mcap` (0.26), which the tests read our files with: in front of every chunk stands our own record with
//! the places and checksums of its messages, and with the lengths of the chunk and of its indexes. Its writer takes such a
//! record, but lays out the chunk and the indexes itself and later, so that both would have to be laid out here as well
//! to know those lengths.

use core::fmt;
use core::mem::take;
use std::collections::{BTreeMap, BTreeSet};
use std::io::{self, Write};

use crate::checks::Checks;
use crate::mcap::{Body, CHUNK_HEAD_BYTES, MAGIC, MESSAGE_HEAD_BYTES, RECORD_HEAD_BYTES, op};
use crate::seal::seal;
use crate::{About, Count, Entry, Envelope, Kind, about, count, message};

/// Messages are gathered to so many bytes before they are written.
const CHUNK_BYTES: usize = 1 << 20;

/// A recording cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The file cannot be written to. What it holds already stays readable.
    #[error("cannot write the recording beyond {n_bytes} bytes")]
    Write {
        /// Bytes that it holds.
        n_bytes: u64,
        /// Why.
        #[source]
        source: io::Error,
    },
    /// The topic is not one of this program's.
    #[error("nothing is known of topic {0:?}")]
    Topic(String),
}

/// Writes a recording.
///
/// Between two flushes it holds at most a chunk (1 MiB, or one message if that is larger), and of
/// every chunk its entry in the index, about a hundred bytes and ten for each of its topics.
///
/// Before every chunk stands the checksum of each of its messages. What is said about the run has one, too, and stands
/// in the file twice, at its beginning and at its end.
pub struct Writer<W: Write> {
    out: W,
    n_bytes: u64,
    /// Once the file could not be written, nothing more is: what follows would lie in a wrong place.
    is_broken: bool,
    topics: Vec<Topic>,
    chunk: Chunk,
    /// What is said again at the end.
    about: [(&'static str, BTreeMap<String, String>); 2],
    /// Schemas, and channels, as they stand in the first chunk and again at the end.
    definitions: [Vec<u8>; 2],
    /// What is said at the end about metadata, and about chunks.
    indexes: [Vec<u8>; 2],
    n_metadata: u32,
    n_chunks: u32,
    n_schemas: u16,
    times: Option<[u64; 2]>,
    /// Losses that the file speaks of already.
    told: Vec<u64>,
}

struct Topic {
    name: String,
    /// None for one of other programs.
    kind: Option<Kind>,
    n_recorded: u64,
}

/// A topic whose messages are for other programs: JSON, by a JSON schema. Readers of recordings leave it out.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Foreign {
    /// Its name.
    pub topic: String,
    /// The name of its schema, by which programs know what they can show.
    pub schema_name: &'static str,
    /// The JSON schema.
    pub schema: &'static str,
}

/// Records that are not in the file yet.
#[derive(Default)]
struct Chunk {
    records: Vec<u8>,
    /// Of every topic: when its messages came, and where they lie among the records.
    messages: BTreeMap<u16, Vec<[u64; 2]>>,
    checks: Checks,
    times: Option<[u64; 2]>,
}

impl<W: Write> fmt::Debug for Writer<W> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Writer")
            .field("n_bytes", &self.n_bytes)
            .finish_non_exhaustive()
    }
}

impl<W: Write> Writer<W> {
    /// Begins a recording; what it says about itself is written at once.
    ///
    /// * `topics`: their names; messages are written by their number here.
    ///
    /// # Errors
    ///
    /// [`WriteError`].
    pub fn begin(out: W, about: &About, topics: &[String]) -> Result<Self, WriteError> {
        Self::begin_with(out, about, topics, &[])
    }

    /// The same, with topics for other programs, whose numbers follow.
    ///
    /// # Errors
    ///
    /// [`WriteError`].
    pub fn begin_with(
        out: W,
        about: &About,
        topics: &[String],
        foreign: &[Foreign],
    ) -> Result<Self, WriteError> {
        let names = foreign.iter().map(|it| &it.topic);
        let names: Vec<String> = topics.iter().chain(names).cloned().collect();
        let mut writer = Self {
            out,
            n_bytes: 0,
            is_broken: false,
            topics: Vec::new(),
            about: [
                (about::NAME, about.to_map()),
                (about::TOPICS, numbered(&names)),
            ],
            chunk: Chunk::default(),
            definitions: [Vec::new(), Vec::new()],
            indexes: [Vec::new(), Vec::new()],
            n_metadata: 0,
            n_chunks: 0,
            n_schemas: 0,
            times: None,
            told: vec![0; topics.len()],
        };
        let mut start = MAGIC.to_vec();
        let library = format!("parallax {}", about.version);
        let header = Body::default().bytes(b"ros2").bytes(library.as_bytes());
        header.finish(op::HEADER, &mut start);
        writer.put(&start)?;
        writer.say_about()?;
        writer.introduce(topics, foreign)?;
        writer.flush(&vec![0; topics.len()])?;
        Ok(writer)
    }

    /// Of which run it is, and which topics there are.
    fn say_about(&mut self) -> Result<(), WriteError> {
        let about = self.about.clone();
        about
            .into_iter()
            .try_for_each(|(name, map)| self.describe(name, map))
    }

    fn introduce(&mut self, names: &[String], foreign: &[Foreign]) -> Result<(), WriteError> {
        let mut known = BTreeSet::new();
        for (channel, name) in (1_u16..).zip(names) {
            let kind = Kind::of_topic(name).ok_or_else(|| WriteError::Topic(name.clone()))?;
            let schema = 1 + kind as u16;
            let [schemas, channels] = &mut self.definitions;
            if known.insert(schema) {
                let body = Body::default().u16(schema);
                let body = body.bytes(kind.schema_name().as_bytes()).bytes(b"ros2msg");
                let body = body.bytes(kind.schema().as_bytes());
                body.finish(op::SCHEMA, schemas);
            }
            let body = Body::default().u16(channel).u16(schema);
            let body = body.bytes(name.as_bytes()).bytes(b"cdr");
            body.map(&BTreeMap::new()).finish(op::CHANNEL, channels);
            self.topics.push(Topic {
                name: name.clone(),
                kind: Some(kind),
                n_recorded: 0,
            });
        }
        let mut strange: Vec<&str> = Vec::new();
        for (channel, it) in (1 + names.len() as u16..).zip(foreign) {
            let [schemas, channels] = &mut self.definitions;
            let nth = strange.iter().position(|name| *name == it.schema_name);
            let schema = 1 + (Kind::ALL.len() + nth.unwrap_or(strange.len())) as u16;
            if nth.is_none() {
                strange.push(it.schema_name);
                let body = Body::default().u16(schema);
                let body = body.bytes(it.schema_name.as_bytes());
                let body = body.bytes(b"jsonschema").bytes(it.schema.as_bytes());
                body.finish(op::SCHEMA, schemas);
            }
            let body = Body::default().u16(channel).u16(schema);
            let body = body.bytes(it.topic.as_bytes()).bytes(b"json");
            body.map(&BTreeMap::new()).finish(op::CHANNEL, channels);
            self.topics.push(Topic {
                name: it.topic.clone(),
                kind: None,
                n_recorded: 0,
            });
        }
        self.n_schemas = (known.len() + strange.len()) as u16;
        for it in &self.definitions {
            self.chunk.records.extend_from_slice(it);
        }
        Ok(())
    }

    /// Writes a message.
    ///
    /// * `topic`: its number; a message of another is left out.
    /// * `entry`: when it came and when it was sent; where it lies is for the file to say.
    /// * `data`: what [`encode`](crate::encode) made of it; JSON where the topic is for other programs.
    ///
    /// # Errors
    ///
    /// [`WriteError::Write`]; then no more can be written.
    pub fn write(&mut self, topic: usize, entry: &Entry, data: &[u8]) -> Result<(), WriteError> {
        self.check()?;
        let Some(it) = self.topics.get_mut(topic) else {
            return Ok(());
        };
        let (channel, time) = (topic as u16 + 1, entry.log_time);
        let nth = it.n_recorded;
        let sequence = nth as u32;
        it.n_recorded += 1;
        let head = data.get(message::PREAMBLE.len()..).unwrap_or(&[]);
        let envelope = it.kind.and_then(|kind| Envelope::of(kind, head));
        if self.chunk.records.len() >= CHUNK_BYTES {
            self.write_chunk()?;
        }
        let chunk = &mut self.chunk;
        let place = [time, chunk.records.len() as u64];
        chunk.messages.entry(channel).or_default().push(place);
        let len = MESSAGE_HEAD_BYTES + data.len() as u64;
        chunk.records.push(op::MESSAGE);
        chunk.records.extend_from_slice(&len.to_le_bytes());
        chunk.records.extend_from_slice(&channel.to_le_bytes());
        chunk.records.extend_from_slice(&sequence.to_le_bytes());
        chunk.records.extend_from_slice(&time.to_le_bytes());
        let published = entry.publish_time.to_le_bytes();
        chunk.records.extend_from_slice(&published);
        let checked = Entry {
            offset: chunk.records.len() as u64,
            len: data.len() as u64,
            frame: envelope.map(|it| it.stamp.frame),
            checksum: Some(crc32fast::hash(data)),
            ..*entry
        };
        chunk.checks.messages.push((channel, nth, checked));
        chunk.records.extend_from_slice(data);
        chunk.times = Some(with(chunk.times, time));
        self.times = Some(with(self.times, time));
        Ok(())
    }

    /// Puts everything so far into the file; says there how much was lost, if that is more than before.
    ///
    /// * `lost`: messages of every topic that were not kept, in the order in which the topics were given.
    ///
    /// # Errors
    ///
    /// [`WriteError::Write`]; then no more can be written.
    pub fn flush(&mut self, lost: &[u64]) -> Result<(), WriteError> {
        self.write_chunk()?;
        if self.told != lost {
            self.tell(lost)?;
        }
        self.out.flush().map_err(|source| self.failed(source))
    }

    /// Ends the recording with its counts and its index.
    ///
    /// * `lost`: as in [`Self::flush`].
    ///
    /// # Errors
    ///
    /// [`WriteError::Write`].
    pub fn finish(mut self, lost: &[u64]) -> Result<(), WriteError> {
        self.write_chunk()?;
        self.tell(lost)?;
        self.say_about()?;
        let mut end = Vec::new();
        // Without a checksum of the data: every message and every chunk has its own.
        Body::default().u32(0).finish(op::DATA_END, &mut end);
        self.put(&end)?;
        let summary_start = self.n_bytes;
        let mut summary = take(&mut self.definitions).concat();
        self.statistics().finish(op::STATISTICS, &mut summary);
        summary.extend(take(&mut self.indexes).concat());
        let footer = Body::default().u64(summary_start).u64(0).u32(0);
        footer.finish(op::FOOTER, &mut summary);
        let n = summary.len() - size_of::<u32>();
        let checksum = crc32fast::hash(&summary[..n]);
        summary[n..].copy_from_slice(&checksum.to_le_bytes());
        summary.extend_from_slice(MAGIC);
        self.put(&summary)?;
        self.out.flush().map_err(|source| self.failed(source))
    }

    fn statistics(&self) -> Body {
        let counts = || self.topics.iter().map(|it| it.n_recorded);
        let [first, last] = self.times.unwrap_or_default();
        Body::default()
            .u64(counts().sum())
            .u16(self.n_schemas)
            .u32(self.topics.len() as u32)
            .u32(0)
            .u32(self.n_metadata)
            .u32(self.n_chunks)
            .u64(first)
            .u64(last)
            .by_channel((1_u16..).zip(counts()))
    }

    /// Bytes that have been written.
    pub fn n_bytes(&self) -> u64 {
        self.n_bytes
    }

    /// Writes the records that are not in the file yet, and where each message lies among them.
    fn write_chunk(&mut self) -> Result<(), WriteError> {
        if self.chunk.records.is_empty() {
            return Ok(());
        }
        let mut chunk = take(&mut self.chunk);
        let n_records = chunk.records.len() as u64;
        let [first, last] = chunk.times.unwrap_or_default();
        let len = CHUNK_HEAD_BYTES + n_records;
        let index = chunk.index();
        let n_index: u64 = index.iter().map(|it| it.1.len() as u64).sum();
        let begin = RECORD_HEAD_BYTES + CHUNK_HEAD_BYTES;
        chunk.checks.ends = [begin, begin + n_records, begin + n_records + n_index];
        let mut head = Vec::new();
        chunk.checks.finish(&mut head);
        let start = self.n_bytes + head.len() as u64;
        head.push(op::CHUNK);
        for it in [len, first, last, n_records] {
            head.extend_from_slice(&it.to_le_bytes());
        }
        let checksum = crc32fast::hash(&chunk.records);
        head.extend_from_slice(&checksum.to_le_bytes());
        head.extend_from_slice(&0_u32.to_le_bytes());
        head.extend_from_slice(&n_records.to_le_bytes());
        self.put(&head)?;
        self.put(&chunk.records)?;
        let mut offsets = Vec::new();
        for (channel, record) in &index {
            offsets.push((*channel, self.n_bytes));
            self.put(record)?;
        }
        let entry = Body::default().u64(first).u64(last).u64(start);
        let entry = entry.u64(RECORD_HEAD_BYTES + len);
        let entry = entry.by_channel(offsets.into_iter());
        let entry = entry.u64(n_index).bytes(b"");
        let entry = entry.u64(n_records).u64(n_records);
        entry.finish(op::CHUNK_INDEX, &mut self.indexes[1]);
        self.n_chunks += 1;
        // The memory serves the next chunk, but not what one very large message took.
        chunk.records.clear();
        chunk.records.shrink_to(2 * CHUNK_BYTES);
        self.chunk.records = chunk.records;
        Ok(())
    }

    fn tell(&mut self, lost: &[u64]) -> Result<(), WriteError> {
        let lost_of = lost.iter().copied().chain(core::iter::repeat(0));
        let counts = self.topics.iter().zip(lost_of).map(|(topic, lost)| {
            let recorded = topic.n_recorded;
            (topic.name.clone(), Count { recorded, lost }.to_string())
        });
        let counts = counts.collect();
        self.describe(count::NAME, counts)?;
        self.told = lost.to_vec();
        Ok(())
    }

    /// Writes metadata; between chunks.
    fn describe(&mut self, name: &str, map: BTreeMap<String, String>) -> Result<(), WriteError> {
        let mut record = Vec::new();
        let map = seal(name, map);
        let body = Body::default().bytes(name.as_bytes()).map(&map);
        body.finish(op::METADATA, &mut record);
        let [offset, len] = [self.n_bytes, record.len() as u64];
        self.put(&record)?;
        let entry = Body::default().u64(offset).u64(len);
        let entry = entry.bytes(name.as_bytes());
        entry.finish(op::METADATA_INDEX, &mut self.indexes[0]);
        self.n_metadata += 1;
        Ok(())
    }

    fn put(&mut self, mut bytes: &[u8]) -> Result<(), WriteError> {
        self.check()?;
        while !bytes.is_empty() {
            match self.out.write(bytes) {
                Ok(0) => return Err(self.failed(io::ErrorKind::WriteZero.into())),
                Ok(n) => {
                    self.n_bytes += n as u64;
                    bytes = &bytes[n..];
                }
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(self.failed(error)),
            }
        }
        Ok(())
    }

    fn check(&mut self) -> Result<(), WriteError> {
        if self.is_broken {
            return Err(self.failed(io::Error::other("it could not be written before")));
        }
        Ok(())
    }

    fn failed(&mut self, source: io::Error) -> WriteError {
        self.is_broken = true;
        WriteError::Write {
            n_bytes: self.n_bytes,
            source,
        }
    }
}

impl Chunk {
    /// Where each message lies: a record for each channel.
    fn index(&self) -> Vec<(u16, Vec<u8>)> {
        let channels = self.messages.iter().map(|(channel, messages)| {
            let places = messages.iter().flatten();
            let places: Vec<u8> = places.flat_map(|it| it.to_le_bytes()).collect();
            let mut record = Vec::new();
            let body = Body::default().u16(*channel).bytes(&places);
            body.finish(op::MESSAGE_INDEX, &mut record);
            (*channel, record)
        });
        channels.collect()
    }
}

/// Names of topics by the numbers of their channels.
fn numbered(topics: &[String]) -> BTreeMap<String, String> {
    let numbered = (1_u16..).zip(topics);
    numbered
        .map(|(channel, name)| (channel.to_string(), name.clone()))
        .collect()
}

fn with(times: Option<[u64; 2]>, time: u64) -> [u64; 2] {
    times.map_or([time; 2], |[first, last]| [first.min(time), last.max(time)])
}
