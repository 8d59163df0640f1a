//! The feature vector of a pose, as a sparse vector.

use std::sync::Arc;

use fmp::{FeaturePyramid, Pose};
use kernels::{FeatureMap, N_CHANNELS};

use crate::shape::{Coordinates, MIN_STIFFNESS, Shape};
use crate::sparse::{Run, Sparse};

/// The features of a pose: its score with the vector `v` is `features . v + fixed`.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Example {
    /// Features of the pose.
    pub features: Sparse,
    /// The part of the score that comes from the minimum stiffness of the springs, which is not trained.
    pub fixed: f64,
}

impl Example {
    /// Copies the features of a pose from its level.
    ///
    /// # Panics
    ///
    /// Panics if the pose is not on the level.
    pub(crate) fn of(shape: &Shape, at: &Coordinates, map: &FeatureMap<'_>, pose: &Pose) -> Self {
        let runs = pose.parts.iter().enumerate().map(|(part, placed)| {
            let corner = [placed.x, placed.y].map(usize::from);
            let cells = window(map, corner, shape.side);
            (
                at.filter(part, usize::from(placed.mixture)),
                Run::Own(cells),
            )
        });
        Self::with(shape, at, pose, None, runs.collect())
    }

    /// Returns the same as [`Self::of`], but refers to shared features instead of copying them.
    ///
    /// # Panics
    ///
    /// Panics if the pose is not on the pyramid.
    pub(crate) fn sharing(shape: &Shape, at: &Coordinates, pyramid: &Cells, pose: &Pose) -> Self {
        let row_len = shape.side * N_CHANNELS;
        let mut runs = Vec::with_capacity((shape.side + 3) * shape.n_parts());
        for (part, placed) in pose.parts.iter().enumerate() {
            let first = at.filter(part, usize::from(placed.mixture));
            let corner = [placed.x, placed.y].map(usize::from);
            for row in 0..shape.side {
                let run = Run::Shared {
                    at: pyramid.cell(pose.level, [corner[0], corner[1] + row]),
                    len: row_len,
                };
                runs.push((first + row * row_len, run));
            }
        }
        Self::with(shape, at, pose, Some(Arc::clone(&pyramid.cells)), runs)
    }

    /// Adds the features of springs and biases to those of the filters.
    fn with(
        shape: &Shape,
        at: &Coordinates,
        pose: &Pose,
        shared: Option<Arc<[f32]>>,
        mut runs: Vec<(usize, Run)>,
    ) -> Self {
        let mut fixed = 0.0;
        for (part, placed) in pose.parts.iter().enumerate() {
            let mixture = usize::from(placed.mixture);
            let Some(parent) = shape.parents[part] else {
                continue;
            };
            let parent = &pose.parts[parent];
            let anchor = shape.anchors[part][mixture];
            let [dx, dy] = [
                i32::from(parent.x) + anchor[0] - i32::from(placed.x),
                i32::from(parent.y) + anchor[1] - i32::from(placed.y),
            ]
            .map(|value| value as f32);
            let bias = at.bias(part, usize::from(parent.mixture), mixture);
            let quadratic = vec![-dx * dx, -dy * dy];
            runs.push((at.quadratic(part, mixture), Run::Own(quadratic)));
            runs.push((at.linear(part, mixture), Run::Own(vec![-dx, -dy])));
            runs.push((bias, Run::Own(vec![1.0])));
            fixed -= MIN_STIFFNESS * f64::from(dx * dx + dy * dy);
        }
        let (root, value) = at.root();
        runs.push((root, Run::Own(vec![value])));
        runs.sort_unstable_by_key(|run| run.0);
        Self {
            features: Sparse::sharing(shared, runs),
            fixed,
        }
    }
}

/// The features of all levels of an image, in one array.
#[derive(Debug)]
pub(crate) struct Cells {
    cells: Arc<[f32]>,
    /// First index and number of columns of each level.
    levels: Vec<(usize, usize)>,
}

impl Cells {
    /// Computes the features of all levels.
    pub(crate) fn of(pyramid: &FeaturePyramid<'_>, n_levels: usize) -> Self {
        let mut cells = Vec::new();
        let mut levels = Vec::new();
        for level in 0..n_levels {
            let map = pyramid.level(level);
            levels.push((cells.len(), map.cols));
            cells.extend_from_slice(&map.cells[..map.rows * map.cols * N_CHANNELS]);
        }
        Self {
            cells: cells.into(),
            levels,
        }
    }

    /// Memory used by the features, in bytes.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&*self.cells)
    }

    fn cell(&self, level: u16, [x, y]: [usize; 2]) -> usize {
        let (first, cols) = self.levels[usize::from(level)];
        first + (y * cols + x) * N_CHANNELS
    }
}

/// The features under a square filter whose top left cell is `[x, y]`: `side x side x N_CHANNELS`.
///
/// # Panics
///
/// Panics if the filter is not on the map.
pub(crate) fn window(map: &FeatureMap<'_>, [x, y]: [usize; 2], side: usize) -> Vec<f32> {
    let row = |row: usize| {
        let first = ((y + row) * map.cols + x) * N_CHANNELS;
        &map.cells[first..first + side * N_CHANNELS]
    };
    (0..side).flat_map(row).copied().collect()
}
