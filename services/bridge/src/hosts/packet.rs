//! Format of a view's message between two hosts.

use formats::checksum::fnv1a;
use messages::Status;

use crate::hosts::VERSION;

const MAGIC: [u8; 4] = *b"PXHP";
/// Number of bytes before the body.
pub const HEAD_BYTES: usize = 128;
/// Position of the hash: the last eight bytes of the head.
const HASH_AT: usize = HEAD_BYTES - 8;
/// Limit on the number of a frame, as in `wire`.
const MOST_FRAMES: u64 = 1 << 48;
/// Maximum difference between the capture time of a picture and the nominal time of its frame, in nanoseconds: an hour.
const MOST_SKEW: u64 = 3_600_000_000_000;

/// Kind of the body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Content {
    /// A frame as JPEG. The body is empty if there is no picture.
    Frame,
    /// Poses of a view, as in a recording. If maps are sent, [`Maps`](crate::hosts::Maps) follow.
    Sightings,
    /// Expected errors of a view, as in a recording.
    ViewQuality,
}

impl Content {
    const ALL: [Self; 3] = [Self::Frame, Self::Sightings, Self::ViewQuality];

    fn of_code(code: u16) -> Option<Self> {
        Self::ALL.get(usize::from(code).checked_sub(1)?).copied()
    }

    fn code(self) -> u16 {
        match self {
            Self::Frame => 1,
            Self::Sightings => 2,
            Self::ViewQuality => 3,
        }
    }
}

/// The head of a packet. All times are of the sending host's `CLOCK_MONOTONIC`, in nanoseconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Head {
    /// Kind of the body.
    pub content: Content,
    /// Index of the view.
    pub view: u32,
    /// Status of the result: good, or why it is missing.
    pub status: Status,
    /// Start time of the sending bridge, which identifies the bridge. Sequence numbers start again at 0 with each bridge.
    pub origin: u64,
    /// Number of the message among the messages of this view and content, counted from 0.
    pub sequence: u64,
    /// Number of the frame on the sending host.
    pub frame: u64,
    /// Nominal time of the frame.
    pub instant_nanos: u64,
    /// Time at which the picture was taken.
    pub captured_at_nanos: u64,
    /// Time at which the stage that created the message received its input.
    pub received_at_nanos: u64,
    /// Time at which the stage that created the message sent it.
    pub sent_at_nanos: u64,
    /// Time at which the packet was ready to be sent.
    pub packed_at_nanos: u64,
    /// Time from the nominal time of the frame until the picture was taken, in nanoseconds.
    pub skew_nanos: i64,
    /// Number of frames that the camera's process has skipped since the start of its run because it was too slow.
    pub n_dropped: u64,
    /// Number of messages of this view and content that were overtaken by newer messages before they were sent, since the bridge started.
    pub n_overtaken: u64,
    /// Width and height of the frame, in pixels; 0 without a picture.
    pub size: [u32; 2],
}

/// A checked packet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Packet<'a> {
    /// Head of the packet.
    pub head: Head,
    /// Body of the packet; see [`Content`].
    pub body: &'a [u8],
}

/// Limits for the check of a packet.
#[derive(Debug, Clone, Copy)]
pub struct Expected<'a> {
    /// Views of the sending host.
    pub views: &'a [usize],
    /// Width and height of the frames of every view of the deployment, in pixels.
    pub sizes: &'a [[u32; 2]],
    /// Maximum size of the body, in bytes.
    pub max_body: usize,
}

/// Error for bytes that are not a packet of the sender.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum PacketError {
    /// The packet is truncated, or longer than its head states.
    #[error("the packet has {len} bytes, expected {expected}")]
    Length {
        /// Length of the packet.
        len: usize,
        /// Length according to the head, or the shortest possible length.
        expected: usize,
    },
    /// The packet does not start with the magic bytes of packets.
    #[error("the message is not a packet of Parallax: it begins with {0:02x?}")]
    Magic([u8; 4]),
    /// The other host has another version.
    #[error(
        "the other host has version {got} of the link, but this host has version {VERSION}; use the same version of Parallax on all hosts"
    )]
    Version {
        /// Version of the other host.
        got: u16,
    },
    /// The bytes differ from the bytes that were sent.
    #[error("the content has the hash {got:016x}, expected {expected:016x}")]
    Hash {
        /// Hash of the received bytes.
        got: u64,
        /// Hash in the head.
        expected: u64,
    },
    /// A number is out of range.
    #[error("{field} is {got}, expected {expected}")]
    Value {
        /// Name of the field.
        field: &'static str,
        /// Value of the field.
        got: u64,
        /// Accepted value, or largest accepted value.
        expected: u64,
    },
}

