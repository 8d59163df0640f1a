//! One term of the sum: residuals, their derivatives, and a loss.

/// Cost of a residual, by s, the squared length of a term's residuals (which are in standard deviations).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Loss {
    /// s: least squares.
    #[default]
    Square,
    /// Loss of width k: s up to k², from there on 2 k √s - k² (Huber 1964).
    Huber(f64),
    /// Loss of width k: k² ln(1 + s / k²) (Cauchy). Outliers have next to no weight.
    Cauchy(f64),
}

impl Loss {
    /// The cost, and its derivative by s, which is the weight of the term.
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

    /// The mean second derivative of half the cost along each of so many residuals: what tells how far a small push moves the
    /// minimum. The weight overstates it where residuals are large.
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

/// A term: residuals in standard deviations, with their derivatives by a few parameters.
///
/// Made to be filled again and again: [`begin`](Self::begin), then everything else.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Term {
    pub(super) residuals: Vec<f64>,
    pub(super) loss: Loss,
    /// Its weight.
    share: f64,
    /// Shared parameters, and their columns one after the other.
    pub(super) shared: Vec<usize>,
    pub(super) by_shared: Vec<f64>,
    /// Coordinates of the local block, and their columns one after the other.
    pub(super) local: Vec<usize>,
    pub(super) by_local: Vec<f64>,
}

impl Term {
    /// Begins anew with these residuals, and without derivatives.
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

    /// Lets the term count as this share of one: where several err alike, each has a part. The loss knows nothing of it.
    pub fn counts(&mut self, share: f64) {
        self.share = share;
    }

    /// The derivative of all residuals by a shared parameter. A parameter that is given twice counts with the sum.
    ///
    /// # Panics
    ///
    /// If there are not as many numbers as residuals.
    pub fn by_shared(&mut self, parameter: usize, column: &[f64]) {
        assert_eq!(column.len(), self.residuals.len(), "one number a residual");
        self.shared.push(parameter);
        self.by_shared.extend_from_slice(column);
    }

    /// The derivative of all residuals by a coordinate of the local block.
    ///
    /// # Panics
    ///
    /// If there are not as many numbers as residuals.
    pub fn by_local(&mut self, coordinate: usize, column: &[f64]) {
        assert_eq!(column.len(), self.residuals.len(), "one number a residual");
        self.local.push(coordinate);
        self.by_local.extend_from_slice(column);
    }

    /// The residuals, in standard deviations.
    pub fn residuals(&self) -> &[f64] {
        &self.residuals
    }

    /// The squared length of the residuals.
    pub fn square(&self) -> f64 {
        self.residuals.iter().map(|residual| residual * residual).sum()
    }

    /// The cost, and the weight, by the loss and by what the term counts as.
    pub fn cost(&self) -> (f64, f64) {
        let (cost, weight) = self.loss.of(self.square());
        (self.share * cost, self.share * weight)
    }

    /// The curvature of the loss, by what the term counts as.
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
