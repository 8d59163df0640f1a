//! Normal equations of a problem, and elimination of its local blocks.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::{Problem, Step, Term};

/// Smallest value that damping uses for a diagonal entry, relative to the largest entry of its block. It prevents large steps of parameters
/// that are not determined.
const LEAST_DIAGONAL: f64 = 1e-12;

/// Equations of one local block.
struct Block {
    /// Shared parameters on which the block depends.
    shared: Vec<usize>,
    /// Product of the block with itself.
    own: DMatrix<f64>,
    /// Mixed part: row = coordinate of the block, column = shared parameter.
    across: DMatrix<f64>,
    gradient: DVector<f64>,
}

/// Half the second derivatives (Gauss-Newton) and half the gradient of the cost.
pub(super) struct Equations {
    blocks: Vec<Block>,
    shared: DMatrix<f64>,
    gradient: DVector<f64>,
    /// Cost at the current values.
    pub(super) cost: f64,
    /// Number of residuals.
    pub(super) n_residuals: usize,
    /// Sum of the weights, and sum of the curvatures of the losses, over all residuals.
    pub(super) weights: [f64; 2],
}

/// Reduced system for the shared parameters, with the data needed to recover the local blocks.
pub(super) struct Reduced {
    pub(super) matrix: DMatrix<f64>,
    pub(super) gradient: DVector<f64>,
    factors: Vec<Cholesky<f64, Dyn>>,
}

/// Returns the cost alone.
pub(super) fn cost<P: Problem>(problem: &P) -> f64 {
    let mut sum = 0.0;
    let mut take = |term: &Term| sum += term.cost().0;
    for local in 0..problem.locals().len() {
        problem.terms_of(local, &mut take);
    }
    problem.priors(&mut take);
    sum
}

impl Equations {
    pub(super) fn new<P: Problem>(problem: &P) -> Self {
        let mut all = Self::of(problem, |_| true);
        problem.priors(&mut |term| {
            all.add_shared(term);
        });
        all
    }

    /// Returns the equations of some of the local blocks, without priors.
    pub(super) fn of<P: Problem>(problem: &P, is_wanted: impl Fn(usize) -> bool) -> Self {
        let n = problem.n_shared();
        let mut all = Self {
            blocks: Vec::new(),
            shared: DMatrix::zeros(n, n),
            gradient: DVector::zeros(n),
            cost: 0.0,
            n_residuals: 0,
            weights: [0.0; 2],
        };
        // Position of each shared parameter among the parameters of the block; n if the block does not depend on it.
        let mut places = vec![n; n];
        let each = problem.locals().into_iter().enumerate();
        for (local, size) in each.filter(|block| is_wanted(block.0)) {
            let block = all.block(problem, local, size, &mut places);
            for parameter in &block.shared {
                places[*parameter] = n;
            }
            all.blocks.push(block);
        }
        all
    }

    /// Returns the equations of the priors alone.
    pub(super) fn known<P: Problem>(problem: &P) -> Self {
        let mut all = Self::of(problem, |_| false);
        problem.priors(&mut |term| {
            all.add_shared(term);
        });
        all
    }

    fn block<P: Problem>(
        &mut self,
        problem: &P,
        local: usize,
        size: usize,
        places: &mut [usize],
    ) -> Block {
        let n = places.len();
        let mut shared: Vec<usize> = Vec::new();
        let mut own = DMatrix::zeros(size, size);
        let mut gradient = DVector::zeros(size);
        let mut across: Vec<DVector<f64>> = Vec::new();
        problem.terms_of(local, &mut |term| {
            let weight = self.add_shared(term);
            for (row, a) in term.local_columns() {
                gradient[row] += weight * dot(a, &term.residuals);
                for (column, b) in term.local_columns() {
                    own[(row, column)] += weight * dot(a, b);
                }
                for (parameter, b) in term.shared_columns() {
                    if places[parameter] == n {
                        places[parameter] = shared.len();
                        shared.push(parameter);
                        across.push(DVector::zeros(size));
                    }
                    across[places[parameter]][row] += weight * dot(a, b);
                }
            }
        });
        let across = if across.is_empty() {
            DMatrix::zeros(size, 0)
        } else {
            DMatrix::from_columns(&across)
        };
        Block {
            shared,
            own,
            across,
            gradient,
        }
    }

