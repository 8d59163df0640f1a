//! Bone lengths of one person, learned over a run.

use crate::body::bone::{self, BONES};
use crate::body::proportion::Kind;
use crate::body::verdict::Verdict;
use crate::body::{Joints, N_BONES};

/// Number of most recent frames whose lengths are kept.
pub const MAX_FRAMES: usize = 240;

/// Number of frames after which a length counts as learned.
pub const MIN_FRAMES: usize = 30;

/// Number of successive frames whose errors are so correlated that they count as one frame: half a second at 30 frames per second. The
/// number is our own choice.
const ALIKE: f64 = 15.0;

/// A learned length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Learned {
    /// The length, in metres; a median over frames.
    pub metres: f64,
    /// Standard deviation of that median, in metres. It is the deviation of single frames (from the median absolute deviation) divided by
    /// the square root of their effective number; [`MAX_FRAMES`] frames count as 16.
    pub sd: f64,
}

/// Bone lengths of one person, learned over a run; the left and right bones of a kind share one length.
///
/// For every kind of bone, the lengths from the last [`MAX_FRAMES`] good frames are stored. The same frames in the same order give the same
/// lengths.
#[derive(Debug, Clone, PartialEq)]
pub struct Lengths {
    frames: Vec<Vec<f64>>,
    next: [usize; Kind::ALL.len()],
    learned: [Option<Learned>; Kind::ALL.len()],
}

impl Default for Lengths {
    /// Creates an empty store.
    fn default() -> Self {
        let empty = || Vec::with_capacity(MAX_FRAMES);
        Self {
            frames: Kind::ALL.iter().map(|_kind| empty()).collect(),
            next: [0; Kind::ALL.len()],
            learned: [None; Kind::ALL.len()],
        }
    }
}

impl Lengths {
    /// Forgets all learned lengths.
    pub fn reset(&mut self) {
        self.frames.iter_mut().for_each(Vec::clear);
        self.next = [0; Kind::ALL.len()];
        self.learned = [None; Kind::ALL.len()];
    }

    /// Adds a frame: the bones whose joints the verdict keeps. A skeleton that cannot be a person's adds nothing.
    ///
    /// * `joints`: the triangulated joints, before refinement; refined joints already have the learned lengths.
    /// * `verdict`: result of [`check`](crate::body::check) for these joints.
    pub fn add(&mut self, joints: &Joints, verdict: &Verdict) {
        if verdict.nobody.is_some() {
            return;
        }
        let lengths = bone::lengths(&verdict.keep(joints));
        for kind in Kind::ALL {
            let of_kind = BONES.iter().zip(&lengths).filter(|bone| bone.0.kind == kind);
            let (sum, n) = of_kind
                .filter_map(|bone| *bone.1)
                .fold((0.0, 0.0), |(sum, n), length| (sum + length, n + 1.0));
            if n > 0.0 {
                self.push(kind, sum / n);
            }
        }
    }

    /// Returns the length of a bone after it was seen in at least [`MIN_FRAMES`] frames.
    ///
    /// * `bone`: index in [`BONES`]; `None` is returned if it is out of range.
    pub fn bone(&self, bone: usize) -> Option<Learned> {
        self.of_kind(BONES.get(bone)?.kind)
    }

    /// Returns the number of bones, out of 14, whose length is known.
    pub fn n_learned(&self) -> usize {
        (0..N_BONES).filter(|bone| self.bone(*bone).is_some()).count()
    }

    pub(crate) fn of_kind(&self, kind: Kind) -> Option<Learned> {
        self.learned[kind.index()]
    }

    fn push(&mut self, kind: Kind, length: f64) {
        let i = kind.index();
        let frames = &mut self.frames[i];
        if frames.len() < MAX_FRAMES {
            frames.push(length);
        } else {
            frames[self.next[i]] = length;
        }
        self.next[i] = (self.next[i] + 1) % MAX_FRAMES;
        if frames.len() >= MIN_FRAMES {
            self.learned[i] = Some(learn(frames));
        }
    }
}

fn learn(frames: &[f64]) -> Learned {
    let n = frames.len();
    let mut values = [0.0; MAX_FRAMES];
    let values = &mut values[..n];
    values.copy_from_slice(frames);
    let metres = median(values);
    for value in &mut *values {
        *value = (*value - metres).abs();
    }
    let of_frames = 1.4826 * median(values);
    let sd = 1.2533 * of_frames / (n as f64 / ALIKE).sqrt();
    Learned { metres, sd }
}

/// Returns the upper median; reorders the values.
fn median(values: &mut [f64]) -> f64 {
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

#[cfg(test)]
mod tests;