impl Packet<'_> {
    /// Returns the packet as bytes.
    pub fn to_bytes(&self) -> Vec<u8> {
        let head = &self.head;
        let mut out = Vec::with_capacity(HEAD_BYTES + self.body.len());
        out.extend_from_slice(&MAGIC);
        out.extend_from_slice(&VERSION.to_le_bytes());
        out.extend_from_slice(&head.content.code().to_le_bytes());
        out.extend_from_slice(&head.view.to_le_bytes());
        out.extend_from_slice(&head.status.0.to_le_bytes());
        for number in [
            head.origin,
            head.sequence,
            head.frame,
            head.instant_nanos,
            head.captured_at_nanos,
            head.received_at_nanos,
            head.sent_at_nanos,
            head.packed_at_nanos,
            head.skew_nanos.cast_unsigned(),
            head.n_dropped,
            head.n_overtaken,
        ] {
            out.extend_from_slice(&number.to_le_bytes());
        }
        for number in head.size {
            out.extend_from_slice(&number.to_le_bytes());
        }
        out.extend_from_slice(&(self.body.len() as u64).to_le_bytes());
        let hash = hash(&out, self.body);
        out.extend_from_slice(&hash.to_le_bytes());
        out.extend_from_slice(self.body);
        out
    }
}

impl<'a> Packet<'a> {
    /// Parses a packet, and checks everything that can be checked without its receiver.
    ///
    /// # Errors
    ///
    /// Fails with [`PacketError`] if the bytes are not a valid packet.
    pub fn parse(bytes: &'a [u8], expected: &Expected<'_>) -> Result<Self, PacketError> {
        let Some((head, body)) = bytes.split_at_checked(HEAD_BYTES) else {
            return Err(PacketError::Length {
                len: bytes.len(),
                expected: HEAD_BYTES,
            });
        };
        let mut fields = Fields(head);
        let magic = fields.take();
        if magic != MAGIC {
            return Err(PacketError::Magic(magic));
        }
        let got = u16::from_le_bytes(fields.take());
        if got != VERSION {
            return Err(PacketError::Version { got });
        }
        let code = u16::from_le_bytes(fields.take());
        let content = Content::of_code(code).ok_or(PacketError::Value {
            field: "content",
            got: u64::from(code),
            expected: 3,
        })?;
        let head = fields.head(content);
        let len = fields.u64();
        most("body", len, expected.max_body as u64)?;
        if body.len() as u64 != len {
            return Err(PacketError::Length {
                len: bytes.len(),
                expected: HEAD_BYTES + len as usize,
            });
        }
        let said = fields.u64();
        let got = hash(&bytes[..HASH_AT], body);
        if got != said {
            return Err(PacketError::Hash {
                got,
                expected: said,
            });
        }
        check(&head, body.len(), expected)?;
        Ok(Self { head, body })
    }
}

fn check(head: &Head, body: usize, expected: &Expected<'_>) -> Result<(), PacketError> {
    if !expected.views.contains(&(head.view as usize)) {
        return Err(PacketError::Value {
            field: "view of another host",
            got: u64::from(head.view),
            expected: expected.views.first().copied().unwrap_or(0) as u64,
        });
    }
    most("frame", head.frame, MOST_FRAMES)?;
    most("skew", head.skew_nanos.unsigned_abs(), MOST_SKEW)?;
    most("n_dropped", head.n_dropped, MOST_FRAMES)?;
    most("n_overtaken", head.n_overtaken, MOST_FRAMES)?;
    let size = expected.sizes.get(head.view as usize).copied();
    let has_picture = head.content == Content::Frame && head.status == Status::OK;
    let due = if has_picture {
        size.unwrap_or([0; 2])
    } else {
        head.size
    };
    for (field, side) in [("width", 0), ("height", 1)] {
        if head.size[side] != due[side] {
            return Err(PacketError::Value {
                field,
                got: u64::from(head.size[side]),
                expected: u64::from(due[side]),
            });
        }
    }
    // A frame without a picture has no body. All other packets have one.
    let has_body = has_picture || head.content != Content::Frame;
    if has_body != (body > 0) {
        return Err(PacketError::Value {
            field: "body",
            got: body as u64,
            expected: u64::from(has_body),
        });
    }
    Ok(())
}

fn most(field: &'static str, got: u64, expected: u64) -> Result<(), PacketError> {
    if got > expected {
        return Err(PacketError::Value {
            field,
            got,
            expected,
        });
    }
    Ok(())
}

/// Returns the hash of a head without its last field, and of a body.
fn hash(head: &[u8], body: &[u8]) -> u64 {
    // The body is hashed in units of eight bytes, because FNV would be too slow byte by byte.
    let words = body.chunks(8).fold(0xcbf2_9ce4_8422_2325_u64, |sum, word| {
        let mut bytes = [0; 8];
        bytes[..word.len()].copy_from_slice(word);
        (sum ^ u64::from_le_bytes(bytes))
            .wrapping_mul(0x0000_0100_0000_01b3)
            .rotate_left(29)
    });
    fnv1a(head) ^ words.wrapping_mul(0x9e37_79b9_7f4a_7c15)
}

