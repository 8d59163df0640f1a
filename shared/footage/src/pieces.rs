//! A live stream in its original form: the packets of `ffmpeg` in a Matroska stream, split so that every picture is a separate piece.

use std::io::{self, Read};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, sync_channel};

/// Maximum number of pieces that may wait. Further pieces are lost and counted.
const MAX_WAITING: usize = 128;
/// Maximum plausible length of an element, in bytes.
const MAX_BYTES: u64 = 64 << 20;

/// Kind of a piece of a stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PieceKind {
    /// The head, which describes how to decode the pictures after it. There is a head before every picture that can be decoded without
    /// other pictures.
    Head,
    /// A picture that can be decoded without other pictures.
    Key,
    /// A picture that can only be decoded together with the pictures before it.
    Other,
}

/// A piece of a stream. A head followed by its pictures is a Matroska file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Piece {
    /// Kind of the piece.
    pub kind: PieceKind,
    /// Time of the piece's picture in the stream, in nanoseconds, rounded to whole milliseconds; 0 for a head.
    pub nanos: u64,
    /// Bytes of the piece.
    pub bytes: Vec<u8>,
}

/// The pieces of an open stream.
#[derive(Debug)]
pub struct Pieces {
    waiting: Receiver<Piece>,
    n_lost: Arc<AtomicU64>,
}

impl Pieces {
    /// Reads a Matroska stream to its end on a separate thread, which never waits for the receiver of the pieces.
    pub(crate) fn follow(stream: impl Read + Send + 'static) -> io::Result<Self> {
        let (sender, waiting) = sync_channel(MAX_WAITING);
        let n_lost = Arc::new(AtomicU64::new(0));
        let counted = Arc::clone(&n_lost);
        let thread = std::thread::Builder::new().name("stream as it came".to_owned());
        thread.spawn(move || {
            let mut cutter = Cutter::new(stream);
            while let Ok(Some(piece)) = cutter.next() {
                if sender.try_send(piece).is_err() {
                    counted.fetch_add(1, Ordering::Relaxed);
                }
            }
            // Data that cannot be split is read and dropped, because the decoder would otherwise wait for the pipe.
            io::copy(&mut cutter.input, &mut io::sink()).ok();
        })?;
        Ok(Self { waiting, n_lost })
    }

    /// Returns the next piece, if there is one.
    pub fn next(&self) -> Option<Piece> {
        self.waiting.try_recv().ok()
    }

    /// Returns the number of pieces since the last call that were lost because the receiver was too slow.
    pub fn take_lost(&self) -> u64 {
        self.n_lost.swap(0, Ordering::Relaxed)
    }
}

/// The Matroska elements that are parsed.
mod id {
    pub(super) const SEGMENT: u32 = 0x1853_8067;
    pub(super) const CLUSTER: u32 = 0x1f43_b675;
    pub(super) const TIMESTAMP: u32 = 0xe7;
    pub(super) const SIMPLE_BLOCK: u32 = 0xa3;
    pub(super) const BLOCK_GROUP: u32 = 0xa0;
    pub(super) const BLOCK: u32 = 0xa1;
    pub(super) const REFERENCE: u32 = 0xfb;
}

struct Cutter<R> {
    input: R,
    head: Vec<u8>,
    /// A picture that follows the head that was just returned.
    after_head: Option<Piece>,
}

impl<R: Read> Cutter<R> {
    fn new(input: R) -> Self {
        Self {
            input,
            head: Vec::new(),
            after_head: None,
        }
    }

    /// Returns the next piece, or `None` at the end of the stream.
    fn next(&mut self) -> io::Result<Option<Piece>> {
        if let Some(piece) = self.after_head.take() {
            return Ok(Some(piece));
        }
        loop {
            let mut bytes = Vec::new();
            let Some((id, length)) = self.element(&mut bytes)? else {
                return Ok(None);
            };
            // The length of the segment is unknown: its elements follow directly.
            if id != id::SEGMENT {
                let begin = bytes.len();
                let length = length.filter(|length| *length <= MAX_BYTES);
                let length = length.ok_or(io::ErrorKind::InvalidData)?;
                // Memory is allocated only for the bytes that exist, regardless of the stated length.
                let n = (&mut self.input).take(length).read_to_end(&mut bytes)?;
                if n as u64 != length {
                    return Ok(None);
                }
                if id == id::CLUSTER {
                    return Ok(Some(self.picture(begin, bytes)));
                }
            }
            self.head.extend_from_slice(&bytes);
            if self.head.len() as u64 > MAX_BYTES {
                return Err(io::ErrorKind::InvalidData.into());
            }
        }
    }

