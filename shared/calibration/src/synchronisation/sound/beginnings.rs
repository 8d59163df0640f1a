//! When sounds begin, and at which offset the beginnings of two recordings fall together.

use super::Sound;

/// Distance of the times that are looked at, seconds.
pub(super) const HOP_S: f64 = 0.002;
/// Share of the last sample that is taken from each: hum and rumble go.
const EMPHASIS: f64 = 0.95;
/// The loudness of this many hops after a time is compared with that of this many before it.
const AFTER: usize = 4;
const BEFORE: usize = 12;
/// A sound begins where the logarithm of the energy grows by more than this, and growth beyond the second does not count.
const GROWTH: [f64; 2] = [0.5, 3.5];
/// Hops between two beginnings that are counted.
const APART: usize = 25;
/// Beginnings at most this many hops apart are of one sound.
const TOGETHER: i64 = 6;
/// Half the width of the kernel that makes peaks of the cosine smooth, hops: sources at different distances.
const SMOOTH: i64 = 4;
/// Another offset is at least this many hops from the best.
const OTHER: usize = 30;
/// Both recordings have at least this share of their energy where they overlap.
const LEAST_SHARE: f64 = 0.15;

/// How suddenly sounds begin, over time.
#[derive(Debug)]
pub(super) struct Beginnings {
    /// The time of the first entry, hops of the camera's clock.
    first: i64,
    /// 0 where nothing begins.
    values: Vec<f64>,
    /// Where sounds begin: the local maxima.
    peaks: Vec<i64>,
}

/// How the beginnings of two recordings fall together.
#[derive(Debug)]
pub(super) struct Match {
    /// The offset of the first of `cosines`, seconds.
    pub(super) first_s: f64,
    /// The cosine between both by offset, smooth; not a number where they hardly overlap.
    pub(super) cosines: Vec<f64>,
    /// The best offset, seconds: what is added to a time of the first to have that of the second.
    pub(super) offset_s: f64,
    /// Its cosine.
    pub(super) cosine: f64,
    /// By how many standard deviations over all offsets it is better than their mean.
    pub(super) contrast: f64,
    /// The best of the other offsets, and its cosine.
    pub(super) second_s: f64,
    pub(super) second: f64,
    /// Beginnings that fall together.
    pub(super) n: usize,
}

impl Match {
    /// How good the second best offset is, as a share of the best.
    pub(super) fn ratio(&self) -> f64 {
        if self.cosine > 0.0 {
            self.second / self.cosine
        } else {
            1.0
        }
    }
}

impl Beginnings {
    pub(super) fn of(sound: &Sound) -> Self {
        let first = (sound.begins_s / HOP_S).ceil() as i64;
        let energies = energies(sound, first);
        let mut sorted: Vec<f64> =
            energies.iter().copied().filter(|energy| *energy > 0.0).collect();
        sorted.sort_by(f64::total_cmp);
        // One step of the converter in every sample, where it is quieter than that.
        let floor = sorted.get(sorted.len() / 2).map_or(1.0, |sorted| sorted.max(1.0));
        let mut sums = vec![0.0];
        for energy in &energies {
            sums.push(sums[sums.len() - 1] + (energy + floor).ln());
        }
        let growth = |at: usize| {
            if at < BEFORE || at + AFTER > energies.len() {
                return 0.0;
            }
            let after = (sums[at + AFTER] - sums[at]) / AFTER as f64;
            let before = (sums[at] - sums[at - BEFORE]) / BEFORE as f64;
            (after - before).min(GROWTH[1]) - GROWTH[0]
        };
        let values: Vec<f64> = (0..energies.len()).map(|i| growth(i).max(0.0)).collect();
        let peaks = peaks(&values);
        let peaks = peaks.into_iter().map(|peak| first + peak as i64).collect();
        Self {
            first,
            values,
            peaks,
        }
    }

    /// How many sounds begin.
    pub(super) fn n(&self) -> usize {
        self.peaks.len()
    }

    pub(super) fn length_s(&self) -> f64 {
        self.values.len() as f64 * HOP_S
    }

    fn at(&self, hop: i64) -> f64 {
        let nth = usize::try_from(hop - self.first).ok();
        nth.and_then(|nth| self.values.get(nth)).map_or(0.0, |value| *value)
    }

    /// From when to when something is recorded, hops.
    pub(super) fn span(&self) -> [i64; 2] {
        [self.first, self.first + self.values.len() as i64]
    }

    /// The part of a length in which most begins in both, hops; all of it if it is shorter.
    pub(super) fn loudest(&self, other: &Self, length_s: f64) -> [i64; 2] {
        let length = (length_s / HOP_S) as i64;
        let [from, to] = self.span();
        if to - from <= length {
            return [from, to];
        }
        let n_in = |heard: &Self, span: [i64; 2]| {
            let within = |hop: &&i64| (span[0]..span[1]).contains(*hop);
            heard.peaks.iter().filter(within).count()
        };
        let starts = (from..=to - length).step_by((length / 6).max(1) as usize);
        let spans = starts.map(|start| [start, start + length]);
        let best = spans.max_by_key(|span| n_in(self, *span).min(n_in(other, *span)));
        best.unwrap_or([from, to])
    }

