//! How many candidates the machine could try if it had nothing else to do.

use std::hint::black_box;

use super::lanes::Lanes;
use crate::isa::{Isa, Kind};

/// Chains of sums and maxima side by side: enough to hide how long each takes, few enough to stay in
/// the sixteen registers of AVX2.
const CHAINS: usize = 12;

/// Tries candidates that are in registers already: what [`VoteRule::cast`](super::VoteRule::cast)
/// would reach without loads, stores and everything around.
///
/// On the portable path it is what the compiler makes of chained arrays, and no bound.
///
/// * Returns the number of candidates.
pub fn max_plus_peak(isa: Isa, rounds: usize) -> usize {
    match isa.0 {
        Kind::Portable => peak::<[f32; 4]>(rounds),
        #[cfg(target_arch = "x86_64")]
        // SAFETY: an `Isa` of this kind only exists where AVX2 and FMA were detected.
        Kind::Avx2 => unsafe { avx2(rounds) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: an `Isa` of this kind only exists where AVX-512 F and VL were detected.
        Kind::Avx512 => unsafe { avx512(rounds) },
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn avx2(rounds: usize) -> usize {
    peak::<std::arch::x86_64::__m256>(rounds)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma,avx512f,avx512vl")]
fn avx512(rounds: usize) -> usize {
    peak::<std::arch::x86_64::__m512>(rounds)
}

#[inline(always)]
fn peak<V: Lanes>(rounds: usize) -> usize {
    let one = V::splat(black_box(1.0));
    let (score, least) = (V::splat(black_box(-1e-3)), V::splat(black_box(0.5)));
    let mut best = [least; CHAINS];
    for _ in 0..rounds {
        for best in &mut best {
            *best = best.plus(one, score).max(least);
        }
    }
    let mut lanes = [0.0; 16];
    for best in best {
        best.store(&mut lanes);
        black_box(&lanes);
    }
    rounds * CHAINS * V::N
}
