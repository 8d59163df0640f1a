//! For each of many points, finds the best of many other points at about a given distance, in double precision.

use crate::dispatch::{Body, dispatch};
use crate::isa::Isa;

/// Points with scores, stored by coordinate, so that several can be evaluated at the same time.
#[derive(Debug, Clone)]
pub struct ScoredPoints {
    at: [Vec<f64>; 3],
    scores: Vec<f64>,
    n: usize,
}

/// A spring between two points, whose cost depends on their distance. Its cost is `weight * min(((distance - mean) / sd)^2 / 2, cap)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LengthSpring {
    /// Distance at which the cost is zero.
    pub mean: f64,
    /// Standard deviation, in the unit of the distance.
    pub sd: f64,
    /// Weight of the cost.
    pub weight: f64,
    /// Largest cost of the spring, before multiplication by the weight.
    pub cap: f64,
}

/// Number of totals that are compared in parallel.
const LANES: usize = 8;

impl ScoredPoints {
    /// * `points`: at least one point.
    /// * `scores`: one score for each point.
    ///
    /// # Panics
    ///
    /// Panics if there are no points, or the number of scores differs from the number of points.
    pub fn new(points: impl ExactSizeIterator<Item = [f64; 3]>, scores: &[f64]) -> Self {
        let n = points.len();
        assert!(
            n > 0 && n == scores.len(),
            "there must be a score for each point"
        );
        let padded = n.next_multiple_of(LANES);
        let mut at: [Vec<f64>; 3] = core::array::from_fn(|_| Vec::with_capacity(padded));
        for point in points {
            for (axis, value) in at.iter_mut().zip(point) {
                axis.push(value);
            }
        }
        for axis in &mut at {
            axis.resize(padded, 0.0);
        }
        let mut scores = scores.to_vec();
        scores.resize(padded, f64::NEG_INFINITY);
        Self { at, scores, n }
    }

    /// Returns for every point of `from` the best of these points and its total: its score minus the cost of the spring between the
    /// two. If several points are equally good, the first is returned. NaN is never the best.
    ///
    /// The result has the same bits as [`Self::best_reference`] on every instruction set.
    pub fn best(
        &self,
        isa: Isa,
        from: impl Iterator<Item = [f64; 3]>,
        spring: &LengthSpring,
    ) -> Vec<(usize, f64)> {
        let mut totals = vec![0.0; self.scores.len()];
        let each = from.map(|from| {
            let mut found = (0, 0.0);
            dispatch(
                isa,
                Best {
                    points: self,
                    from,
                    spring: *spring,
                    totals: &mut totals,
                    found: &mut found,
                },
            );
            found
        });
        each.collect()
    }

    /// The readable reference of [`Self::best`].
    pub fn best_reference(
        &self,
        from: impl Iterator<Item = [f64; 3]>,
        spring: &LengthSpring,
    ) -> Vec<(usize, f64)> {
        let each = from.map(|from| {
            let [x, y, z] = &self.at;
            let mut best = (0, f64::NEG_INFINITY);
            for nth in 0..self.n {
                let total = total(from, [x[nth], y[nth], z[nth]], self.scores[nth], spring);
                if total > best.1 {
                    best = (nth, total);
                }
            }
            best
        });
        each.collect()
    }
}

/// The score of a point minus the cost of the spring.
#[inline(always)]
fn total(from: [f64; 3], [x, y, z]: [f64; 3], score: f64, spring: &LengthSpring) -> f64 {
    let by = [x - from[0], y - from[1], z - from[2]];
    let length = (by[0] * by[0] + by[1] * by[1] + by[2] * by[2]).sqrt();
    let off = (length - spring.mean) / spring.sd;
    let cost = 0.5 * off * off;
    let cost = if cost < spring.cap { cost } else { spring.cap };
    score - spring.weight * cost
}

