//! Learns the consistency parameters from single views and their ground truth.

use std::f64::consts::PI;

use skeleton::{JointSet, N_PARTS, PARENT};
use statistics::Sorted;

use crate::learned::counts::{Counts, Shape};
use crate::learned::joints::{JointFit, JointSample};
use crate::learned::{Learned, LearnedFrom, ModelOf, NamedPair, NamedRig, Weights};

/// Settings of the learning.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Number of bins of half the circle.
    pub n_bins: usize,
    /// Maximum error of a part and of its parent at which the type of the part counts, in tenths of the person's size.
    pub max_error: f32,
    /// Maximum mean error of a person who is used for the joint map, in tenths of the person's size.
    pub max_mean_error: f32,
    /// Observations of independent types added to every table.
    pub smoothing: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            n_bins: 12,
            max_error: 0.5,
            max_mean_error: 0.8,
            smoothing: 20.0,
        }
    }
}

/// The best pose of one view together with the ground truth.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewObservation {
    /// Type of every part.
    pub types: Vec<u8>,
    /// Centres of all parts, in pixels; parts have the names of the model.
    pub centres: Vec<[f64; 2]>,
    /// Error of every part, in tenths of the person's size.
    pub errors: Vec<f32>,
    /// True if, according to the ground truth, the person is seen from behind, so that left and right are swapped.
    pub exchanged: bool,
    /// Size of the person, in pixels.
    pub size: f64,
    /// The true joints of the joint set, in pixels; `None` for a joint that is not annotated.
    pub joints: Vec<Option<[f64; 2]>>,
}

/// Two views of one instant.
#[derive(Debug, Clone, Copy)]
pub struct Pair<'a> {
    /// Observations of the two views.
    pub views: [&'a ViewObservation; 2],
    /// The angle from the first to the second view as seen from the person (`crate::angle_between`), in radians.
    pub angle: Option<f64>,
    /// Names of the two cameras, if their pair is also learned by name.
    pub cameras: Option<[&'a str; 2]>,
}

/// Reason why nothing was learned.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum LearnError {
    /// In no view was the pose close enough to the truth.
    #[error("none of the {views} views is near the true pose, so nothing can be learned from them")]
    Nothing {
        /// Number of views seen.
        views: u64,
    },
}

/// Learns from one instant after the other; the order of instants only affects rounding in the joints.
#[derive(Debug, Clone)]
pub struct Learner {
    settings: Settings,
    shape: Shape,
    ring: Vec<Counts>,
    named: Vec<NamedPair>,
    /// Errors of every part.
    errors: Vec<Vec<f32>>,
    joints: JointFit,
    from: LearnedFrom,
}

impl Learner {
    /// Creates a learner without data.
    pub fn new(shape: Shape, settings: Settings) -> Self {
        Self {
            ring: vec![Counts::new(&shape); settings.n_bins.max(1)],
            errors: vec![Vec::new(); shape.n_types.len()],
            named: Vec::new(),
            joints: JointFit::default(),
            from: LearnedFrom::default(),
            settings,
            shape,
        }
    }

    /// Adds one view.
    ///
    /// * `set`: joint set of the view.
    pub fn add_view(&mut self, view: &ViewObservation, set: &'static JointSet) {
        self.from.views += 1;
        for (all, error) in self.errors.iter_mut().zip(&view.errors) {
            all.push(*error);
        }
        let mean = view.errors.iter().sum::<f32>() / view.errors.len().max(1) as f32;
        if view.centres.len() != N_PARTS || mean > self.settings.max_mean_error {
            return;
        }
        let part = |part: usize| view.centres[self.shape.partner(part, view.exchanged)];
        let centres: Vec<[f64; 2]> = (0..N_PARTS).map(part).collect();
        for (joint, at) in set.joints.iter().zip(&view.joints) {
            if let Some(at) = at {
                self.joints.add(&JointSample {
                    centres: &centres,
                    joint: *at,
                    parts: joint.parts,
                    size: view.size,
                });
            }
        }
    }