    /// Returns the piece made from a cluster, or the head before it.
    fn picture(&mut self, begin: usize, bytes: Vec<u8>) -> Piece {
        let (nanos, is_key) = looked_into(&bytes[begin..]);
        let kind = if is_key {
            PieceKind::Key
        } else {
            PieceKind::Other
        };
        let piece = Piece { kind, nanos, bytes };
        if !is_key {
            return piece;
        }
        self.after_head = Some(piece);
        Piece {
            kind: PieceKind::Head,
            nanos: 0,
            bytes: self.head.clone(),
        }
    }

    /// Returns the id and length of the next element, and appends them to `bytes`. Returns `None` at the end. The length is `None` if it
    /// is not known.
    fn element(&mut self, bytes: &mut Vec<u8>) -> io::Result<Option<(u32, Option<u64>)>> {
        let mut first = [0];
        if self.input.read(&mut first)? == 0 {
            return Ok(None);
        }
        let id = self.vint(first[0], 4, bytes)?;
        let id = bytes[id..].iter().fold(0, |sum, it| sum << 8 | u32::from(*it));
        self.input.read_exact(&mut first)?;
        let length = self.vint(first[0], 8, bytes)?;
        Ok(Some((id, number(&bytes[length..]))))
    }

    /// Appends a number of variable length to `bytes`. Returns the index at which it begins.
    fn vint(&mut self, first: u8, most: u32, bytes: &mut Vec<u8>) -> io::Result<usize> {
        let n_more = first.leading_zeros();
        if n_more >= most {
            return Err(io::ErrorKind::InvalidData.into());
        }
        let begin = bytes.len();
        bytes.push(first);
        bytes.resize(begin + 1 + n_more as usize, 0);
        self.input.read_exact(&mut bytes[begin + 1..])?;
        Ok(begin)
    }
}

/// Reads a number of variable length with its marker; `None` if all its bits are ones, which means that the number is unknown.
fn number(bytes: &[u8]) -> Option<u64> {
    let all = bytes.iter().fold(0_u64, |sum, it| sum << 8 | u64::from(*it));
    let mask = (1_u64 << (7 * bytes.len())) - 1;
    Some(all & mask).filter(|value| *value != mask)
}

/// Splits off one element of a slice: returns its id, its content, and the rest.
fn split(bytes: &[u8]) -> Option<(u32, &[u8], &[u8])> {
    let n_id = bytes.first()?.leading_zeros() as usize + 1;
    let id = bytes.get(..n_id).filter(|_| n_id <= 4)?;
    let id = id.iter().fold(0, |id, it| id << 8 | u32::from(*it));
    let rest = &bytes[n_id..];
    let n_length = rest.first()?.leading_zeros() as usize + 1;
    let length = number(rest.get(..n_length).filter(|_| n_length <= 8)?)?;
    let rest = &rest[n_length..];
    let length = usize::try_from(length).ok().filter(|value| *value <= rest.len())?;
    let (inside, after) = rest.split_at(length);
    Some((id, inside, after))
}

/// Returns the time in nanoseconds of the first picture of a cluster, and whether this picture can be decoded without other pictures.
fn looked_into(mut cluster: &[u8]) -> (u64, bool) {
    let mut base = 0_i64;
    while let Some((id, inside, after)) = split(cluster) {
        cluster = after;
        let (block, is_key) = match id {
            id::TIMESTAMP if inside.len() <= 8 => {
                let all = inside.iter().fold(0_u64, |sum, it| sum << 8 | u64::from(*it));
                base = all.cast_signed();
                continue;
            }
            id::SIMPLE_BLOCK => (
                inside,
                inside.get(3).is_some_and(|inside| inside & 0x80 != 0),
            ),
            id::BLOCK_GROUP => group(inside),
            _ => continue,
        };
        let &[_, high, low, ..] = block else { continue };
        let ms = base.saturating_add(i64::from(i16::from_be_bytes([high, low])));
        return (ms.max(0).cast_unsigned().saturating_mul(1_000_000), is_key);
    }
    (base.max(0).cast_unsigned().saturating_mul(1_000_000), false)
}

