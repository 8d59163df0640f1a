//! Assigns rows to columns at the lowest total cost, each row to at most one column.

/// Cost of a forbidden pair.
pub(crate) const NEVER: f64 = 1e6;

/// Assigns rows to columns so that the sum of the costs is minimal.
///
/// Uses shortest augmenting paths (Jonker & Volgenant 1987); the run time is cubic in the larger side of the matrix.
///
/// * `cost`: function that returns the cost of a row and a column, at least 0; [`NEVER`] or more if the pair is forbidden.
/// * Returns the column of every row; `None` for an unassigned row.
pub(crate) fn assign(
    n_rows: usize,
    n_columns: usize,
    cost: impl Fn(usize, usize) -> f64,
) -> Vec<Option<usize>> {
    // The matrix is padded to a square; padding costs as much as a forbidden pair.
    let n = n_rows.max(n_columns);
    let cost = |row: usize, column: usize| {
        if row < n_rows && column < n_columns {
            cost(row, column).min(NEVER)
        } else {
            NEVER
        }
    };
    let mut potentials = Potentials {
        rows: vec![0.0; n],
        columns: vec![0.0; n + 1],
    };
    // Column `n` represents the row that is being added.
    let mut row_of: Vec<Option<usize>> = vec![None; n + 1];
    for row in 0..n {
        row_of[n] = Some(row);
        augment(&mut potentials, &mut row_of, n, cost);
    }
    let mut assigned = vec![None; n_rows];
    for (column, row) in row_of.iter().take(n_columns).enumerate() {
        if let Some(row) = row.filter(|row| *row < n_rows && cost(*row, column) < NEVER) {
            assigned[row] = Some(column);
        }
    }
    assigned
}

/// The dual solution.
struct Potentials {
    rows: Vec<f64>,
    columns: Vec<f64>,
}

/// Finds the shortest path from the row of column `n` to a free column, and shifts the assignments along it.
fn augment(
    potentials: &mut Potentials,
    row_of: &mut [Option<usize>],
    n: usize,
    cost: impl Fn(usize, usize) -> f64,
) {
    let mut least = vec![f64::INFINITY; n];
    let mut from = vec![n; n];
    let mut is_done = vec![false; n + 1];
    let mut at = n;
    while let Some(row) = row_of[at] {
        is_done[at] = true;
        let mut next = (f64::INFINITY, n);
        for column in (0..n).filter(|column| !is_done[*column]) {
            let reduced = cost(row, column) - potentials.rows[row] - potentials.columns[column];
            if reduced < least[column] {
                (least[column], from[column]) = (reduced, at);
            }
            if least[column] < next.0 {
                next = (least[column], column);
            }
        }
        let (step, column) = next;
        for done in 0..=n {
            if is_done[done] {
                if let Some(row) = row_of[done] {
                    potentials.rows[row] += step;
                }
                potentials.columns[done] -= step;
            } else if done < n {
                least[done] -= step;
            }
        }
        at = column;
        if at == n {
            return;
        }
    }
    while at != n {
        row_of[at] = row_of[from[at]];
        at = from[at];
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn total(costs: &[Vec<f64>], assigned: &[Option<usize>]) -> f64 {
        let each = costs.iter().zip(assigned);
        each.map(|(row, column)| column.map_or(NEVER, |column| row[column])).sum()
    }

    /// Returns the smallest total cost over all assignments of the rows from `row` on.
    fn least(costs: &[Vec<f64>], row: usize, taken: u32) -> f64 {
        let Some(own) = costs.get(row) else {
            return 0.0;
        };
        let free = (0..own.len()).filter(|column| taken >> column & 1 == 0);
        let with = free.map(|column| own[column] + least(costs, row + 1, taken | 1 << column));
        with.fold(NEVER + least(costs, row + 1, taken), f64::min)
    }

    proptest! {
        #[test]
        fn no_other_assignment_costs_less(
            (n_rows, n_columns) in (0_usize..5, 0_usize..5),
            costs in prop::collection::vec(prop_oneof![3 => 0.0..1.0, 1 => Just(NEVER)], 25),
        ) {
            let costs: Vec<Vec<f64>> = costs.chunks(5).take(n_rows).map(|row| row[..n_columns].to_vec()).collect();
            let assigned = assign(n_rows, n_columns, |row, column| costs[row][column]);
            let mut columns: Vec<usize> = assigned.iter().flatten().copied().collect();
            columns.sort_unstable();
            columns.dedup();
            prop_assert_eq!(columns.len(), assigned.iter().flatten().count(), "a column has one row");
            prop_assert!((total(&costs, &assigned) - least(&costs, 0, 0)).abs() < 1e-6);
        }
    }

    #[test]
    fn a_forbidden_pair_is_never_assigned() {
        let assigned = assign(2, 1, |row, _| [NEVER, 0.5][row]);
        assert_eq!(assigned, [None, Some(0)]);
    }
}
