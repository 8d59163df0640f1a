//! A few operations on a register of floats, so that a kernel is written once for all machines.

mod portable;
#[cfg(target_arch = "x86_64")]
mod x86;

use crate::isa::{Isa, Kind};
use portable::Portable;

/// Number of floats in a [`Row`].
pub(crate) const ROW: usize = 32;

/// Thirty-two floats, aligned to a cache line.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(128))]
pub(crate) struct Row(pub(crate) [f32; ROW]);

impl Row {
    pub(crate) const ZERO: Self = Self([0.0; ROW]);
}

/// The floats of all rows.
#[inline(always)]
pub(crate) fn flat(rows: &[Row]) -> &[f32] {
    // SAFETY: a `Row` consists only of its floats. Its size is 128 bytes, a multiple of its alignment.
    unsafe { std::slice::from_raw_parts(rows.as_ptr().cast(), rows.len() * ROW) }
}

/// The floats of all rows, as a mutable slice.
#[inline(always)]
pub(crate) fn flat_mut(rows: &mut [Row]) -> &mut [f32] {
    // SAFETY: as in `flat`; the rows are borrowed as long as their floats.
    unsafe { std::slice::from_raw_parts_mut(rows.as_mut_ptr().cast(), rows.len() * ROW) }
}

impl std::borrow::Borrow<[f32; ROW]> for Row {
    #[inline(always)]
    fn borrow(&self) -> &[f32; ROW] {
        &self.0
    }
}

/// An instruction set; a value proves that the machine has it.
///
/// Lanes are independent, except in [`Self::transposed`]. Each operation rounds once according
/// to IEEE 754, so the same calls give the same bits for any number of lanes.
pub(crate) trait Simd: Copy {
    /// Type of a register.
    type V: Copy;
    /// Type of `LANES` registers.
    type Square: AsRef<[Self::V]>;
    /// Number of floats in a register; it divides half a [`Row`].
    const LANES: usize;
    /// Number of pairs of sums that fit into the registers together with two weights and a cell.
    const BLOCK: usize;

    /// Returns `value` in all lanes.
    fn splat(self, value: f32) -> Self::V;
    /// Loads the first `LANES` values.
    fn load(self, from: &[f32]) -> Self::V;
    /// Loads the `LANES` values from index `at`, like [`Self::load`] but without a check.
    ///
    /// # Safety
    ///
    /// `at + LANES` is at most the slice's length.
    unsafe fn load_at(self, from: &[f32], at: usize) -> Self::V;
    /// Writes a register to the first `LANES` values of `to`.
    fn store(self, value: Self::V, to: &mut [f32]);
    /// Writes a register to all of `to`, or to its first `LANES` values if `to` is longer.
    fn store_partial(self, value: Self::V, to: &mut [f32]);
    /// `a * b + c`, rounded once.
    fn mul_add(self, a: Self::V, b: Self::V, c: Self::V) -> Self::V;
    /// `a + b`.
    fn add(self, a: Self::V, b: Self::V) -> Self::V;
    /// `a - b`.
    fn sub(self, a: Self::V, b: Self::V) -> Self::V;
    /// Returns `a one + b`, where `one` contains ones: a sum that is computed by the multiply units, if there are any. Some processors
    /// compare with their add units and have separate multiply units. If sums are computed as products, the add units are free for the
    /// maxima, which doubles the number of candidates per cycle.
    fn plus(self, a: Self::V, one: Self::V, b: Self::V) -> Self::V;
    /// Returns the larger value, or `b` if they are equal.
    fn max(self, a: Self::V, b: Self::V) -> Self::V;
    /// Returns the smaller value, or `b` if they are equal.
    fn min(self, a: Self::V, b: Self::V) -> Self::V;
    /// Returns the first `n` lanes of `a` and the other lanes of `b`.
    fn first(self, n: usize, a: Self::V, b: Self::V) -> Self::V;
    /// Transposes: register `i` contains value `lane + i` of each of the first `LANES` rows.
    fn transposed(self, rows: &[Row], lane: usize) -> Self::Square;
    /// Runs a kernel in a separate function, so that no other values occupy registers in its loop.
    fn apart(self, kernel: impl Kernel);
}

/// A computation that runs with the machine's instruction set.
pub(crate) trait Kernel {
    /// Runs the computation. It must be `#[inline(always)]`, so that it is compiled for the instruction set of `simd`.
    fn run<S: Simd>(self, simd: S);
}

