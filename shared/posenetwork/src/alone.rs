//! The pose of one person by the maps of that person alone.

use fmp::{Layout, Pose, Region, Responses, Scope, Solver};

use crate::maps::JointMaps;
use crate::springs::WINDOW_CELLS;

impl JointMaps {
    /// The level of a pyramid whose cells are nearest to those that the springs were learned with.
    pub fn level(&self, layout: &Layout) -> u16 {
        let [_, top, _, bottom] = self.extent();
        let cell = (bottom - top) / WINDOW_CELLS;
        let distance = |level: usize| (layout.levels[level].scale / cell).ln().abs();
        let levels = 0..layout.levels.len();
        let nearest = levels.min_by(|a, b| distance(*a).total_cmp(&distance(*b)));
        nearest.unwrap_or(0) as u16
    }

    /// The pixels of the picture that the maps cover; `None` if they lie beyond it.
    pub fn region(&self, layout: &Layout) -> Option<Region> {
        let [left, top, right, bottom] = self.extent();
        let along = |from: f64, to: f64, side: usize| {
            let from = from.floor().clamp(0.0, side as f64) as u32;
            let to = to.ceil().clamp(0.0, side as f64) as u32;
            (from < to).then_some([from, to])
        };
        let [width, height] = layout.image_size;
        Some(Region {
            x: along(left, right, width)?,
            y: along(top, bottom, height)?,
        })
    }

    /// The best pose of a tree of [`springs`](crate::springs) over these maps, on their own level; `None` if they lie beyond the
    /// picture.
    ///
    /// * `layout`: of the picture, for that tree.
    /// * `responses`: memory that is used again.
    pub fn pose(
        &mut self,
        solver: &Solver,
        layout: &Layout,
        responses: &mut Vec<f32>,
    ) -> Option<Pose> {
        let level = self.level(layout);
        let scope = Scope::new(layout, level..level + 1, self.region(layout)?).ok()?;
        responses.resize(layout.n_values(&scope), 0.0);
        self.fill(layout, &scope, responses);
        let levels = [level];
        solver.best(&Responses::within(layout, responses, &levels, scope), None)
    }
}
