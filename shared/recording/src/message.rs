//! One message as bytes: CDR, little endian.

use bytemuck::{bytes_of, cast_slice, pod_read_unaligned};
use messages::{Skeletons, Stamp, Status, Timing};

use crate::Kind;

/// Preamble of CDR: little endian, no options.
pub(crate) const PREAMBLE: [u8; 4] = [0, 1, 0, 0];

const _: () = assert!(
    cfg!(target_endian = "little"),
    "messages are written with their layout in memory"
);

/// Reason why the bytes of a message do not match its type.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Malformed {
    /// The length of the message does not match its type and its count.
    #[error("the message has {len} bytes, expected {expected}")]
    Length {
        /// Length of the message, in bytes.
        len: u64,
        /// Expected length, in bytes. If the count is missing, this is the minimum length.
        expected: u64,
    },
    /// The message is not little-endian CDR.
    #[error("the message begins with {0:02x?}, which is not little-endian CDR")]
    Encoding([u8; 4]),
}

/// Appends a message to `out`.
///
/// * `head`: the struct. It is truncated or padded to [`Kind::head_bytes`].
/// * `elements`: the array of the message as bytes, if it has one.
pub fn encode(kind: Kind, head: &[u8], elements: &[u8], out: &mut Vec<u8>) {
    out.extend_from_slice(&PREAMBLE);
    let begin = out.len();
    out.extend_from_slice(&head[..head.len().min(kind.head_bytes())]);
    out.resize(begin + kind.head_bytes(), 0);
    if let Some(size) = kind.element_bytes() {
        let n = u32::try_from(elements.len() / size).unwrap_or(u32::MAX);
        out.extend_from_slice(&n.to_le_bytes());
        out.extend_from_slice(&elements[..n as usize * size]);
    }
}

/// Splits skeletons into the fields before the count, and the array of people.
pub fn split_skeletons(skeletons: &Skeletons) -> [&[u8]; 2] {
    let head = &bytes_of(skeletons)[..Kind::Skeletons.head_bytes()];
    [head, cast_slice(skeletons.listed())]
}

/// A parsed message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Message<'a> {
    /// Bytes of the struct.
    pub head: &'a [u8],
    /// Bytes of the array; empty if the message has none.
    pub elements: &'a [u8],
}

impl<'a> Message<'a> {
    /// Parses a message.
    ///
    /// # Errors
    ///
    /// Returns a [`Malformed`] on failure.
    pub fn parse(kind: Kind, data: &'a [u8]) -> Result<Self, Malformed> {
        let fixed = PREAMBLE.len() + kind.head_bytes();
        check_length(kind, data.len() as u64)?;
        if !data.starts_with(&PREAMBLE) {
            return Err(Malformed::Encoding(pod_read_unaligned(&data[..4])));
        }
        let head = &data[PREAMBLE.len()..fixed];
        let Some(size) = kind.element_bytes() else {
            return Ok(Self {
                head,
                elements: &[],
            });
        };
        let n: u32 = pod_read_unaligned(&data[fixed..fixed + 4]);
        let elements = &data[fixed + 4..];
        let expected = u64::from(n) * size as u64;
        if elements.len() as u64 != expected {
            return Err(Malformed::Length {
                len: data.len() as u64,
                expected: expected + (fixed + 4) as u64,
            });
        }
        Ok(Self { head, elements })
    }

    /// Returns the message as [`Skeletons`]; `None` if it is of another kind.
    pub fn skeletons(&self) -> Option<Box<Skeletons>> {
        let mut skeletons = Box::<Skeletons>::default();
        let size = Kind::Skeletons.element_bytes()?;
        let n_people = self.elements.len() / size;
        let is_due = self.head.len() == Kind::Skeletons.head_bytes()
            && self.elements.len().is_multiple_of(size)
            && n_people <= skeletons.people.len();
        if !is_due {
            return None;
        }
        let bytes = bytemuck::bytes_of_mut(&mut *skeletons);
        bytes[..self.head.len()].copy_from_slice(self.head);
        skeletons.n_people = n_people as u32;
        let people: &mut [u8] = bytemuck::cast_slice_mut(&mut skeletons.people[..n_people]);
        people.copy_from_slice(self.elements);
        Some(skeletons)
    }
}

