//! Queue of a live camera's original pictures for a recording. No process waits for it, and pictures that do not fit are counted.

use std::collections::VecDeque;
use std::sync::{Mutex, MutexGuard, PoisonError};

use footage::{Piece, PieceKind, Pieces, Size};
use messages::NO_SEQUENCE;

/// Maximum number of waiting bytes: a second of large raw pictures.
const MAX_BYTES: usize = 128 << 20;
/// Maximum number of pieces of a stream that wait until the decoder gives their times. Also the maximum number of decoded pictures whose
/// times are remembered.
const MAX_PENDING: usize = 64;
/// Tolerance for the time of a piece, which is rounded to milliseconds.
const SAME_NANOS: u64 = 1_000_000;

/// An original picture.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Original {
    /// Format of the bytes, as in [`messages::PictureHeader::format`].
    pub format: [u8; 4],
    pub bytes: Vec<u8>,
    /// Times at which the picture was taken and arrived, by `CLOCK_MONOTONIC`, in nanoseconds.
    pub at_nanos: u64,
    pub arrived_at_nanos: u64,
    /// Number that the camera gave the picture, or [`NO_SEQUENCE`].
    pub sequence: u64,
    /// Time of the picture in the stream; 0 if it has none.
    pub presented_nanos: u64,
    pub bytes_per_row: u32,
    pub size: Size,
    pub is_whole: bool,
    /// Number of times that the camera had been opened before. [`Originals::put`] sets it.
    pub connection: u32,
}

#[derive(Debug, Default)]
struct State {
    waiting: VecDeque<(u64, Original)>,
    n_bytes: usize,
    /// Number of the next picture.
    next: u64,
    n_connections: u32,
}

/// Numbered pictures that wait to be sent to the recording. Lost pictures also have numbers.
#[derive(Debug, Default)]
pub(crate) struct Originals(Mutex<State>);

impl Originals {
    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Records that the camera was opened.
    pub(super) fn connected(&self) {
        self.state().n_connections += 1;
    }

    /// Adds a picture, or counts it if there is no space.
    pub(super) fn put(&self, original: Original) {
        let mut state = self.state();
        let number = state.next;
        state.next += 1;
        let n_bytes = original.bytes.len();
        if state.n_bytes + n_bytes > MAX_BYTES {
            return;
        }
        state.n_bytes += n_bytes;
        let connection = state.n_connections.saturating_sub(1);
        state.waiting.push_back((
            number,
            Original {
                connection,
                ..original
            },
        ));
    }

    /// Counts pictures that were lost before they arrived.
    fn lose(&self, n: u64) {
        self.state().next += n;
    }

    /// Removes and returns the oldest picture, with its number.
    pub(crate) fn take(&self) -> Option<(u64, Original)> {
        let mut state = self.state();
        let (number, original) = state.waiting.pop_front()?;
        state.n_bytes -= original.bytes.len();
        Some((number, original))
    }

    /// Returns the number of all pictures so far.
    pub(crate) fn n_all(&self) -> u64 {
        self.state().next
    }
}

/// Pieces of a stream that wait until its decoder has given the times of their pictures.
#[derive(Debug)]
pub(super) struct KeptStream {
    originals: std::sync::Arc<Originals>,
    size: Size,
    pending: VecDeque<Piece>,
    /// Times of decoded pictures, in the stream and by this machine's clock.
    decoded: VecDeque<(i64, u64)>,
}

impl KeptStream {
    pub(super) fn new(originals: std::sync::Arc<Originals>, size: Size) -> Self {
        Self {
            originals,
            size,
            pending: VecDeque::new(),
            decoded: VecDeque::new(),
        }
    }

    /// Records that a picture was decoded.
    ///
    /// * `label_nanos`: time of the picture in the stream.
    /// * `at_nanos`: time at which the picture was taken.
    pub(super) fn decoded(&mut self, label_nanos: i64, at_nanos: u64) {
        self.decoded.push_back((label_nanos, at_nanos));
        if self.decoded.len() > MAX_PENDING {
            self.decoded.pop_front();
        }
    }