    /// Adds two views of one instant.
    pub fn add_pair(&mut self, pair: &Pair<'_>) {
        let [first, second] = pair.views;
        let exchanged = first.exchanged != second.exchanged;
        for part in 0..self.shape.n_types.len() {
            let partner = self.shape.partner(part, exchanged);
            if !self.is_right(first, part) || !self.is_right(second, partner) {
                continue;
            }
            let types = [first.types[part], second.types[partner]].map(usize::from);
            if let Some(angle) = pair.angle {
                let n = self.ring.len();
                let bin = ((angle.abs() / PI * n as f64) as usize).min(n - 1);
                if angle >= 0.0 {
                    self.ring[bin].add(&self.shape, part, types, exchanged);
                } else {
                    let types = [types[1], types[0]];
                    self.ring[bin].add(&self.shape, partner, types, exchanged);
                }
            }
            if let Some(cameras) = pair.cameras {
                self.add_named(cameras, part, types, exchanged);
            }
        }
    }

    fn add_named(&mut self, cameras: [&str; 2], part: usize, types: [usize; 2], exchanged: bool) {
        let at = self.named.iter().position(|named| named.cameras == cameras);
        let at = at.unwrap_or_else(|| {
            self.named.push(NamedPair {
                cameras: cameras.map(str::to_owned),
                counts: Counts::new(&self.shape),
            });
            self.named.len() - 1
        });
        self.named[at].counts.add(&self.shape, part, types, exchanged);
    }

    /// Returns true if a part and its parent are right. Only then does the type of the part count, because it is relative to the parent.
    fn is_right(&self, view: &ViewObservation, part: usize) -> bool {
        let parent = PARENT.get(part).copied().flatten().unwrap_or(part);
        let right = |part: usize| {
            view.errors.get(part).is_some_and(|error| *error <= self.settings.max_error)
        };
        right(part) && right(parent)
    }

    /// Counts an instant whose views were added.
    pub fn end_instant(&mut self) {
        self.from.instants += 1;
    }

    /// Returns the regression of the joints.
    pub fn joints(&self) -> &JointFit {
        &self.joints
    }

    /// Returns the mean lift of another learner's types under the tables of this one: the mean over all parts of `ln p(a, b) / (p(a)
    /// p(b))`. It is above 0 if the tables are informative.
    pub fn lift_on(&self, other: &Self) -> Option<f64> {
        let marginals =
            crate::learned::marginals(&self.shape, &self.ring.iter().collect::<Vec<_>>());
        let (mut sum, mut n) = (0.0, 0.0);
        for (own, theirs) in self.ring.iter().zip(&other.ring) {
            for exchanged in [false, true] {
                let joint = own.joint(&self.shape, &marginals, self.settings.smoothing, exchanged);
                for (part, cells) in theirs.of(exchanged).iter().enumerate() {
                    let (rows, cols) = (joint[part].column_sum(), joint[part].row_sum());
                    for (cell, count) in cells.iter().enumerate().filter(|cell| *cell.1 > 0) {
                        let at = (cell / cols.len(), cell % cols.len());
                        let lift = joint[part][at] / (rows[at.0] * cols[at.1]);
                        sum += f64::from(*count) * lift.ln();
                        n += f64::from(*count);
                    }
                }
            }
        }
        (n > 0.0).then(|| sum / n)
    }

    /// Returns the learned parameters.
    ///
    /// * `rig`: the rig of the pairs of cameras that were learned by name.
    ///
    /// # Errors
    ///
    /// [`LearnError::Nothing`].
    pub fn learned(
        &self,
        fingerprint: String,
        weights: Weights,
        rig: Option<&str>,
        ridge: Option<f64>,
    ) -> Result<Learned, LearnError> {
        if self.ring.iter().all(|counts| counts.total() == 0) {
            return Err(LearnError::Nothing {
                views: self.from.views,
            });
        }
        let (format, version) = Learned::head();
        let rigs = rig.map(|name| NamedRig {
            name: name.to_owned(),
            pairs: self.named.clone(),
        });
        let sets = JointSet::ALL.into_iter();
        Ok(Learned {
            format,
            version,
            model: ModelOf {
                fingerprint,
                shape: self.shape.clone(),
            },
            learned: self.from,
            weights,
            tau_tenths: self.errors.iter().map(|error| median(error)).collect(),
            smoothing: self.settings.smoothing,
            ring: self.ring.clone(),
            rigs: rigs.into_iter().collect(),
            joints: ridge.map_or_else(Vec::new, |ridge| {
                sets.map(|set| self.joints.solve(set, ridge)).collect()
            }),
        })
    }
}

/// Returns the median; the lower one for an even number of values.
fn median(values: &[f32]) -> f32 {
    let median = Sorted::new(values).lower_median();
    // More than four digits would exceed the precision of the pictures.
    median.map_or(0.0, |median| (median * 1e4).round() / 1e4)
}
