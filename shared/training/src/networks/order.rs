//! The random order of samples, which is computed from the number of a sample alone.

use fastrand::Rng;

/// An odd number whose multiples are spread evenly over the whole range of `u64`.
const SPREAD: u64 = 0x9e37_79b9_7f4a_7c15;

/// Index of the sample with a given number. All samples are used once before any is used again.
///
/// * `n`: number of different samples.
pub(crate) fn shown(number: usize, n: usize, seed: u64) -> usize {
    shuffled(number % n, n, seed.wrapping_add((number / n) as u64))
}

/// Returns the random generator for the item with a given number.
pub(crate) fn dice(number: usize, seed: u64) -> Rng {
    Rng::with_seed(seed ^ (number as u64 + 1).wrapping_mul(SPREAD))
}

/// The number at an index of a random order of `0..n`.
///
/// It is computed by a Feistel network over the next power of 4, repeated until the result is below `n`. The order therefore does not have
/// to be stored as a list.
fn shuffled(place: usize, n: usize, seed: u64) -> usize {
    let half = (usize::BITS - (n.max(2) - 1).leading_zeros()).div_ceil(2);
    let mask = (1usize << half) - 1;
    let mut at = place;
    loop {
        let [mut left, mut right] = [at >> half, at & mask];
        for round in 0..4u64 {
            let mixed = (right as u64 ^ seed.wrapping_mul(SPREAD))
                .wrapping_add(round.wrapping_mul(0xd1b5_4a32_d192_ed03));
            let mixed = (mixed ^ (mixed >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            let mixed = (mixed ^ (mixed >> 32)) as usize & mask;
            (left, right) = (right, left ^ mixed);
        }
        at = (left << half) | right;
        if at < n {
            return at;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shuffled_order_contains_every_sample_once() {
        for n in [1, 2, 3, 17, 64, 1000] {
            let mut seen: Vec<usize> = (0..n).map(|place| shuffled(place, n, 5)).collect();
            seen.sort_unstable();
            assert_eq!(seen, (0..n).collect::<Vec<usize>>(), "{n}");
        }
        let order = |seed| {
            let all = (0..100).map(move |place| shuffled(place, 100, seed));
            all.collect::<Vec<_>>()
        };
        assert_ne!(order(1), order(2));
    }
}
