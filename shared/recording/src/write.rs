//! Writes a recording. The file is only appended to, so that later failures do not damage the data already written.

use core::fmt;
use std::collections::BTreeMap;
use std::io::{self, BufWriter, Write};

use mcap::McapError;
use mcap::records::{MessageHeader, Metadata};
use mcap::write::NoSeek;

use crate::gate::{Gate, Keeper};
use crate::seal::seal;
use crate::{About, Count, Entry, Envelope, Kind, about, count, message};

/// Size at which a chunk ends, in bytes. A chunk ends with the message that exceeds this size, or earlier, with the last message of a
/// frame.
const CHUNK_BYTES: u64 = 4 << 20;

/// Reason why a recording cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The file cannot be written to. Its existing content remains readable.
    #[error("cannot write the recording beyond {n_bytes} bytes")]
    Write {
        /// Size of the file, in bytes.
        n_bytes: u64,
        /// Cause of the error.
        #[source]
        source: io::Error,
    },
    /// This program does not know the topic.
    #[error("topic {0:?} is unknown")]
    Topic(String),
}

/// Writes a recording.
///
/// A chunk of the file ends when a message of a later frame arrives. A changed byte or a killed run therefore loses at most one chunk, and
/// a replay works without one frame. A frame of more than 4 MiB has several chunks. The writer keeps in memory the current chunk, and an
/// index entry of some hundred bytes for every chunk before it.
///
/// Every chunk has a checksum. The metadata of the run also has a checksum, and is in the file twice, at its beginning and at its end.
pub struct Writer<W: Write> {
    out: mcap::Writer<NoSeek<BufWriter<Gate<W>>>>,
    keeper: Keeper,
    topics: Vec<Topic>,
    /// Metadata, which is written again at the end.
    about: [(&'static str, BTreeMap<String, String>); 2],
    /// Latest frame of a message.
    latest: Option<u64>,
    /// Numbers of lost messages that have already been written to the file.
    told: Vec<u64>,
}

struct Topic {
    name: String,
    /// Kind of the messages; `None` for a topic that is meant for other programs.
    kind: Option<Kind>,
    n_recorded: u64,
}

/// The schema of a topic, for other programs.
#[derive(Clone, Copy)]
struct Schema<'a> {
    name: &'a str,
    encoding: &'a str,
    text: &'a str,
}

/// A topic whose messages are for other programs: JSON with a JSON schema. Readers of recordings ignore it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Foreign {
    /// Name of the topic.
    pub topic: String,
    /// Name of the schema. Programs recognise by this name whether they can show the content.
    pub schema_name: &'static str,
    /// Text of the JSON schema.
    pub schema: &'static str,
}

impl<W: Write> fmt::Debug for Writer<W> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Writer")
            .field("n_bytes", &self.n_bytes())
            .finish_non_exhaustive()
    }
}

impl<W: Write> Writer<W> {
    /// Begins a recording and writes its metadata at once.
    ///
    /// * `topics`: names of the topics. The position of a topic in this list is its number for [`Self::write`].
    ///
    /// # Errors
    ///
    /// Returns a [`WriteError`] on failure.
    pub fn begin(out: W, about: &About, topics: &[String]) -> Result<Self, WriteError> {
        Self::begin_with(out, about, topics, &[])
    }

    /// Begins a recording with additional topics that are meant for other programs. They are numbered after the other topics.
    ///
    /// # Errors
    ///
    /// Returns a [`WriteError`] on failure.
    pub fn begin_with(
        out: W,
        about: &About,
        topics: &[String],
        foreign: &[Foreign],
    ) -> Result<Self, WriteError> {
        let keeper = Keeper::default();
        let gate = Gate::new(out, keeper.clone());
        let begun = mcap::WriteOptions::new()
            .compression(None)
            .profile("ros2")
            .library(format!("parallax {}", about.version))
            .chunk_size(Some(CHUNK_BYTES))
            .disable_seeking(true)
            // Every chunk has its own checksum.
            .calculate_data_section_crc(false)
            .create(NoSeek::new(BufWriter::new(gate)));
        let names = foreign.iter().map(|strange| &strange.topic);
        let names: Vec<String> = topics.iter().chain(names).cloned().collect();
        let mut writer = Self {
            out: begun.map_err(|error| failed(&keeper, error))?,
            keeper,
            topics: Vec::new(),
            about: [
                (about::NAME, about.to_map()),
                (about::TOPICS, numbered(&names)),
            ],
            latest: None,
            told: vec![0; topics.len()],
        };
        writer.say_about()?;
        for name in topics {
            let kind = Kind::of_topic(name).ok_or_else(|| WriteError::Topic(name.clone()))?;
            let schema = Schema {
                name: kind.schema_name(),
                encoding: "ros2msg",
                text: &kind.schema(),
            };
            writer.introduce((name, Some(kind)), schema, "cdr")?;
        }
        for strange in foreign {
            let schema = Schema {
                name: strange.schema_name,
                encoding: "jsonschema",
                text: strange.schema,
            };
            writer.introduce((&strange.topic, None), schema, "json")?;
        }
        writer.flush(&vec![0; topics.len()])?;
        Ok(writer)
    }

