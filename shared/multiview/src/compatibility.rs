//! Compatibility of the types of a part in two views, learned from training images.

use nalgebra::{DMatrix, DVector};

/// A value for every part and pair of types, `[part][type in first view][type in second view]`.
#[derive(Debug, Clone, PartialEq)]
pub struct Compatibility {
    values: Vec<DMatrix<f64>>,
    n_unseen: usize,
}

/// Reason why a table was rejected.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CompatibilityError {
    /// The number of rows differs from the total number of types of all parts of the model.
    #[error("the table has {got} rows, expected {expected}, one for each part and type")]
    Rows {
        /// Number of rows found.
        got: usize,
        /// Number of types of all parts together.
        expected: usize,
    },
    /// The length of a row differs from the number of types of the part.
    #[error(
        "line {line} has {got} columns, expected {expected}: one for the part, and one for each type"
    )]
    Columns {
        /// Line number, counted from 1.
        line: usize,
        /// Number of columns found.
        got: usize,
        /// Expected number of columns.
        expected: usize,
    },
    /// The parts are not listed in order.
    #[error("line {line}, column 1: part `{got}`, expected {expected}")]
    Part {
        /// Line number, counted from 1.
        line: usize,
        /// The field found.
        got: String,
        /// The expected part, counted from 1.
        expected: usize,
    },
    /// A field is not a probability, although some values of its row are not NaN.
    #[error("line {line}, column {column}: `{got}` is not a probability from 0 to 1")]
    Probability {
        /// Line number, counted from 1.
        line: usize,
        /// Column number, counted from 1.
        column: usize,
        /// The field found.
        got: String,
    },
    /// The probabilities of a row do not sum to 1.
    #[error("line {line}: the sum of the probabilities is {sum}, expected 1")]
    Sum {
        /// Line number, counted from 1.
        line: usize,
        /// Sum of the probabilities.
        sum: f64,
    },
    /// Two tables belong to different models.
    #[error(
        "the two tables must have the same number of types per part, but they have {first:?} and {second:?}"
    )]
    Shape {
        /// Number of types of every part in the first table.
        first: Vec<usize>,
        /// Number of types of every part in the second table.
        second: Vec<usize>,
    },
}

impl Compatibility {
    /// Reads a table in the authors' format: conditional probabilities, without a header.
    ///
    /// The table has one line for each part and each of its types in the *first* view, ordered by part, then by type. A line contains the
    /// part's number, counted from 1, and then `p(type in second view | type in first view)` for every type of the second view, separated
    /// by commas. A type of the first view that did not occur in training has a line of NaN or of zeros. Such a line is read as zeros,
    /// which add nothing to any score, and counted by [`Self::n_unseen`].
    ///
    /// * `n_types`: number of types of every part.
    ///
    /// # Errors
    ///
    /// [`CompatibilityError`], naming line and column.
    pub fn parse(text: &str, n_types: &[usize]) -> Result<Self, CompatibilityError> {
        let lines = text.lines().enumerate();
        let rows: Vec<(usize, &str)> = lines
            .map(|(idx, line)| (idx + 1, line.trim()))
            .filter(|(_, line)| !line.is_empty())
            .collect();
        let expected: usize = n_types.iter().sum();
        if rows.len() != expected {
            return Err(CompatibilityError::Rows {
                got: rows.len(),
                expected,
            });
        }
        let mut rows = rows.into_iter();
        let mut table = Self {
            values: Vec::with_capacity(n_types.len()),
            n_unseen: 0,
        };
        for (part_idx, &n) in n_types.iter().enumerate() {
            let mut values = DMatrix::zeros(n, n);
            for (first, (line, row)) in rows.by_ref().take(n).enumerate() {
                match parse_row(line, row, part_idx + 1, n)? {
                    Some(row) => values.row_mut(first).copy_from_slice(&row),
                    None => table.n_unseen += 1,
                }
            }
            table.values.push(values);
        }
        Ok(table)
    }

