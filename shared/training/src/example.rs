//! What a placed pose looks like to the trainer: a sparse vector.

use fmp::{FeaturePyramid, Pose};
use kernels::{FeatureMap, N_CHANNELS};

use crate::shape::{Coordinates, MIN_STIFFNESS, Shape};
use crate::sparse::Sparse;

/// A pose as the trainer sees it: its score under the vector `v` is `features . v + fixed`.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Example {
    /// Features.
    pub features: Sparse,
    /// What the least stiffness, which is not trained, adds to the score.
    pub fixed: f64,
}

impl Example {
    /// Reads the features of a pose off its pyramid.
    ///
    /// # Panics
    ///
    /// If the pose does not lie on the pyramid.
    pub(crate) fn of(
        shape: &Shape,
        at: &Coordinates,
        pyramid: &FeaturePyramid<'_>,
        pose: &Pose,
    ) -> Self {
        let map = pyramid.level(usize::from(pose.level));
        let mut runs: Vec<(usize, Vec<f32>)> = Vec::with_capacity(4 * shape.n_parts());
        let mut fixed = 0.0;
        for (part, placed) in pose.parts.iter().enumerate() {
            let (x, y) = (usize::from(placed.x), usize::from(placed.y));
            let mixture = usize::from(placed.mixture);
            let cells = window(&map, [x, y], shape.side);
            runs.push((at.filter(part, mixture), cells));
            let Some(parent) = shape.parents[part] else {
                continue;
            };
            let parent = &pose.parts[parent];
            let anchor = shape.anchors[part][mixture];
            let [dx, dy] = [
                i32::from(parent.x) + anchor[0] - i32::from(placed.x),
                i32::from(parent.y) + anchor[1] - i32::from(placed.y),
            ]
            .map(|it| it as f32);
            runs.push((at.quadratic(part, mixture), vec![-dx * dx, -dy * dy]));
            runs.push((at.linear(part, mixture), vec![-dx, -dy]));
            let bias = at.bias(part, usize::from(parent.mixture), mixture);
            runs.push((bias, vec![1.0]));
            fixed -= MIN_STIFFNESS * f64::from(dx * dx + dy * dy);
        }
        let (root, value) = at.root();
        runs.push((root, vec![value]));
        runs.sort_unstable_by_key(|it| it.0);
        Self {
            features: Sparse::new(runs),
            fixed,
        }
    }
}

/// The features under a square filter whose top left cell is `[x, y]`: `side x side x N_CHANNELS`.
///
/// # Panics
///
/// If the filter does not lie on the map.
pub(crate) fn window(map: &FeatureMap<'_>, [x, y]: [usize; 2], side: usize) -> Vec<f32> {
    let row = |row: usize| {
        let first = ((y + row) * map.cols + x) * N_CHANNELS;
        &map.cells[first..first + side * N_CHANNELS]
    };
    (0..side).flat_map(row).copied().collect()
}
