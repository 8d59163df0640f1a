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

/// The value of a map between sixteen cells: along each of four rows, then across them.
pub(crate) fn between(map: &[f32], columns: usize, row: &Tap, column: &Tap) -> f32 {
    let [a, b, c, d] = row.cells.map(|it| {
        let line = &map[it * columns..(it + 1) * columns];
        column.along(line)
    });
    let [w_a, w_b, w_c, w_d] = row.weights;
    w_a * a + w_b * b + w_c * c + w_d * d
}

impl Tap {
    /// The value of a line at the place.
    fn along(&self, line: &[f32]) -> f32 {
        let [a, b, c, d] = self.cells;
        let [w_a, w_b, w_c, w_d] = self.weights;
        w_a * line[a] + w_b * line[b] + w_c * line[c] + w_d * line[d]
    }
}

/// The values of a map at the crossings of places down and across, each that of [`between`] to the bit: every row of the map is
/// interpolated once, not for each of the places between which it lies.
///
/// * `map`: row major, `columns` wide.
/// * `lines`: memory that is used again from map to map.
/// * `take`: called for each row of places with its number and its values; those across that are not inside have none.
pub(crate) fn for_each_row(
    map: &[f32],
    columns: usize,
    [across, down]: [&[Tap]; 2],
    lines: &mut Vec<f32>,
    mut take: impl FnMut(usize, Option<&[f32]>),
) {
    let width = across.len();
    let n_rows = map.len().checked_div(columns).unwrap_or(0);
    let needed = down.iter().filter(|it| it.is_inside);
    let cells = needed.flat_map(|it| it.cells);
    let [first, last] = cells.fold([n_rows, 0], |[first, last], it| {
        [first.min(it), last.max(it + 1)]
    });
    // Those of the rows that are needed, then one for the result.
    let n_lines = last.saturating_sub(first);
    lines.resize((n_lines + 1) * width, 0.0);
    let (of_rows, result) = lines.split_at_mut(n_lines * width);
    let rows = map.chunks_exact(columns.max(1)).skip(first);
    for (line, row) in of_rows.chunks_exact_mut(width.max(1)).zip(rows) {
        for (value, tap) in line.iter_mut().zip(across) {
            *value = tap.along(row);
        }
    }
    for (nth, tap) in down.iter().enumerate() {
        if !tap.is_inside {
            take(nth, None);
            continue;
        }
        let [a, b, c, d] = tap.cells.map(|it| {
            let at = (it - first) * width;
            &of_rows[at..at + width]
        });
        let [w_a, w_b, w_c, w_d] = tap.weights;
        for ((((value, a), b), c), d) in result.iter_mut().zip(a).zip(b).zip(c).zip(d) {
            *value = w_a * a + w_b * b + w_c * c + w_d * d;
        }
        take(nth, Some(result));
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_of_places_have_the_values_of_each_place_to_the_bit() {
        let (columns, rows) = (7, 5);
        let map: Vec<f32> = (0..columns * rows)
            .map(|nth| ((nth * 13 + 5) % 17) as f32 * 0.37 - 2.0)
            .collect();
        // From beyond the first cell to beyond the last, and in another order than that of the map.
        let places = |n: usize| -> Vec<f64> {
            let each = (0..40).map(|nth| f64::from(nth * 29 % 40) / 39.0);
            each.map(|it| it * (n as f64 + 4.0) - 2.0).collect()
        };
        let (across, down) = (places(columns), places(rows));
        let taps = |places: &[f64], n: usize| -> Vec<Tap> {
            places.iter().map(|it| Tap::at(*it, n)).collect()
        };
        let of_places = [&taps(&across, columns)[..], &taps(&down, rows)[..]];
        let mut n_compared = 0;
        for_each_row(&map, columns, of_places, &mut Vec::new(), |row, line| {
            for (nth, column) in across.iter().enumerate() {
                let inside = of_places[0][nth].is_inside;
                let got = line.filter(|_| inside).map(|it| it[nth].to_bits());
                let wanted = interpolate(&map, [columns, rows], [*column, down[row]]);
                assert_eq!(got, wanted.map(f32::to_bits), "{column} {}", down[row]);
                n_compared += usize::from(got.is_some());
            }
        });
        assert!(n_compared > 500, "{n_compared}");
        // Nothing is needed where no place is inside.
        let beyond = [&[Tap::at(-9.0, columns)][..], &[Tap::at(-9.0, rows)][..]];
        for_each_row(&map, columns, beyond, &mut Vec::new(), |_, line| {
            assert_eq!(line, None);
        });
    }
}
