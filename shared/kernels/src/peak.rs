//! Peak rates of the machine, for comparison with the kernels.

use crate::dispatch::{Body, dispatch};
use crate::isa::{Isa, Kind};

/// A loop that does nothing but one kind of arithmetic.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Peak {
    /// `sum = sum a + b` in single precision, as in the filters.
    MultiplyAdd,
    /// `best = max(best, score + cost)` in single precision, as in the messages.
    MaxPlus,
}

/// Number of values that are combined with each weight, followed by the number of weights that are combined with each value. Their product
/// is the number of sums or maxima that are computed at once. These fit into the registers of every instruction set.
const ROWS: usize = 5;
const WEIGHTS: usize = 2;
/// Number of steps in a round, whose values fit in the first-level cache.
const STEPS: usize = 50;

impl Peak {
    /// Runs the loop, and returns the number of single values that it computed.
    ///
    /// If the instruction set has no fused multiply-add, multiplication and addition are
    /// two operations that are counted as one.
    ///
    /// * `rounds`: number of rounds; each round takes at most a microsecond.
    pub fn run(self, isa: Isa, rounds: usize) -> u64 {
        match isa.0 {
            Kind::Portable => self.run_on::<4, false>(isa, rounds),
            #[cfg(target_arch = "x86_64")]
            Kind::Avx2 => self.run_on::<8, true>(isa, rounds),
            #[cfg(target_arch = "x86_64")]
            Kind::Avx512 => self.run_on::<16, true>(isa, rounds),
        }
    }

    fn run_on<const LANES: usize, const FUSED: bool>(self, isa: Isa, rounds: usize) -> u64 {
        match self {
            Self::MultiplyAdd => {
                dispatch(isa, MultiplyAdd::<LANES, FUSED> { rounds });
            }
            Self::MaxPlus => dispatch(isa, MaxPlus::<LANES, FUSED> { rounds }),
        }
        (rounds * STEPS * ROWS * WEIGHTS * LANES) as u64
    }
}

struct MultiplyAdd<const LANES: usize, const FUSED: bool> {
    rounds: usize,
}

impl<const LANES: usize, const FUSED: bool> Body for MultiplyAdd<LANES, FUSED> {
    #[inline(always)]
    fn run(self) {
        let term = |sum: f32, value: f32, weight: f32| {
            if FUSED {
                value.mul_add(weight, sum)
            } else {
                sum + value * weight
            }
        };
        rounds::<LANES>(self.rounds, 0.0, term);
    }
}

struct MaxPlus<const LANES: usize, const FUSED: bool> {
    rounds: usize,
}

impl<const LANES: usize, const FUSED: bool> Body for MaxPlus<LANES, FUSED> {
    #[inline(always)]
    fn run(self) {
        // As in the messages, comparisons keep the add units busy, while the multiply units are free.
        let one = std::hint::black_box(1.0_f32);
        let larger = |best: f32, score: f32, cost: f32| {
            let score = if FUSED {
                score.mul_add(one, cost)
            } else {
                score + cost
            };
            if score > best { score } else { best }
        };
        rounds::<LANES>(self.rounds, f32::NEG_INFINITY, larger);
    }
}

/// Folds rows of values into one row per weight and position of the row in a step.
#[inline(always)]
fn rounds<const LANES: usize>(n: usize, start: f32, fold: impl Fn(f32, f32, f32) -> f32) {
    let weights = std::hint::black_box([0.125_f32; WEIGHTS]);
    let values = std::hint::black_box([[[1.0_f32; LANES]; ROWS]; STEPS]);
    for _ in 0..n {
        let mut folded = [[[start; LANES]; WEIGHTS]; ROWS];
        for step in &values {
            for (folded, value) in folded.iter_mut().zip(step) {
                for (folded, weight) in folded.iter_mut().zip(weights) {
                    for (folded, value) in folded.iter_mut().zip(value) {
                        *folded = fold(*folded, *value, weight);
                    }
                }
            }
        }
        std::hint::black_box(&folded);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_rounds_count_as_more_operations() {
        for isa in Isa::available() {
            for peak in [Peak::MultiplyAdd, Peak::MaxPlus] {
                let [one, three] = [1, 3].map(|rounds| peak.run(isa, rounds));
                assert!(one > 0 && three == 3 * one);
            }
        }
    }
}
