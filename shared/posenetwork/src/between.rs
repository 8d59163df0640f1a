//! Interpolated values of a map between its cells.

/// Four neighbouring cells along an axis, and their weights.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Tap {
    cells: [usize; 4],
    weights: [f32; 4],
    pub(crate) is_inside: bool,
}

impl Tap {
    /// Returns the four cells around a position, or no cells if the position is outside an axis of `n` cells.
    pub(crate) fn at(cell: f64, n: usize) -> Self {
        let is_inside = (-1.0..=n as f64).contains(&cell);
        if !is_inside {
            return Self {
                cells: [0; 4],
                weights: [0.0; 4],
                is_inside,
            };
        }
        // The cell at or before the position. This computes `floor` for numbers of at least -1, also on processors without an instruction
        // for it.
        let lower = (cell + 1.0) as i64 - 1;
        let mut cells = [0; 4];
        for (cell, at) in cells.iter_mut().zip(lower - 1..) {
            *cell = at.clamp(0, n as i64 - 1) as usize;
        }
        Self {
            cells,
            weights: cubic((cell - lower as f64) as f32),
            is_inside,
        }
    }
}

/// Interpolates a map between sixteen cells: first along each of four rows, then across the rows.
pub(crate) fn between(map: &[f32], columns: usize, row: &Tap, column: &Tap) -> f32 {
    // Loops over arrays are inlined here, unlike `map`.
    let mut values = [0.0; 4];
    for (value, cell) in values.iter_mut().zip(row.cells) {
        *value = column.along(&map[cell * columns..][..columns]);
    }
    let ([a, b, c, d], [w_a, w_b, w_c, w_d]) = (values, row.weights);
    w_a * a + w_b * b + w_c * c + w_d * d
}

impl Tap {
    /// Interpolates along one line.
    fn along(&self, line: &[f32]) -> f32 {
        let [a, b, c, d] = self.cells;
        let [w_a, w_b, w_c, w_d] = self.weights;
        w_a * line[a] + w_b * line[b] + w_c * line[c] + w_d * line[d]
    }
}

/// Weights of four neighbours for a position between the two middle ones (Catmull & Rom 1974).
fn cubic(t: f32) -> [f32; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [
        0.5 * (-t3 + 2.0 * t2 - t),
        0.5 * (3.0 * t3 - 5.0 * t2 + 2.0),
        0.5 * (-3.0 * t3 + 4.0 * t2 + t),
        0.5 * (t3 - t2),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_interpolates_linearly_between_its_cells() {
        let (columns, rows) = (7, 5);
        let plane = |x: f64, y: f64| (0.5 * x - 0.3 * y) as f32;
        let map: Vec<f32> = (0..columns * rows)
            .map(|cell| plane((cell % columns) as f64, (cell / columns) as f64))
            .collect();
        let at = |x: f64, y: f64| {
            let [across, down] = [Tap::at(x, columns), Tap::at(y, rows)];
            assert!(across.is_inside && down.is_inside);
            between(&map, columns, &down, &across)
        };
        for (x, y) in [(2.0, 3.0), (2.25, 1.5), (4.9, 2.0)] {
            assert!((at(x, y) - plane(x, y)).abs() < 1e-5, "{x} {y}");
        }
        assert!(!Tap::at(-1.01, columns).is_inside && !Tap::at(7.01, columns).is_inside);
        assert!(!Tap::at(f64::NAN, columns).is_inside);
    }
}
