//! Search for the offsets of all cameras that agree best, and for the second best.

use crate::synchronisation::curve::{Curve, STEP_S};

/// Number of samples with a gain of 0 that are added, so that a gain from few samples has a low weight.
const PRIOR_SAMPLES: f64 = 20.0;
/// The basin around the best offset ends where the gain falls below this fraction of the best gain.
const BASIN: f64 = 0.6;
/// Number of neighbours on each side that an entry is compared with; the entry is a peak if no neighbour is higher.
const NEAR: usize = 3;
/// Length of the blocks of time whose gains are assumed independent, in seconds.
const BLOCK_S: f64 = 0.5;
/// Maximum number of cameras for which every division into two groups is tried.
const MOST_DIVIDED: usize = 8;

/// A division of the cameras into two groups, with a comparison of the best and the second-best offset between the groups.
#[derive(Debug, Clone)]
pub(crate) struct Rival {
    /// Cameras of the group without the reference.
    pub(crate) group: Vec<usize>,
    /// Difference between the second-best and the best offset of the group, in seconds.
    pub(crate) away_s: f64,
    /// Gain of the second-best offset as a fraction of the gain of the best.
    pub(crate) ratio: f64,
    /// Difference of the two gains, in standard errors.
    pub(crate) t: f64,
}

/// Result of the search.
#[derive(Debug, Clone)]
pub(crate) struct Found {
    /// Offset of each camera in seconds; 0 for the reference.
    pub(crate) offsets_s: Vec<f64>,
    /// One rival for every division, the most doubtful first.
    pub(crate) rivals: Vec<Rival>,
}

/// Finds the offsets with the largest gain over all pairs.
///
/// * `active`: the cameras that take part; the first is the reference.
/// * `curves`: curves of pairs of these cameras.
pub(crate) fn search(n_cameras: usize, active: &[usize], curves: &[Curve]) -> Found {
    let groups = groups(active);
    let mut best: Option<(f64, Vec<f64>)> = None;
    for mut offsets_s in starts(n_cameras, active, curves) {
        for _ in 0..20 {
            let mut has_moved = false;
            for group in &groups {
                let curve = Joint::new(curves, group, &offsets_s);
                let (by, value) = curve.best();
                if by != 0 && value > curve.value(0) + 1e-9 {
                    for &camera in group {
                        offsets_s[camera] += by as f64 * STEP_S;
                    }
                    has_moved = true;
                }
            }
            if !has_moved {
                break;
            }
        }
        let value = total(curves, &offsets_s);
        if best.as_ref().is_none_or(|best| value > best.0) {
            best = Some((value, offsets_s));
        }
    }
    let mut offsets_s = best.map_or_else(|| vec![0.0; n_cameras], |best| best.1);
    let zero = active.first().map_or(0.0, |active| offsets_s[*active]);
    for it in &mut offsets_s {
        *it -= zero;
    }
    let mut rivals: Vec<Rival> =
        groups.iter().map(|group| rival(curves, group, &offsets_s)).collect();
    rivals.sort_by(|a, b| b.ratio.total_cmp(&a.ratio));
    Found { offsets_s, rivals }
}

/// Returns the groups of cameras that are shifted relative to the others: all groups without the reference, or single cameras if there are
/// many.
fn groups(active: &[usize]) -> Vec<Vec<usize>> {
    let others = active.get(1..).unwrap_or(&[]);
    if active.len() > MOST_DIVIDED {
        let mut singles: Vec<Vec<usize>> = others.iter().map(|other| vec![*other]).collect();
        singles.push(others.to_vec());
        return singles;
    }
    let chosen = |bits: usize| {
        let each = others.iter().enumerate();
        each.filter(|(nth, _)| bits >> nth & 1 == 1).map(|other| *other.1).collect()
    };
    (1..1_usize << others.len()).map(chosen).collect()
}

