//! A term of the sum: residuals, their derivatives, and a loss.

/// Loss function of a term: its cost as a function of s, the squared length of its residuals (in standard deviations).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Loss {
    /// Least squares: s.
    #[default]
    Square,
    /// Loss of width k: s up to k², beyond that 2 k √s - k² (Huber 1964).
    Huber(f64),
    /// Loss of width k: k² ln(1 + s / k²) (Cauchy). Outliers have almost no weight.
    Cauchy(f64),
}

impl Loss {
    /// Returns the cost, and its derivative with respect to s, which is the weight of the term.
    pub fn of(self, s: f64) -> (f64, f64) {
        match self {
            Self::Square => (s, 1.0),
            Self::Huber(k) if s <= k * k => (s, 1.0),
            Self::Huber(k) => (2.0 * k * s.sqrt() - k * k, k / s.sqrt()),
            Self::Cauchy(k) => {
                let share = s / (k * k);
                (k * k * share.ln_1p(), 1.0 / (1.0 + share))
            }
        }
    }

    /// Returns the mean second derivative of half the cost along each of `n_residuals` residuals. It determines how far a small change
    /// moves the minimum. For large residuals, the weight would overstate the curvature.
    pub fn curvature(self, s: f64, n_residuals: usize) -> f64 {
        let weight = self.of(s).1;
        let by_s = match self {
            Self::Square => 0.0,
            Self::Huber(k) if s <= k * k => 0.0,
            Self::Huber(k) => -0.5 * k / (s * s.sqrt()),
            Self::Cauchy(k) => -(weight / k).powi(2),
        };
        weight + 2.0 * by_s * s / n_residuals.max(1) as f64
    }
}

/// A term: residuals in standard deviations, with their derivatives with respect to a few parameters.
///
/// A term is meant to be reused: call [`begin`](Self::begin) first, then the other methods.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Term {
    pub(super) residuals: Vec<f64>,
    pub(super) loss: Loss,
    /// Weight of the term.
    share: f64,
    /// Indices of shared parameters. The next field contains the column of derivatives for each of them, one after another.
    pub(super) shared: Vec<usize>,
    pub(super) by_shared: Vec<f64>,
    /// Coordinates of the local block. The next field contains the column of derivatives for each of them, one after another.
    pub(super) local: Vec<usize>,
    pub(super) by_local: Vec<f64>,
}

impl Term {
    /// Resets the term to these residuals, without derivatives.
    pub fn begin(&mut self, residuals: &[f64], loss: Loss) {
        self.residuals.clear();
        self.residuals.extend_from_slice(residuals);
        self.loss = loss;
        self.share = 1.0;
        self.shared.clear();
        self.by_shared.clear();
        self.local.clear();
        self.by_local.clear();
    }

    /// Sets the weight of the term, from 0 to 1. It is below 1 if several terms have the same error. The loss function does not depend on
    /// this weight.
    pub fn counts(&mut self, share: f64) {
        self.share = share;
    }

    /// Adds the derivative of all residuals with respect to a shared parameter. Derivatives for the same parameter are summed.
    ///
    /// # Panics
    ///
    /// Panics if the number of values differs from the number of residuals.
    pub fn by_shared(&mut self, parameter: usize, column: &[f64]) {
        assert_eq!(column.len(), self.residuals.len(), "one number a residual");
        self.shared.push(parameter);
        self.by_shared.extend_from_slice(column);
    }

    /// Adds the derivative of all residuals with respect to a coordinate of the local block.
    ///
    /// # Panics
    ///
    /// Panics if the number of values differs from the number of residuals.
    pub fn by_local(&mut self, coordinate: usize, column: &[f64]) {
        assert_eq!(column.len(), self.residuals.len(), "one number a residual");
        self.local.push(coordinate);
        self.by_local.extend_from_slice(column);
    }

    /// Returns the residuals, in standard deviations.
    pub fn residuals(&self) -> &[f64] {
        &self.residuals
    }

    /// Returns the squared length of the residuals.
    pub fn square(&self) -> f64 {
        self.residuals.iter().map(|residual| residual * residual).sum()
    }

    /// Returns the cost and the weight, including the loss and the weight of the term.
    pub fn cost(&self) -> (f64, f64) {
        let (cost, weight) = self.loss.of(self.square());
        (self.share * cost, self.share * weight)
    }

    /// Returns the curvature of the loss, including the weight of the term.
    pub(super) fn curvature(&self) -> f64 {
        self.share * self.loss.curvature(self.square(), self.residuals.len())
    }

    pub(super) fn shared_columns(&self) -> impl Iterator<Item = (usize, &[f64])> {
        let rows = self.residuals.len();
        let columns = self.by_shared.chunks_exact(rows.max(1));
        self.shared.iter().copied().zip(columns)
    }

    pub(super) fn local_columns(&self) -> impl Iterator<Item = (usize, &[f64])> {
        let rows = self.residuals.len();
        let columns = self.by_local.chunks_exact(rows.max(1));
        self.local.iter().copied().zip(columns)
    }
}
