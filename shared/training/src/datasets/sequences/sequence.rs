//! The common form of all data sets.

use geometry::Rig;
use skeleton::JointSet;
use statistics::score::Point;

/// A sequence of one person doing one action in front of one rig.
#[derive(Debug, Clone, PartialEq)]
pub struct Sequence {
    /// Name of the sequence, unique in the data set: `S1 Walking`.
    pub name: String,
    /// Name of the data set: `HumanEva`, `UMPM`, `synthetic`, or a name from a description.
    pub dataset: String,
    /// Name of the subject: `S1`; may be empty.
    pub subject: String,
    /// Name of the action: `Walking`; the paper's tables have a row for each action.
    pub action: String,
    /// The calibrated cameras, in the order of the views.
    pub rig: Rig,
    /// The footage, one item for each camera.
    pub views: Vec<View>,
    /// Frames per second of the footage.
    pub frame_rate_hz: Option<f64>,
    /// Names of the true joints.
    pub joints: &'static JointSet,
    /// The frames to evaluate, in ascending order.
    pub frames: Vec<Frame>,
}

/// The footage of one camera.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct View {
    /// Name of the camera in the rig.
    pub camera: String,
    /// The footage to open: a video, a folder of images, or a pattern.
    pub source: String,
    /// Number of the footage's frame (from 0) that is frame 0 of the sequence.
    pub first: u64,
    /// Position of the footage's top-left pixel in the calibrated image, if the footage is a part of that image.
    pub source_offset_px: Option<[u32; 2]>,
}

/// One frame of a sequence.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Number of the frame in the data set.
    pub number: u64,
    /// Index of the frame in the sequence, from 0. [`View::first`] plus this index is the frame of the footage.
    pub index: u64,
    /// The joints of the sequence's joint set, in metres; `None` if a joint is unknown.
    pub joints: Vec<Option<Point>>,
}

/// Alignment of UMPM's frames with its motion capture, which has twice the rate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Alignment {
    /// The first frame corresponds to the first pose, as the documentation of the data set says.
    #[default]
    Direct,
    /// Every frame is combined with the pose of the frame before it. The tool released with the paper does this, apparently by mistake.
    OneLate,
}

/// Options for reading sequences.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Options {
    /// The alignment of UMPM.
    pub alignment: Alignment,
    /// Share of the frames to read, as start and end from 0 to 1; all if `None`.
    pub share: Option<[f64; 2]>,
}

impl Options {
    /// The range of frames to read, for a sequence of `n` frames.
    pub(crate) fn range(&self, n: usize) -> std::ops::Range<usize> {
        let [from, to] = self.share.unwrap_or([0.0, 1.0]);
        let at = |share: f64| ((share.clamp(0.0, 1.0) * n as f64).round() as usize).min(n);
        at(from)..at(to).max(at(from))
    }
}

impl Sequence {
    /// Keeps a part of the frames.
    ///
    /// * `every`: keeps the first frame and every `every`-th frame after it.
    /// * `most`: maximum number of frames.
    pub fn thin_out(&mut self, every: usize, most: Option<usize>) {
        let kept = std::mem::take(&mut self.frames).into_iter();
        let kept = kept.step_by(every.max(1));
        self.frames = kept.take(most.unwrap_or(usize::MAX)).collect();
    }
}
