//! Part-type tables (stub of the coordinator so that multiview compiles: replace freely, keep `value`).

/// A table `[part][type in first][type in second]`.
#[derive(Debug, Clone, PartialEq)]
pub struct Compatibility {
    values: Vec<Vec<Vec<f64>>>,
}

/// Why a table was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("refused")]
pub struct CompatibilityError;

impl Compatibility {
    /// The entry of a part for a pair of types (row: first-named view; column: second-named view);
    /// 0 where nothing is known.
    pub fn value(&self, part: usize, first: usize, second: usize) -> f64 {
        self.values[part][first][second]
    }
}