    /// Adds the part of a term that concerns only shared parameters; returns its weight.
    fn add_shared(&mut self, term: &Term) -> f64 {
        let (cost, weight) = term.cost();
        self.cost += cost;
        self.n_residuals += term.residuals.len();
        let n = term.residuals.len() as f64;
        self.weights[0] += n * weight;
        self.weights[1] += n * term.curvature();
        for (row, a) in term.shared_columns() {
            self.gradient[row] += weight * dot(a, &term.residuals);
            for (column, b) in term.shared_columns() {
                self.shared[(row, column)] += weight * dot(a, b);
            }
        }
        weight
    }

    /// Eliminates the local blocks. Returns `None` if a block is not finite.
    pub(super) fn reduced(&self, damping: f64) -> Option<Reduced> {
        let mut matrix = damped(&self.shared, damping);
        let mut gradient = self.gradient.clone();
        let mut factors = Vec::with_capacity(self.blocks.len());
        for block in &self.blocks {
            let factor = damped(&block.own, damping.max(LEAST_DIAGONAL)).cholesky()?;
            let mut half = block.across.clone();
            let mut of_gradient = block.gradient.clone();
            let lower = factor.l_dirty();
            lower.solve_lower_triangular_mut(&mut half);
            lower.solve_lower_triangular_mut(&mut of_gradient);
            // The product of the half with itself is symmetric, so only one triangle is computed.
            for (i, row) in block.shared.iter().enumerate() {
                let of_row = half.column(i);
                gradient[*row] -= of_row.dot(&of_gradient);
                matrix[(*row, *row)] -= of_row.dot(&of_row);
                for (j, column) in block.shared.iter().enumerate().take(i) {
                    let square = of_row.dot(&half.column(j));
                    matrix[(*row, *column)] -= square;
                    matrix[(*column, *row)] -= square;
                }
            }
            factors.push(factor);
        }
        Some(Reduced {
            matrix,
            gradient,
            factors,
        })
    }

    /// Returns the step to the minimum of the quadratic that the equations describe; `None` if there is no minimum.
    pub(super) fn step(&self, damping: f64) -> Option<Step> {
        let reduced = self.reduced(damping)?;
        let shared = if reduced.matrix.is_empty() {
            DVector::zeros(0)
        } else {
            reduced.matrix.cholesky()?.solve(&-reduced.gradient)
        };
        let each = self.blocks.iter().zip(&reduced.factors);
        let of_block = |(block, factor): (&Block, &Cholesky<f64, Dyn>)| {
            let known = block.shared.iter().map(|parameter| shared[*parameter]);
            let known = DVector::from_iterator(block.shared.len(), known);
            let right = -(&block.gradient + &block.across * known);
            factor.solve(&right).iter().copied().collect()
        };
        let locals: Vec<Vec<f64>> = each.map(of_block).collect();
        let shared: Vec<f64> = shared.iter().copied().collect();
        let mut all = shared.iter().chain(locals.iter().flatten());
        all.all(|value| value.is_finite()).then_some(Step { shared, locals })
    }

    /// Returns the decrease of the cost that the quadratic predicts for a step.
    pub(super) fn gain(&self, step: &Step) -> f64 {
        let shared = DVector::from_column_slice(&step.shared);
        let mut gain = -2.0 * self.gradient.dot(&shared) - shared.dot(&(&self.shared * &shared));
        for (block, local) in self.blocks.iter().zip(&step.locals) {
            let local = DVector::from_column_slice(local);
            let known = block.shared.iter().map(|shared| step.shared[*shared]);
            let known = DVector::from_iterator(block.shared.len(), known);
            gain -= 2.0 * block.gradient.dot(&local)
                + local.dot(&(&block.own * &local))
                + 2.0 * local.dot(&(&block.across * known));
        }
        gain
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Applies Marquardt's damping: every entry of the diagonal grows by a fraction of itself.
fn damped(matrix: &DMatrix<f64>, damping: f64) -> DMatrix<f64> {
    let mut matrix = matrix.clone();
    let largest = matrix.diagonal().amax();
    let least = if largest > 0.0 {
        LEAST_DIAGONAL * largest
    } else {
        1.0
    };
    for nth in 0..matrix.nrows() {
        matrix[(nth, nth)] += damping * matrix[(nth, nth)].max(least);
    }
    matrix
}
