//! Recorded original pictures of a live camera, used as footage: `run.mcap#left`.
//!
//! Reading order: [`Recorded`] (the address), `table` (the instant of each picture), `pieces` (a stream, to be decoded
//! again), [`RecordedFeed`] (the pictures).

mod pieces;
mod table;

use std::fs::File;
use std::path::{Path, PathBuf};

use footage::{FootageError, FrameView, PixelFormat, RemadeStream, SourceSpec};
use recording::{Buffer, Kind, ReadError};

use crate::info::FeedInfo;
use table::{Picture, Table};

/// Separator between the file and the camera.
const MARK: &str = ".mcap#";

/// A camera of a recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Recorded {
    /// Path of the recording.
    pub file: PathBuf,
    /// Name of the camera.
    pub camera: String,
}

/// Error if a recording has no pictures of a camera.
#[derive(Debug, thiserror::Error)]
pub enum RecordedError {
    /// The address does not name a camera.
    #[error("the address does not name a camera: use run.mcap#NAME")]
    NoName,
    /// The file cannot be opened.
    #[error("cannot open the recording")]
    Open(#[from] std::io::Error),
    /// The file is not a recording, or cannot be read.
    #[error("cannot read the recording")]
    Read(#[from] ReadError),
    /// The recording has no pictures of this camera.
    #[error("the recording has no original pictures of camera {camera:?}; {}", others(.known))]
    NoCamera {
        /// Name of the camera.
        camera: String,
        /// Cameras whose pictures the recording has.
        known: Vec<String>,
    },
    /// The recorded metadata of the camera's pictures is inconsistent.
    #[error("the recorded pictures of camera {camera:?} cannot be used: {what}")]
    Malformed {
        /// Name of the camera.
        camera: String,
        /// Description of the mistake.
        what: &'static str,
    },
    /// The choice of frames is invalid.
    #[error(transparent)]
    Choice(#[from] FootageError),
}

fn others(known: &[String]) -> String {
    if known.is_empty() {
        "it has no original pictures at all: only `parallax record` of live cameras keeps them"
            .to_owned()
    } else {
        format!("it has original pictures of {}", known.join(", "))
    }
}

impl Recorded {
    /// Returns true if a source is the address of a recording.
    pub fn is_recorded(source: &str) -> bool {
        let is_file = Path::new(source).extension().is_some_and(|extension| extension == "mcap");
        source.contains(MARK) || is_file
    }

    /// Parses an address.
    ///
    /// # Errors
    ///
    /// Fails with [`RecordedError::NoName`] if no camera is named.
    pub fn parse(source: &str) -> Result<Self, RecordedError> {
        let at = source.find(MARK).ok_or(RecordedError::NoName)?;
        let (file, camera) = source.split_at(at + MARK.len());
        if camera.is_empty() {
            return Err(RecordedError::NoName);
        }
        Ok(Self {
            file: file.trim_end_matches('#').into(),
            camera: camera.to_owned(),
        })
    }

    /// Returns the address of a camera in a recording.
    pub fn address(file: &Path, camera: &str) -> String {
        format!("{}#{camera}", file.display())
    }
}

/// The pictures of a camera in a recording, at the frame rate of the recorded run or at another rate.
#[derive(Debug)]
pub struct RecordedFeed {
    pub(crate) info: FeedInfo,
    pub(crate) rgb: Vec<u8>,
    table: Table,
    name: String,
    path: PathBuf,
    file: File,
    buffer: Buffer,
    /// Index of the next picture in the table, and the frames to use.
    at: usize,
    next: u64,
    step: u64,
    n_left: u64,
    stream: Option<Open>,
}

/// A stream that is decoded again.
#[derive(Debug)]
struct Open {
    decoder: RemadeStream,
    connection: [u32; 2],
}

impl RecordedFeed {
    /// Returns the properties of the frames that `spec` selects.
    pub(crate) fn look(recorded: &Recorded, spec: &SourceSpec) -> Result<FeedInfo, RecordedError> {
        Ok(Self::open(recorded, spec)?.info)
    }

    pub(crate) fn open(recorded: &Recorded, spec: &SourceSpec) -> Result<Self, RecordedError> {
        let mut file = files::open(&recorded.file)?;
        let table = Table::read(&mut file, &recorded.camera, spec.frame_rate_hz)?;
        let n_frames = spec.n_delivered(table.n_frames())?;
        let plain = FeedInfo::plain(table.size, n_frames, table.rate_hz / spec.step as f64);
        // The decoder of a stream shrinks pictures, during the recorded run as well.
        let shrink = if table.pictures.iter().any(Picture::is_piece) {
            table.size.divisor(spec.most_shrink)
        } else {
            1
        };
        let info = FeedInfo {
            size: table.size.shrunk(shrink),
            shrink,
            ..plain
        };
        Ok(Self {
            rgb: vec![0; info.size.rgb_bytes()],
            info,
            name: Recorded::address(&recorded.file, &recorded.camera),
            path: recorded.file.clone(),
            file,
            buffer: Buffer::default(),
            at: table.first_at(spec.start),
            table,
            next: spec.start,
            step: spec.step,
            n_left: info.n_frames,
            stream: None,
        })
    }

    /// Returns the next frame that has a picture; `None` at the end. Damaged pictures are left out.
    pub(crate) fn next_frame(&mut self) -> Result<Option<FrameView<'_>>, FootageError> {
        while self.n_left > 0 {
            let Some(picture) = self.table.pictures.get(self.at).copied() else {
                return Ok(None);
            };
            let past_last = self.next + (self.n_left - 1) * self.step;
            if picture.instant > past_last {
                return Ok(None);
            }
            let found = if picture.is_piece() {
                self.next_of_stream(picture)?
            } else {
                self.at += 1;
                let is_good = self.is_wanted(picture.instant) && self.decode(&picture)?;
                is_good.then_some(picture)
            };
            let Some(picture) = found else { continue };
            let n_passed = (picture.instant - self.next) / self.step + 1;
            self.skip(n_passed);
            return Ok(Some(FrameView {
                index: picture.instant,
                time_s: Some(self.table.seconds(&picture)),
                rgb: &self.rgb,
            }));
        }
        Ok(None)
    }

    fn is_wanted(&self, instant: u64) -> bool {
        instant >= self.next && (instant - self.next).is_multiple_of(self.step)
    }

    /// Skips the next `n` frames, or fewer at the end. Returns the number of skipped frames.
    pub(crate) fn skip(&mut self, n: u64) -> u64 {
        let n = n.min(self.n_left);
        self.n_left -= n;
        self.next = self.next.saturating_add(n.saturating_mul(self.step));
        n
    }

    /// Decodes a picture that can be decoded on its own. Returns `false` if it is damaged.
    fn decode(&mut self, picture: &Picture) -> Result<bool, FootageError> {
        let (file, buffer) = (&mut self.file, &mut self.buffer);
        let message = match recording::read(file, Kind::Picture, &picture.entry, buffer) {
            Ok(message) => message,
            Err(ReadError::Read(source)) => {
                let path = self.path.clone();
                return Err(FootageError::Io { path, source });
            }
            Err(_) => return Ok(false),
        };
        let format = PixelFormat::of_letters(picture.format);
        let (stride, size) = (picture.bytes_per_row as usize, self.table.size);
        Ok(format
            .is_some_and(|format| format.to_rgb(message.elements, stride, size, &mut self.rgb)))
    }

    /// Returns the next wanted picture of a stream; `None` if the next picture belongs to another connection.
    ///
    /// * `first`: the next picture of the table.
    fn next_of_stream(&mut self, first: Picture) -> Result<Option<Picture>, FootageError> {
        let is_open = |open: &Open| open.connection == first.connection;
        if !self.stream.as_ref().is_some_and(is_open) {
            let wanted = self.table.first_at(self.next).max(self.at);
            let wanted = self.table.pictures.get(wanted).copied();
            let wanted = wanted.filter(|wanted| wanted.connection == first.connection);
            let pieces = pieces::from(&self.path, &self.table, &wanted.unwrap_or(first));
            let pieces = pieces.map_err(|source| FootageError::Io {
                path: self.path.clone(),
                source,
            })?;
            self.stream = Some(Open {
                decoder: RemadeStream::open(&self.name, pieces, self.table.size, self.info.shrink)?,
                connection: first.connection,
            });
        }
        let Some(open) = &mut self.stream else {
            return Ok(None);
        };
        let label = match open.decoder.next_into(&mut self.rgb) {
            Ok(label) => label,
            // The camera was set to another size. The following pictures cannot be used until the camera is opened again.
            Err(FootageError::SizeChanged { .. }) => None,
            Err(error) => return Err(error),
        };
        let Some(label) = label else {
            self.stream = None;
            self.at = self.table.after_connection(self.at);
            return Ok(None);
        };
        let Some(at) = self.table.of_label(first.connection, label) else {
            return Ok(None);
        };
        let picture = self.table.pictures[at];
        if at < self.at || !self.is_wanted(picture.instant) {
            return Ok(None);
        }
        self.at = at + 1;
        Ok(Some(picture))
    }
}

#[cfg(test)]
mod tests;