    /// Passes on the pieces whose pictures have been decoded, or should have been decoded by now.
    pub(super) fn put_all(&mut self, pieces: &Pieces, arrived_at_nanos: u64) {
        self.originals.lose(pieces.take_lost());
        while let Some(piece) = pieces.next() {
            self.pending.push_back(piece);
        }
        self.put_decoded(arrived_at_nanos);
    }

    fn put_decoded(&mut self, arrived_at_nanos: u64) {
        let Some(&(last, _)) = self.decoded.back() else {
            return;
        };
        while let Some(piece) = self.pending.front() {
            let is_due = piece.nanos.cast_signed() <= last.saturating_add(SAME_NANOS.cast_signed());
            if !is_due && self.pending.len() <= MAX_PENDING {
                return;
            }
            let at_nanos = self.taken_at(piece.nanos.cast_signed());
            let Some(piece) = self.pending.pop_front() else {
                return;
            };
            self.originals.put(Original {
                format: *match piece.kind {
                    PieceKind::Head => b"MKV0",
                    PieceKind::Key => b"MKV1",
                    PieceKind::Other => b"MKV2",
                },
                bytes: piece.bytes,
                at_nanos,
                arrived_at_nanos,
                sequence: NO_SEQUENCE,
                presented_nanos: piece.nanos,
                bytes_per_row: 0,
                size: self.size,
                is_whole: true,
                connection: 0,
            });
        }
    }

    /// Returns the time at which the picture of a piece was taken. It is the time of the decoded picture, if it was decoded. Otherwise, it
    /// is extrapolated from the last decoded picture.
    fn taken_at(&self, nanos: i64) -> u64 {
        let is_it = |decoded: &&(i64, u64)| decoded.0.abs_diff(nanos) <= SAME_NANOS;
        if let Some(&(_, at)) = self.decoded.iter().find(is_it) {
            return at;
        }
        self.decoded.back().map_or(0, |&(label, at)| {
            let apart = nanos.saturating_sub(label);
            at.saturating_add_signed(apart)
        })
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;

    const MS: u64 = 1_000_000;

    fn original(n_bytes: usize) -> Original {
        Original {
            format: *b"MJPG",
            bytes: vec![0; n_bytes],
            at_nanos: 1,
            arrived_at_nanos: 2,
            sequence: 3,
            presented_nanos: 0,
            bytes_per_row: 0,
            size: Size::new(1, 1),
            is_whole: true,
            connection: 0,
        }
    }

    #[test]
    fn pictures_beyond_the_limit_are_lost_and_keep_their_numbers() {
        let originals = Originals::default();
        originals.connected();
        for _ in 0..3 {
            originals.put(original(MAX_BYTES / 2));
        }
        originals.take().unwrap();
        originals.put(original(9));
        let numbers: Vec<u64> =
            core::iter::from_fn(|| originals.take().map(|original| original.0)).collect();
        assert_eq!(numbers, [1, 3], "the third had no room");
        assert_eq!(originals.n_all(), 4);
        originals.put(original(MAX_BYTES));
        assert_eq!(originals.take().unwrap().0, 4, "room was freed");
    }

    #[test]
    fn encoded_pieces_get_the_times_of_their_decoded_pictures() {
        let originals = Arc::new(Originals::default());
        let mut kept = KeptStream::new(Arc::clone(&originals), Size::new(2, 2));
        let piece = |kind, ms: u64| Piece {
            kind,
            nanos: ms * MS,
            bytes: vec![1],
        };
        kept.pending.extend([
            piece(PieceKind::Head, 0),
            piece(PieceKind::Key, 33),
            piece(PieceKind::Other, 67),
            piece(PieceKind::Other, 100),
        ]);
        kept.put_decoded(0);
        assert_eq!(originals.n_all(), 0, "the capture time is not known yet");
        kept.decoded(33_366_667, 5000 * MS);
        // The second piece was not decoded.
        kept.decoded(100_100_000, 5067 * MS);
        kept.put_decoded(9000 * MS);
        let all: Vec<([u8; 4], u64)> = core::iter::from_fn(|| {
            originals.take().map(|original| (original.1.format, original.1.at_nanos))
        })
        .collect();
        assert_eq!(all[1], (*b"MKV1", 5000 * MS));
        assert_eq!(all[2], (*b"MKV2", 5033 * MS + 900_000));
        assert_eq!(all[3], (*b"MKV2", 5067 * MS));
    }
}
