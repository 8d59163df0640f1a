//! Assignment of recorded pictures to the frames of a run.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufReader;

use bytemuck::pod_read_unaligned;
use footage::Size;
use messages::{MAX_NAME, PictureHeader, Status};
use recording::{Entry, Kind, Track};

use super::RecordedError;
use crate::live::Grid;

/// Longest time from taking a picture until it was sent, in nanoseconds. A longer time shows damage.
const MAX_AGE_NANOS: u64 = 60_000_000_000;
/// Lowest and highest accepted frame rate, in hertz.
const RATES_HZ: [f64; 2] = [0.01, 10_000.0];
/// Tolerance for the time of a piece of a stream, which is rounded to milliseconds.
const SAME_NANOS: i64 = 1_000_000;

/// A picture that is assigned to a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Picture {
    pub instant: u64,
    pub at_nanos: u64,
    pub entry: Entry,
    pub format: [u8; 4],
    pub bytes_per_row: u32,
    /// Number of restarts of the recording process, and number of times that it had opened the camera.
    pub connection: [u32; 2],
    pub label_nanos: i64,
}

impl Picture {
    /// Returns true if the picture is a piece of a stream.
    pub(super) fn is_piece(&self) -> bool {
        is_stream(self.format)
    }
}

fn is_stream(format: [u8; 4]) -> bool {
    format.starts_with(b"MKV")
}

/// A message of a stream, in the order of its numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Part {
    pub entry: Entry,
    pub format: [u8; 4],
    pub connection: [u32; 2],
    pub number: u64,
}

/// The pictures of a camera.
#[derive(Debug)]
pub(super) struct Table {
    pub size: Size,
    pub rate_hz: f64,
    pub grid: Grid,
    /// Pictures that are assigned to a frame, by time.
    pub pictures: Vec<Picture>,
    /// All messages of streams, by number.
    pub parts: Vec<Part>,
    pub labels: BTreeMap<([u32; 2], i64), usize>,
}

impl Table {
    /// Reads the heads of all pictures of a camera.
    ///
    /// * `rate_hz`: number of frames per second; `None` for the frame rate of the recorded run.
    pub(super) fn read(
        file: &mut File,
        camera: &str,
        rate_hz: Option<f64>,
    ) -> Result<Self, RecordedError> {
        let recording = recording::scan(file)?;
        let mut input = BufReader::new(file);
        let tracks = recording.tracks.values();
        let tracks = tracks.filter(|track| track.kind == Kind::Picture);
        let mut known = Vec::new();
        for track in tracks {
            let heads = heads(&mut input, track)?;
            let Some(first) = heads.first().map(|head| head.1) else {
                continue;
            };
            let name = name_of(&first);
            if name == camera[..camera.floor_char_boundary(MAX_NAME)] {
                return Self::from_heads(camera, &first, &heads, rate_hz);
            }
            known.push(name);
        }
        Err(RecordedError::NoCamera {
            camera: camera.to_owned(),
            known,
        })
    }

    fn from_heads(
        camera: &str,
        first: &PictureHeader,
        heads: &[(Entry, PictureHeader)],
        rate_hz: Option<f64>,
    ) -> Result<Self, RecordedError> {
        let malformed = |what| RecordedError::Malformed {
            camera: camera.to_owned(),
            what,
        };
        let rate_hz = rate_hz.unwrap_or(first.grid_rate_hz);
        if !(RATES_HZ[0]..=RATES_HZ[1]).contains(&rate_hz) {
            return Err(malformed("the recorded frame rate is out of range"));
        }
        let size = Size::new(first.width as usize, first.height as usize);
        if size.rgb_bytes() == 0 || size.width.max(size.height) > 1 << 16 {
            return Err(malformed("the recorded picture size is out of range"));
        }
        let mut table = Self {
            size,
            rate_hz,
            grid: Grid::new(first.grid_start_nanos, rate_hz),
            pictures: Vec::new(),
            parts: Vec::new(),
            labels: BTreeMap::new(),
        };
        table.parts.extend(heads.iter().filter_map(part));
        table.parts.sort_by_key(|part| (part.connection[0], part.number));
        table.place(heads);
        if table.pictures.is_empty() {
            return Err(malformed(
                "no picture is complete and belongs to an instant of the run",
            ));
        }
        Ok(table)
    }

