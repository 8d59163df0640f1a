//! A finished run, which pages look at frame by frame: its folder, or its recording.

mod folder;
mod tape;

use std::path::Path;
use std::sync::Arc;

use failure::Failure;
use serde_json::{Value, json};

use crate::moment::Moment;
use crate::scene::Scene;
use folder::Folder;
use tape::Tape;

/// Most pieces of the time line that the page gets.
const MOST_PIECES: usize = 600;

/// A finished run.
#[derive(Debug)]
pub(crate) enum Finished {
    /// The folder of its results.
    Folder(Folder),
    /// Its recording.
    Tape(Tape),
}

impl Finished {
    /// Opens the folder of a run, also of one that was cut short.
    ///
    /// # Errors
    ///
    /// There is no result in it.
    pub(crate) fn folder(path: &Path) -> Result<Self, Failure> {
        Folder::open(path).map(Self::Folder)
    }

    /// Opens a recording, also one that was cut off.
    ///
    /// # Errors
    ///
    /// The file is not a recording, or has no result.
    pub(crate) fn tape(path: &Path) -> Result<Self, Failure> {
        Tape::open(path).map(Self::Tape)
    }

    /// Its cameras and joints.
    pub(crate) fn scene(&self) -> Arc<Scene> {
        match self {
            Self::Folder(it) => it.scene(),
            Self::Tape(it) => it.scene(),
        }
    }

    /// Returns the first message to a page.
    pub(crate) fn hello(&self) -> Value {
        let (frames, name, notes) = match self {
            Self::Folder(it) => (it.frames(), it.name(), it.notes()),
            Self::Tape(it) => (it.frames(), it.name(), it.notes()),
        };
        let scene = self.scene();
        json!({
            "type": "hello", "mode": "finished", "name": name, "scene": scene.json(),
            "n": frames.len(), "line": pieces(frames), "notes": notes,
            "first": frames.first().map(|frame| frame.number), "last": frames.last().map(|frame| frame.number),
        })
    }

    /// A frame.
    ///
    /// * `at`: from 0; beyond the end it is the last.
    ///
    /// # Errors
    ///
    /// It cannot be read.
    pub(crate) fn moment(&self, at: usize) -> Result<Moment, Failure> {
        match self {
            Self::Folder(it) => it.moment(at),
            Self::Tape(it) => it.moment(at),
        }
    }

    /// The picture of a view at a frame ([`crate::picture::message`]), or the last one before; none if there is none.
    pub(crate) fn picture(&self, frame: u64, view: usize) -> Option<Vec<u8>> {
        match self {
            Self::Folder(it) => it.picture(frame, view),
            Self::Tape(it) => it.picture(frame, view),
        }
    }
}

/// A frame of a finished run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Frame {
    /// Its number.
    pub number: u64,
    /// True if it has a skeleton, where that is known without reading it.
    pub has_pose: Option<bool>,
    /// Where it lies: bytes from the beginning of its file, or the number of its message.
    pub place: u64,
}

/// The time line in pieces, a letter each: `1` skeletons, `0` none, `?` some, or not known.
fn pieces(frames: &[Frame]) -> String {
    let per = frames.len().div_ceil(MOST_PIECES).max(1);
    let piece = |frames: &[Frame]| {
        let is_all = |has: bool| frames.iter().all(|frame| frame.has_pose == Some(has));
        match (is_all(true), is_all(false)) {
            (true, _) => '1',
            (_, true) => '0',
            _ => '?',
        }
    };
    frames.chunks(per).map(piece).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_time_line_is_told_in_few_pieces() {
        let frame = |number: u64| Frame {
            number,
            has_pose: Some(number < 600),
            place: 0,
        };
        let frames: Vec<Frame> = (0..1201).map(frame).collect();
        let line = pieces(&frames);
        assert_eq!(line.len(), 401);
        assert_eq!(&line[198..202], "1100");
        assert_eq!(pieces(&frames[..2]), "11");
        assert_eq!(pieces(&[]), "");
    }
}
