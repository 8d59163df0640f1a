//! Two rigs beside one another on what neither was fitted to, and which person each camera sees.

use std::collections::BTreeMap;

use geometry::Camera;
use statistics::Sorted;

use super::Outcome;
use crate::people::begin::{Choice, Study};
use crate::people::certainty::BLOCK_S;
use crate::people::sides::{exchange, of_pair, point};

/// A rig is better only where the distance becomes less by this share.
const LEAST_GAIN: f64 = 0.02;
/// And where the mean gain of a block is so many standard errors.
const CERTAIN: f64 = 2.0;
/// A block has at least so many joints.
const LEAST: usize = 20;

/// Of each camera the chain that fits what the others see, by the rig that is given.
pub(super) fn chosen(study: &Study<'_>, offsets_s: &[f64]) -> Vec<Choice> {
    let first = |camera: usize| Choice {
        chain: 0,
        offset_s: offsets_s.get(camera).copied().unwrap_or(0.0),
        is_exchanged: false,
    };
    let n = study.cameras.len();
    let mut choices: Vec<Choice> = (0..n).map(first).collect();
    // The person of the camera with fewest others in view is the one that is followed.
    let anchor = (0..n).min_by_key(|it| study.chains[*it].len()).unwrap_or(0);
    for camera in (0..n).filter(|it| *it != anchor) {
        let cost = |chain: usize| {
            let mut all = vec![None; n];
            all[anchor] = Some(choices[anchor]);
            all[camera] = Some(Choice {
                chain,
                ..first(camera)
            });
            let seen = study.sightings(&all);
            let mut each = Vec::new();
            for instant in &seen.seen {
                let both = instant[camera].iter().zip(&instant[anchor]);
                for (own, other) in both {
                    if let Some(it) = *own {
                        let pair = [anchor, camera];
                        let away = of_pair(&study.cameras, pair, *other, [it; 2]);
                        each.extend(away.map(|it| it[0]));
                    }
                }
            }
            if each.len() < LEAST {
                return f64::INFINITY;
            }
            Sorted::new(each).upper_median().unwrap_or(f64::INFINITY)
        };
        let n_chains = study.chains[camera].len();
        let best = (0..n_chains).min_by(|a, b| cost(*a).total_cmp(&cost(*b)));
        choices[camera].chain = best.unwrap_or(0);
    }
    choices
}

/// Distances of joints from where the other cameras see them, by block of time, before and after.
#[derive(Debug, Default)]
pub(super) struct Blocks {
    /// Of each block the mean robust costs.
    costs: BTreeMap<i64, [f64; 2]>,
    /// Of each camera all distances, pixels.
    distances: Vec<[Vec<f64>; 2]>,
}

impl Blocks {
    /// Adds what a rig was not fitted to.
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
                    let others: Vec<usize> = (0..n).filter(|it| *it != camera).collect();
                    for joint in 0..rest.n_joints {
                        let Some(it) = instant[camera][joint] else {
                            continue;
                        };
                        let away = match &others[..] {
                            [only] => {
                                of_pair(cameras, [*only, camera], instant[*only][joint], [it; 2])
                                    .map(|it| it[0])
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
            if both.iter().all(|it| it.1 >= LEAST) {
                self.costs
                    .insert(block, both.map(|(sum, n)| sum / n as f64));
            }
        }
    }

    /// Median distances of a camera, pixels: before and after.
    pub(super) fn of_camera(&self, camera: usize) -> [f64; 2] {
        let of = |it: &Vec<f64>| Sorted::new(it.clone()).upper_median().unwrap_or(f64::NAN);
        self.distances
            .get(camera)
            .map_or([f64::NAN; 2], |it| [of(&it[0]), of(&it[1])])
    }

    /// Whether the new rig is better.
    pub(super) fn judge(&self, outcome: &mut Outcome) {
        let all = |nth: usize| {
            let each = self.distances.iter().flat_map(|it| it[nth].iter().copied());
            Sorted::new(each.collect::<Vec<_>>())
                .upper_median()
                .unwrap_or(f64::NAN)
        };
        let [before, after] = [all(0), all(1)];
        outcome.held_out_px = [before, after];
        let gains: Vec<f64> = self.costs.values().map(|[a, b]| a - b).collect();
        let n = gains.len() as f64;
        let mean = gains.iter().sum::<f64>() / n;
        let squares: f64 = gains.iter().map(|it| (it - mean).powi(2)).sum();
        let error = (squares / (n - 1.0).max(1.0) / n).sqrt();
        outcome.blocks = [gains.len(), gains.iter().filter(|it| **it > 0.0).count()];
        outcome.certainty = if gains.len() < 2 {
            0.0
        } else {
            mean / error.max(1e-12)
        };
        outcome.is_better = after < (1.0 - LEAST_GAIN) * before && outcome.certainty > CERTAIN;
    }
}
