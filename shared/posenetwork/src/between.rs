//! Values of a map between its cells.

/// Four neighbouring cells along an axis, and how much each counts.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Tap {
    cells: [usize; 4],
    weights: [f32; 4],
    pub(crate) is_inside: bool,
}

impl Tap {
    /// Those about a place; beyond the `n` cells of the axis there are none.
    pub(crate) fn at(cell: f64, n: usize) -> Self {
        let is_inside = (-1.0..=n as f64).contains(&cell);
        if !is_inside {
            return Self {
                cells: [0; 4],
                weights: [0.0; 4],
                is_inside,
            };
        }
        // The cell that it lies in or behind: `floor` of a number of at least -1, for processors without an instruction for it.
        let lower = (cell + 1.0) as i64 - 1;
        let first = lower - 1;
        Self {
            cells: [0, 1, 2, 3].map(|it| (first + it).clamp(0, n as i64 - 1) as usize),
            weights: cubic((cell - lower as f64) as f32),
            is_inside,
        }
    }
}

/// The value of a map at a place between its cells (Catmull & Rom 1974); `None` beyond it.
///
/// * `map`: row major; `size` is the number of its columns and rows.
/// * `cell`: column and row, the first cell at 0.
pub fn interpolate(map: &[f32], [columns, rows]: [usize; 2], cell: [f64; 2]) -> Option<f32> {
    let [across, down] = [Tap::at(cell[0], columns), Tap::at(cell[1], rows)];
    (across.is_inside && down.is_inside).then(|| between(map, columns, &down, &across))
}

/// The value of a map between sixteen cells.
pub(crate) fn between(map: &[f32], columns: usize, row: &Tap, column: &Tap) -> f32 {
    let mut sum = 0.0;
    for (down, row_weight) in row.cells.into_iter().zip(row.weights) {
        let line = &map[down * columns..(down + 1) * columns];
        for (across, weight) in column.cells.into_iter().zip(column.weights) {
            sum += row_weight * weight * line[across];
        }
    }
    sum
}

/// Weights of four neighbours for a place between the two in the middle (Catmull & Rom 1974).
fn cubic(t: f32) -> [f32; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [
        0.5 * (-t3 + 2.0 * t2 - t),
        0.5 * (3.0 * t3 - 5.0 * t2 + 2.0),
        0.5 * (-3.0 * t3 + 4.0 * t2 + t),
        0.5 * (t3 - t2),
    ]
}
