//! Checks that the messages in a file are nested as in an ONNX file.
//!
//! The library that reads the file trusts the lengths in it. If a length leads backwards, the library loops for ever. It also allocates as
//! much memory as a length asks for. Lengths are therefore checked first. Field numbers are those of the published `onnx.proto`.

/// Largest nesting depth.
const MAX_DEPTH: usize = 32;

/// A type of message in the format.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    Model,
    Graph,
    Node,
    Attribute,
    Tensor,
    ValueInfo,
    Type,
    TensorType,
    Shape,
    /// A message without nested messages: an operator set, an entry or a dimension.
    Flat,
}

impl Kind {
    /// The type of a field of this message, if the field is a message that the library reads.
    fn child(self, field: u64) -> Option<Self> {
        Some(match (self, field) {
            (Self::Model, 7) | (Self::Attribute, 6 | 11) => Self::Graph,
            (Self::Model, 8 | 14) | (Self::Tensor, 13) | (Self::Shape, 1) => Self::Flat,
            (Self::Graph, 1) => Self::Node,
            (Self::Graph, 5) | (Self::Attribute, 5 | 10) => Self::Tensor,
            (Self::Graph, 11..=13) => Self::ValueInfo,
            (Self::Node, 5) => Self::Attribute,
            (Self::ValueInfo, 2) | (Self::TensorType, 1) => Self::Type,
            (Self::Type, 1 | 4) => Self::TensorType,
            (Self::TensorType, 2) => Self::Shape,
            _ => return None,
        })
    }
}

/// Position, from 0, of the first byte at which the nesting is wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the file is truncated or not an ONNX file: byte {at} is unexpected")]
pub(crate) struct MalformedFile {
    at: usize,
}

/// Checks a whole file.
pub(crate) fn check(file: &[u8]) -> Result<(), MalformedFile> {
    walk(Kind::Model, file, 0, 0)
}

/// Checks one message that begins at byte `base` of the file.
fn walk(kind: Kind, bytes: &[u8], base: usize, depth: usize) -> Result<(), MalformedFile> {
    let malformed = |at: usize| MalformedFile { at: base + at };
    let mut at = 0;
    while at < bytes.len() {
        let begin = at;
        let tag = varint(bytes, &mut at).ok_or(malformed(begin))?;
        let (field, wire) = (tag >> 3, tag & 7);
        if field == 0 {
            return Err(malformed(begin));
        }
        let length = match wire {
            0 => varint(bytes, &mut at).map(|_| 0),
            1 => Some(8),
            2 => varint(bytes, &mut at).and_then(|length| usize::try_from(length).ok()),
            5 => Some(4),
            _ => None,
        };
        let end = length.and_then(|length| at.checked_add(length));
        let end = end.filter(|end| *end <= bytes.len()).ok_or(malformed(begin))?;
        if let (2, Some(child)) = (wire, kind.child(field)) {
            if depth == MAX_DEPTH {
                return Err(malformed(begin));
            }
            walk(child, &bytes[at..end], base + at, depth + 1)?;
        }
        at = end;
    }
    Ok(())
}

/// Reads a number with seven bits per byte, lowest bits first; `None` if the bytes end before the number does.
pub(crate) fn varint(bytes: &[u8], at: &mut usize) -> Option<u64> {
    let mut value = 0;
    for shift in (0..64).step_by(7) {
        let byte = *bytes.get(*at)?;
        *at += 1;
        value |= u64::from(byte & 0x7f) << shift;
        if byte < 0x80 {
            return Some(value);
        }
    }
    None
}
