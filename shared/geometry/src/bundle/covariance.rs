//! Uncertainty of the shared parameters.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::Problem;
use super::equations::Equations;

/// Smallest eigenvalue of the information matrix relative to the largest, after each parameter is scaled by its own information. If an
/// eigenvalue is below this ratio, the data do not determine the direction of its eigenvector.
const LEAST_EIGENVALUE: f64 = 1e-11;
/// A parameter is named as not determined if its component in an undetermined direction is at least this fraction of the largest component.
const NAMED: f64 = 0.2;

/// Covariance of the shared parameters, if the residuals of terms have variance 1.
#[derive(Debug, Clone, PartialEq)]
pub struct Covariance {
    /// Covariance matrix in the order of the parameters, in the coordinates of a step.
    pub matrix: DMatrix<f64>,
}

impl Covariance {
    /// Returns the standard deviation of a parameter.
    pub fn sd(&self, parameter: usize) -> f64 {
        self.matrix[(parameter, parameter)].max(0.0).sqrt()
    }
}

/// Error if the data do not determine the shared parameters.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Undetermined {
    /// Movement along some directions does not change the cost.
    #[error("the data do not determine {}", listed(.directions))]
    Directions {
        /// For each direction, the names of the parameters that move in it.
        directions: Vec<Vec<String>>,
    },
    /// Some values are not finite.
    #[error("the values are not finite, so the parameters cannot be determined")]
    NotFinite,
}

fn listed(directions: &[Vec<String>]) -> String {
    let each = directions.iter().map(|direction| direction.join(" with "));
    each.collect::<Vec<_>>().join("; nor ")
}

/// Returns the covariance of the shared parameters at the current values, with all local blocks unknown.
///
/// The weights of losses are taken at the current values.
///
/// # Errors
///
/// [`Undetermined`] names the parameters that the terms do not determine.
pub fn covariance<P: Problem>(problem: &P) -> Result<Covariance, Undetermined> {
    let information = information(problem).ok_or(Undetermined::NotFinite)?;
    let matrix = inverse(problem, &information)?;
    Ok(Covariance { matrix })
}

/// Returns the covariance of the shared parameters from the differences between clusters of local blocks. Errors within a cluster may be
/// correlated, such as those of successive frames or of all joints of a picture. The standard deviations of terms are used as weights only.
///
/// Each cluster is left out in turn (jackknife), by one Newton step from the minimum; Cameron, Gelbach & Miller, Review of Economics and
/// Statistics 90, 2008, call this CR3. The errors of priors are assumed to be as stated. The length of a step is computed from the
/// curvature of the losses, not from their weights. With m clusters, a standard deviation is known to a relative accuracy of about 1 / √(2
/// (m - 1)). If residuals are about as large as the width of a loss, the deviations come out too small by a third.
///
/// * `cluster_of`: cluster of every local block, counted from 0.
/// * Returns `None` if there are fewer than two clusters, or if the parameters are not determined without one of the clusters.
///
/// # Errors
///
/// [`Undetermined`] names the parameters that the terms do not determine.
pub fn clustered<P: Problem>(
    problem: &P,
    cluster_of: &[usize],
) -> Result<Option<Covariance>, Undetermined> {
    let n_clusters = cluster_of.iter().max().map_or(0, |value| value + 1);
    let mut clusters = Vec::new();
    let mut weights = [0.0; 2];
    for cluster in 0..n_clusters {
        let equations = Equations::of(problem, |local| cluster_of.get(local) == Some(&cluster));
        weights = [0, 1].map(|i| weights[i] + equations.weights[i]);
        clusters.push(equations.reduced(0.0).ok_or(Undetermined::NotFinite)?);
    }
    let steepness = weights[1] / weights[0];
    let known = Equations::known(problem);
    let known = known.reduced(0.0).ok_or(Undetermined::NotFinite)?.matrix;
    let of_clusters = clusters.iter().map(|cluster| &cluster.matrix * steepness);
    let information = of_clusters.fold(known.clone(), |sum, it| sum + it);
    let inverse = inverse(problem, &information)?;
    let mut matrix = &inverse * known * &inverse;
    let m = clusters.len() as f64;
    if clusters.len() < 2 || steepness.is_nan() {
        return Ok(None);
    }
    for it in &clusters {
        let rest = &information - &it.matrix * steepness;
        let Some(factor) = rest.cholesky() else {
            return Ok(None);
        };
        let step = factor.solve(&it.gradient);
        matrix += (m - 1.0) / m * &step * step.transpose();
    }
    let is_finite = matrix.iter().all(|value| value.is_finite());
    Ok(is_finite.then_some(Covariance { matrix }))
}

/// Returns the inverse of the information matrix.
fn inverse<P: Problem>(
    problem: &P,
    information: &DMatrix<f64>,
) -> Result<DMatrix<f64>, Undetermined> {
    if information.iter().any(|value| !value.is_finite()) {
        return Err(Undetermined::NotFinite);
    }
    let n = information.nrows();
    if n == 0 {
        return Ok(information.clone());
    }
    let size = |nth: usize| information[(nth, nth)].max(f64::MIN_POSITIVE).sqrt();
    let sizes = DVector::from_iterator(n, (0..n).map(size));
    let scaled = DMatrix::from_fn(n, n, |i, j| information[(i, j)] / (sizes[i] * sizes[j]));
    let eigen = SymmetricEigen::new(scaled);
    let limit = LEAST_EIGENVALUE * eigen.eigenvalues.amax();
    let lost = (0..n).filter(|i| eigen.eigenvalues[*i] <= limit);
    let directions: Vec<Vec<String>> = lost
        .map(|lost| names(problem, &eigen.eigenvectors.column(lost).into_owned()))
        .collect();
    if !directions.is_empty() {
        return Err(Undetermined::Directions { directions });
    }
    let inverse = eigen.eigenvalues.map(|eigenvalue| 1.0 / eigenvalue);
    let vectors = &eigen.eigenvectors;
    let scaled = vectors * DMatrix::from_diagonal(&inverse) * vectors.transpose();
    Ok(DMatrix::from_fn(n, n, |i, j| {
        scaled[(i, j)] / (sizes[i] * sizes[j])
    }))
}

/// Returns the information of the terms on the shared parameters, with all local blocks unknown: the inverse of the covariance.
fn information<P: Problem>(problem: &P) -> Option<DMatrix<f64>> {
    let reduced = Equations::new(problem).reduced(0.0)?;
    let is_finite = reduced.matrix.iter().all(|value| value.is_finite());
    is_finite.then_some(reduced.matrix)
}

fn names<P: Problem>(problem: &P, direction: &DVector<f64>) -> Vec<String> {
    let least = NAMED * direction.amax();
    let moving = (0..direction.len()).filter(|i| direction[*i].abs() >= least);
    moving.map(|moving| problem.name(moving)).collect()
}
