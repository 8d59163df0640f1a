//! What every filter answers at every cell: the evidence of one image.

use crate::Layout;

/// Responses of all filters on the levels that are offered.
///
/// The array may lie in shared memory; nothing here copies it.
#[derive(Debug, Clone, Copy)]
pub struct Responses<'a> {
    layout: &'a Layout,
    values: &'a [f32],
    levels: &'a [u16],
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
        }
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
