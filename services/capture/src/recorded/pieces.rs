//! Reconstructs a recorded stream, starting at a given picture.

use std::io;
use std::path::Path;

use recording::{Buffer, Kind};

use super::table::{Part, Picture, Table};

/// Returns the bytes of a head and of the following pictures, up to the end of the connection. The pictures begin with the last picture
/// before `first` that does not depend on another picture.
///
/// After a gap or a damaged message, pictures are left out up to the next picture that does not depend on another picture.
pub(super) fn from(
    file: &Path,
    table: &Table,
    first: &Picture,
) -> io::Result<impl Iterator<Item = Vec<u8>> + Send + 'static> {
    let mut input = files::open(file)?;
    let parts = &table.parts;
    let is_of = |part: &Part| part.connection == first.connection;
    let own: Vec<Part> = parts.iter().copied().filter(is_of).collect();
    let here = own.iter().position(|part| part.entry == first.entry);
    let head = |part: &Part| part.format == *b"MKV0";
    let begin = own[..here.unwrap_or(0)].iter().rposition(head);
    let mut state = State::Begin;
    let mut last = None;
    let mut buffer = Buffer::default();
    let from_begin = own.into_iter().skip(begin.unwrap_or(0));
    Ok(from_begin.filter_map(move |part| {
        let is_next = last.is_none_or(|number: u64| number.checked_add(1) == Some(part.number));
        last = Some(part.number);
        let read = recording::read(&mut input, Kind::Picture, &part.entry, &mut buffer);
        let message = read.ok();
        state = state.after(part.format, is_next, message.is_some());
        let is_sent = match state {
            State::Head => true,
            State::Pictures => part.format != *b"MKV0",
            State::Begin | State::Gap => false,
        };
        message.filter(|_| is_sent).map(|message| message.elements.to_vec())
    }))
}

/// State of the stream, which decides what pieces may follow.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    /// Nothing has been sent yet.
    Begin,
    /// The head was the last piece.
    Head,
    /// Consecutive pictures have been sent.
    Pictures,
    /// A picture is missing.
    Gap,
}

impl State {
    /// Returns the state after a piece.
    ///
    /// * `is_next`: true if the piece directly follows the previous piece.
    /// * `is_read`: true if the piece is not damaged.
    fn after(self, format: [u8; 4], is_next: bool, is_read: bool) -> Self {
        match (self, &format) {
            (Self::Begin, b"MKV0") if is_read => Self::Head,
            (Self::Begin, _) => Self::Begin,
            (_, b"MKV1") if is_read => Self::Pictures,
            (Self::Head | Self::Pictures, _) if is_next && is_read => Self::Pictures,
            _ => Self::Gap,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn after_a_gap_decoding_continues_at_the_next_key_picture() {
        let mut state = State::Begin;
        let parts = [
            (b"MKV2", true, true),
            (b"MKV0", true, true),
            (b"MKV1", true, true),
            (b"MKV2", true, true),
            (b"MKV2", false, true),
            (b"MKV2", true, true),
            (b"MKV1", true, false),
            (b"MKV0", true, true),
            (b"MKV1", true, true),
        ];
        let states = parts.map(|(format, is_next, is_read)| {
            state = state.after(*format, is_next, is_read);
            state
        });
        let expected = [
            State::Begin,
            State::Head,
            State::Pictures,
            State::Pictures,
            State::Gap,
            State::Gap,
            State::Gap,
            State::Gap,
            State::Pictures,
        ];
        assert_eq!(states, expected);
    }
}
