//! Cost of the offset between the clocks of a pair of cameras.

use geometry::Camera;

use crate::synchronisation::pair::{Epipolar, cost};
use crate::synchronisation::track::{LEAST_JOINTS, Track};

/// Step between the offsets that are tried, and between the times at which people are compared, in seconds.
pub(crate) const STEP_S: f64 = 0.01;
/// Maximum number of samples for a pair of cameras.
const MOST_SAMPLES: usize = 500;

/// People of one camera at multiples of [`STEP_S`], by the camera's own clock.
#[derive(Debug, Clone)]
pub(crate) struct Grid {
    first: i64,
    columns: Vec<Vec<Standing>>,
}

/// A person at one time.
#[derive(Debug, Clone)]
struct Standing {
    size: f64,
    /// Position and weight by joint; the weight is 0 if the position is not known.
    joints: Vec<([f64; 2], f64)>,
}

impl Grid {
    /// Creates the grid.
    ///
    /// * `span`: times to cover, in seconds by the clock of the camera.
    pub(crate) fn new(tracks: &[Track], n_joints: usize, span: [f64; 2]) -> Self {
        let first = (span[0] / STEP_S).ceil() as i64;
        let last = (span[1] / STEP_S).floor() as i64;
        let n = usize::try_from(last - first + 1).unwrap_or(0);
        let mut columns = vec![Vec::new(); n];
        for track in tracks {
            let from = ((track.span[0] / STEP_S).ceil() as i64).max(first);
            let to = ((track.span[1] / STEP_S).floor() as i64).min(last);
            for index in from..=to {
                let time_s = index as f64 * STEP_S;
                let joint = |joint: usize| {
                    let place = track.place(joint, time_s);
                    place.map_or(([0.0; 2], 0.0), |place| (place.at, place.weight))
                };
                let joints: Vec<_> = (0..n_joints).map(joint).collect();
                if joints.iter().filter(|joint| joint.1 > 0.0).count() >= LEAST_JOINTS {
                    columns[(index - first) as usize].push(Standing {
                        size: track.size,
                        joints,
                    });
                }
            }
        }
        Self { first, columns }
    }

    fn at(&self, index: i64) -> &[Standing] {
        let nth = usize::try_from(index - self.first).ok();
        nth.and_then(|nth| self.columns.get(nth)).map_or(&[], |column| column)
    }
}

/// One person of the first camera at one time, and the cost of each offset for this person.
#[derive(Debug, Clone)]
pub(crate) struct Costs {
    /// Time in seconds by the clock of the first camera.
    pub(crate) time_s: f64,
    /// Cost by offset; NaN if the second camera sees no person at that time.
    each: Vec<f32>,
    /// Mean over the offsets that have a cost.
    mean: f64,
}

impl Costs {
    /// Returns the decrease of the cost relative to the mean of all offsets; `None` if the offset has no cost.
    pub(crate) fn gain(&self, nth: usize) -> Option<f64> {
        let cost = f64::from(*self.each.get(nth)?);
        cost.is_finite().then_some(self.mean - cost)
    }
}

/// Cost of every offset between the clocks of two cameras.
#[expect(
    clippy::partial_pub_fields,
    reason = "only the search uses the samples; the other fields are read elsewhere"
)]
#[derive(Debug, Clone)]
pub struct Curve {
    /// Indices of the two cameras.
    pub cameras: [usize; 2],
    /// Step between offsets, in seconds.
    pub step_s: f64,
    /// Offset of the first entry in seconds. An offset is added to a time of the first camera to get the time of the second.
    pub first_s: f64,
    /// Decrease of the cost by offset relative to the mean of all offsets, over all samples.
    pub gain: Vec<f64>,
    /// Mean cost by offset; NaN if the recordings do not overlap at this offset.
    pub cost: Vec<f64>,
    /// Number of samples by offset.
    pub n: Vec<f64>,
    pub(crate) samples: Vec<Costs>,
}

