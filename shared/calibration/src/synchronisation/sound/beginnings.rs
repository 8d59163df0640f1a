//! Beginnings of sounds, and the offset at which the beginnings in two recordings coincide.

use super::Sound;

/// Time step (hop) of the analysis, in seconds.
pub(super) const HOP_S: f64 = 0.002;
/// Fraction of the previous sample to subtract from each sample, which removes hum and rumble.
const EMPHASIS: f64 = 0.95;
/// Numbers of hops after and before a time whose mean loudness is compared.
const AFTER: usize = 4;
const BEFORE: usize = 12;
/// Minimum growth of the logarithm of the energy at which a sound begins, and the value at which the growth is capped.
const GROWTH: [f64; 2] = [0.5, 3.5];
/// Minimum number of hops between two beginnings.
const APART: usize = 25;
/// Maximum number of hops between two beginnings of the same sound.
const TOGETHER: i64 = 6;
/// Half the width of the kernel that smooths the peaks of the cosine, in hops; it allows for sources at different distances.
const SMOOTH: i64 = 4;
/// Minimum number of hops between the best offset and another.
const OTHER: usize = 30;
/// Minimum fraction of each recording's energy that is within the overlap of the two recordings.
const LEAST_SHARE: f64 = 0.15;

/// Suddenness of sounds over time.
#[derive(Debug)]
pub(super) struct Beginnings {
    /// Time of the first entry, in hops of the camera's clock.
    first: i64,
    /// Suddenness by time; 0 if nothing begins.
    values: Vec<f64>,
    /// Times at which sounds begin: the local maxima.
    peaks: Vec<i64>,
}

/// Comparison of the beginnings in two recordings.
#[derive(Debug)]
pub(super) struct Match {
    /// Offset of the first of `cosines`, in seconds.
    pub(super) first_s: f64,
    /// Smoothed cosine between both recordings by offset; NaN if the recordings hardly overlap.
    pub(super) cosines: Vec<f64>,
    /// Best offset in seconds. It is added to a time of the first recording to get the time of the second.
    pub(super) offset_s: f64,
    /// Cosine at the best offset.
    pub(super) cosine: f64,
    /// Difference between the best cosine and the mean cosine over all offsets, in standard deviations of the cosines.
    pub(super) contrast: f64,
    /// Second-best offset in seconds, followed by its cosine.
    pub(super) second_s: f64,
    pub(super) second: f64,
    /// Number of beginnings that coincide.
    pub(super) n: usize,
}

impl Match {
    /// Returns the cosine at the second-best offset as a fraction of the cosine at the best.
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
        // The noise floor is at least the energy of a signal of one quantisation step.
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

    /// Returns the number of sounds that begin.
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

    /// Returns the start and end of the recording, in hops.
    pub(super) fn span(&self) -> [i64; 2] {
        [self.first, self.first + self.values.len() as i64]
    }

    /// Returns the part with the given length in which most sounds begin in both recordings, in hops; the whole recording if it is shorter.
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

    /// Searches all offsets.
    ///
    /// * `span`: part of this recording to compare, in hops.
    /// * `around_s`: centre of the searched offsets, and their largest deviation from it in both directions, in seconds.
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

    /// Returns the number of beginnings that coincide at an offset, in hops.
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

/// Returns the energy of every hop from the given one.
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

/// Returns the local maxima that are far enough apart.
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

/// Returns weighted means over neighbours, with weights that decrease on both sides.
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
