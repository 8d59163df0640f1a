//! A few operations on a register of floats, so that a kernel is written once for all machines.

#[cfg(target_arch = "x86_64")]
mod x86;

use crate::isa::{Isa, Kind};

/// Floats in a [`Row`].
pub(crate) const ROW: usize = 32;

/// Thirty-two floats that begin at a cache line.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(128))]
pub(crate) struct Row(pub(crate) [f32; ROW]);

impl Row {
    pub(crate) const ZERO: Self = Self([0.0; ROW]);
}

impl std::borrow::Borrow<[f32; ROW]> for Row {
    #[inline(always)]
    fn borrow(&self) -> &[f32; ROW] {
        &self.0
    }
}

/// An instruction set: holding a value proves that the machine has it.
///
/// Lanes never meet, but in [`Self::transposed`], and each operation rounds once as IEEE 754 says:
/// the same calls give the same bits whatever the number of lanes.
pub(crate) trait Simd: Copy {
    /// A register.
    type V: Copy;
    /// `LANES` registers.
    type Square: AsRef<[Self::V]>;
    /// Floats in a register; divides half a [`Row`].
    const LANES: usize;
    /// Pairs of sums that fit into the register file beside two weights and a cell.
    const BLOCK: usize;

    /// `value` in all lanes.
    fn splat(self, value: f32) -> Self::V;
    /// The first `LANES` values.
    fn load(self, from: &[f32]) -> Self::V;
    /// Writes the first `LANES` values of `to`.
    fn store(self, value: Self::V, to: &mut [f32]);
    /// Writes all of `to` or its first `LANES` values, whichever is less.
    fn store_some(self, value: Self::V, to: &mut [f32]);
    /// `a * b + c`, rounded once.
    fn mul_add(self, a: Self::V, b: Self::V, c: Self::V) -> Self::V;
    /// `a + b`.
    fn add(self, a: Self::V, b: Self::V) -> Self::V;
    /// `a - b`.
    fn sub(self, a: Self::V, b: Self::V) -> Self::V;
    /// Register `i` holds value `lane + i` of each of the first `LANES` rows.
    fn transposed(self, rows: &[Row], lane: usize) -> Self::Square;
}

/// Something to be done with whatever instructions the machine has.
pub(crate) trait Kernel {
    /// Does it; must be `#[inline(always)]`, so that it is compiled for the set of `simd`.
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

/// Whatever the target guarantees, eight lanes at a time.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Portable;

type Eight = [f32; 8];

#[inline(always)]
fn map3(a: Eight, b: Eight, c: Eight, f: impl Fn(f32, f32, f32) -> f32) -> Eight {
    std::array::from_fn(|it| f(a[it], b[it], c[it]))
}

impl Simd for Portable {
    type V = Eight;
    type Square = [Eight; 8];
    const LANES: usize = 8;
    const BLOCK: usize = 6;

    #[inline(always)]
    fn splat(self, value: f32) -> Eight {
        [value; 8]
    }

    #[inline(always)]
    fn load(self, from: &[f32]) -> Eight {
        let mut value = [0.0; 8];
        value.copy_from_slice(&from[..8]);
        value
    }

    #[inline(always)]
    fn store(self, value: Eight, to: &mut [f32]) {
        to[..8].copy_from_slice(&value);
    }

    #[inline(always)]
    fn store_some(self, value: Eight, to: &mut [f32]) {
        copy_some(value, to);
    }

    #[inline(always)]
    fn mul_add(self, a: Eight, b: Eight, c: Eight) -> Eight {
        map3(a, b, c, f32::mul_add)
    }

    #[inline(always)]
    fn add(self, a: Eight, b: Eight) -> Eight {
        map3(a, b, a, |a, b, _| a + b)
    }

    #[inline(always)]
    fn sub(self, a: Eight, b: Eight) -> Eight {
        map3(a, b, a, |a, b, _| a - b)
    }

    #[inline(always)]
    fn transposed(self, rows: &[Row], lane: usize) -> [Eight; 8] {
        let rows = &rows[..8];
        std::array::from_fn(|i| std::array::from_fn(|row| rows[row].0[lane + i]))
    }
}

/// Copies as much as fits, without a call for the odd lengths.
#[inline(always)]
fn copy_some(value: Eight, to: &mut [f32]) {
    if to.len() >= 8 {
        to[..8].copy_from_slice(&value);
        return;
    }
    let mut done = 0;
    if to.len() & 4 != 0 {
        to[..4].copy_from_slice(&value[..4]);
        done = 4;
    }
    if to.len() & 2 != 0 {
        to[done..done + 2].copy_from_slice(&value[done..done + 2]);
        done += 2;
    }
    if to.len() & 1 != 0 {
        to[done] = value[done];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Transposes a row of numbered floats, and stores every length.
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
                        simd.store_some(*value, &mut to);
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
    fn every_instruction_set_transposes_and_stores_parts_of_registers() {
        for isa in Isa::available() {
            isa.run(Check);
        }
    }

    /// One of each operation.
    struct Arithmetic<'a>(&'a mut Vec<f32>);

    impl Kernel for Arithmetic<'_> {
        #[inline(always)]
        fn run<S: Simd>(self, simd: S) {
            let a = simd.splat(1.0 + f32::EPSILON);
            let b = simd.load(&[3.0; ROW]);
            let c = simd.splat(-3.0);
            for value in [simd.mul_add(a, a, c), simd.add(a, b), simd.sub(a, b)] {
                let mut to = [0.0; ROW];
                simd.store(value, &mut to);
                assert!(to[..S::LANES].iter().all(|it| *it == to[0]));
                self.0.push(to[0]);
            }
        }
    }

    #[test]
    fn every_instruction_set_rounds_once() {
        let a = 1.0 + f32::EPSILON;
        for isa in Isa::available() {
            let mut got = Vec::new();
            isa.run(Arithmetic(&mut got));
            assert_eq!(got, [a.mul_add(a, -3.0), a + 3.0, a - 3.0], "{isa:?}");
        }
    }
}
