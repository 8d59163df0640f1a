//! Reproducible random numbers: hashes of a seed, and smooth noise in space.

use nalgebra::Vector3;

/// A generator of numbers that depend only on the seed (splitmix64, Steele et al. 2014).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Random(u64);

const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(mix(seed.wrapping_add(GOLDEN)))
    }

    /// Returns another generator for a separate purpose, so that an additional draw from one of them does not change the other.
    pub(crate) fn fork(self, purpose: &str) -> Self {
        Self(mix(self.0 ^ formats::checksum::fnv1a(purpose.as_bytes())))
    }

    /// Returns another generator, for the n-th of many items.
    pub(crate) fn nth(self, n: u64) -> Self {
        Self(mix(self.0 ^ mix(n.wrapping_add(GOLDEN))))
    }

    pub(crate) fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(GOLDEN);
        mix(self.0)
    }

    /// Draws a number that is at least 0 and less than 1.
    pub(crate) fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Draws a number that is at least `low` and less than `high`.
    pub(crate) fn range(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Draws a number with mean 0 and standard deviation 1: the sum of twelve uniform numbers, limited to 3.5 in either direction.
    pub(crate) fn normal(&mut self) -> f64 {
        let sum: f64 = (0..12).map(|_| self.unit()).sum();
        (sum - 6.0).clamp(-3.5, 3.5)
    }

    /// Returns true with that probability.
    pub(crate) fn chance(&mut self, probability: f64) -> bool {
        self.unit() < probability
    }

    /// Draws one of several items. `from` must not be empty.
    pub(crate) fn pick<'a, T>(&mut self, from: &'a [T]) -> &'a T {
        &from[(self.bits() % from.len() as u64) as usize]
    }
}

fn lattice(x: i32, y: i32, z: i32, seed: u32) -> f32 {
    let mut h = (x as u32).wrapping_mul(0x8da6_b343)
        ^ (y as u32).wrapping_mul(0xd816_3841)
        ^ (z as u32).wrapping_mul(0xcb1a_b31f)
        ^ seed.wrapping_mul(0x9e37_79b9);
    h = (h ^ (h >> 15)).wrapping_mul(0x2c1b_3c6d);
    h = (h ^ (h >> 12)).wrapping_mul(0x297a_2d39);
    h ^= h >> 15;
    (h >> 8) as f32 / (1 << 23) as f32 - 1.0
}

/// Smooth noise between -1 and 1, with one feature per unit of length (value noise on a cubic lattice).
pub(crate) fn noise(at: &Vector3<f32>, seed: u32) -> f32 {
    let cell = at.map(f32::floor);
    let f = (at - cell).map(|t| t * t * (3.0 - 2.0 * t));
    let [x, y, z] = [cell.x as i32, cell.y as i32, cell.z as i32];
    let along_x = |dy: i32, dz: i32| {
        let a = lattice(x, y.wrapping_add(dy), z.wrapping_add(dz), seed);
        let b = lattice(
            x.wrapping_add(1),
            y.wrapping_add(dy),
            z.wrapping_add(dz),
            seed,
        );
        a + (b - a) * f.x
    };
    let along_y = |dz: i32| {
        let [a, b] = [along_x(0, dz), along_x(1, dz)];
        a + (b - a) * f.y
    };
    let [a, b] = [along_y(0), along_y(1)];
    a + (b - a) * f.z
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn random_streams_for_different_purposes_and_numbers_differ() {
        let random = Random::new(1);
        let mut all: Vec<u64> = ["a", "b"]
            .map(|name| random.fork(name).bits())
            .into_iter()
            .chain((0..100).map(|i| random.nth(i).bits()))
            .collect();
        all.sort_unstable();
        all.dedup();
        assert_eq!(all.len(), 102);
    }

    #[test]
    fn normal_numbers_have_mean_0_and_variance_1() {
        let mut random = Random::new(7);
        let numbers: Vec<f64> = (0..4000).map(|_| random.normal()).collect();
        let mean = numbers.iter().sum::<f64>() / 4000.0;
        let variance = numbers.iter().map(|number| (number - mean).powi(2)).sum::<f64>() / 4000.0;
        assert!(mean.abs() < 0.06 && (variance - 1.0).abs() < 0.08);
    }

    proptest! {
        #[test]
        fn noise_is_bounded_and_smooth(
            x in -50.0_f32..50.0, y in -50.0_f32..50.0, z in -50.0_f32..50.0, seed: u32,
        ) {
            let at = Vector3::new(x, y, z);
            let here = noise(&at, seed);
            prop_assert!((-1.0..=1.0).contains(&here));
            let near = noise(&(at + Vector3::new(1e-3, 0.0, 0.0)), seed);
            prop_assert!((near - here).abs() < 5e-3);
        }

        #[test]
        fn random_numbers_stay_in_their_range(seed: u64, low in -5.0..0.0, high in 0.1..5.0) {
            let at = Random::new(seed).range(low, high);
            prop_assert!((low..high).contains(&at));
        }
    }
}
