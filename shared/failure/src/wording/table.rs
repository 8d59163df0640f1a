//! Columns of text, each as wide as its widest cell.

use core::fmt;

/// A table with a line of titles.
///
/// ```
/// let mut table = failure::wording::Table::new(["<camera", "rms, px"]);
/// table.row(["left".to_owned(), "0.31".to_owned()]);
/// assert_eq!(table.to_string(), "camera  rms, px\nleft       0.31");
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Table {
    is_left: Vec<bool>,
    /// Rows of the table; the first row has the titles.
    rows: Vec<Vec<String>>,
}

impl Table {
    /// Creates a table without rows.
    ///
    /// * `titles`: titles of the columns. `<` before a title aligns its column to the left.
    #[must_use]
    pub fn new(titles: impl IntoIterator<Item = impl AsRef<str>>) -> Self {
        let (mut is_left, mut row) = (Vec::new(), Vec::new());
        for title in titles {
            let title = title.as_ref();
            is_left.push(title.starts_with('<'));
            row.push(title.trim_start_matches('<').to_owned());
        }
        Self {
            is_left,
            rows: vec![row],
        }
    }

    /// Adds a row, which may have fewer cells than there are columns.
    pub fn row(&mut self, cells: impl IntoIterator<Item = String>) {
        self.rows.push(cells.into_iter().collect());
    }

    /// Returns the lines, the titles first.
    #[must_use]
    pub fn lines(&self) -> Vec<String> {
        let width = |column: usize| {
            let cells = self.rows.iter().filter_map(|row| row.get(column));
            let widths = cells.map(|cell| cell.chars().count());
            widths.max().unwrap_or(0)
        };
        let n_columns = self.rows.iter().map(Vec::len).max().unwrap_or(0);
        let widths: Vec<usize> = (0..n_columns).map(width).collect();
        let line = |row: &Vec<String>| {
            let cells = row.iter().zip(&widths).enumerate();
            let cells = cells.map(|(column, (cell, &width))| {
                if self.is_left.get(column) == Some(&true) {
                    format!("{cell:<width$}")
                } else {
                    format!("{cell:>width$}")
                }
            });
            let line = cells.collect::<Vec<_>>().join("  ");
            line.trim_end().to_owned()
        };
        self.rows.iter().map(line).collect()
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.lines().join("\n"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_as_wide_as_their_widest_cell_and_short_rows_end_early() {
        let mut table = Table::new(["<who", "p50", "<how"]);
        for row in [&["somebody", "10.25", "by µs"][..], &["x", "1"]] {
            table.row(row.iter().map(|cell| (*cell).to_owned()));
        }
        let lines = [
            "who         p50  how",
            "somebody  10.25  by µs",
            "x             1",
        ];
        assert_eq!(table.lines(), lines);
        assert_eq!(table.to_string(), lines.join("\n"));
    }
}
