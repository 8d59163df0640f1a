//! Writing a recording: append only, so that what has been written stays whatever comes after.

use core::fmt;
use std::collections::BTreeMap;
use std::io::{self, BufWriter, Write};

use mcap::McapError;
use mcap::records::{MessageHeader, Metadata};
use mcap::write::NoSeek;

use crate::gate::{Gate, Keeper};
use crate::seal::seal;
use crate::{About, Count, Entry, Envelope, Kind, about, count, message};

/// A chunk ends with the message that makes it longer than this, or with its frame.
const CHUNK_BYTES: u64 = 4 << 20;

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
    #[error("topic {0:?} is unknown")]
    Topic(String),
}

/// Writes a recording.
///
/// A chunk of the file ends when a message of a later frame comes: a chunk is what one changed byte costs, and what a
/// killed run loses, and a frame is what a replay can do without. A frame of more than 4 MiB has several. In memory are
/// the chunk, and an entry of some hundred bytes in the index for every chunk before it.
///
/// Every chunk has a checksum. What is said about the run has one, too, and stands in the file twice, at its beginning
/// and at its end.
pub struct Writer<W: Write> {
    out: mcap::Writer<NoSeek<BufWriter<Gate<W>>>>,
    keeper: Keeper,
    topics: Vec<Topic>,
    /// Said again at the end.
    about: [(&'static str, BTreeMap<String, String>); 2],
    /// The latest frame of a message.
    latest: Option<u64>,
    /// Losses that the file speaks of already.
    told: Vec<u64>,
}

struct Topic {
    name: String,
    /// None for a topic of other programs.
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

impl<W: Write> fmt::Debug for Writer<W> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Writer")
            .field("n_bytes", &self.n_bytes())
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
        let keeper = Keeper::default();
        let gate = Gate::new(out, keeper.clone());
        let begun = mcap::WriteOptions::new()
            .compression(None)
            .profile("ros2")
            .library(format!("parallax {}", about.version))
            .chunk_size(Some(CHUNK_BYTES))
            .disable_seeking(true)
            // Every chunk has a checksum of its own.
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

    /// Writes which run it is of, and which topics there are.
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
    /// * `topic`: its number; a message of another is left out.
    /// * `entry`: when it came and when it was sent; where it lies is for the file to say.
    /// * `data`: what [`encode`](crate::encode) made of it; JSON where the topic is for other programs.
    ///
    /// # Errors
    ///
    /// [`WriteError::Write`]; then no more can be written.
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

    /// Puts everything so far into the file; says there how much was lost, if that is more than before.
    ///
    /// * `lost`: messages of every topic that were not kept, in the order in which the topics were given.
    ///
    /// # Errors
    ///
    /// [`WriteError::Write`]; then no more can be written.
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
    /// * `lost`: as in [`Self::flush`].
    ///
    /// # Errors
    ///
    /// [`WriteError::Write`].
    pub fn finish(mut self, lost: &[u64]) -> Result<(), WriteError> {
        self.check()?;
        self.tell(lost)?;
        self.say_about()?;
        let finished = self.out.finish().map(drop);
        finished.map_err(|error| failed(&self.keeper, error))
    }

    /// Bytes that have been written.
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

    /// Writes metadata; this ends the chunk.
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
            let error = io::Error::other("it could not be written before");
            return Err(failed(&self.keeper, error.into()));
        }
        Ok(())
    }
}

/// A recording that was not finished gets no end.
impl<W: Write> Drop for Writer<W> {
    fn drop(&mut self) {
        self.keeper.close();
    }
}

/// Lets nothing more into the file.
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

/// Names of topics by the numbers of their channels.
fn numbered(topics: &[String]) -> BTreeMap<String, String> {
    let numbered = (1_u16..).zip(topics);
    numbered.map(|(channel, name)| (channel.to_string(), name.clone())).collect()
}
