//! Ridge regression of the linear map from parts to joints (the paper's section 7).

use nalgebra::{DMatrix, DVector};
use skeleton::{JointSet, MIRROR, N_PARTS};

use crate::learned::JointWeights;

/// One person in one picture: the detected parts, named by the person's left and right, and a true joint.
#[derive(Debug, Clone, Copy)]
pub struct JointSample<'a> {
    /// Centres of the 26 parts, in pixels.
    pub centres: &'a [[f64; 2]],
    /// The true joint, in pixels.
    pub joint: [f64; 2],
    /// The parts whose mean is the joint by default (`skeleton::Joint::parts`).
    pub parts: &'static [usize],
    /// Size of the person, in pixels.
    pub size: f64,
}

/// Ridge regression for every known joint.
///
/// A joint is the mean of its own parts, plus a weighted sum of the offsets of all parts from that mean. So the map is
/// invariant to translation, rotation and scale. The weights minimise the squared error in units of the
/// person's size, plus `ridge` per sample times the squared weights, so that rare joints stay close to the default.
/// The mirror image of every person is added as well.
#[derive(Debug, Clone, Default)]
pub struct JointFit {
    joints: Vec<Normal>,
}

/// Normal equations of one joint.
#[derive(Debug, Clone)]
struct Normal {
    parts: &'static [usize],
    n: f64,
    products: DMatrix<f64>,
    targets: DVector<f64>,
    squares: f64,
}

impl JointFit {
    /// Adds a sample.
    ///
    /// # Panics
    ///
    /// If there are not 26 centres.
    pub fn add(&mut self, sample: &JointSample<'_>) {
        let mirrored: Vec<[f64; 2]> = MIRROR
            .iter()
            .map(|&mirror| [-sample.centres[mirror][0], sample.centres[mirror][1]])
            .collect();
        self.add_one(sample);
        if let Some(parts) = mirror_of(sample.parts) {
            self.add_one(&JointSample {
                centres: &mirrored,
                joint: [-sample.joint[0], sample.joint[1]],
                parts,
                size: sample.size,
            });
        }
    }

    fn add_one(&mut self, sample: &JointSample<'_>) {
        let at = self.joints.iter().position(|joint| joint.parts == sample.parts);
        let at = at.unwrap_or_else(|| {
            self.joints.push(Normal::new(sample.parts));
            self.joints.len() - 1
        });
        let joint = &mut self.joints[at];
        for axis in 0..2 {
            let own = sample.parts.iter().map(|&part| sample.centres[part][axis]);
            let own = own.sum::<f64>() / sample.parts.len() as f64;
            let row = sample.centres.iter();
            let row =
                DVector::from_iterator(N_PARTS, row.map(|row| (row[axis] - own) / sample.size));
            let target = (sample.joint[axis] - own) / sample.size;
            joint.products.ger(1.0, &row, &row, 1.0);
            joint.targets.axpy(target, &row, 1.0);
            joint.squares += target * target;
            joint.n += 1.0;
        }
    }

    /// Returns the map for a set, with rows for all its joints; joints without samples keep their default.
    pub fn solve(&self, set: &JointSet, ridge: f64) -> JointWeights {
        let rows = set.joints.iter().map(|joint| self.row(joint.parts, ridge));
        JointWeights {
            set: set.name.to_owned(),
            weights: rows.collect(),
        }
    }

    fn row(&self, parts: &[usize], ridge: f64) -> Vec<f64> {
        let Some(joint) = self.joints.iter().find(|joint| joint.parts == parts) else {
            // The joint is the mean of joints that may have samples of their own.
            let n = parts.len() as f64;
            return match parts {
                [part] => unit(*part),
                _ => parts.iter().fold(vec![0.0; N_PARTS], |sum, &part| {
                    let row = self.row(&[part], ridge);
                    sum.iter().zip(row).map(|(a, b)| a + b / n).collect()
                }),
            };
        };
        let Some(weights) = joint.solve(ridge) else {
            return default_row(parts);
        };
        let left = 1.0 - weights.sum();
        let defaults = default_row(parts);
        let row = weights.iter().zip(defaults);
        row.map(|(weight, own)| rounded(weight + left * own)).collect()
    }

    /// Returns the mean squared error, on the samples of this fit, of the maps of another fit, in units of the person's size; `None`
    /// without samples.
    pub fn error_of(&self, other: &Self, ridge: f64) -> Option<f64> {
        let n: f64 = self.joints.iter().map(|joint| joint.n).sum();
        let error = |joint: &Normal| {
            let theirs = other.joints.iter().find(|candidate| candidate.parts == joint.parts);
            let weights = theirs.and_then(|theirs| theirs.solve(ridge));
            joint.error(&weights.unwrap_or_else(|| DVector::zeros(N_PARTS)))
        };
        (n > 0.0).then(|| self.joints.iter().map(error).sum::<f64>() / n)
    }
}