struct Best<'a> {
    points: &'a ScoredPoints,
    from: [f64; 3],
    spring: LengthSpring,
    totals: &'a mut [f64],
    found: &'a mut (usize, f64),
}

impl Body for Best<'_> {
    #[inline(always)]
    fn run(self) {
        let Best {
            points: ScoredPoints { at, scores, .. },
            from,
            spring,
            totals,
            found,
        } = self;
        let [x, y, z] = at.each_ref().map(|at| at.as_chunks::<LANES>().0);
        let scores = scores.as_chunks::<LANES>().0;
        let all = totals.as_chunks_mut::<LANES>().0;
        let mut most = [f64::NEG_INFINITY; LANES];
        let points = x.iter().zip(y).zip(z).zip(scores);
        for (totals, (((x, y), z), scores)) in all.iter_mut().zip(points) {
            // The slices are copied, because with references the compiler would process one position after the other, which is ten times
            // slower.
            let (x, y, z, scores) = (*x, *y, *z, *scores);
            let here: [f64; LANES] = core::array::from_fn(|lane| {
                total(from, [x[lane], y[lane], z[lane]], scores[lane], &spring)
            });
            for (most, here) in most.iter_mut().zip(here) {
                *most = if here > *most { here } else { *most };
            }
            *totals = here;
        }
        let larger = |a: f64, b: f64| if b > a { b } else { a };
        let most = most.into_iter().fold(f64::NEG_INFINITY, larger);
        let mut of_best = all.iter().enumerate().filter_map(|(chunk, totals)| {
            // The best totals are counted instead of searched for, so that all totals are compared at once.
            let n_best = totals.iter().filter(|total| **total == most).count();
            let lane = (n_best > 0).then(|| totals.iter().position(|total| *total == most))??;
            Some((chunk * LANES + lane, totals[lane]))
        });
        *found = of_best.next().unwrap_or((0, f64::NEG_INFINITY));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pseudo-random numbers from -1 to 1.
    fn numbers(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed;
        move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 33) as f64 / f64::from(1_u32 << 30) - 1.0
        }
    }

    #[test]
    fn the_fast_version_equals_the_reference_bit_for_bit() {
        let spring = LengthSpring {
            mean: 0.4,
            sd: 0.1,
            weight: 1.5,
            cap: 8.0,
        };
        for n in [1, 7, 8, 9, 40, 125] {
            let mut next = numbers(n as u64);
            let mut point = || [next(), next(), next()];
            let points: Vec<[f64; 3]> = (0..n).map(|_| point()).collect();
            let from: Vec<[f64; 3]> = (0..crate::sized(50, 3)).map(|_| point()).collect();
            // There are few different scores, so that several points are equally good.
            let scores: Vec<f64> = (0..n).map(|i| f64::from(i as u32 % 3)).collect();
            let one = ScoredPoints::new(points.iter().copied(), &scores);
            let wanted = one.best_reference(from.iter().copied(), &spring);
            for isa in Isa::available() {
                let got = one.best(isa, from.iter().copied(), &spring);
                let bits = |best: &(usize, f64)| (best.0, best.1.to_bits());
                assert!(got.iter().map(bits).eq(wanted.iter().map(bits)), "{n}");
            }
        }
    }

    #[test]
    fn ties_go_to_the_first_point_and_nan_never_wins() {
        let spring = LengthSpring {
            mean: 1.0,
            sd: 1.0,
            weight: 1.0,
            cap: 8.0,
        };
        let points = [[f64::NAN, 0.0, 0.0], [1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]];
        let one = ScoredPoints::new(points.into_iter(), &[9.0, 2.0, 2.0]);
        for isa in Isa::available() {
            let got = one.best(isa, [[0.0; 3]].into_iter(), &spring);
            assert_eq!(got, [(1, 2.0)]);
        }
        assert_eq!(
            one.best_reference([[0.0; 3]].into_iter(), &spring),
            [(1, 2.0)]
        );
    }
}
