//! The best few distinct poses.

use super::{Root, Solver};
use crate::{Bound, Bounds, Pose, Responses};

/// Number of roots that are backtracked together at the first request for a level; it is doubled at each further request.
const BATCH: usize = 16;

impl Solver {
    /// Returns the best `n` poses that are distinct; the first one is [`Self::best`].
    ///
    /// The search is greedy, best first, over the local maxima of the root's scores on every level. A pose is kept
    /// if it is far enough from all poses kept before it.
    ///
    /// * `min_separation`: minimum mean distance between the part centres of two poses, in units of
    ///   the mean side of the boxes of both.
    ///
    /// # Panics
    ///
    /// If the evidence belongs to another model.
    pub fn distinct(&self, evidence: &Responses<'_>, n: usize, min_separation: f64) -> Vec<Pose> {
        self.distinct_and_bounds(evidence, n, min_separation).0
    }

    /// Computes [`Self::distinct`] and [`Self::bounds`] in one pass.
    ///
    /// # Panics
    ///
    /// If the evidence belongs to another model.
    pub fn distinct_and_bounds(
        &self,
        evidence: &Responses<'_>,
        n: usize,
        min_separation: f64,
    ) -> (Vec<Pose>, Bounds) {
        let edges = self.most_of_edges();
        let found = self.sweep_levels(evidence, evidence.levels(), None, |sweep| {
            let roots: Vec<_> = sweep.roots().collect();
            (peaks(&roots), (sweep.level(), Bound::of(sweep, edges)))
        });
        let (peaks, bounds): (Vec<_>, Vec<_>) = found.into_iter().unzip();
        let poses = self.greedy(evidence, peaks.concat(), n, min_separation);
        (
            poses,
            Bounds::of_some(evidence.layout().levels.len(), bounds),
        )
    }

    /// Returns the best `n` of these roots whose poses are far enough from each other.
    fn greedy(
        &self,
        evidence: &Responses<'_>,
        mut peaks: Vec<Root>,
        n: usize,
        min_separation: f64,
    ) -> Vec<Pose> {
        peaks.sort_by(Root::best_first);
        let mut poses: Vec<Option<Pose>> = vec![None; peaks.len()];
        let mut batches = vec![BATCH; evidence.layout().levels.len()];
        let mut kept: Vec<Pose> = Vec::new();
        for at in 0..peaks.len() {
            if kept.len() >= n {
                break;
            }
            if poses[at].is_none() {
                let level = peaks[at].level;
                let batch = &mut batches[usize::from(level)];
                let next: Vec<_> =
                    (at..peaks.len()).filter(|&i| peaks[i].level == level).take(*batch).collect();
                *batch *= 2;
                let found = self.sweep_levels(evidence, &[level], None, |sweep| {
                    let trees = next.iter().map(|&i| (i, sweep.backtrack(peaks[i])));
                    trees.collect::<Vec<_>>()
                });
                for (it, pose) in found.into_iter().flatten() {
                    poses[it] = pose;
                }
            }
            let Some(pose) = poses[at].take() else {
                continue;
            };
            let (model, layout) = (&*self.model, evidence.layout());
            if pose.is_apart(&kept, (model, layout), min_separation) {
                kept.push(pose);
            }
        }
        kept
    }
}

/// Returns the roots that are local maxima: none of the eight neighbours is better, and none before it in the order is equal.
fn peaks(roots: &[Root]) -> Vec<Root> {
    let Some(last) = roots.last() else {
        return Vec::new();
    };
    let (rows, cols) = (last.y + 1, last.x + 1);
    let is_peak = |root: &&Root| {
        let mut around = (root.y.saturating_sub(1)..rows.min(root.y + 2))
            .flat_map(|y| (root.x.saturating_sub(1)..cols.min(root.x + 2)).map(move |x| (y, x)));
        root.score > f32::NEG_INFINITY
            && around.all(|(y, x)| {
                let other = roots[y * cols + x].score;
                other < root.score || (other == root.score && (y, x) >= (root.y, root.x))
            })
    };
    roots.iter().filter(is_peak).copied().collect()
}