impl Normal {
    fn new(parts: &'static [usize]) -> Self {
        Self {
            parts,
            n: 0.0,
            products: DMatrix::zeros(N_PARTS, N_PARTS),
            targets: DVector::zeros(N_PARTS),
            squares: 0.0,
        }
    }

    fn solve(&self, ridge: f64) -> Option<DVector<f64>> {
        let ridge = DMatrix::identity(N_PARTS, N_PARTS) * (ridge * self.n);
        let factors = (&self.products + ridge).cholesky()?;
        Some(factors.solve(&self.targets))
    }

    /// Returns the sum of squared errors.
    fn error(&self, weights: &DVector<f64>) -> f64 {
        let quadratic = weights.dot(&(&self.products * weights));
        (self.squares - 2.0 * weights.dot(&self.targets) + quadratic).max(0.0)
    }
}

fn unit(part: usize) -> Vec<f64> {
    default_row(&[part])
}

fn default_row(parts: &[usize]) -> Vec<f64> {
    let mut row = vec![0.0; N_PARTS];
    for &part in parts {
        row[part] += 1.0 / parts.len() as f64;
    }
    row
}

/// Six digits are more precise than the data.
fn rounded(weight: f64) -> f64 {
    (weight * 1e6).round() / 1e6
}

/// Returns the parts of the joint on the other side.
fn mirror_of(parts: &[usize]) -> Option<&'static [usize]> {
    let mut mirrored: Vec<usize> = parts.iter().map(|&part| MIRROR[part]).collect();
    mirrored.sort_unstable();
    let all = JointSet::ALL.into_iter().flat_map(|joint_set| joint_set.joints);
    all.map(|joint| joint.parts).find(|parts| *parts == mirrored)
}

#[cfg(test)]
mod tests {
    use skeleton::{PARSE14, UMPM15};

    use super::*;

    /// Random people whose right wrist lies a fifth of the forearm beyond its part.
    fn samples(n: usize, seed: u64) -> Vec<(Vec<[f64; 2]>, [f64; 2])> {
        let mut dice = fastrand::Rng::with_seed(seed);
        let mut person = || {
            let centres: Vec<[f64; 2]> =
                (0..N_PARTS).map(|_| [dice.f64() * 100.0 + 30.0, dice.f64() * 200.0]).collect();
            let wrist = [0, 1].map(|i| 1.2 * centres[6][i] - 0.2 * centres[4][i]);
            (centres, wrist)
        };
        (0..n).map(|_| person()).collect()
    }

    fn fit(n: usize, seed: u64) -> JointFit {
        let mut fit = JointFit::default();
        for (centres, joint) in samples(n, seed) {
            fit.add(&JointSample {
                centres: &centres,
                joint,
                parts: &[6],
                size: 200.0,
            });
        }
        fit
    }

    #[test]
    fn a_linear_map_is_recovered_and_mirrored() {
        let map = fit(100, 1).solve(&PARSE14, 1e-9);
        let [right, left] = [6, 11].map(|i| &map.weights[i]);
        assert!((right[6] - 1.2).abs() < 1e-3 && (right[4] + 0.2).abs() < 1e-3);
        assert!((left[18] - 1.2).abs() < 1e-3 && (left[16] + 0.2).abs() < 1e-3);
    }

    #[test]
    fn rows_sum_to_one() {
        for set in JointSet::ALL {
            for row in fit(40, 2).solve(set, 0.01).weights {
                assert!((row.iter().sum::<f64>() - 1.0).abs() < 1e-4);
            }
        }
    }

    #[test]
    fn joints_without_samples_keep_their_default() {
        let map = fit(40, 3).solve(&UMPM15, 0.01);
        assert_eq!(map.weights[0], default_row(&[9, 21]));
        assert_eq!(map.weights[2], unit(0));
    }

    #[test]
    fn a_large_ridge_gives_the_default() {
        let row = &fit(40, 4).solve(&PARSE14, 1e9).weights[6];
        assert!((row[6] - 1.0).abs() < 1e-5, "{}", row[6]);
    }

    #[test]
    fn the_error_on_other_samples_is_small() {
        let (train, test) = (fit(200, 5), fit(200, 6));
        let with = test.error_of(&train, 1e-9).unwrap();
        let without = test.error_of(&JointFit::default(), 1e-9).unwrap();
        assert!(with < 1e-6 && without > 1e-3, "{with} {without}");
    }
}