    /// Writes the metadata of the run and the names of the topics.
    fn say_about(&mut self) -> Result<(), WriteError> {
        let about = self.about.clone();
        about.into_iter().try_for_each(|(name, map)| self.describe(name, map))
    }

    /// Adds the next topic.
    fn introduce(
        &mut self,
        (name, kind): (&str, Option<Kind>),
        schema: Schema<'_>,
        encoding: &str,
    ) -> Result<(), WriteError> {
        let channel = self.topics.len() as u16 + 1;
        let added = self
            .out
            .add_schema(schema.name, schema.encoding, schema.text.as_bytes())
            .and_then(|schema| {
                let nothing = BTreeMap::new();
                self.out.add_channel_with_id(channel, schema, name, encoding, &nothing)
            });
        added.map_err(|error| failed(&self.keeper, error))?;
        self.topics.push(Topic {
            name: name.to_owned(),
            kind,
            n_recorded: 0,
        });
        Ok(())
    }

    /// Writes a message.
    ///
    /// * `topic`: number of the topic. A message with an unknown number is ignored.
    /// * `entry`: times of receiving and of sending. Its position in the file is ignored.
    /// * `data`: result of [`encode`](crate::encode), or JSON if the topic is for other programs.
    ///
    /// # Errors
    ///
    /// Returns [`WriteError::Write`]. After that, nothing more can be written.
    pub fn write(&mut self, topic: usize, entry: &Entry, data: &[u8]) -> Result<(), WriteError> {
        self.check()?;
        let Some(known) = self.topics.get_mut(topic) else {
            return Ok(());
        };
        let header = MessageHeader {
            channel_id: topic as u16 + 1,
            sequence: known.n_recorded as u32,
            log_time: entry.log_time,
            publish_time: entry.publish_time,
        };
        known.n_recorded += 1;
        let head = data.get(message::PREAMBLE.len()..).unwrap_or(&[]);
        let envelope = known.kind.and_then(|kind| Envelope::of(kind, head));
        let frame = envelope.map(|envelope| envelope.stamp.frame);
        let mut written = Ok(());
        if frame > self.latest {
            self.latest = frame;
            written = self.out.flush();
        }
        let written = written.and_then(|()| self.out.write_to_known_channel(&header, data));
        written.map_err(|error| failed(&self.keeper, error))
    }

    /// Writes all data so far to the file, and the number of lost messages if it has increased.
    ///
    /// * `lost`: number of lost messages of every topic, in the order in which the topics were given.
    ///
    /// # Errors
    ///
    /// Returns [`WriteError::Write`]. After that, nothing more can be written.
    pub fn flush(&mut self, lost: &[u64]) -> Result<(), WriteError> {
        self.check()?;
        if self.told != lost {
            self.tell(lost)?;
        }
        let flushed = self.out.flush();
        flushed.map_err(|error| failed(&self.keeper, error))
    }

    /// Ends the recording with its counts and its index.
    ///
    /// * `lost`: number of lost messages, as in [`Self::flush`].
    ///
    /// # Errors
    ///
    /// Returns [`WriteError::Write`] on failure.
    pub fn finish(mut self, lost: &[u64]) -> Result<(), WriteError> {
        self.check()?;
        self.tell(lost)?;
        self.say_about()?;
        let finished = self.out.finish().map(drop);
        finished.map_err(|error| failed(&self.keeper, error))
    }

    /// Returns the number of bytes that have been written.
    pub fn n_bytes(&self) -> u64 {
        self.keeper.n_bytes()
    }

    fn tell(&mut self, lost: &[u64]) -> Result<(), WriteError> {
        let all = lost.iter().copied().chain(core::iter::repeat(0));
        let counts = self.topics.iter().zip(all).map(|(topic, lost)| {
            let recorded = topic.n_recorded;
            (topic.name.clone(), Count { recorded, lost }.to_string())
        });
        let counts = counts.collect();
        self.describe(count::NAME, counts)?;
        self.told = lost.to_vec();
        Ok(())
    }

    /// Writes metadata, which also ends the current chunk.
    fn describe(&mut self, name: &str, map: BTreeMap<String, String>) -> Result<(), WriteError> {
        let metadata = Metadata {
            name: name.to_owned(),
            metadata: seal(name, map),
        };
        let written = self.out.write_metadata(&metadata);
        written.map_err(|error| failed(&self.keeper, error))
    }

    fn check(&self) -> Result<(), WriteError> {
        if self.keeper.is_closed() {
            let error = io::Error::other("an earlier write failed");
            return Err(failed(&self.keeper, error.into()));
        }
        Ok(())
    }
}

/// Closes a recording that was not finished, without writing its end.
impl<W: Write> Drop for Writer<W> {
    fn drop(&mut self) {
        self.keeper.close();
    }
}

/// Stops all further writes to the file, and returns the error.
fn failed(keeper: &Keeper, error: McapError) -> WriteError {
    keeper.close();
    WriteError::Write {
        n_bytes: keeper.n_bytes(),
        source: match error {
            McapError::Io(error) => error,
            error => io::Error::other(error),
        },
    }
}

/// Returns the names of topics by the numbers of their channels.
fn numbered(topics: &[String]) -> BTreeMap<String, String> {
    let numbered = (1_u16..).zip(topics);
    numbered.map(|(channel, name)| (channel.to_string(), name.clone())).collect()
}
