//! The maps of one person with their position in a picture.

use skeleton::PARSE14;

use crate::between::{Tap, between};

/// Minimum evidence above the floor for a cell to count as a maximum.
const LEAST_ABOVE: f32 = 1e-3;

/// Position of the cells of maps in a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapGrid {
    /// Centre of the first cell, in pixels of the picture.
    pub first_px: [f64; 2],
    /// Distance between neighbouring cells, across and down, in pixels of the picture.
    pub cell_px: [f64; 2],
    /// Number of columns and rows.
    pub size: [usize; 2],
}

impl MapGrid {
    /// Number of cells of a map.
    pub fn area(&self) -> usize {
        self.size[0] * self.size[1]
    }

    /// Number of values of the maps of all joints.
    pub fn n_values(&self) -> usize {
        PARSE14.joints.len() * self.area()
    }

    /// Converts a point of the picture to cell coordinates, with fractions.
    pub fn cell(&self, point: [f64; 2]) -> [f64; 2] {
        let along = |axis: usize| (point[axis] - self.first_px[axis]) / self.cell_px[axis];
        [along(0), along(1)]
    }

    /// Converts cell coordinates to a point of the picture, in pixels.
    ///
    /// * `cell`: column and row, with fractions.
    pub fn place(&self, cell: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|axis| self.first_px[axis] + cell[axis] * self.cell_px[axis])
    }
}

/// The maps of one person, as logarithms ([`MapSettings`](crate::MapSettings)), with their position in the picture.
#[derive(Debug, Clone, Copy)]
pub struct PersonMaps<'a> {
    grid: MapGrid,
    values: &'a [f32],
    floor: f32,
}

impl<'a> PersonMaps<'a> {
    /// Wraps the values of maps without changing them.
    ///
    /// * `values`: `[joint][row][column]`, joints of `skeleton::PARSE14`.
    /// * `floor`: evidence where the network sees nothing.
    ///
    /// # Panics
    ///
    /// Panics if the number of values does not match the grid.
    pub fn new(grid: MapGrid, values: &'a [f32], floor: f32) -> Self {
        assert_eq!(values.len(), grid.n_values(), "values of the maps");
        Self {
            grid,
            values,
            floor,
        }
    }

    /// Position of the cells in the picture.
    pub fn grid(&self) -> &MapGrid {
        &self.grid
    }

    /// All values: `[joint][row][column]`.
    pub fn values(&self) -> &'a [f32] {
        self.values
    }

    /// Evidence where the network sees nothing.
    pub fn floor(&self) -> f32 {
        self.floor
    }

    /// The map of a joint, row by row.
    pub fn map(&self, joint: usize) -> &'a [f32] {
        let area = self.grid.area();
        &self.values[joint * area..(joint + 1) * area]
    }

    /// The evidence for a joint at a point of the picture, in pixels. It is interpolated between sixteen cells (Catmull & Rom 1974), so
    /// that a maximum may be between two cells. Outside the maps, the evidence is the floor.
    pub fn at(&self, joint: usize, point: [f64; 2]) -> f32 {
        let [x, y] = self.grid.cell(point);
        let [columns, rows] = self.grid.size;
        let [across, down] = [Tap::at(x, columns), Tap::at(y, rows)];
        if !(across.is_inside && down.is_inside) {
            return self.floor;
        }
        between(self.map(joint), columns, &down, &across)
    }

    /// The highest maxima of a joint's map, the best first: positions in pixels of the picture, and the evidence of their cells. Each
    /// position is the vertex of parabolas through the cell and its neighbours, because the logarithm of a Gaussian is a parabola.
    ///
    /// * `n`: maximum number of maxima.
    /// * `is_wanted`: returns true for positions of maxima that should be included, in pixels of the picture.
    pub fn maxima(
        &self,
        joint: usize,
        n: usize,
        is_wanted: impl Fn([f64; 2]) -> bool,
    ) -> Vec<([f64; 2], f32)> {
        let [columns, rows] = self.grid.size;
        let map = self.map(joint);
        let least = self.floor + LEAST_ABOVE;
        let mut found: Vec<([f64; 2], f32)> = Vec::new();
        for (row, line) in map.chunks_exact(columns.max(1)).enumerate() {
            // Most cells of a map are at the floor.
            let above = line.iter().enumerate().filter(|(_, here)| **here > least);
            for (column, here) in above {
                let mut around = row.saturating_sub(1)..(row + 2).min(rows);
                let beside = column.saturating_sub(1)..(column + 2).min(columns);
                let is_highest = around.all(|row| {
                    let line = &map[row * columns..(row + 1) * columns];
                    line[beside.clone()].iter().all(|other| other <= here)
                });
                if !is_highest {
                    continue;
                }
                let above = row.checked_sub(1).map(|row| map[row * columns + column]);
                let below = map.get((row + 1) * columns + column).copied();
                let left = column.checked_sub(1).map(|column| line[column]);
                let right = line.get(column + 1).copied();
                let away = [vertex(left, *here, right), vertex(above, *here, below)];
                let at = self.grid.place([column as f64 + away[0], row as f64 + away[1]]);
                if is_wanted(at) {
                    found.push((at, *here));
                }
            }
        }
        found.sort_by(|a, b| b.1.total_cmp(&a.1));
        found.truncate(n);
        found
    }
}

/// Vertex of the parabola through a maximum and its neighbours, in cells from the maximum; 0 at an edge.
fn vertex(before: Option<f32>, here: f32, after: Option<f32>) -> f64 {
    let (Some(before), Some(after)) = (before, after) else {
        return 0.0;
    };
    let [before, here, after] = [before, here, after].map(f64::from);
    let bend = before - 2.0 * here + after;
    if bend < 0.0 {
        (0.5 * (before - after) / bend).clamp(-0.5, 0.5)
    } else {
        0.0
    }
}
