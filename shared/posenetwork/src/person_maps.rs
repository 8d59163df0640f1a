//! The maps of one person with their position in a picture.

use skeleton::PARSE14;

use crate::between::{Tap, between};

/// Minimum evidence above the floor for a cell to count as a maximum.
const LEAST_ABOVE: f32 = 1e-3;

/// Form of the values of a person's maps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum MapKind {
    /// A value for each cell: `[joint][row][column]`.
    #[default]
    Cells,
    /// A [`Peak`] for each joint, from keypoints: `[joint][column, row, evidence, sigma]`.
    Peaks,
}

/// The only maximum of a joint's map: a Gaussian.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Peak {
    /// Column and row, in cells.
    pub cell: [f32; 2],
    /// Evidence at the maximum; the floor if the joint was not found.
    pub evidence: f32,
    /// Standard deviation, in cells.
    pub sigma: f32,
}

impl Peak {
    /// Number of values.
    pub(crate) const LENGTH: usize = 4;

    /// Reads the values of a joint.
    fn read(values: &[f32]) -> Self {
        Self {
            cell: [values[0], values[1]],
            evidence: values[2],
            sigma: values[3],
        }
    }
}

/// Position of the cells of maps in a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapGrid {
    /// Form of the values.
    pub kind: MapKind,
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
        let of_joint = match self.kind {
            MapKind::Cells => self.area(),
            MapKind::Peaks => Peak::LENGTH,
        };
        PARSE14.joints.len() * of_joint
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
    /// * `values`: joints of `skeleton::PARSE14`, in the form of [`MapGrid::kind`].
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

    /// All values, in the form of [`MapGrid::kind`].
    pub fn values(&self) -> &'a [f32] {
        self.values
    }

    /// Evidence where the network sees nothing.
    pub fn floor(&self) -> f32 {
        self.floor
    }

    /// The peaks of all joints; `None` if the maps are given by their cells.
    pub fn peaks(&self) -> Option<impl Iterator<Item = Peak> + 'a> {
        let is_peaks = self.grid.kind == MapKind::Peaks;
        is_peaks.then(|| self.values.chunks_exact(Peak::LENGTH).map(Peak::read))
    }

    /// The map of a joint.
    pub fn map(&self, joint: usize) -> JointMap<'a> {
        let length = self.values.len() / PARSE14.joints.len();
        let values = &self.values[joint * length..(joint + 1) * length];
        let content = match self.grid.kind {
            MapKind::Cells => Content::Cells(values),
            MapKind::Peaks => Content::Peak(PeakInPicture::new(&Peak::read(values), &self.grid)),
        };
        JointMap {
            grid: self.grid,
            content,
            floor: self.floor,
        }
    }

    /// The cells of a joint's map, row by row; none for [`MapKind::Peaks`].
    pub(crate) fn cells(&self, joint: usize) -> &'a [f32] {
        match self.map(joint).content {
            Content::Cells(cells) => cells,
            Content::Peak(_) => &[],
        }
    }

    /// The evidence for a joint at a point of the picture ([`JointMap::at`]).
    pub fn at(&self, joint: usize, point: [f64; 2]) -> f32 {
        self.map(joint).at(point)
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
        let least = self.floor + LEAST_ABOVE;
        let map = match self.map(joint).content {
            Content::Cells(cells) => cells,
            Content::Peak(peak) => {
                let PeakInPicture { at, evidence, .. } = peak;
                let is_there = n > 0 && evidence > least && is_wanted(at);
                return is_there.then_some((at, evidence)).into_iter().collect();
            }
        };
        let [columns, rows] = self.grid.size;
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

/// The map of one joint of a person.
#[derive(Debug, Clone, Copy)]
pub struct JointMap<'a> {
    grid: MapGrid,
    content: Content<'a>,
    floor: f32,
}

#[derive(Debug, Clone, Copy)]
enum Content<'a> {
    /// Row by row.
    Cells(&'a [f32]),
    Peak(PeakInPicture),
}

/// A peak in pixels of the picture.
#[derive(Debug, Clone, Copy)]
struct PeakInPicture {
    at: [f64; 2],
    evidence: f32,
    /// Half of the inverse variance along each axis.
    half_precision: [f64; 2],
    /// Area of the maps: left, top, right, bottom. Outside it, the evidence is the floor.
    area: [f64; 4],
}

impl PeakInPicture {
    fn new(peak: &Peak, grid: &MapGrid) -> Self {
        let [left, top] = grid.place([-1.0; 2]);
        let [right, bottom] = grid.place(grid.size.map(|side| side as f64));
        Self {
            at: grid.place(peak.cell.map(f64::from)),
            evidence: peak.evidence,
            half_precision: grid.cell_px.map(|cell| 0.5 / (cell * f64::from(peak.sigma)).powi(2)),
            area: [left, top, right, bottom],
        }
    }

    /// The logarithm of a Gaussian, but at least the floor.
    fn evidence_at(&self, [x, y]: [f64; 2], floor: f32) -> f32 {
        let [left, top, right, bottom] = self.area;
        let is_inside = x >= left && x <= right && y >= top && y <= bottom;
        if !is_inside {
            return floor;
        }
        let [across, down] = [x - self.at[0], y - self.at[1]];
        let [a, b] = self.half_precision;
        let below = a * across * across + b * down * down;
        ((f64::from(self.evidence) - below) as f32).max(floor)
    }
}

impl JointMap<'_> {
    /// The evidence for the joint at a point of the picture, in pixels. Cells are interpolated, sixteen at a time (Catmull & Rom 1974), so
    /// that a maximum may be between two cells. The evidence of a peak is the logarithm of its Gaussian, and at least the floor. Outside the
    /// maps, the evidence is the floor.
    pub fn at(&self, point: [f64; 2]) -> f32 {
        match &self.content {
            Content::Cells(cells) => {
                let [x, y] = self.grid.cell(point);
                let [columns, rows] = self.grid.size;
                let [across, down] = [Tap::at(x, columns), Tap::at(y, rows)];
                if across.is_inside && down.is_inside {
                    between(cells, columns, &down, &across)
                } else {
                    self.floor
                }
            }
            Content::Peak(peak) => peak.evidence_at(point, self.floor),
        }
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