/// Checks the length of a message without reading it.
pub(crate) fn check_length(kind: Kind, len: u64) -> Result<(), Malformed> {
    let count = kind.element_bytes().map_or(0, |_| size_of::<u32>());
    let expected = (PREAMBLE.len() + kind.head_bytes() + count) as u64;
    let fits = match kind.element_bytes() {
        None => len == expected,
        Some(size) => {
            len >= expected
                && (len - expected).is_multiple_of(size as u64)
                && (len - expected) / size as u64 <= kind.most_elements()
        }
    };
    if fits {
        Ok(())
    } else {
        Err(Malformed::Length { len, expected })
    }
}

/// Stamp, timing and status of a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Envelope {
    /// Stamp of the message.
    pub stamp: Stamp,
    /// Times of the message.
    pub timing: Timing,
    /// States whether the message contains a result and, if not, why.
    pub status: Status,
}

impl Envelope {
    /// Reads the envelope from a struct. Returns `None` for heartbeats, which have no stamp, and for a struct that is too short.
    pub fn of(kind: Kind, head: &[u8]) -> Option<Self> {
        let at = kind.status_at()?;
        let stamp = head.get(..size_of::<Stamp>())?;
        let timing = head.get(size_of::<Stamp>()..)?.get(..size_of::<Timing>())?;
        let status = head.get(at..)?.get(..size_of::<Status>())?;
        Some(Self {
            stamp: pod_read_unaligned(stamp),
            timing: pod_read_unaligned(timing),
            status: pod_read_unaligned(status),
        })
    }

    /// Writes the envelope into a struct of the type. Heartbeats and structs that are too short are not changed.
    pub fn put(&self, kind: Kind, head: &mut [u8]) {
        let Some(at) = kind.status_at().filter(|_| head.len() >= kind.head_bytes()) else {
            return;
        };
        let pieces = [
            (0, bytes_of(&self.stamp)),
            (size_of::<Stamp>(), bytes_of(&self.timing)),
            (at, bytes_of(&self.status)),
        ];
        for (at, bytes) in pieces {
            head[at..at + bytes.len()].copy_from_slice(bytes);
        }
    }
}

#[cfg(test)]
mod tests {
    use messages::{
        EvidenceHeader, FrameHeader, PairPose, People, PictureHeader, Sightings, ViewQuality,
    };
    use proptest::prelude::*;

    use super::*;

    fn envelope(n: u64) -> Envelope {
        Envelope {
            stamp: Stamp {
                session: n,
                frame: n + 1,
                captured_at_nanos: n + 2,
                view: 3,
                epoch: 4,
            },
            timing: Timing {
                received_at_nanos: n + 5,
                sent_at_nanos: n + 6,
            },
            status: Status::NO_DETECTION,
        }
    }

    /// Returns the bytes of messages with this envelope, one for every kind that has an envelope.
    fn heads(it: Envelope) -> Vec<(Kind, Vec<u8>)> {
        let (mut frame, mut evidence) = (FrameHeader::default(), EvidenceHeader::default());
        let (mut pose, mut quality) = (Sightings::default(), ViewQuality::default());
        let (mut pair, mut skeletons) = (PairPose::default(), Skeletons::default());
        let (mut people, mut picture) = (People::default(), PictureHeader::default());
        (people.stamp, people.timing, people.status) = (it.stamp, it.timing, it.status);
        (picture.stamp, picture.timing, picture.status) = (it.stamp, it.timing, it.status);
        (frame.stamp, frame.timing, frame.status) = (it.stamp, it.timing, it.status);
        (evidence.stamp, evidence.timing, evidence.status) = (it.stamp, it.timing, it.status);
        (pose.stamp, pose.timing, pose.status) = (it.stamp, it.timing, it.status);
        (quality.stamp, quality.timing, quality.status) = (it.stamp, it.timing, it.status);
        (pair.stamp, pair.timing, pair.status) = (it.stamp, it.timing, it.status);
        (skeletons.stamp, skeletons.timing, skeletons.status) = (it.stamp, it.timing, it.status);
        let heads = [
            (Kind::Frame, bytes_of(&frame)),
            (Kind::Evidence, bytes_of(&evidence)),
            (Kind::Sightings, bytes_of(&pose)),
            (Kind::ViewQuality, bytes_of(&quality)),
            (Kind::PairPose, bytes_of(&pair)),
            (Kind::People, bytes_of(&people)),
            (Kind::Skeletons, split_skeletons(&skeletons)[0]),
            (Kind::Picture, bytes_of(&picture)),
        ];
        heads.map(|(kind, bytes)| (kind, bytes.to_vec())).into()
    }

