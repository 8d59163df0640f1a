//! The scores of every filter at every cell, which are the evidence of one image.

use crate::{Bounds, Layout, Pose, Scope, Window};

/// Responses of all filters on the levels that were made available.
///
/// The array may be in shared memory; it is not copied.
#[derive(Debug, Clone, Copy)]
pub struct Responses<'a> {
    layout: &'a Layout,
    values: &'a [f32],
    levels: &'a [u16],
    scope: Scope,
    bounds: Option<&'a Bounds>,
}

impl<'a> Responses<'a> {
    /// Interprets `values` as the responses of `layout`.
    ///
    /// * `values`: [`Layout::n_responses`] scores, `[level][filter][row][col]`.
    /// * `levels`: the levels with valid values, in ascending order.
    ///
    /// # Panics
    ///
    /// If `values` is shorter than the layout requires, or a level is out of range.
    pub fn new(layout: &'a Layout, values: &'a [f32], levels: &'a [u16]) -> Self {
        Self::within(layout, values, levels, Scope::whole(layout))
    }

    /// Interprets `values` as the responses of a scope. Cells outside the scope have no value, and no pose has
    /// a part there.
    ///
    /// * `values`: [`Layout::n_values`] scores, `[level][filter][row][col]` without gaps.
    /// * `levels`: the levels with valid values, in ascending order.
    ///
    /// # Panics
    ///
    /// If there are fewer values than the scope requires, or a level is outside the scope.
    pub fn within(layout: &'a Layout, values: &'a [f32], levels: &'a [u16], scope: Scope) -> Self {
        assert!(
            values.len() >= layout.n_values(&scope),
            "one value per cell"
        );
        assert!(
            levels.iter().all(|level| scope.levels().contains(level)),
            "levels of the scope"
        );
        Self {
            layout,
            values,
            levels,
            scope,
            bounds: None,
        }
    }

    /// Adds the bounds from [`Solver::bounds`](crate::Solver::bounds), so that they need not be computed again.
    ///
    /// # Panics
    ///
    /// If the bounds belong to another layout.
    #[must_use]
    pub fn with_bounds(self, bounds: &'a Bounds) -> Self {
        assert_eq!(
            bounds.n_levels(),
            self.layout.levels.len(),
            "bounds of this layout"
        );
        Self {
            bounds: Some(bounds),
            ..self
        }
    }

    /// Returns the bounds that came with the responses.
    pub fn bounds(&self) -> Option<&'a Bounds> {
        self.bounds
    }

    /// Returns the layout of the cells.
    pub fn layout(&self) -> &'a Layout {
        self.layout
    }

    /// Returns the levels with valid values, in ascending order.
    pub fn levels(&self) -> &'a [u16] {
        self.levels
    }

    /// Returns the part of the layout that the values cover.
    pub fn scope(&self) -> &Scope {
        &self.scope
    }

    /// Returns the cells of a level that have values.
    pub fn window(&self, level: usize) -> Window {
        self.layout.window(&self.scope, level)
    }

    /// Returns true if every part of a pose is at a cell with a value.
    pub fn covers(&self, pose: &Pose) -> bool {
        self.levels.binary_search(&pose.level).is_ok()
            && self.window(usize::from(pose.level)).contains_all(pose)
    }

    /// Returns the response maps of all filters of a level, one after the other, each with the size of the window,
    /// row major.
    pub fn maps(&self, level: usize) -> &'a [f32] {
        &self.values[self.layout.maps_in(&self.scope, level)]
    }

    /// Returns the response map of a filter: the rows and columns of [`Self::window`], row major.
    pub fn map(&self, level: usize, filter: usize) -> &'a [f32] {
        let maps = self.maps(level);
        let area = maps.len() / self.layout.n_filters;
        &maps[filter * area..][..area]
    }
}
