//! The common form of all data sets.

use geometry::Rig;
use skeleton::JointSet;
use statistics::score::Point;

/// One person doing one action in front of one rig.
#[derive(Debug, Clone, PartialEq)]
pub struct Sequence {
    /// Name, different for all sequences of a data set: `S1 Walking`.
    pub name: String,
    /// Name of the data set: `HumanEva`, `UMPM`, `synthetic`, or that of a description.
    pub dataset: String,
    /// Name of the subject: `S1`; may be empty.
    pub subject: String,
    /// Name of the action: `Walking`; the paper's tables have a row for each.
    pub action: String,
    /// The calibrated cameras, in the order of the views.
    pub rig: Rig,
    /// The footage, one for each camera.
    pub views: Vec<View>,
    /// Frames per second of the footage.
    pub frame_rate_hz: Option<f64>,
    /// The set of the true joints.
    pub joints: &'static JointSet,
    /// The frames that are evaluated, ascending.
    pub frames: Vec<Frame>,
}

/// The footage of one camera.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct View {
    /// Name of the camera in the rig.
    pub camera: String,
    /// The footage to open: a video, a folder of images, a pattern.
    pub source: String,
    /// Frame of the footage (from 0) that is frame 0 of the sequence.
    pub first: u64,
    /// The calibrated pixel of the footage's top-left pixel, if it lacks rows or columns.
    pub source_offset_px: Option<[u32; 2]>,
}

/// One instant.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Number in the data set.
    pub number: u64,
    /// Frame of the sequence, from 0: [`View::first`] plus this is the frame of the footage.
    pub index: u64,
    /// The joints of the sequence's joint set, metres; `None` where one is unknown.
    pub joints: Vec<Option<Point>>,
}

/// How the frames of UMPM correspond to its motion capture, which is twice as fast.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Alignment {
    /// The first frame corresponds to the first pose, as documented by the data set.
    #[default]
    Direct,
    /// Every frame corresponds to the pose of the frame before it: as computed by the tool that was
    /// released with the paper, apparently by mistake.
    OneLate,
}

/// Options for reading sequences.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Options {
    /// The alignment of UMPM.
    pub alignment: Alignment,
    /// Which share of the frames to read, from and to, 0..1; all if not set.
    pub share: Option<[f64; 2]>,
}

impl Options {
    /// The chosen range of `n` frames.
    pub(crate) fn range(&self, n: usize) -> std::ops::Range<usize> {
        let [from, to] = self.share.unwrap_or([0.0, 1.0]);
        let at = |share: f64| ((share.clamp(0.0, 1.0) * n as f64).round() as usize).min(n);
        at(from)..at(to).max(at(from))
    }
}

impl Sequence {
    /// Keeps some of the frames.
    ///
    /// * `every`: the distance between frames, from the first.
    /// * `most`: the largest number of frames.
    pub fn thin_out(&mut self, every: usize, most: Option<usize>) {
        let kept = std::mem::take(&mut self.frames).into_iter();
        let kept = kept.step_by(every.max(1));
        self.frames = kept.take(most.unwrap_or(usize::MAX)).collect();
    }
}