/// Returns offsets from which the search begins: along the pairs with the clearest minima, and from every camera to all others.
fn starts(n_cameras: usize, active: &[usize], curves: &[Curve]) -> Vec<Vec<f64>> {
    let mut peaks: Vec<(f64, [usize; 2], f64)> = curves
        .iter()
        .map(|curve| {
            let (nth, value) = peak(curve);
            (value, curve.cameras, curve.offset_s(nth))
        })
        .collect();
    peaks.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut starts = vec![spread(n_cameras, &peaks)];
    for &hub in active {
        let of_hub: Vec<_> = peaks.iter().filter(|peak| peak.1.contains(&hub)).copied().collect();
        starts.push(spread(n_cameras, &of_hub));
    }
    starts
}

/// Returns offsets that follow from the offsets of pairs; earlier pairs in the list take precedence.
fn spread(n_cameras: usize, peaks: &[(f64, [usize; 2], f64)]) -> Vec<f64> {
    let mut offsets_s = vec![0.0; n_cameras];
    let mut tree: Vec<usize> = (0..n_cameras).collect();
    for &(_, [a, b], offset_s) in peaks {
        let (of_a, of_b) = (tree[a], tree[b]);
        if of_a == of_b {
            continue;
        }
        // The offset of a pair is the offset of the first camera minus the offset of the second.
        let by = offsets_s[a] - offset_s - offsets_s[b];
        for camera in 0..n_cameras {
            if tree[camera] == of_b {
                offsets_s[camera] += by;
                tree[camera] = of_a;
            }
        }
    }
    offsets_s
}

/// Returns the clearest minimum of a pair: its entry, and its clarity.
pub(crate) fn peak(curve: &Curve) -> (usize, f64) {
    let each = curve.gain.iter().zip(&curve.n).enumerate();
    let each = each.map(|(nth, (gain, n))| (nth, clearness(*gain, *n)));
    each.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, 0.0))
}

/// Returns the second-best minimum of a pair: its entry, and its gain as a fraction of the best.
pub(crate) fn second(curve: &Curve) -> Option<(usize, f64)> {
    let (best, _) = peak(curve);
    let each = curve.gain.iter().zip(&curve.n);
    let values: Vec<f64> = each.map(|(gain, n)| clearness(*gain, *n)).collect();
    let other = other_peak(&values, best)?;
    Some((other, (values[other] / values[best]).max(0.0)))
}

/// Returns the highest peak outside the basin of the best entry. If the basin extends to an end, the end counts as a peak.
fn other_peak(values: &[f64], best: usize) -> Option<usize> {
    let last = values.len().checked_sub(1)?;
    let is_below = |i: &usize| values[*i] < BASIN * values[best];
    let after = (best..=last).find(is_below).unwrap_or(last);
    let before = (0..=best).rev().find(is_below).unwrap_or(0);
    let is_peak = |i: &usize| {
        let near = i.saturating_sub(NEAR)..=(i + NEAR).min(last);
        // A flank of the basin is not a peak, because the neighbour towards the best entry is higher.
        near.clone().all(|other| values[other] <= values[*i])
    };
    let others = (0..=before).chain(after..=last);
    let others = others.filter(|other| *other != best && is_peak(other));
    others.max_by(|a, b| values[*a].total_cmp(&values[*b]))
}

fn clearness(gain: f64, n: f64) -> f64 {
    gain / (n + PRIOR_SAMPLES).sqrt()
}

fn total(curves: &[Curve], offsets_s: &[f64]) -> f64 {
    let (mut gain, mut n) = (0.0, 0.0);
    for it in curves {
        let [a, b] = it.cameras;
        if let Some(nth) = it.index(offsets_s[a] - offsets_s[b]) {
            gain += it.gain[nth];
            n += it.n[nth];
        }
    }
    clearness(gain, n)
}

/// Curves of all pairs between a group and the other cameras, as a function of a shift of the whole group.
struct Joint<'a> {
    /// Each curve, its entry without a shift, and the sign with which the shift is added.
    crossing: Vec<(&'a Curve, i64, i64)>,
    half: i64,
}

