//! Learns the positions of joints relative to the parts around them from annotated people, some of whom are detected badly.

use nalgebra::{DMatrix, DVector};
use skeleton::{MIRROR, N_PARTS, PARENT, PARSE14};

/// Number of joints in `skeleton::PARSE14`.
const N_JOINTS: usize = 14;
/// Parts of shoulders and hips; for each of these, the opposite part is used as well.
const ACROSS_TRUNK: [usize; 4] = [2, 9, 14, 21];
/// Maximum error that counts, as a fraction of the person's size; a joint with a larger error is taken as not found.
const LIMIT: f64 = 0.1;
/// Maximum number of rounds of reweighting, and the change of weights at which the rounds end.
const MOST_ROUNDS: usize = 50;
const SETTLED: f64 = 1e-9;
/// Number of groups of people for the cross-validation of the settings.
const FOLDS: usize = 5;

/// A person with found parts and annotated joints.
#[derive(Debug, Clone, PartialEq)]
pub struct Marked {
    /// Centres of the 26 parts, in pixels.
    pub centres: [[f64; 2]; N_PARTS],
    /// The joints of `skeleton::PARSE14`, in pixels; left and right as seen in the picture.
    pub joints: [[f64; 2]; N_JOINTS],
}

/// Settings for learning joints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Local {
    /// Maximum number of bones between the joint's own part and a part that determines its position.
    pub reach: usize,
    /// Cost of a weight on parts other than the joint's own: squared, per person, in units of the person's size.
    pub ridge: f64,
}

impl Local {
    /// Returns the settings to try, the simplest first.
    pub fn tried() -> Vec<Self> {
        let with = |reach| [1e-2, 1e-3, 1e-4].map(|ridge| Self { reach, ridge });
        [1, 2, 4].into_iter().flat_map(with).collect()
    }

    /// Learns a row of weights, one per part, for every joint of `skeleton::PARSE14`; rows sum to 1.
    ///
    /// A joint is its own part plus a weighted sum of the offsets of the parts around it. So the map is the same if people are moved,
    /// rotated or scaled. Every data set has the same weight, because data sets define joints differently. The mirror image of every person
    /// is added as well, so the map is symmetric. Errors beyond a tenth of a person's size are ignored (Tukey's biweight), because the limb
    /// was not found.
    pub fn learn(self, sets: &[Vec<&Marked>]) -> Vec<Vec<f64>> {
        let mut rows = vec![Vec::new(); N_JOINTS];
        for joint in 0..N_JOINTS {
            let own = own(joint);
            if MIRROR[own] < own {
                continue;
            }
            let row = self.row(joint, sets);
            let mirrored: Vec<f64> = MIRROR.iter().map(|&mirror| row[mirror]).collect();
            if MIRROR[own] == own {
                // The row is symmetric apart from rounding.
                let both = row.iter().zip(&mirrored);
                rows[joint] = rounded(own, both.map(|(a, b)| f64::midpoint(*a, *b)));
            } else {
                rows[mirror_of(joint)] = rounded(MIRROR[own], mirrored.into_iter());
                rows[joint] = rounded(own, row.into_iter());
            }
        }
        rows
    }

    /// Returns the weights of one joint.
    fn row(self, joint: usize, sets: &[Vec<&Marked>]) -> Vec<f64> {
        let own = own(joint);
        let around = around(own, self.reach);
        let samples = samples(joint, &around, sets);
        let n = around.len();
        let mut weights = DVector::zeros(n);
        for _ in 0..MOST_ROUNDS {
            let (mut products, mut targets) = (DMatrix::zeros(n, n), DVector::zeros(n));
            let mut total = 0.0;
            for sample in &samples {
                let trust = sample.trust(&weights);
                if trust <= 0.0 {
                    continue;
                }
                total += trust;
                for axis in 0..2 {
                    products.ger(trust, &sample.around[axis], &sample.around[axis], 1.0);
                    targets.axpy(trust * sample.joint[axis], &sample.around[axis], 1.0);
                }
            }
            for it in 0..n {
                products[(it, it)] += self.ridge * total;
            }
            let Some(solved) = products.cholesky().map(|cholesky| cholesky.solve(&targets)) else {
                break;
            };
            let moved = (&solved - &weights).amax();
            weights = solved;
            if moved < SETTLED {
                break;
            }
        }
        let mut row = vec![0.0; N_PARTS];
        for (part, weight) in around.iter().zip(&weights) {
            row[*part] = *weight;
        }
        row[own] = 1.0 - weights.sum();
        row
    }
}

/// Returns the mean distance of joints from their annotations, in percent of the person's size, each at most 10; `None` if there are no
/// people.
///
/// * `rows`: result of [`Local::learn`]; if `None`, the parts themselves are used.
pub fn mean_error(rows: Option<&[Vec<f64>]>, people: &[&Marked]) -> Option<f64> {
    let of_person = |person: &&Marked| {
        let size = size(&person.joints);
        let joint = |joint: usize| {
            let at = rows.map_or(person.centres[own(joint)], |rows| {
                read(&rows[joint], person)
            });
            let [x, y] = [0, 1].map(|axis| at[axis] - person.joints[joint][axis]);
            100.0 * (x.hypot(y) / size).min(LIMIT)
        };
        (0..N_JOINTS).map(joint).sum::<f64>() / N_JOINTS as f64
    };
    (!people.is_empty()).then(|| people.iter().map(of_person).sum::<f64>() / people.len() as f64)
}

/// One of [`Local::tried`], with its errors on every data set, measured on people who were left out of the learning.
pub type Tried = (Local, Vec<f64>);