/// The fields of a head that have not been read yet.
struct Fields<'a>(&'a [u8]);

impl Fields<'_> {
    /// Returns the next bytes, with zeros beyond the end.
    fn take<const N: usize>(&mut self) -> [u8; N] {
        let (now, rest) = self.0.split_first_chunk().unwrap_or((&[0; N], &[]));
        self.0 = rest;
        *now
    }

    fn u32(&mut self) -> u32 {
        u32::from_le_bytes(self.take())
    }

    fn u64(&mut self) -> u64 {
        u64::from_le_bytes(self.take())
    }

    fn head(&mut self, content: Content) -> Head {
        Head {
            content,
            view: self.u32(),
            status: Status(self.u32()),
            origin: self.u64(),
            sequence: self.u64(),
            frame: self.u64(),
            instant_nanos: self.u64(),
            captured_at_nanos: self.u64(),
            received_at_nanos: self.u64(),
            sent_at_nanos: self.u64(),
            packed_at_nanos: self.u64(),
            skew_nanos: self.u64().cast_signed(),
            n_dropped: self.u64(),
            n_overtaken: self.u64(),
            size: [self.u32(), self.u32()],
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const EXPECTED: Expected<'static> = Expected {
        views: &[1, 3],
        sizes: &[[8, 9]; 4],
        max_body: 100,
    };

    fn head() -> Head {
        Head {
            content: Content::Frame,
            view: 3,
            status: Status::OK,
            origin: 77,
            sequence: 5,
            frame: 9,
            instant_nanos: 1000,
            captured_at_nanos: 1001,
            received_at_nanos: 1002,
            sent_at_nanos: 1003,
            packed_at_nanos: 1004,
            skew_nanos: -4,
            n_dropped: 2,
            n_overtaken: 1,
            size: [8, 9],
        }
    }

    fn bytes(change: impl Fn(&mut Head), body: &[u8]) -> Vec<u8> {
        let mut head = head();
        change(&mut head);
        Packet { head, body }.to_bytes()
    }

    #[test]
    fn a_packet_survives_a_round_trip() {
        let sent = bytes(|_| {}, b"picture");
        let got = Packet::parse(&sent, &EXPECTED).unwrap();
        assert_eq!((got.head, got.body), (head(), &b"picture"[..]));
        let empty = bytes(
            |head| (head.status, head.size) = (Status::UNPLUGGED, [0; 2]),
            b"",
        );
        assert_eq!(Packet::parse(&empty, &EXPECTED).unwrap().body, b"");
    }

    #[test]
    fn impossible_values_are_refused_with_the_number() {
        let refused = |bytes: &[u8]| Packet::parse(bytes, &EXPECTED).unwrap_err().to_string();
        for (change, words) in [
            (
                (|head| head.view = 0) as fn(&mut Head),
                "view of another host is 0",
            ),
            (
                |head| head.frame = u64::MAX,
                "frame is 18446744073709551615",
            ),
            (
                |head| head.skew_nanos = i64::MIN,
                "skew is 9223372036854775808",
            ),
            (|head| head.size = [8, 8], "height is 8, expected 9"),
            (|head| head.n_dropped = u64::MAX, "n_dropped is"),
            (|head| head.status = Status::FROZEN, "body is 7, expected 0"),
        ] {
            let got = refused(&bytes(change, b"picture"));
            assert!(got.contains(words), "{words}: {got}");
        }
        let whole = bytes(|_| {}, b"picture");
        assert!(refused(&whole[..50]).contains("50 bytes, expected 128"));
        assert!(refused(&whole[..130]).contains("130 bytes, expected 135"));
        assert!(refused(&bytes(|_| {}, &[0; 101])).contains("body is 101, expected 100"));
        assert!(refused(&bytes(|_| {}, b"")).contains("body is 0, expected 1"));
        assert!(refused(b"GET / HTTP/1.1").contains("14 bytes"));
        let mut other = whole.clone();
        other[4] = 9;
        assert!(refused(&other).contains("version 9 of the link"));
    }

    proptest! {
        #[test]
        fn one_changed_byte_is_detected(at in 0_usize..135, by in 1_u8..) {
            let mut changed = bytes(|_| {}, b"picture");
            changed[at] ^= by;
            prop_assert!(Packet::parse(&changed, &EXPECTED).is_err());
        }

        #[test]
        fn any_bytes_are_parsed_as_a_packet_or_refused(bytes: Vec<u8>) {
            let _parsed = Packet::parse(&bytes, &EXPECTED).is_ok();
        }
    }
}