impl<'a> Joint<'a> {
    fn new(curves: &'a [Curve], group: &[usize], offsets_s: &[f64]) -> Self {
        let crosses =
            |curve: &&Curve| group.contains(&curve.cameras[0]) != group.contains(&curve.cameras[1]);
        let crossing = curves.iter().filter(crosses);
        let crossing: Vec<_> = crossing
            .map(|crossing| {
                let [a, b] = crossing.cameras;
                let now = (offsets_s[a] - offsets_s[b] - crossing.first_s) / crossing.step_s;
                let sign = if group.contains(&a) { 1 } else { -1 };
                (crossing, now.round() as i64, sign)
            })
            .collect();
        let half = crossing.iter().map(|crossing| crossing.0.gain.len() as i64).max();
        Self {
            crossing,
            half: half.unwrap_or(0),
        }
    }

    fn entries(&self, by: i64) -> impl Iterator<Item = (&'a Curve, usize)> {
        let each = self.crossing.iter();
        each.filter_map(move |&(curve, now, sign)| {
            let nth = usize::try_from(now + sign * by).ok()?;
            (nth < curve.gain.len()).then_some((curve, nth))
        })
    }

    fn value(&self, by: i64) -> f64 {
        let (mut gain, mut n) = (0.0, 0.0);
        for (curve, nth) in self.entries(by) {
            gain += curve.gain[nth];
            n += curve.n[nth];
        }
        clearness(gain, n)
    }

    fn best(&self) -> (i64, f64) {
        let each = (-self.half..=self.half).map(|offset| (offset, self.value(offset)));
        each.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, 0.0))
    }

    /// Returns the gains of the blocks of time, without and with a shift.
    fn blocks(&self, by: i64) -> Vec<[f64; 2]> {
        let mut blocks = std::collections::BTreeMap::<(usize, i64), [f64; 2]>::new();
        for (number, &(curve, now, sign)) in self.crossing.iter().enumerate() {
            let entries = [now, now + sign * by].map(|index| usize::try_from(index).ok());
            for sample in &curve.samples {
                let block = (sample.time_s / BLOCK_S).floor() as i64;
                let sums = blocks.entry((number, block)).or_default();
                for (sum, nth) in sums.iter_mut().zip(entries) {
                    *sum += nth.and_then(|nth| sample.gain(nth)).unwrap_or(0.0);
                }
            }
        }
        blocks.into_values().collect()
    }
}

/// Returns the second-best offset of a group.
fn rival(curves: &[Curve], group: &[usize], offsets_s: &[f64]) -> Rival {
    let joint = Joint::new(curves, group, offsets_s);
    let values: Vec<f64> = (-joint.half..=joint.half).map(|offset| joint.value(offset)).collect();
    let now = joint.half as usize;
    let best = values.get(now).copied().unwrap_or(0.0);
    let other = other_peak(&values, now);
    let by = other.map_or(0, |other| other as i64 - joint.half);
    let value = other.map_or(0.0, |other| values[other]);
    let differences: Vec<f64> = joint.blocks(by).iter().map(|block| block[0] - block[1]).collect();
    Rival {
        group: group.to_vec(),
        away_s: by as f64 * STEP_S,
        ratio: if best > 0.0 {
            (value / best).max(0.0)
        } else {
            1.0
        },
        t: if other.is_some() {
            sum_in_errors(&differences)
        } else {
            f64::INFINITY
        },
    }
}

/// Returns the sum of independent numbers, in units of its standard error.
fn sum_in_errors(each: &[f64]) -> f64 {
    let n = each.len() as f64;
    let sum: f64 = each.iter().sum();
    let squares: f64 = each.iter().map(|value| (value - sum / n).powi(2)).sum();
    let error = (squares * n / (n - 1.0).max(1.0)).sqrt();
    if error > 0.0 { sum / error } else { 0.0 }
}