impl Curve {
    /// Searches all offsets.
    ///
    /// * `window_s`: largest offset in both directions.
    /// * `mirror`: for each joint, the index of the corresponding joint on the other side of the body; `None` if left and right are never
    ///   swapped.
    pub(crate) fn search(
        numbers: [usize; 2],
        cameras: [&Camera; 2],
        grids: [&Grid; 2],
        window_s: f64,
        mirror: Option<&[usize]>,
    ) -> Option<Self> {
        let epipolar = Epipolar::new(cameras[0], cameras[1])?;
        let half = (window_s / STEP_S).round() as i64;
        let [of_a, of_b] = grids;
        let n_samples: usize = of_a.columns.iter().map(Vec::len).sum();
        let stride = n_samples.div_ceil(MOST_SAMPLES).max(1);
        let mut samples = Vec::new();
        for (nth, column) in of_a.columns.iter().enumerate().step_by(stride) {
            let index = of_a.first + nth as i64;
            for standing in column {
                let of_offset = |m: i64| {
                    let others = of_b.at(index + m).iter();
                    let each = others.filter_map(|other| epipolar.costs(standing, other, mirror));
                    each.min_by(f64::total_cmp).map_or(f32::NAN, |value| value as f32)
                };
                let each: Vec<f32> = (-half..=half).map(of_offset).collect();
                let known = each.iter().filter(|value| value.is_finite());
                let n = known.clone().count();
                if n > 0 {
                    let mean = known.map(|value| f64::from(*value)).sum::<f64>() / n as f64;
                    let time_s = index as f64 * STEP_S;
                    samples.push(Costs { time_s, each, mean });
                }
            }
        }
        (!samples.is_empty()).then(|| Self::from_samples(numbers, half, samples))
    }

    fn from_samples(cameras: [usize; 2], half: i64, samples: Vec<Costs>) -> Self {
        let n_offsets = (2 * half + 1) as usize;
        let mut it = Self {
            cameras,
            step_s: STEP_S,
            first_s: -(half as f64) * STEP_S,
            gain: vec![0.0; n_offsets],
            cost: vec![0.0; n_offsets],
            n: vec![0.0; n_offsets],
            samples: Vec::new(),
        };
        for sample in &samples {
            for (nth, cost) in sample.each.iter().enumerate() {
                if cost.is_finite() {
                    it.gain[nth] += sample.mean - f64::from(*cost);
                    it.cost[nth] += f64::from(*cost);
                    it.n[nth] += 1.0;
                }
            }
        }
        for (cost, n) in it.cost.iter_mut().zip(&it.n) {
            *cost /= n;
        }
        it.samples = samples;
        it
    }

    /// Returns the entry nearest to an offset; `None` outside the window.
    pub(crate) fn index(&self, offset_s: f64) -> Option<usize> {
        let nth = ((offset_s - self.first_s) / self.step_s).round();
        (nth >= 0.0 && nth < self.gain.len() as f64).then_some(nth as usize)
    }

    /// Returns the offset of an entry, in seconds.
    pub fn offset_s(&self, nth: usize) -> f64 {
        self.first_s + nth as f64 * self.step_s
    }
}

impl Epipolar {
    /// Returns the mean cost of the joints that two people have in common; `None` if there are too few.
    fn costs(&self, a: &Standing, b: &Standing, mirror: Option<&[usize]>) -> Option<f64> {
        let plain = self.costs_of(a, b, |joint| joint)?;
        let Some(mirror) = mirror else {
            return Some(plain);
        };
        let exchanged = self.costs_of(a, b, |i| mirror[i]);
        Some(exchanged.map_or(plain, |exchanged| exchanged.min(plain)))
    }

    fn costs_of(&self, a: &Standing, b: &Standing, other: impl Fn(usize) -> usize) -> Option<f64> {
        let (mut sum, mut weights, mut n) = (0.0, 0.0, 0);
        for (joint, &(in_a, weight_a)) in a.joints.iter().enumerate() {
            let (in_b, weight_b) = b.joints[other(joint)];
            let weight = weight_a * weight_b;
            if weight > 0.0
                && let Some(residual) = self.residual(in_a, in_b, [a.size, b.size])
            {
                sum += weight * cost(residual.value);
                weights += weight;
                n += 1;
            }
        }
        (n >= LEAST_JOINTS).then(|| sum / weights)
    }
}