    #[test]
    fn the_envelope_is_read_and_written_in_every_type_of_message() {
        for ((kind, head), (_, other)) in heads(envelope(9)).into_iter().zip(heads(envelope(70))) {
            assert_eq!(Envelope::of(kind, &head), Some(envelope(9)), "{kind:?}");
            let mut changed = head;
            envelope(70).put(kind, &mut changed);
            assert_eq!(changed, other, "{kind:?}");
            assert_eq!(Envelope::of(kind, &changed[..20]), None);
        }
        assert_eq!(Envelope::of(Kind::Health, &[0; 104]), None);
    }

    #[test]
    fn evidence_survives_a_round_trip_bit_for_bit() {
        let values = [1.5_f32, f32::NAN, -0.0];
        let (kind, head) = heads(envelope(1)).swap_remove(1);
        let mut data = Vec::new();
        encode(kind, &head, cast_slice(&values), &mut data);
        let got = Message::parse(kind, &data).unwrap();
        assert_eq!(got.head, head);
        assert_eq!(got.elements, cast_slice::<f32, u8>(&values));
    }

    #[test]
    fn a_recorded_message_contains_only_the_people_present() {
        let mut skeletons = Box::<Skeletons>::default();
        skeletons.stamp.frame = 7;
        for (nth, person) in skeletons.people.iter_mut().enumerate() {
            (person.id, person.joints[3].in_world[1]) = (nth as u64 + 1, 0.5 + nth as f64);
        }
        for n_people in [0, 2, 8] {
            skeletons.n_people = n_people as u32;
            let [head, elements] = split_skeletons(&skeletons);
            let mut data = Vec::new();
            encode(Kind::Skeletons, head, elements, &mut data);
            // The layout is the same as in memory, with the count directly before the list.
            let n_bytes = core::mem::offset_of!(Skeletons, people) + elements.len();
            assert_eq!(data[PREAMBLE.len()..], bytes_of(&*skeletons)[..n_bytes]);
            let got = Message::parse(Kind::Skeletons, &data).unwrap();
            let got = got.skeletons().unwrap();
            assert_eq!(got.stamp.frame, 7);
            assert_eq!(got.listed(), skeletons.listed());
            assert!(got.people[n_people..].iter().all(|person| person.id == 0));
        }
        let people = vec![0; 9 * Kind::Skeletons.element_bytes().unwrap()];
        let mut data = Vec::new();
        encode(Kind::Skeletons, &[], &people, &mut data);
        Message::parse(Kind::Skeletons, &data).unwrap_err();
    }

    #[test]
    fn another_byte_order_is_refused() {
        let mut data = Vec::new();
        encode(Kind::Health, &[7; 104], &[], &mut data);
        data[1] = 0;
        let refused = Message::parse(Kind::Health, &data);
        assert_eq!(refused, Err(Malformed::Encoding([0; 4])));
    }

    #[test]
    fn a_count_that_does_not_match_is_refused() {
        let mut data = Vec::new();
        encode(Kind::Frame, &[0; 128], &[1, 2, 3], &mut data);
        data[132] = 4;
        let refused = Message::parse(Kind::Frame, &data);
        let [len, expected] = [139, 140];
        assert_eq!(refused, Err(Malformed::Length { len, expected }));
    }

    proptest! {
        #[test]
        fn any_bytes_are_parsed_as_a_message_or_refused(kind in prop::sample::select(Kind::ALL.to_vec()), n in 0_usize..400, fill: u8) {
            let mut data = vec![fill; n];
            if n >= 4 { data[..4].copy_from_slice(&PREAMBLE); }
            if let Ok(it) = Message::parse(kind, &data) {
                prop_assert_eq!(it.head.len(), kind.head_bytes());
            }
        }
    }
}
