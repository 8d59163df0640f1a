//! A finished run, which is shown frame by frame from its folder or its recording.

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

/// Largest number of pieces in the time line of a page.
const MOST_PIECES: usize = 600;

/// A finished run.
#[derive(Debug)]
pub(crate) struct Finished {
    /// Path of the folder or of the recording.
    name: String,
    /// Cameras and joints of the run.
    scene: Arc<Scene>,
    /// Frames in ascending order.
    frames: Vec<Frame>,
    /// Remarks for the user.
    notes: Vec<String>,
    kept: Kept,
}

/// Results and pictures of a finished run.
#[derive(Debug)]
enum Kept {
    Folder(Folder),
    Tape(Tape),
}

impl Finished {
    /// Opens the folder of a run, even if the run was cut short.
    ///
    /// # Errors
    ///
    /// Fails if the folder has no result.
    pub(crate) fn folder(path: &Path) -> Result<Self, Failure> {
        Folder::open(path)
    }

    /// Opens a recording, even if it was cut off.
    ///
    /// # Errors
    ///
    /// Fails if the file is not a recording or has no result.
    pub(crate) fn tape(path: &Path) -> Result<Self, Failure> {
        Tape::open(path)
    }

    /// Returns the cameras and joints of the run.
    pub(crate) fn scene(&self) -> Arc<Scene> {
        Arc::clone(&self.scene)
    }

    /// Returns the first message to a page.
    pub(crate) fn hello(&self) -> Value {
        let frames = &self.frames;
        json!({
            "type": "hello", "mode": "finished", "name": self.name, "scene": self.scene.json(),
            "n": frames.len(), "line": pieces(frames), "notes": self.notes,
            "first": frames.first().map(|frame| frame.number), "last": frames.last().map(|frame| frame.number),
        })
    }

    /// Returns a frame.
    ///
    /// * `at`: index of the frame; the last frame if the index is too large.
    ///
    /// # Errors
    ///
    /// Fails if the frame cannot be read.
    pub(crate) fn moment(&self, at: usize) -> Result<Moment, Failure> {
        let at = at.min(self.frames.len() - 1);
        let place = self.frames[at].place;
        let mut moment = match &self.kept {
            Kept::Folder(folder) => folder.moment(&self.scene, place)?,
            Kept::Tape(tape) => tape.moment(&self.scene, place)?,
        };
        moment.at = Some(at);
        Ok(moment)
    }

    /// Returns the picture of a view at a frame ([`crate::picture::message`]), or the last picture before it; `None` if there is no
    /// picture.
    pub(crate) fn picture(&self, frame: u64, view: usize) -> Option<Vec<u8>> {
        match &self.kept {
            Kept::Folder(folder) => folder.picture(frame, view),
            Kept::Tape(tape) => tape.picture(frame, view),
        }
    }
}

/// A frame of a finished run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Frame {
    /// Number of the frame.
    pub number: u64,
    /// True if the frame has a skeleton; `None` if the frame must be read to know this.
    pub has_pose: Option<bool>,
    /// Position of the frame: the offset in bytes in its file, or the number of its message.
    pub place: u64,
}

/// Returns the time line with one character per piece: `1` if all frames have skeletons, `0` if none has, `?` if only some have or it is
/// unknown.
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
    fn a_long_timeline_is_sent_in_few_pieces() {
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