/// Tries all settings with cross-validation: every fifth person of each data set is left out in turn.
pub fn try_all(sets: &[Vec<Marked>]) -> Vec<Tried> {
    let tried = Local::tried().into_iter();
    tried.map(|tried| (tried, left_out(tried, sets))).collect()
}

/// Returns the settings with the smallest error, with the same weight for every data set; the first ones in a tie.
pub fn best(tried: &[Tried]) -> Option<&Tried> {
    let mean = |tried: &&Tried| tried.1.iter().sum::<f64>();
    tried.iter().min_by(|a, b| mean(a).total_cmp(&mean(b)))
}

fn left_out(settings: Local, sets: &[Vec<Marked>]) -> Vec<f64> {
    let mut sums = vec![(0.0, 0.0); sets.len()];
    for fold in 0..FOLDS {
        let deal = |is_in: bool| -> Vec<Vec<&Marked>> {
            let of_set = |set: &Vec<Marked>| -> Vec<usize> {
                (0..set.len()).filter(|i| (i % FOLDS == fold) == is_in).collect()
            };
            let sets = sets.iter().map(|set| (set, of_set(set)));
            sets.map(|(set, at)| at.into_iter().map(|at| &set[at]).collect()).collect()
        };
        let rows = settings.learn(&deal(false));
        for (people, (sum, n)) in deal(true).iter().zip(&mut sums) {
            let error = mean_error(Some(&rows), people).unwrap_or(0.0);
            *sum += error * people.len() as f64;
            *n += people.len() as f64;
        }
    }
    sums.iter().map(|(sum, n)| sum / f64::max(*n, 1.0)).collect()
}

/// A joint of one person. All positions are relative to the joint's own part, in units of the person's size.
struct Sample {
    around: [DVector<f64>; 2],
    joint: [f64; 2],
    share: f64,
}

impl Sample {
    /// Returns the weight of the sample: Tukey's biweight of its distance.
    fn trust(&self, weights: &DVector<f64>) -> f64 {
        let [x, y] = [0, 1].map(|axis| self.joint[axis] - self.around[axis].dot(weights));
        let square = (x * x + y * y) / (LIMIT * LIMIT);
        self.share * (1.0 - square).max(0.0).powi(2)
    }
}

fn samples(joint: usize, around: &[usize], sets: &[Vec<&Marked>]) -> Vec<Sample> {
    let mut samples = Vec::new();
    for people in sets {
        let share = 0.5 / people.len().max(1) as f64;
        for person in people {
            for is_mirrored in [false, true] {
                samples.push(sample(person, joint, around, is_mirrored, share));
            }
        }
    }
    samples
}

fn sample(
    person: &Marked,
    joint: usize,
    around: &[usize],
    is_mirrored: bool,
    share: f64,
) -> Sample {
    let side = if is_mirrored { -1.0 } else { 1.0 };
    let turned = |[x, y]: [f64; 2]| [side * x, y];
    let centre =
        |part: usize| turned(person.centres[if is_mirrored { MIRROR[part] } else { part }]);
    let mark = person.joints[if is_mirrored { mirror_of(joint) } else { joint }];
    let (own, size) = (centre(own(joint)), size(&person.joints));
    Sample {
        around: [0, 1].map(|axis| {
            let relative = around.iter().map(|&around| (centre(around)[axis] - own[axis]) / size);
            DVector::from_iterator(around.len(), relative)
        }),
        joint: [0, 1].map(|axis| (turned(mark)[axis] - own[axis]) / size),
        share,
    }
}

fn read(row: &[f64], person: &Marked) -> [f64; 2] {
    [0, 1].map(|axis| {
        let weighed = row.iter().zip(&person.centres);
        weighed.map(|(weight, at)| weight * at[axis]).sum()
    })
}

/// Returns the part that represents a joint of `skeleton::PARSE14` by default.
pub(crate) fn own(joint: usize) -> usize {
    PARSE14.joints[joint].parts[0]
}

/// Returns the same joint of `skeleton::PARSE14` on the other side.
fn mirror_of(joint: usize) -> usize {
    let other = MIRROR[own(joint)];
    (0..N_JOINTS).find(|i| own(*i) == other).unwrap_or(joint)
}

/// Returns the parts up to `reach` bones away from a part, without the part itself, in ascending order; for shoulders and hips also the
/// opposite part.
fn around(own: usize, reach: usize) -> Vec<usize> {
    let mut near = [false; N_PARTS];
    near[own] = true;
    for _ in 0..reach {
        let before = near;
        for (part, parent) in PARENT.iter().enumerate() {
            if let Some(parent) = *parent {
                near[part] |= before[parent];
                near[parent] |= before[part];
            }
        }
    }
    if ACROSS_TRUNK.contains(&own) {
        near[MIRROR[own]] = true;
    }
    (0..N_PARTS).filter(|&i| near[i] && i != own).collect()
}

/// Returns the longer side of the box around the joints plus a pixel, as in PCK.
fn size(joints: &[[f64; 2]]) -> f64 {
    let side = |axis: usize| {
        let values = || joints.iter().map(move |joint| joint[axis]);
        values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min)
    };
    side(0).max(side(1)) + 1.0
}

/// Weights with six decimals that sum to 1; the joint's own part takes the remainder.
fn rounded(own: usize, row: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut millionths: Vec<i64> = row.map(|row| (row * 1e6).round() as i64).collect();
    let sum: i64 = millionths.iter().sum();
    millionths[own] += 1_000_000 - sum;
    millionths.iter().map(|&millionth| millionth as f64 / 1e6).collect()
}
