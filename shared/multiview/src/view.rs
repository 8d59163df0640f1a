//! What a view brings to fusion: its camera, where its cells lie, and its own answer.

use std::sync::{Arc, OnceLock};

use fmp::{Layout, Model, Placement, Pose};
use geometry::Camera;
use nalgebra::Point2;

use crate::Settings;

/// A view prepared once: camera, pyramid, and where every cell's centre lies without lens distortion.
#[derive(Debug)]
pub struct ViewPlan {
    camera: Camera,
    model: Arc<Model>,
    layout: Arc<Layout>,
    /// The sizes of filters, `[rows, cols]` in cells.
    sizes: Vec<[usize; 2]>,
    /// Which of them every part has.
    class_of_part: Vec<usize>,
    /// `[class][level]`: undistorted centre of every cell, row major, pixels; NaN where the lens
    /// model has no answer. Made when it is first asked for: all together they take as long as some frames, and
    /// people are found on few levels.
    cells: Vec<Vec<OnceLock<Vec<[f64; 2]>>>>,
}

impl ViewPlan {
    /// Prepares a view.
    ///
    /// A part's centre is that of its first type's filter; in a model that mixes filter sizes within
    /// one part the others are off by at most half the difference, in cells.
    ///
    /// * `camera`: the camera of the frame that the pyramid was built on, after resizing and turning.
    pub fn new(camera: Camera, model: Arc<Model>, layout: Arc<Layout>) -> Self {
        let mut sizes: Vec<[usize; 2]> = Vec::new();
        let class_of_part = (0..model.n_parts())
            .map(|part| {
                let filter = model.filter(part, 0);
                let size = [filter.rows, filter.cols];
                sizes.iter().position(|it| *it == size).unwrap_or_else(|| {
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

    /// The camera of the frame.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// The pyramid of the frame.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// The model.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Size of a cell of a level, pixels of the frame.
    pub fn scale(&self, level: usize) -> f64 {
        self.layout.levels[level].scale
    }

    /// Undistorted centres of a part at all cells of a level, row major, pixels.
    pub fn cells(&self, part: usize, level: usize) -> &[[f64; 2]] {
        let class = self.class_of_part[part];
        let make = || undistorted_cells(&self.camera, &self.layout, level, self.sizes[class]);
        self.cells[class][level].get_or_init(make)
    }

    /// Undistorted centre of a part of a pose, pixels; NaN where the lens model has no answer.
    pub fn ideal_centre(&self, pose: &Pose, part: usize) -> [f64; 2] {
        let level = usize::from(pose.level);
        let at = pose.parts[part];
        let cell = usize::from(at.y) * self.layout.levels[level].cols + usize::from(at.x);
        self.cells(part, level)[cell]
    }

    /// How large the person of a pose is: the longer side of the rectangle around the centres of its parts, pixels
    /// of the frame.
    pub fn size(&self, pose: &Pose) -> f64 {
        let parts = 0..pose.parts.len();
        let side = |axis: usize| {
            let values = parts.clone().map(|part| self.centre(pose, part)[axis]);
            let [low, high] = values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], it| {
                [low.min(it), high.max(it)]
            });
            high - low
        };
        side(0).max(side(1)).max(0.0)
    }

    /// Centre of a part of a pose, pixels of the frame.
    pub fn centre(&self, pose: &Pose, part: usize) -> [f64; 2] {
        pose.centre(&self.model, &self.layout, part)
    }

    /// Centres of all parts of a pose, pixels of the frame.
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
    let it = &layout.levels[level];
    (0..it.rows * it.cols)
        .map(|cell| {
            let at = Placement {
                x: (cell % it.cols) as u16,
                y: (cell / it.cols) as u16,
                mixture: 0,
            };
            let [x, y] = layout.centre(level, size, at);
            camera
                .undistorted_px(&Point2::new(x, y))
                .map_or([f64::NAN; 2], |point| [point.x, point.y])
        })
        .collect()
}

/// What one view says about one frame, besides its evidence.
#[derive(Debug, Clone, Copy)]
pub struct ViewInput<'a> {
    /// The prepared view.
    pub plan: &'a ViewPlan,
    /// Its distinct candidates, best first; never empty.
    pub candidates: &'a [Pose],
    /// Expected error of every part, pixels; `None` where there is no prediction.
    pub sigma_px: Option<&'a [f32]>,
    /// Thresholds that came with the prediction, pixels; they count where
    /// [`Settings::tau_px`] and [`Settings::tau_tenths`] are empty.
    pub tau_px: Option<&'a [f32]>,
}

impl ViewInput<'_> {
    /// Expected error and threshold of a part, where there are both.
    pub(crate) fn expectation(&self, settings: &Settings, part: usize) -> Option<[f32; 2]> {
        let sigma = *self.sigma_px?.get(part)?;
        let tau = if !settings.tau_px.is_empty() {
            *settings.tau_px.get(part)?
        } else if !settings.tau_tenths.is_empty() {
            let tenth = self.plan.size(self.candidates.first()?) / 10.0;
            *settings.tau_tenths.get(part)? * tenth as f32
        } else {
            *self.tau_px?.get(part)?
        };
        Some([sigma, tau])
    }
}
