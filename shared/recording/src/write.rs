//! Writing a recording: append only, so that what has been written stays whatever comes after.

use core::cell::Cell;
use core::fmt;
use std::collections::BTreeMap;
use std::io::{self, Write};
use std::rc::Rc;

use mcap::records::{MessageHeader, Metadata};
use mcap::write::NoSeek;
use mcap::{McapError, WriteOptions};

use crate::{About, Count, Entry, Kind, about, count};

/// Messages are gathered to so many bytes before they are written.
const CHUNK_BYTES: u64 = 1 << 20;

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
    /// The format does not allow it.
    #[error("cannot put this into an MCAP file")]
    Format(#[source] Box<McapError>),
    /// The topic is not one of this program's.
    #[error("nothing is known of topic {0:?}")]
    Topic(String),
}

/// Writes a recording.
///
/// Between two flushes it holds at most a chunk (1 MiB, or one message if that is larger), and of
/// every chunk its entry in the index, a few hundred bytes.
pub struct Writer<W: Write> {
    inner: mcap::Writer<NoSeek<Counted<W>>>,
    n_bytes: Rc<Cell<u64>>,
    topics: Vec<Topic>,
    /// Losses that the file speaks of already.
    told: Vec<u64>,
}

struct Topic {
    name: String,
    channel: u16,
    n_recorded: u64,
}

impl<W: Write> fmt::Debug for Writer<W> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let n_bytes = self.n_bytes.get();
        f.debug_struct("Writer")
            .field("n_bytes", &n_bytes)
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
        let n_bytes = Rc::new(Cell::new(0));
        let counted = Counted {
            out,
            n_bytes: Rc::clone(&n_bytes),
        };
        let options = WriteOptions::new()
            .compression(None)
            .chunk_size(Some(CHUNK_BYTES))
            .disable_seeking(true)
            .profile("ros2")
            .library(format!("parallax {}", about.version));
        let inner = options.create(NoSeek::new(counted));
        let inner = inner.map_err(|source| failed(n_bytes.get(), source))?;
        let mut writer = Self {
            inner,
            n_bytes,
            topics: Vec::new(),
            told: vec![0; topics.len()],
        };
        writer.describe(about::NAME, about.to_map())?;
        for name in topics {
            writer.add(name)?;
        }
        writer.flush(&vec![0; topics.len()])?;
        Ok(writer)
    }

    fn add(&mut self, name: &str) -> Result<(), WriteError> {
        let kind = Kind::of_topic(name).ok_or_else(|| WriteError::Topic(name.to_owned()))?;
        let added = self
            .inner
            .add_schema(kind.schema_name(), "ros2msg", kind.schema().as_bytes())
            .and_then(|schema| {
                self.inner
                    .add_channel(schema, name, "cdr", &BTreeMap::new())
            });
        let channel = added.map_err(|source| failed(self.n_bytes(), source))?;
        self.topics.push(Topic {
            name: name.to_owned(),
            channel,
            n_recorded: 0,
        });
        Ok(())
    }

    /// Writes a message.
    ///
    /// * `topic`: its number; a message of another is left out.
    /// * `entry`: when it came and when it was sent; where it lies is for the file to say.
    /// * `data`: what [`encode`](crate::encode) made of it.
    ///
    /// # Errors
    ///
    /// [`WriteError::Write`]; then no more can be written.
    pub fn write(&mut self, topic: usize, entry: &Entry, data: &[u8]) -> Result<(), WriteError> {
        let Some(it) = self.topics.get_mut(topic) else {
            return Ok(());
        };
        let header = MessageHeader {
            channel_id: it.channel,
            sequence: it.n_recorded as u32,
            log_time: entry.log_time,
            publish_time: entry.publish_time,
        };
        let written = self.inner.write_to_known_channel(&header, data);
        written.map_err(|source| failed(self.n_bytes.get(), source))?;
        it.n_recorded += 1;
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
        if self.told != lost {
            self.tell(lost)?;
        }
        let flushed = self.inner.flush();
        flushed.map_err(|source| failed(self.n_bytes(), source))
    }

    /// Ends the recording with its counts and its index.
    ///
    /// * `lost`: as in [`Self::flush`].
    ///
    /// # Errors
    ///
    /// [`WriteError::Write`].
    pub fn finish(mut self, lost: &[u64]) -> Result<(), WriteError> {
        self.tell(lost)?;
        let finished = self.inner.finish().map(drop);
        finished.map_err(|source| failed(self.n_bytes(), source))
    }

    /// Messages of every topic that were written, in the order in which the topics were given.
    pub fn n_recorded(&self) -> impl Iterator<Item = u64> {
        self.topics.iter().map(|it| it.n_recorded)
    }

    /// Bytes that have been written.
    pub fn n_bytes(&self) -> u64 {
        self.n_bytes.get()
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

    fn describe(
        &mut self,
        name: &str,
        metadata: BTreeMap<String, String>,
    ) -> Result<(), WriteError> {
        let written = self.inner.write_metadata(&Metadata {
            name: name.to_owned(),
            metadata,
        });
        written.map_err(|source| failed(self.n_bytes(), source))
    }
}

fn failed(n_bytes: u64, source: McapError) -> WriteError {
    match source {
        McapError::Io(source) => WriteError::Write { n_bytes, source },
        other => WriteError::Format(Box::new(other)),
    }
}

/// Counts what got through.
struct Counted<W> {
    out: W,
    n_bytes: Rc<Cell<u64>>,
}

impl<W: Write> Write for Counted<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let n = self.out.write(bytes)?;
        self.n_bytes.set(self.n_bytes.get() + n as u64);
        Ok(n)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}
