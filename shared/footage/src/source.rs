//! Footage, frame by frame.

use crate::{FootageError, Size, SourceSpec};

/// What footage is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SourceKind {
    /// One image, repeated.
    Still,
    /// Images of a folder, glob or numbered pattern.
    Images,
    /// A video.
    Video,
}

/// What is known of footage before its first frame is read.
#[derive(Debug, Clone, PartialEq)]
pub struct SourceInfo {
    /// Size of every frame.
    pub size: Size,
    /// Frames that will be handed out, as far as the footage tells beforehand.
    pub n_frames: Option<u64>,
    /// Frames handed out per second of the scene, where it is known.
    pub frame_rate_hz: Option<f64>,
    /// What it is made of.
    pub kind: SourceKind,
}

/// One frame of footage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameView<'a> {
    /// Index in the footage, from 0: `start + k * step`.
    pub index: u64,
    /// Presentation time, seconds after frame 0 of the footage; `None` where no rate is known.
    pub time_s: Option<f64>,
    /// The pixels, RGB, `width * height * 3` bytes.
    pub rgb: &'a [u8],
}

/// Open footage.
#[derive(Debug)]
pub struct Source {
    info: SourceInfo,
}

impl Source {
    /// Opens footage.
    pub fn open(_spec: &SourceSpec) -> Result<Self, FootageError> {
        todo!()
    }

    /// What is known of it.
    pub fn info(&self) -> &SourceInfo {
        &self.info
    }

    /// The next frame, in a buffer of the source's own; `None` at the end, and ever after.
    pub fn next_frame(&mut self) -> Result<Option<FrameView<'_>>, FootageError> {
        todo!()
    }

    /// The next frame, decoded into `rgb`, `width * height * 3` bytes; `None` at the end, and ever after.
    pub fn next_into<'a>(
        &mut self,
        _rgb: &'a mut [u8],
    ) -> Result<Option<FrameView<'a>>, FootageError> {
        todo!()
    }

    /// Passes over the next `n` frames; returns how many there were.
    pub fn skip(&mut self, _n: u64) -> Result<u64, FootageError> {
        todo!()
    }
}