/// Returns the block of a group, and whether it can be decoded without other blocks.
fn group(mut inside: &[u8]) -> (&[u8], bool) {
    let (mut block, mut is_key) = (&[][..], true);
    while let Some((id, it, after)) = split(inside) {
        inside = after;
        match id {
            id::BLOCK => block = it,
            id::REFERENCE => is_key = false,
            _ => {}
        }
    }
    (block, is_key)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn element(id: &[u8], inside: &[u8]) -> Vec<u8> {
        let length = 0x1000_0000 | inside.len() as u32;
        [id, &length.to_be_bytes(), inside].concat()
    }

    fn cluster(ms: u16, is_key: bool, picture: &[u8]) -> Vec<u8> {
        let block = [&[0x81, 0, 3, if is_key { 0x80 } else { 0 }][..], picture].concat();
        let inside = [
            element(&[0xe7], &ms.to_be_bytes()),
            element(&[0xa3], &block),
        ];
        element(&[0x1f, 0x43, 0xb6, 0x75], &inside.concat())
    }

    fn head() -> Vec<u8> {
        let segment = [0x18, 0x53, 0x80, 0x67, 1, 255, 255, 255, 255, 255, 255, 255];
        let ebml = element(&[0x1a, 0x45, 0xdf, 0xa3], &[1, 2, 3]);
        let tracks = element(&[0x16, 0x54, 0xae, 0x6b], &[4; 20]);
        [&ebml[..], &segment, &tracks].concat()
    }

    fn cut(bytes: &[u8]) -> Vec<Piece> {
        let mut cutter = Cutter::new(bytes);
        core::iter::from_fn(|| cutter.next().ok().flatten()).collect()
    }

    #[test]
    fn every_picture_is_one_piece_and_key_pictures_include_the_header() {
        let pictures = [
            cluster(40, true, b"a"),
            cluster(80, false, b"bb"),
            cluster(120, true, b"c"),
        ];
        let pieces = cut(&[head(), pictures.concat()].concat());
        let kinds: Vec<(PieceKind, u64)> =
            pieces.iter().map(|piece| (piece.kind, piece.nanos / 1_000_000)).collect();
        let expected = [
            (PieceKind::Head, 0),
            (PieceKind::Key, 43),
            (PieceKind::Other, 83),
            (PieceKind::Head, 0),
            (PieceKind::Key, 123),
        ];
        assert_eq!(kinds, expected);
        assert_eq!(pieces[0].bytes, head());
        assert_eq!(
            [&pieces[1].bytes[..], &pieces[2].bytes].concat(),
            pictures[..2].concat()
        );
    }

    #[test]
    fn a_picture_is_a_key_picture_if_it_refers_to_no_other() {
        let block = element(&[0xa1], &[0x81, 0, 0, 0, 9]);
        let alone = element(&[0xa0], &block);
        let with = element(&[0xa0], &[block, element(&[0xfb], &[0xff])].concat());
        assert_eq!(looked_into(&alone), (0, true));
        assert_eq!(looked_into(&with), (0, false));
    }

    proptest! {
        #[test]
        fn any_bytes_are_split_into_pieces_or_refused(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
            cut(&bytes);
            cut(&[head(), bytes].concat());
        }

        #[test]
        fn a_truncated_stream_gives_its_complete_pictures(n in 0_usize..200) {
            let whole = [head(), cluster(1, true, &[7; 60]), cluster(2, false, &[8; 40])].concat();
            let pieces = cut(&whole[..n.min(whole.len())]);
            prop_assert!(pieces.len() <= 3);
            prop_assert!(pieces.iter().all(|piece| whole.windows(piece.bytes.len()).any(|w| w == piece.bytes)));
        }
    }
}