    /// Computes `p(type in first view, type in second view)` from both conditionals.
    ///
    /// With `R = p(b | a)` and `Q = p(a | b)`, the marginal `p(a)` satisfies `p(a) = p(a) R Q`. It is the stationary distribution of the
    /// chain that goes from a type of the first view to a type of the second view and back. Then `p(b) = p(a) R`, and both `p(a) R` and
    /// `p(b) Q` are the joint distribution. If the tables contradict each other, these two joint distributions differ, although they have
    /// the same marginals; the result is their mean. Types that did not occur get 0.
    ///
    /// If the types form groups that never occur together, the tables do not determine the
    /// frequency of the groups. Every group is then weighted by its number of types in the first
    /// view.
    ///
    /// * `second_given_first`: `p(b | a)`, `[part][a][b]`; `first_given_second`: `p(a | b)`,
    ///   `[part][b][a]`, as [`Self::parse`] reads them from the two files of a pair.
    /// * Returns the joint distribution, which sums to 1 for every part that occurred. Also returns the largest total variation distance
    ///   between the two joint distributions of a part: 0 if the tables agree, at most 1.
    ///
    /// # Errors
    ///
    /// [`CompatibilityError::Shape`]
    pub fn joint_from_conditionals(
        second_given_first: &Self,
        first_given_second: &Self,
    ) -> Result<(Self, f64), CompatibilityError> {
        let [first, second] = [second_given_first, first_given_second].map(Self::n_types);
        if first != second {
            return Err(CompatibilityError::Shape { first, second });
        }
        let mut disagreement = 0.0_f64;
        let pairs = second_given_first.values.iter();
        let values = pairs
            .zip(&first_given_second.values)
            .map(|(second, first)| {
                let [one, other] = joints(second, first);
                disagreement = disagreement.max((&one - &other).abs().sum() / 2.0);
                (one + other) / 2.0
            })
            .collect();
        Ok((Self::of(values), disagreement))
    }

    /// Returns the entry of a part for a pair of types; 0 if it is unknown.
    ///
    /// # Panics
    ///
    /// If the part or one of the types is out of range.
    pub fn value(&self, part: usize, first: usize, second: usize) -> f64 {
        self.values[part][(first, second)]
    }

    /// Returns the number of types of every part.
    pub fn n_types(&self) -> Vec<usize> {
        self.values.iter().map(DMatrix::nrows).collect()
    }

    /// Returns the number of types of the first view, over all parts, that did not occur in training.
    pub fn n_unseen(&self) -> usize {
        self.n_unseen
    }

    /// Returns the table with the two views in the opposite order.
    #[must_use]
    pub fn transposed(&self) -> Self {
        Self::of(self.values.iter().map(DMatrix::transpose).collect())
    }

    /// Returns the table whose part `i` is part `parts[i]` of this table.
    pub(crate) fn permuted(&self, parts: &[usize]) -> Self {
        Self::of(parts.iter().map(|&part| self.values[part].clone()).collect())
    }

    /// Returns `p(type in second view | type in first view)` for a joint table.
    #[must_use]
    pub fn conditional(&self) -> Self {
        let normalised = |matrix: &DMatrix<f64>| normalise_rows(matrix.clone());
        Self::of(self.values.iter().map(normalised).collect())
    }

    /// Creates a table from one matrix per part: rows are types in the first view.
    pub fn of(values: Vec<DMatrix<f64>>) -> Self {
        let unseen =
            |matrix: &DMatrix<f64>| matrix.row_iter().filter(|row| row.sum() <= 0.0).count();
        Self {
            n_unseen: values.iter().map(unseen).sum(),
            values,
        }
    }
}

/// Maximum deviation from 1 that rounding to five digits may cause in the sum of a row.
const ROUNDING: f64 = 1e-3;

/// Reads one row; `None` if its type did not occur in training.
fn parse_row(
    line: usize,
    row: &str,
    part: usize,
    n_types: usize,
) -> Result<Option<Vec<f64>>, CompatibilityError> {
    let fields: Vec<&str> = row.split(',').map(str::trim).collect();
    if fields.len() != n_types + 1 {
        return Err(CompatibilityError::Columns {
            line,
            got: fields.len(),
            expected: n_types + 1,
        });
    }
    if fields[0].parse() != Ok(part) {
        return Err(CompatibilityError::Part {
            line,
            got: shortened(fields[0]),
            expected: part,
        });
    }
    let probabilities = &fields[1..];
    if probabilities.iter().all(|field| field.eq_ignore_ascii_case("nan")) {
        return Ok(None);
    }
    let mut values = Vec::with_capacity(n_types);
    for (idx, field) in probabilities.iter().enumerate() {
        match field.parse() {
            Ok(value) if (0.0..=1.0).contains(&value) => values.push(value),
            _ => {
                return Err(CompatibilityError::Probability {
                    line,
                    column: idx + 2,
                    got: shortened(field),
                });
            }
        }
    }
    let sum: f64 = values.iter().sum();
    if sum == 0.0 {
        return Ok(None);
    }
    if (sum - 1.0).abs() > ROUNDING {
        return Err(CompatibilityError::Sum { line, sum });
    }
    Ok(Some(values))
}

fn shortened(field: &str) -> String {
    field.chars().take(24).collect()
}