    /// Assigns a picture to every frame.
    fn place(&mut self, heads: &[(Entry, PictureHeader)]) {
        let is_picture = |picture: &&(Entry, PictureHeader)| {
            let header = &picture.1;
            header.status == Status::OK
                && header.format != *b"MKV0"
                && [header.width, header.height].map(|value| value as usize)
                    == [self.size.width, self.size.height]
        };
        let mut by_time: Vec<_> = heads.iter().filter(is_picture).collect();
        by_time.sort_by_key(|picture| picture.1.stamp.captured_at_nanos);
        let times = by_time.iter().map(|by_time| by_time.1.stamp.captured_at_nanos);
        self.grid.learn(times);
        let mut next = 0;
        for (entry, header) in by_time {
            let at_nanos = header.stamp.captured_at_nanos;
            if self.grid.wrong_clock(at_nanos, at_nanos).is_some() {
                continue;
            }
            let Some(instant) = self.grid.place(at_nanos, next) else {
                continue;
            };
            next = instant + 1;
            let picture = Picture {
                instant,
                at_nanos,
                entry: *entry,
                format: header.format,
                bytes_per_row: header.bytes_per_row,
                connection: connection(header),
                label_nanos: header.presented_nanos.cast_signed(),
            };
            if picture.is_piece() {
                let label = (picture.connection, picture.label_nanos);
                self.labels.insert(label, self.pictures.len());
            }
            self.pictures.push(picture);
        }
    }

    /// Returns the number of frames up to the last picture.
    pub(super) fn n_frames(&self) -> u64 {
        self.pictures.last().map_or(0, |picture| picture.instant + 1)
    }

    /// Returns the first picture whose frame is not before a given frame.
    pub(super) fn first_at(&self, instant: u64) -> usize {
        self.pictures.partition_point(|picture| picture.instant < instant)
    }

    /// Returns the first picture whose connection is later than the connection of a given picture.
    pub(super) fn after_connection(&self, at: usize) -> usize {
        let rest = self.pictures.get(at..).unwrap_or_default();
        let n = rest.iter().take_while(|picture| picture.connection == rest[0].connection);
        at + n.count()
    }

    /// Returns the picture with a given time in the stream.
    pub(super) fn of_label(&self, connection: [u32; 2], label_nanos: i64) -> Option<usize> {
        let from = (connection, label_nanos.saturating_sub(SAME_NANOS));
        let to = (connection, label_nanos.saturating_add(SAME_NANOS));
        let near = self.labels.range(from..=to);
        let nearest = near.min_by_key(|label| label.0.1.abs_diff(label_nanos));
        nearest.map(|nearest| *nearest.1)
    }

    /// Returns the time of a picture after the first frame, in seconds.
    pub(super) fn seconds(&self, picture: &Picture) -> f64 {
        self.grid.seconds(picture.at_nanos)
    }
}

fn name_of(header: &PictureHeader) -> String {
    let name = String::from_utf8_lossy(&header.name);
    name.trim_end_matches('\0').to_owned()
}

fn connection(header: &PictureHeader) -> [u32; 2] {
    [header.stamp.epoch, header.connection]
}

fn part(it: &(Entry, PictureHeader)) -> Option<Part> {
    let (entry, header) = it;
    is_stream(header.format).then(|| Part {
        entry: *entry,
        format: header.format,
        connection: connection(header),
        number: header.stamp.frame,
    })
}

/// Returns the heads of a topic's messages, without the end of the stream and without messages that are visibly damaged.
fn heads(
    input: &mut BufReader<&mut File>,
    track: &Track,
) -> Result<Vec<(Entry, PictureHeader)>, RecordedError> {
    let mut buffer = Vec::new();
    let mut all = Vec::with_capacity(track.entries.len());
    for entry in &track.entries {
        let head = recording::read_head(input, track.kind, entry, &mut buffer)?;
        let header: PictureHeader = pod_read_unaligned(head);
        // The file's index, whose checksum was verified, also has the frame number and the send time.
        let is_same = entry.frame.is_none_or(|frame| frame == header.stamp.frame)
            && entry.publish_time == header.timing.sent_at_nanos;
        let age = header.timing.sent_at_nanos.abs_diff(header.stamp.captured_at_nanos);
        if is_same && age <= MAX_AGE_NANOS && header.status != Status::END {
            all.push((*entry, header));
        }
    }
    Ok(all)
}