    /// The full search.
    ///
    /// * `span`: the part of this recording that is compared, hops.
    /// * `around_s`: offsets around the first, up to the second both ways, seconds.
    pub(super) fn compare(&self, other: &Self, span: [i64; 2], around_s: [f64; 2]) -> Match {
        let [centre, half] = around_s.map(|around_s| (around_s / HOP_S).round() as i64);
        let own: Vec<(i64, f64)> = (span[0]..span[1])
            .map(|hop| (hop, self.at(hop)))
            .filter(|hop| hop.1 > 0.0)
            .collect();
        let mut squares = vec![0.0];
        for value in &other.values {
            squares.push(squares[squares.len() - 1] + value * value);
        }
        let energy = |[from, to]: [i64; 2]| {
            let within =
                |value: i64| (value - other.first).clamp(0, other.values.len() as i64) as usize;
            squares[within(to)] - squares[within(from)]
        };
        let all: f64 = own.iter().map(|hop| hop.1 * hop.1).sum();
        let most = energy(other.span());
        let cosine = |offset: i64| {
            let [low, high] = other.span().map(|span| span - offset);
            let (mut product, mut of_own) = (0.0, 0.0);
            for (hop, value) in &own {
                if (low..high).contains(hop) {
                    product += value * other.at(hop + offset);
                    of_own += value * value;
                }
            }
            let of_other = energy([span[0] + offset, span[1] + offset]);
            let overlaps = of_own > LEAST_SHARE * all && of_other > LEAST_SHARE * most.min(all);
            if overlaps {
                product / (of_own * of_other).sqrt()
            } else {
                f64::NAN
            }
        };
        let cosines: Vec<f64> = (centre - half..=centre + half).map(cosine).collect();
        let cosines = smooth(&cosines);
        let first_s = (centre - half) as f64 * HOP_S;
        let mut found = Match::from_cosines(first_s, cosines);
        found.n = self.together(other, span, (found.offset_s / HOP_S).round() as i64);
        found
    }

    /// How many beginnings fall together at an offset, hops.
    fn together(&self, other: &Self, span: [i64; 2], offset: i64) -> usize {
        let is_shared = |hop: &&i64| {
            let of_other = other.peaks.iter();
            (span[0]..span[1]).contains(*hop)
                && of_other.clone().any(|value| (**hop + offset - value).abs() <= TOGETHER)
        };
        self.peaks.iter().filter(is_shared).count()
    }
}

impl Match {
    fn from_cosines(first_s: f64, cosines: Vec<f64>) -> Self {
        let or_none = |value: &f64| if value.is_finite() { *value } else { 0.0 };
        let known: Vec<f64> = cosines.iter().copied().filter(|cosine| cosine.is_finite()).collect();
        let n = known.len().max(1) as f64;
        let mean = known.iter().sum::<f64>() / n;
        let spread = (known.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / n).sqrt();
        let highest = |skip: Option<usize>| {
            let each = cosines.iter().enumerate();
            let allowed =
                each.filter(|(nth, _)| skip.is_none_or(|skip| nth.abs_diff(skip) > OTHER));
            let best = allowed.max_by(|a, b| or_none(a.1).total_cmp(&or_none(b.1)));
            best.map_or((0, 0.0), |(nth, it)| (nth, or_none(it)))
        };
        let (nth, cosine) = highest(None);
        let (second, second_cosine) = highest(Some(nth));
        let around = |by: usize| cosines.get((nth + by).wrapping_sub(1)).copied();
        let fine = match [around(0), around(2)] {
            [Some(left), Some(right)] if left.is_finite() && right.is_finite() => {
                let bend = left - 2.0 * cosine + right;
                if bend < 0.0 {
                    (0.5 * (left - right) / bend).clamp(-0.5, 0.5)
                } else {
                    0.0
                }
            }
            _ => 0.0,
        };
        Self {
            first_s,
            offset_s: first_s + (nth as f64 + fine) * HOP_S,
            cosine,
            contrast: if spread > 0.0 {
                (cosine - mean) / spread
            } else {
                0.0
            },
            second_s: first_s + second as f64 * HOP_S,
            second: second_cosine,
            n: 0,
            cosines,
        }
    }
}

/// The energy of every hop, from one on.
fn energies(sound: &Sound, first: i64) -> Vec<f64> {
    let at = |hop: i64| {
        let sample = (hop as f64 * HOP_S - sound.begins_s) * sound.rate_hz;
        sample.round().max(0.0) as usize
    };
    let mut energies = Vec::new();
    let mut hop = first;
    while at(hop + 1) < sound.samples.len() && at(hop + 1) > at(hop) {
        let from = at(hop).max(1);
        let each = (from..at(hop + 1)).map(|k| {
            let [last, this] = [k - 1, k].map(|i| f64::from(sound.samples[i]));
            (this - EMPHASIS * last).powi(2)
        });
        energies.push(each.sum());
        hop += 1;
    }
    energies
}

/// Local maxima that are far enough apart.
fn peaks(values: &[f64]) -> Vec<usize> {
    let mut peaks: Vec<usize> = Vec::new();
    for (nth, value) in values.iter().enumerate() {
        if *value <= 0.0 {
            continue;
        }
        match peaks.last_mut() {
            Some(last) if nth - *last < APART => {
                if *value > values[*last] {
                    *last = nth;
                }
            }
            _ => peaks.push(nth),
        }
    }
    peaks
}

/// Means over neighbours, with weights that fall to both sides.
fn smooth(cosines: &[f64]) -> Vec<f64> {
    let at = |nth: i64| usize::try_from(nth).ok().and_then(|value| cosines.get(value));
    let each = (0..cosines.len() as i64).map(|nth| {
        let (mut sum, mut weights) = (0.0, 0.0);
        for by in -SMOOTH..=SMOOTH {
            if let Some(value) = at(nth + by).filter(|value| value.is_finite()) {
                let weight = 1.0 - by.abs() as f64 / (SMOOTH + 1) as f64;
                sum += weight * value;
                weights += weight;
            }
        }
        if at(nth).is_some_and(|value| value.is_finite()) {
            sum / weights
        } else {
            f64::NAN
        }
    });
    each.collect()
}