impl Isa {
    /// Runs `kernel` with this instruction set.
    pub(crate) fn run(self, kernel: impl Kernel) {
        match self.0 {
            Kind::Portable => kernel.run(Portable),
            #[cfg(target_arch = "x86_64")]
            // SAFETY: an `Isa` of this kind only exists where AVX2 and FMA were detected.
            Kind::Avx2 => unsafe { x86::run_avx2(kernel) },
            #[cfg(target_arch = "x86_64")]
            // SAFETY: an `Isa` of this kind only exists where AVX-512 F and VL were detected.
            Kind::Avx512 => unsafe { x86::run_avx512(kernel) },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A test that transposes a row of numbered floats, and stores partial registers of every length.
    struct Check;

    impl Kernel for Check {
        #[inline(always)]
        fn run<S: Simd>(self, simd: S) {
            let rows: Vec<Row> = (0..S::LANES)
                .map(|y| Row(std::array::from_fn(|x| (y * ROW + x) as f32)))
                .collect();
            for lane in (0..ROW).step_by(S::LANES) {
                let square = simd.transposed(&rows, lane);
                for (i, value) in square.as_ref().iter().enumerate() {
                    for n in 0..S::LANES + 3 {
                        let mut to = vec![-1.0; n];
                        simd.store_partial(*value, &mut to);
                        let want = |y| {
                            if y < S::LANES {
                                (y * ROW + lane + i) as f32
                            } else {
                                -1.0
                            }
                        };
                        assert_eq!(to, (0..n).map(want).collect::<Vec<_>>());
                    }
                }
            }
        }
    }

    #[test]
    fn every_instruction_set_transposes_and_stores_partial_registers() {
        for isa in Isa::available() {
            isa.run(Check);
        }
    }

    /// A test that runs every operation once.
    struct Arithmetic<'a>(&'a mut Vec<f32>);

    impl Kernel for Arithmetic<'_> {
        #[inline(always)]
        fn run<S: Simd>(self, simd: S) {
            let a = simd.splat(1.0 + f32::EPSILON);
            let b = simd.load(&[3.0; ROW]);
            let c = simd.splat(-3.0);
            let (one, tiny) = (simd.splat(1.0), simd.splat(f32::EPSILON / 2.0));
            for value in [
                simd.mul_add(a, a, c),
                simd.add(a, b),
                simd.sub(a, b),
                simd.plus(a, one, tiny),
                simd.max(a, b),
                simd.max(b, a),
                simd.min(a, b),
                simd.min(b, a),
                simd.max(simd.splat(0.0), simd.splat(-0.0)),
                simd.min(simd.splat(-0.0), simd.splat(0.0)),
            ] {
                let mut to = [0.0; ROW];
                simd.store(value, &mut to);
                assert!(to[..S::LANES].iter().all(|lane| *lane == to[0]));
                self.0.push(to[0]);
            }
        }
    }

    #[test]
    fn every_instruction_set_rounds_once_and_max_returns_the_second_operand_on_ties() {
        let a = 1.0 + f32::EPSILON;
        let sums = [a.mul_add(a, -3.0), a + 3.0, a - 3.0, a + f32::EPSILON / 2.0];
        let want = [sums.as_slice(), &[3.0, 3.0, a, a, -0.0, 0.0]].concat();
        for isa in Isa::available() {
            let mut got = Vec::new();
            isa.run(Arithmetic(&mut got));
            let bits =
                |values: &[f32]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
            assert_eq!(bits(&got), bits(&want), "{isa:?}");
        }
    }

    /// A test that loads at every position of a row, and combines registers at every lane.
    struct Places;

    impl Kernel for Places {
        #[inline(always)]
        fn run<S: Simd>(self, simd: S) {
            let row: [f32; ROW] = std::array::from_fn(|i| i as f32);
            for at in 0..=ROW - S::LANES {
                // SAFETY: the last register ends where the row does.
                let value = unsafe { simd.load_at(&row, at) };
                for n in 0..=S::LANES {
                    let mut to = [0.0; ROW];
                    simd.store(simd.first(n, value, simd.splat(-1.0)), &mut to);
                    let want = |lane| if lane < n { (at + lane) as f32 } else { -1.0 };
                    assert_eq!(to[..S::LANES], (0..S::LANES).map(want).collect::<Vec<_>>());
                }
            }
        }
    }

    #[test]
    fn every_instruction_set_loads_unaligned_data_and_joins_registers() {
        for isa in Isa::available() {
            isa.run(Places);
        }
    }
}
