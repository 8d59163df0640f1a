//! People in a frame, and the candidate of every view that shows each person.

use bytemuck::Zeroable as _;
use bytemuck_derive::{Pod, Zeroable};
use iceoryx2::prelude::ZeroCopySend;

use crate::{MAX_PEOPLE, MAX_VIEWS, Stamp, Status, Timing};

/// Entry of [`PersonMessage::candidates`] for a view that does not show the person.
pub const NO_CANDIDATE: u8 = u8::MAX;

/// One person.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ZeroCopySend, Pod, Zeroable)]
#[type_name("PersonMessage.v1")]
#[repr(C)]
pub struct PersonMessage {
    /// The person's id within the run, counted from 1; never reused for another person.
    pub id: u64,
    /// Index of the person among the candidates of every view. [`NO_CANDIDATE`] if the view does not show the person, or if there is no
    /// such view.
    pub candidates: [u8; MAX_VIEWS],
}

/// The people of one frame. The followed person comes first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ZeroCopySend, Pod, Zeroable)]
#[type_name("People.v1")]
#[repr(C)]
pub struct People {
    /// Identity of the frame; `view` is 0.
    pub stamp: Stamp,
    /// Times at which the last input arrived and the message was sent.
    pub timing: Timing,
    /// States whether there is at least one person and, if not, why.
    pub status: Status,
    /// Number of valid people.
    pub n_people: u32,
    /// Number of people on whom several views agree, including people who are not in the list.
    pub n_seen: u32,
    /// Bit `v` is set if the candidates of view `v` arrived in time.
    pub views_present: u32,
    /// The people.
    pub people: [PersonMessage; MAX_PEOPLE],
}

impl Default for People {
    fn default() -> Self {
        Self::zeroed()
    }
}
