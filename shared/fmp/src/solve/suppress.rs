//! Several people in one image: thresholding and non-maximum suppression.

use super::{CandidateSettings, Root, Solver};
use crate::{Layout, Model, Pose, Responses};

/// Maximum number of candidates considered by suppression, as in the reference programs.
const MOST: usize = 1000;

impl Solver {
    /// Returns every pose whose root scores at least the threshold, except those that overlap a better pose.
    ///
    /// The rule is that of the reference programs: the 1000 best candidates are considered, best first, and a candidate is dropped if it
    /// overlaps a selected one by more than `overlap`. To compute the overlap, each box of the selected candidate is compared with the same
    /// box of the other candidate; the boxes are those of all parts, and the rectangle around them. The overlap is the largest fraction of
    /// such a box that is covered. The result is sorted best first; ties are resolved as in [`Self::best`].
    ///
    /// # Panics
    ///
    /// If the evidence belongs to another model.
    pub fn candidates(&self, evidence: &Responses<'_>, settings: &CandidateSettings) -> Vec<Pose> {
        let poses = self.above(evidence, settings.threshold, MOST).into_iter();
        suppress(&self.model, evidence.layout(), poses, settings)
    }

    /// Returns the poses whose root scores at least `threshold`, or only the best `max` of them, sorted best first; ties are resolved as in
    /// [`Self::best`]. Most of these poses are neighbours of other poses: see [`Self::candidates`].
    ///
    /// # Panics
    ///
    /// If the evidence belongs to another model.
    pub fn above(&self, evidence: &Responses<'_>, threshold: f32, max: usize) -> Vec<Pose> {
        let roots = self.sweep_levels(evidence, evidence.levels(), None, |sweep| {
            let roots = sweep.roots();
            roots
                .filter(|root| root.score >= threshold && root.score > f32::NEG_INFINITY)
                .collect::<Vec<_>>()
        });
        let mut roots = roots.concat();
        roots.sort_by(Root::best_first);
        roots.truncate(max);
        let mut levels: Vec<_> = roots.iter().map(|root| root.level).collect();
        levels.sort_unstable();
        levels.dedup();
        let poses = self.sweep_levels(evidence, &levels, None, |sweep| {
            let of_level = roots.iter().enumerate();
            of_level
                .filter(|(_, it)| it.level == sweep.level())
                .filter_map(|(rank, it)| Some((rank, sweep.backtrack(*it)?)))
                .collect::<Vec<_>>()
        });
        let mut poses = poses.concat();
        poses.sort_unstable_by_key(|(rank, _)| *rank);
        poses.into_iter().map(|(_, pose)| pose).collect()
    }
}

impl Root {
    /// Orders by highest score first, then lowest level, then row-major order.
    pub fn best_first(&self, other: &Self) -> std::cmp::Ordering {
        let place = |root: &Self| (root.level, root.y, root.x);
        other.score.total_cmp(&self.score).then_with(|| place(self).cmp(&place(other)))
    }
}

/// Boxes `[x1, y1, x2, y2]` of all parts, then the rectangle around all parts.
type Boxes = Vec<[f64; 4]>;

fn suppress(
    model: &Model,
    layout: &Layout,
    best_first: impl Iterator<Item = Pose>,
    settings: &CandidateSettings,
) -> Vec<Pose> {
    let mut picked: Vec<(Pose, Boxes)> = Vec::new();
    for pose in best_first {
        if picked.len() >= settings.max {
            break;
        }
        let boxes = boxes(model, layout, &pose);
        if picked.iter().all(|(_, it)| overlap(it, &boxes) <= settings.overlap) {
            picked.push((pose, boxes));
        }
    }
    picked.into_iter().map(|(pose, _)| pose).collect()
}

fn boxes(model: &Model, layout: &Layout, pose: &Pose) -> Boxes {
    let mut all: Boxes =
        (0..model.n_parts()).map(|part| pose.part_box(model, layout, part)).collect();
    all.push(pose.bounding_box(model, layout));
    all
}

/// Returns the largest fraction of a selected candidate's box that the other candidate's box covers.
fn overlap(picked: &Boxes, other: &Boxes) -> f64 {
    let share = |(a, b): (&[f64; 4], &[f64; 4])| {
        let side = |low: f64, high: f64| (high - low + 1.0).max(0.0);
        let common = side(a[0].max(b[0]), a[2].min(b[2])) * side(a[1].max(b[1]), a[3].min(b[3]));
        common / (side(a[0], a[2]) * side(a[1], a[3]))
    };
    picked.iter().zip(other).map(share).fold(0.0, f64::max)
}
