//! A pose in one image: the position and the type of every part.

use crate::{Layout, Model, Placement};

/// The parts of one person in one image, all at the same level of the pyramid.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Pose {
    /// Value of the maximised energy (eq. 1 of the paper, or eq. 3 as seen from this view).
    pub score: f32,
    /// Level of the pyramid, counted from 0 (full resolution).
    pub level: u16,
    /// One placement per part of the model.
    pub parts: Vec<Placement>,
}

impl Pose {
    /// Returns the centre of a part's box, in pixels of the image; the centre of the top-left pixel is (0, 0).
    pub fn centre(&self, model: &Model, layout: &Layout, part: usize) -> [f64; 2] {
        let placement = self.parts[part];
        let filter = model.filter(part, usize::from(placement.mixture));
        layout.centre(
            usize::from(self.level),
            [filter.rows, filter.cols],
            placement,
        )
    }

    /// Returns the centre of a part, in pixels counted from 1; see [`Layout::centre_from_one`].
    pub fn centre_from_one(&self, model: &Model, layout: &Layout, part: usize) -> [f64; 2] {
        let placement = self.parts[part];
        let filter = model.filter(part, usize::from(placement.mixture));
        let filter = [filter.rows, filter.cols];
        layout.centre_from_one(usize::from(self.level), filter, placement)
    }

    /// Returns the centres of all parts; see [`Self::centre`].
    pub fn centres(&self, model: &Model, layout: &Layout) -> Vec<[f64; 2]> {
        (0..self.parts.len()).map(|part| self.centre(model, layout, part)).collect()
    }

    /// Returns the box `[x1, y1, x2, y2]` of a part, in pixels of the image; both corners belong to the box.
    pub fn part_box(&self, model: &Model, layout: &Layout, part: usize) -> [f64; 4] {
        let placement = self.parts[part];
        let filter = model.filter(part, usize::from(placement.mixture));
        layout.part_box(
            usize::from(self.level),
            [filter.rows, filter.cols],
            placement,
        )
    }

    /// Returns the smallest box `[x1, y1, x2, y2]` around the boxes of all parts; see [`Self::part_box`].
    pub fn bounding_box(&self, model: &Model, layout: &Layout) -> [f64; 4] {
        let boxes = (0..self.parts.len()).map(|part| self.part_box(model, layout, part));
        boxes
            .reduce(|a, b| {
                [
                    a[0].min(b[0]),
                    a[1].min(b[1]),
                    a[2].max(b[2]),
                    a[3].max(b[3]),
                ]
            })
            .unwrap_or_default()
    }
    /// Returns true if the pose is far enough from all others.
    ///
    /// * `min_separation`: minimum mean distance between the part centres of two poses, in units of the mean side of the part boxes of both
    ///   poses.
    pub fn is_apart(
        &self,
        others: &[Self],
        (model, layout): (&Model, &Layout),
        min_separation: f64,
    ) -> bool {
        let separation = |other: &Self| {
            let (mut distances, mut sides) = (0.0, 0.0);
            for part in 0..self.parts.len() {
                let [p, q] = [other, self].map(|pose| pose.centre(model, layout, part));
                distances += (p[0] - q[0]).hypot(p[1] - q[1]);
                for pose in [other, self] {
                    let [x1, y1, x2, y2] = pose.part_box(model, layout, part);
                    sides += f64::midpoint(x2 - x1 + 1.0, y2 - y1 + 1.0);
                }
            }
            distances / (sides / 2.0)
        };
        others.iter().all(|other| separation(other) >= min_separation)
    }
}