/// Returns the joint distribution `[a, b]`, computed twice: from `second = p(b | a)` and from `first = p(a | b)`.
fn joints(second: &DMatrix<f64>, first: &DMatrix<f64>) -> [DMatrix<f64>; 2] {
    let (second, first) = without_unseen(second.clone(), first.clone());
    let n = second.nrows();
    let seen = DVector::from_fn(n, |a, _| f64::from(second.row(a).sum() > 0.0));
    if seen.sum() == 0.0 {
        return [DMatrix::zeros(n, n), DMatrix::zeros(n, n)];
    }
    // Half of the probability stays in place in every step, so that the chain cannot oscillate. By squaring,
    // 64 rounds take 2^64 steps.
    let mut steps = normalise_rows((&second * &first + DMatrix::identity(n, n)) / 2.0);
    for _ in 0..64 {
        steps = normalise_rows(&steps * &steps);
    }
    let of_first = steps.tr_mul(&(&seen / seen.sum()));
    let of_second = second.tr_mul(&of_first);
    [
        DMatrix::from_diagonal(&of_first) * second,
        (DMatrix::from_diagonal(&of_second) * first).transpose(),
    ]
}

/// Makes the tables agree on which types occur, and normalises their rows.
fn without_unseen(
    mut second: DMatrix<f64>,
    mut first: DMatrix<f64>,
) -> (DMatrix<f64>, DMatrix<f64>) {
    // Every round removes at least one type, until none is left to remove.
    for _ in 0..2 * second.nrows() {
        clear_unseen(&first, &mut second);
        clear_unseen(&second, &mut first);
    }
    (normalise_rows(second), normalise_rows(first))
}

/// Clears every column of `to` whose row in `from` is empty.
fn clear_unseen(from: &DMatrix<f64>, to: &mut DMatrix<f64>) {
    for (idx, row) in from.row_iter().enumerate() {
        if row.sum() <= 0.0 {
            to.column_mut(idx).fill(0.0);
        }
    }
}

