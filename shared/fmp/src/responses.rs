//! What every filter answers at every cell: the evidence of one image.

use crate::{Bounds, Layout};

/// Responses of all filters on the levels that are offered.
///
/// The array may lie in shared memory; nothing here copies it.
#[derive(Debug, Clone, Copy)]
pub struct Responses<'a> {
    layout: &'a Layout,
    values: &'a [f32],
    levels: &'a [u16],
    bounds: Option<&'a Bounds>,
}

impl<'a> Responses<'a> {
    /// Views `values` as the responses of `layout`.
    ///
    /// * `values`: [`Layout::n_responses`] scores, `[level][filter][row][col]`.
    /// * `levels`: the levels that hold valid values, ascending.
    ///
    /// # Panics
    ///
    /// If `values` is shorter than the layout, or a level is out of range.
    pub fn new(layout: &'a Layout, values: &'a [f32], levels: &'a [u16]) -> Self {
        assert!(values.len() >= layout.n_responses(), "one value per cell");
        assert!(
            levels
                .iter()
                .all(|&it| usize::from(it) < layout.levels.len()),
            "levels of the layout"
        );
        Self {
            layout,
            values,
            levels,
            bounds: None,
        }
    }

    /// The same, with what [`Solver::bounds`](crate::Solver::bounds) says of them: whoever needs the
    /// bounds then takes these instead of computing them.
    ///
    /// # Panics
    ///
    /// If the bounds are another layout's.
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

    /// The bounds that came with the responses.
    pub fn bounds(&self) -> Option<&'a Bounds> {
        self.bounds
    }

    /// Where the cells lie.
    pub fn layout(&self) -> &'a Layout {
        self.layout
    }

    /// The levels that hold valid values, ascending.
    pub fn levels(&self) -> &'a [u16] {
        self.levels
    }

    /// The response map of a filter, `rows x cols`, row major.
    pub fn map(&self, level: usize, filter: usize) -> &'a [f32] {
        &self.values[self.layout.map_range(level, filter)]
    }
}
