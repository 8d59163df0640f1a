//! Comparison of two rigs on data that neither was fitted to, and selection of the person for each camera.

use std::collections::BTreeMap;

use geometry::Camera;
use statistics::Sorted;

use super::Outcome;
use crate::people::begin::{Choice, Study};
use crate::people::certainty::BLOCK_S;
use crate::people::sides::{exchange, of_pair, point};

/// A rig counts as better if it decreases the distance by at least this fraction.
const LEAST_GAIN: f64 = 0.02;
/// A rig counts as better if its mean improvement over the blocks is at least this number of standard errors.
const CERTAIN: f64 = 2.0;
/// Minimum number of joints in a block.
const LEAST: usize = 20;

/// Returns, for each camera, the chain (one person's tracks) that best fits the other cameras with the given rig.
pub(super) fn chosen(study: &Study<'_>, offsets_s: &[f64]) -> Vec<Choice> {
    let choice = |(camera, chain): (usize, usize)| Choice {
        chain,
        offset_s: offsets_s.get(camera).copied().unwrap_or(0.0),
        is_exchanged: false,
    };
    let n = study.cameras.len();
    let n_chains = |camera: usize| study.chains[camera].len();
    // The person that all cameras see is searched for among the people of the camera that sees the fewest.
    let anchor = (0..n).min_by_key(|i| n_chains(*i)).unwrap_or(0);
    let followed = (0..n_chains(anchor)).map(|chain| {
        let with = |camera: usize| {
            let each = (0..n_chains(camera)).map(|i| {
                let pair = [(anchor, chain), (camera, i)];
                (distance(study, pair, pair.map(choice)), i)
            });
            each.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((f64::INFINITY, 0))
        };
        let all: Vec<(f64, usize)> =
            (0..n).map(|i| if i == anchor { (0.0, chain) } else { with(i) }).collect();
        let sum: f64 = all.iter().map(|fit| fit.0).sum();
        (sum, all)
    });
    let best = followed.min_by(|a, b| a.0.total_cmp(&b.0));
    let chains = best.map_or_else(|| vec![(0.0, 0); n], |best| best.1);
    let chains = chains.iter().enumerate();
    chains.map(|(camera, it)| choice((camera, it.1))).collect()
}

/// Returns the median distance between the joints of a person in one camera and those of a person in another, as a fraction of the
/// person's size. It is infinite if both cameras see too few joints.
///
/// * `pair`: a camera and a chain for each.
fn distance(study: &Study<'_>, pair: [(usize, usize); 2], choices: [Choice; 2]) -> f64 {
    let [(anchor, _), (camera, chain)] = pair;
    let mut all = vec![None; study.cameras.len()];
    (all[anchor], all[camera]) = (Some(choices[0]), Some(choices[1]));
    let seen = study.sightings(&all);
    let mut each = Vec::new();
    for instant in &seen.seen {
        for (own, other) in instant[camera].iter().zip(&instant[anchor]) {
            if let Some(it) = *own {
                let away = of_pair(&study.cameras, [anchor, camera], *other, [it; 2]);
                each.extend(away.map(|away| away[0]));
            }
        }
    }
    if each.len() < LEAST {
        return f64::INFINITY;
    }
    let median = Sorted::new(each).upper_median();
    median.map_or(f64::INFINITY, |median| {
        median / study.chains[camera][chain].size()
    })
}

/// Distances of joints from the positions that the other cameras predict, by block of time, with the given rig and with the new one.
#[derive(Debug, Default)]
pub(super) struct Blocks {
    /// Mean robust cost of each block, with the given rig and with the new one.
    costs: BTreeMap<i64, [f64; 2]>,
    /// All distances of each camera in pixels, with the given rig and with the new one.
    distances: Vec<[Vec<f64>; 2]>,
}

impl Blocks {
    /// Adds data to which the rigs were not fitted.
    pub(super) fn add(
        &mut self,
        rest: &Study<'_>,
        (before, choices): (&[Camera], &[Choice]),
        (after, moved): (&[Camera], &[Choice]),
    ) {
        let n = before.len();
        self.distances.resize_with(n, Default::default);
        let mut sums = BTreeMap::<i64, [(f64, usize); 2]>::new();
        for (nth, (cameras, choices)) in [(before, choices), (after, moved)].into_iter().enumerate()
        {
            let chosen: Vec<Option<Choice>> = choices.iter().copied().map(Some).collect();
            let sigmas_px = rest.sigmas(&chosen);
            let mut seen = rest.sightings(&chosen);
            exchange(cameras, &mut seen, &sigmas_px, rest.sides);
            for (time_s, instant) in seen.times_s.iter().zip(&seen.seen) {
                let block = (time_s / BLOCK_S * 2.0).floor() as i64;
                for camera in 0..n {
                    let others: Vec<usize> = (0..n).filter(|i| *i != camera).collect();
                    for joint in 0..rest.n_joints {
                        let Some(it) = instant[camera][joint] else {
                            continue;
                        };
                        let away = match &others[..] {
                            [only] => {
                                of_pair(cameras, [*only, camera], instant[*only][joint], [it; 2])
                                    .map(|distances| distances[0])
                            }
                            many => point(cameras, instant, many, joint, &sigmas_px)
                                .and_then(|point| cameras[camera].project(&point))
                                .map(|image| (image - it.at).norm()),
                        };
                        let Some(away) = away else { continue };
                        self.distances[camera][nth].push(away);
                        let sum = &mut sums.entry(block).or_default()[nth];
                        sum.0 += (away / sigmas_px[camera][joint]).powi(2).ln_1p();
                        sum.1 += 1;
                    }
                }
            }
        }
        for (block, both) in sums {
            if both.iter().all(|sum| sum.1 >= LEAST) {
                self.costs.insert(block, both.map(|(sum, n)| sum / n as f64));
            }
        }
    }

    /// Returns the median distance of a camera in pixels, with the given rig and with the new one.
    pub(super) fn of_camera(&self, camera: usize) -> [f64; 2] {
        let of = |distances: &Vec<f64>| {
            Sorted::new(distances.clone()).upper_median().unwrap_or(f64::NAN)
        };
        self.distances.get(camera).map_or([f64::NAN; 2], |distance| {
            [of(&distance[0]), of(&distance[1])]
        })
    }

    /// Decides whether the new rig is better.
    pub(super) fn judge(&self, outcome: &mut Outcome) {
        let all = |nth: usize| {
            let each = self.distances.iter().flat_map(|distance| distance[nth].iter().copied());
            Sorted::new(each.collect::<Vec<_>>()).upper_median().unwrap_or(f64::NAN)
        };
        let [before, after] = [all(0), all(1)];
        outcome.held_out_px = [before, after];
        let gains: Vec<f64> = self.costs.values().map(|[a, b]| a - b).collect();
        let n = gains.len() as f64;
        let mean = gains.iter().sum::<f64>() / n;
        let squares: f64 = gains.iter().map(|gain| (gain - mean).powi(2)).sum();
        let error = (squares / (n - 1.0).max(1.0) / n).sqrt();
        outcome.blocks = [
            gains.len(),
            gains.iter().filter(|gain| **gain > 0.0).count(),
        ];
        outcome.certainty = if gains.len() < 2 {
            0.0
        } else {
            mean / error.max(1e-12)
        };
        outcome.is_better = after < (1.0 - LEAST_GAIN) * before && outcome.certainty > CERTAIN;
    }
}
