//! Four lanes with the instructions that the target guarantees: the size of a register of SSE2 and NEON.

use super::{Kernel, Row, Simd};

/// The portable instruction set. It has no requirements, so it can always be constructed.
#[derive(Debug, Clone, Copy)]
pub(super) struct Portable;

type Four = [f32; 4];

#[inline(always)]
fn map2(a: Four, b: Four, f: impl Fn(f32, f32) -> f32) -> Four {
    std::array::from_fn(|i| f(a[i], b[i]))
}

impl Simd for Portable {
    type V = Four;
    type Square = [Four; 4];
    const LANES: usize = 4;
    const BLOCK: usize = 6;

    #[inline(always)]
    fn splat(self, value: f32) -> Four {
        [value; 4]
    }

    #[inline(always)]
    fn load(self, from: &[f32]) -> Four {
        let mut value = [0.0; 4];
        value.copy_from_slice(&from[..4]);
        value
    }

    #[inline(always)]
    unsafe fn load_at(self, from: &[f32], at: usize) -> Four {
        debug_assert!(at + 4 <= from.len(), "the caller's promise");
        // SAFETY: the caller promises that `at` is inside the slice.
        let from = unsafe { from.as_ptr().add(at) };
        // SAFETY: the caller promises that four floats follow; an array has the same alignment.
        unsafe { from.cast::<Four>().read() }
    }

    #[inline(always)]
    fn store(self, value: Four, to: &mut [f32]) {
        to[..4].copy_from_slice(&value);
    }

    #[inline(always)]
    fn store_partial(self, value: Four, to: &mut [f32]) {
        copy_partial(&value, to);
    }

    #[inline(always)]
    fn mul_add(self, a: Four, b: Four, c: Four) -> Four {
        std::array::from_fn(|i| a[i].mul_add(b[i], c[i]))
    }

    #[inline(always)]
    fn add(self, a: Four, b: Four) -> Four {
        map2(a, b, |a, b| a + b)
    }

    #[inline(always)]
    fn sub(self, a: Four, b: Four) -> Four {
        map2(a, b, |a, b| a - b)
    }

    #[inline(always)]
    fn plus(self, a: Four, _one: Four, b: Four) -> Four {
        self.add(a, b)
    }

    #[inline(always)]
    fn max(self, a: Four, b: Four) -> Four {
        map2(a, b, |a, b| if a > b { a } else { b })
    }

    #[inline(always)]
    fn min(self, a: Four, b: Four) -> Four {
        map2(a, b, |a, b| if a < b { a } else { b })
    }

    #[inline(always)]
    fn first(self, n: usize, a: Four, b: Four) -> Four {
        std::array::from_fn(|lane| if lane < n { a[lane] } else { b[lane] })
    }

    #[inline(always)]
    fn transposed(self, rows: &[Row], lane: usize) -> [Four; 4] {
        let rows = &rows[..4];
        std::array::from_fn(|i| std::array::from_fn(|row| rows[row].0[lane + i]))
    }

    #[inline(never)]
    fn apart(self, kernel: impl Kernel) {
        kernel.run(self);
    }
}

/// Copies as many values of a register of four or eight as fit. Lengths other than a whole register need no function call.
#[inline(always)]
pub(super) fn copy_partial(value: &[f32], to: &mut [f32]) {
    if to.len() >= value.len() {
        to[..value.len()].copy_from_slice(value);
        return;
    }
    let mut done = 0;
    for n in [4, 2, 1] {
        if to.len() & n != 0 {
            to[done..done + n].copy_from_slice(&value[done..done + n]);
            done += n;
        }
    }
}
