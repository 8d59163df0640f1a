//! The data of a view for fusion: its camera, the positions of its cells, and its single-view result.

use std::sync::{Arc, OnceLock};

use fmp::{Layout, Model, Placement, Pose};
use geometry::Camera;
use nalgebra::Point2;

use crate::Settings;

/// A prepared view: camera, pyramid, and the undistorted centre of every cell.
#[derive(Debug)]
pub struct ViewPlan {
    camera: Camera,
    model: Arc<Model>,
    layout: Arc<Layout>,
    /// The distinct filter sizes, `[rows, cols]` in cells.
    sizes: Vec<[usize; 2]>,
    /// The index into `sizes` for every part.
    class_of_part: Vec<usize>,
    /// Undistorted centre of every cell, in pixels: `[class][level]`, row major; NaN if the lens
    /// model has no solution. They are computed at first use, because all levels together take as long as several
    /// frames, and people are found on few levels.
    cells: Vec<Vec<OnceLock<Vec<[f64; 2]>>>>,
}

impl ViewPlan {
    /// Prepares a view.
    ///
    /// A part's centre is the centre of its first type's filter. If the types of a part have filters of different sizes, the centres of the
    /// other types are wrong by at most half the difference in size.
    ///
    /// * `camera`: the camera of the frame from which the pyramid is built, after resizing and
    ///   rotation.
    pub fn new(camera: Camera, model: Arc<Model>, layout: Arc<Layout>) -> Self {
        let mut sizes: Vec<[usize; 2]> = Vec::new();
        let class_of_part = (0..model.n_parts())
            .map(|part| {
                let filter = model.filter(part, 0);
                let size = [filter.rows, filter.cols];
                sizes.iter().position(|other| *other == size).unwrap_or_else(|| {
                    sizes.push(size);
                    sizes.len() - 1
                })
            })
            .collect();
        Self {
            cells: vec![vec![OnceLock::new(); layout.levels.len()]; sizes.len()],
            camera,
            model,
            layout,
            sizes,
            class_of_part,
        }
    }

    /// Returns the camera of the frame.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Returns the pyramid of the frame.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Returns the model.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Returns the size of a cell of a level, in pixels of the frame.
    pub fn scale(&self, level: usize) -> f64 {
        self.layout.levels[level].scale
    }

    /// Returns the undistorted centres of a part at all cells of a level, row major, in pixels.
    pub fn cells(&self, part: usize, level: usize) -> &[[f64; 2]] {
        let class = self.class_of_part[part];
        let make = || undistorted_cells(&self.camera, &self.layout, level, self.sizes[class]);
        self.cells[class][level].get_or_init(make)
    }

    /// Returns the undistorted centre of a part of a pose, in pixels; NaN if the lens model has no solution.
    pub fn ideal_centre(&self, pose: &Pose, part: usize) -> [f64; 2] {
        let level = usize::from(pose.level);
        let at = pose.parts[part];
        let cell = usize::from(at.y) * self.layout.levels[level].cols + usize::from(at.x);
        self.cells(part, level)[cell]
    }

    /// Returns the size of the person in a pose: the longer side of the rectangle around the centres of the
    /// parts, in pixels of the frame.
    pub fn size(&self, pose: &Pose) -> f64 {
        let centres = (0..pose.parts.len()).map(|part| self.centre(pose, part));
        geometry::longer_side(centres).unwrap_or(0.0)
    }

    /// Returns the centre of a part of a pose, in pixels of the frame.
    pub fn centre(&self, pose: &Pose, part: usize) -> [f64; 2] {
        pose.centre(&self.model, &self.layout, part)
    }

    /// Returns the centres of all parts of a pose, in pixels of the frame.
    pub fn centres(&self, pose: &Pose) -> Vec<[f64; 2]> {
        pose.centres(&self.model, &self.layout)
    }
}

fn undistorted_cells(
    camera: &Camera,
    layout: &Layout,
    level: usize,
    size: [usize; 2],
) -> Vec<[f64; 2]> {
    let level_layout = &layout.levels[level];
    (0..level_layout.rows * level_layout.cols)
        .map(|cell| {
            let at = Placement {
                x: (cell % level_layout.cols) as u16,
                y: (cell / level_layout.cols) as u16,
                mixture: 0,
            };
            let [x, y] = layout.centre(level, size, at);
            camera
                .undistorted_px(&Point2::new(x, y))
                .map_or([f64::NAN; 2], |point| [point.x, point.y])
        })
        .collect()
}

/// The single-view result of one view for one frame, without its evidence.
#[derive(Debug, Clone, Copy)]
pub struct ViewInput<'a> {
    /// The prepared view.
    pub plan: &'a ViewPlan,
    /// Distinct candidates of the view, best first; not empty.
    pub candidates: &'a [Pose],
    /// Candidates that show a different person from the other views: bit `c` is set for candidate `c`. Fusion cannot start from them. At
    /// least one bit is 0.
    pub others: u64,
    /// Expected error of every part, in pixels; `None` without a prediction.
    pub sigma_px: Option<&'a [f32]>,
    /// Thresholds that came with the prediction, in pixels; used if [`Settings::tau_px`] and
    /// [`Settings::tau_tenths`] are empty.
    pub tau_px: Option<&'a [f32]>,
}

impl ViewInput<'_> {
    /// Returns true if a candidate shows another person.
    pub(crate) fn is_other(&self, candidate: usize) -> bool {
        candidate < u64::BITS as usize && self.others >> candidate & 1 == 1
    }

    /// Returns the best candidate that does not show another person.
    pub(crate) fn best(&self) -> Option<&Pose> {
        let mut each = self.candidates.iter().enumerate();
        each.find(|candidate| !self.is_other(candidate.0)).map(|candidate| candidate.1)
    }

    /// Returns the expected error and threshold of a part, if both are known.
    pub(crate) fn expectation(&self, settings: &Settings, part: usize) -> Option<[f32; 2]> {
        let sigma = *self.sigma_px?.get(part)?;
        let tau = if !settings.tau_px.is_empty() {
            *settings.tau_px.get(part)?
        } else if !settings.tau_tenths.is_empty() {
            let tenth = self.plan.size(self.best()?) / 10.0;
            *settings.tau_tenths.get(part)? * tenth as f32
        } else {
            *self.tau_px?.get(part)?
        };
        Some([sigma, tau])
    }
}