/// Scales every row so that it sums to 1; a row of zeros stays zero.
fn normalise_rows(mut matrix: DMatrix<f64>) -> DMatrix<f64> {
    for mut row in matrix.row_iter_mut() {
        let sum = row.sum();
        if sum > 0.0 {
            row /= sum;
        }
    }
    matrix
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn table(rows: &[[f64; 2]; 2]) -> Compatibility {
        Compatibility::of(vec![DMatrix::from_fn(2, 2, |row, col| rows[row][col])])
    }

    /// Returns joint distributions of one part with 4 types, the last of which does not occur in the first view.
    fn joint() -> impl Strategy<Value = Compatibility> {
        prop::collection::vec(0.01..1.0, 16).prop_map(|mut cells| {
            cells[12..].fill(0.0);
            let sum: f64 = cells.iter().sum();
            Compatibility::of(vec![DMatrix::from_row_slice(4, 4, &cells) / sum])
        })
    }

    fn largest_difference(a: &Compatibility, b: &Compatibility) -> f64 {
        (&a.values[0] - &b.values[0]).abs().max()
    }

    proptest! {
        #[test]
        fn a_joint_distribution_is_recovered_from_its_conditionals(planted in joint()) {
            let conditionals = [planted.conditional(), planted.transposed().conditional()];
            let (found, disagreement) =
                Compatibility::joint_from_conditionals(&conditionals[0], &conditionals[1]).unwrap();
            prop_assert!(largest_difference(&found, &planted) < 1e-9);
            prop_assert!(disagreement < 1e-9);
            prop_assert_eq!(found.n_unseen(), 1);
        }

        #[test]
        fn swapping_the_views_transposes_the_joint_distribution(one in joint(), other in joint()) {
            // Two tables that contradict each other.
            let (second, first) = (one.conditional(), other.transposed().conditional());
            let (joint, there) = Compatibility::joint_from_conditionals(&second, &first).unwrap();
            let (exchanged, back) = Compatibility::joint_from_conditionals(&first, &second).unwrap();
            prop_assert!(largest_difference(&joint, &exchanged.transposed()) < 1e-9);
            prop_assert!((there - back).abs() < 1e-9);
            prop_assert!((joint.values[0].sum() - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn tables_that_contradict_each_other_are_reported() {
        let alike = table(&[[1.0, 0.0], [0.0, 1.0]]);
        let exchanged = table(&[[0.0, 1.0], [1.0, 0.0]]);
        let (joint, disagreement) =
            Compatibility::joint_from_conditionals(&alike, &exchanged).unwrap();
        assert!((disagreement - 1.0).abs() < 1e-12);
        assert!(largest_difference(&joint, &table(&[[0.25, 0.25], [0.25, 0.25]])) < 1e-12);
    }

    #[test]
    fn a_periodic_chain_converges() {
        let to_and_fro = [0.0, 0.5, 0.5, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0];
        let second = Compatibility::of(vec![DMatrix::from_row_slice(3, 3, &to_and_fro)]);
        let first = Compatibility::of(vec![DMatrix::identity(3, 3)]);
        let (joint, _) = Compatibility::joint_from_conditionals(&second, &first).unwrap();
        let settled = [2.0, 1.0, 1.0, 1.0, 1.0, 0.0, 1.0, 0.0, 1.0].map(|value| value / 8.0);
        let settled = Compatibility::of(vec![DMatrix::from_row_slice(3, 3, &settled)]);
        assert!(largest_difference(&joint, &settled) < 1e-12);
    }

    #[test]
    fn separate_groups_of_types_are_weighted_by_their_number_of_types() {
        let apart = table(&[[1.0, 0.0], [0.0, 1.0]]);
        let (joint, disagreement) = Compatibility::joint_from_conditionals(&apart, &apart).unwrap();
        assert!(largest_difference(&joint, &table(&[[0.5, 0.0], [0.0, 0.5]])) < 1e-12);
        assert!(disagreement < 1e-12);
    }

    #[test]
    fn a_type_that_occurs_in_one_table_only_counts_as_unseen() {
        let second = table(&[[0.5, 0.5], [0.0, 1.0]]);
        let first = table(&[[1.0, 0.0], [0.0, 0.0]]);
        let (joint, _) = Compatibility::joint_from_conditionals(&second, &first).unwrap();
        assert!(largest_difference(&joint, &table(&[[1.0, 0.0], [0.0, 0.0]])) < 1e-12);
        let (joint, _) = Compatibility::joint_from_conditionals(&first, &second).unwrap();
        assert!(largest_difference(&joint, &table(&[[1.0, 0.0], [0.0, 0.0]])) < 1e-12);
        let nothing = table(&[[0.0; 2]; 2]);
        let (joint, disagreement) =
            Compatibility::joint_from_conditionals(&second, &nothing).unwrap();
        assert_eq!((joint, disagreement), (nothing, 0.0));
    }

    #[test]
    fn tables_of_different_models_are_rejected() {
        let small = table(&[[1.0, 0.0], [0.0, 1.0]]);
        let large = Compatibility::of(vec![DMatrix::identity(3, 3)]);
        let error = Compatibility::joint_from_conditionals(&small, &large).unwrap_err();
        assert_eq!(
            error.to_string(),
            "the two tables must have the same number of types per part, but they have [2] and [3]"
        );
    }

    const TEXT: &str = "1,0.25,0.75\n1,NaN,NaN\n2,0,0\n2,0.33333,0.66667\n";

    fn outcome(text: &str) -> String {
        match Compatibility::parse(text, &[2, 2]) {
            Ok(table) => format!("fine: {} unseen", table.n_unseen()),
            Err(error) => error.to_string(),
        }
    }

    #[test]
    fn rows_are_types_of_the_first_view() {
        let table = Compatibility::parse(TEXT, &[2, 2]).unwrap();
        assert_eq!(table.value(0, 0, 1), 0.75);
        assert_eq!(table.value(1, 1, 0), 0.33333);
    }

    #[test]
    fn an_unseen_type_has_zeros_and_is_counted() {
        let table = Compatibility::parse(TEXT, &[2, 2]).unwrap();
        assert_eq!([table.value(0, 1, 0), table.value(1, 0, 1)], [0.0, 0.0]);
        assert_eq!(table.n_unseen(), 2);
    }

    #[test]
    fn errors_name_line_and_column() {
        let cases = [
            (
                "0.75",
                "0.8",
                "line 1: the sum of the probabilities is 1.05, expected 1",
            ),
            (
                "0.75",
                "1.2",
                "line 1, column 3: `1.2` is not a probability from 0 to 1",
            ),
            (
                "0.75",
                "NaN",
                "line 1, column 3: `NaN` is not a probability from 0 to 1",
            ),
            (
                "0.75",
                "-0.1",
                "line 1, column 3: `-0.1` is not a probability from 0 to 1",
            ),
            (
                "0.25",
                "",
                "line 1, column 2: `` is not a probability from 0 to 1",
            ),
            ("2,0,0", "3,0,0", "line 3, column 1: part `3`, expected 2"),
            (
                "2,0,0",
                "2,0,0,0",
                "line 3 has 4 columns, expected 3: one for the part, and one for each type",
            ),
            (
                "2,0,0\n",
                "",
                "the table has 3 rows, expected 4, one for each part and type",
            ),
        ];
        for (from, to, expected) in cases {
            assert_eq!(outcome(&TEXT.replace(from, to)), expected);
        }
    }

    proptest! {
        #[test]
        fn a_changed_table_never_panics(at in 0..TEXT.len(), to in "[0-9a-zN.,\\n-]{0,8}") {
            let mut text = TEXT.to_owned();
            text.replace_range(at..(at + 3).min(TEXT.len()), &to);
            let _outcome = outcome(&text);
        }
    }
}
