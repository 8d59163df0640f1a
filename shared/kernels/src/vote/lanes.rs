//! A register of neighbouring scores, in the three widths that the votes are compiled for.

#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::{
    __m256, __m512, _mm256_blendv_ps, _mm256_cmp_ps, _mm256_fmadd_ps, _mm256_loadu_ps,
    _mm256_max_ps, _mm256_min_ps, _mm256_set1_ps, _mm256_storeu_ps, _mm512_fmadd_ps,
    _mm512_loadu_ps, _mm512_mask_blend_ps, _mm512_max_ps, _mm512_min_ps, _mm512_set1_ps,
    _mm512_storeu_ps,
};

/// Scores of neighbouring cells.
///
/// Every operation works lane by lane and rounds as the scalar one does, so all widths give the
/// same bits. Values of the wide types may only be made where their instructions were detected;
/// the functions that are compiled for them are called nowhere else.
pub(super) trait Lanes: Copy {
    /// Cells in a register; divides [`ROW_ALIGN`](super::ROW_ALIGN).
    const N: usize;

    /// `value` in every lane.
    fn splat(value: f32) -> Self;

    /// The first scores of a slice, which holds [`Self::N`] at least.
    fn load(from: &[f32]) -> Self;

    /// The scores from `at` on, of which there are [`Self::N`] at least: as [`Self::load`], unchecked.
    ///
    /// # Safety
    ///
    /// `at + N` is at most the slice's length.
    unsafe fn load_at(from: &[f32], at: usize) -> Self;

    /// Overwrites the first scores of a slice, which holds [`Self::N`] at least.
    fn store(self, to: &mut [f32]);

    /// `self one + other`, where `one` holds ones: a sum, on the units that multiply.
    ///
    /// Some processors compare on the units that add, and have others that multiply: sums that look
    /// like products leave the former to the maxima, which doubles the candidates per cycle.
    fn plus(self, one: Self, other: Self) -> Self;

    /// The larger one; `other` where they are equal.
    fn max(self, other: Self) -> Self;

    /// The smaller one; `other` where they are equal.
    fn min(self, other: Self) -> Self;

    /// The first `n` lanes of `self`, the others of `other`.
    fn first(self, n: usize, other: Self) -> Self;
}

impl Lanes for [f32; 4] {
    const N: usize = 4;

    #[inline(always)]
    fn splat(value: f32) -> Self {
        [value; 4]
    }

    #[inline(always)]
    fn load(from: &[f32]) -> Self {
        std::array::from_fn(|lane| from[..4][lane])
    }

    #[inline(always)]
    unsafe fn load_at(from: &[f32], at: usize) -> Self {
        Self::load(&from[at..])
    }

    #[inline(always)]
    fn store(self, to: &mut [f32]) {
        to[..4].copy_from_slice(&self);
    }

    #[inline(always)]
    fn plus(self, _one: Self, other: Self) -> Self {
        std::array::from_fn(|lane| self[lane] + other[lane])
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        let larger = |lane: usize| self[lane] > other[lane];
        std::array::from_fn(|lane| {
            if larger(lane) {
                self[lane]
            } else {
                other[lane]
            }
        })
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        let smaller = |lane: usize| self[lane] < other[lane];
        std::array::from_fn(|lane| {
            if smaller(lane) {
                self[lane]
            } else {
                other[lane]
            }
        })
    }

    #[inline(always)]
    fn first(self, n: usize, other: Self) -> Self {
        std::array::from_fn(|lane| if lane < n { self[lane] } else { other[lane] })
    }
}

#[cfg(target_arch = "x86_64")]
impl Lanes for __m256 {
    const N: usize = 8;

    #[inline(always)]
    fn splat(value: f32) -> Self {
        // SAFETY: AVX was detected, see the trait.
        unsafe { _mm256_set1_ps(value) }
    }

    #[inline(always)]
    fn load(from: &[f32]) -> Self {
        let from = &from[..8];
        // SAFETY: AVX was detected, see the trait, and `from` has eight floats; any alignment will do.
        unsafe { _mm256_loadu_ps(from.as_ptr()) }
    }

    #[inline(always)]
    unsafe fn load_at(from: &[f32], at: usize) -> Self {
        debug_assert!(at + Self::N <= from.len(), "the caller's promise");
        // SAFETY: the caller promises that `at` is inside of the slice.
        let from = unsafe { from.as_ptr().add(at) };
        // SAFETY: AVX was detected, see the trait, and the caller promises eight floats from here on.
        unsafe { _mm256_loadu_ps(from) }
    }

    #[inline(always)]
    fn store(self, to: &mut [f32]) {
        let to = &mut to[..8];
        // SAFETY: AVX was detected, see the trait, and `to` has eight floats; any alignment will do.
        unsafe { _mm256_storeu_ps(to.as_mut_ptr(), self) }
    }

    #[inline(always)]
    fn plus(self, one: Self, other: Self) -> Self {
        // SAFETY: FMA was detected, see the trait.
        unsafe { _mm256_fmadd_ps(self, one, other) }
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        // SAFETY: AVX was detected, see the trait.
        unsafe { _mm256_max_ps(self, other) }
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        // SAFETY: AVX was detected, see the trait.
        unsafe { _mm256_min_ps(self, other) }
    }

    #[inline(always)]
    fn first(self, n: usize, other: Self) -> Self {
        let numbers = Self::load(&[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
        let end = Self::splat(n as f32);
        // SAFETY: AVX was detected, see the trait.
        let inside = unsafe { _mm256_cmp_ps::<1>(numbers, end) };
        // SAFETY: AVX was detected, see the trait.
        unsafe { _mm256_blendv_ps(other, self, inside) }
    }
}

#[cfg(target_arch = "x86_64")]
impl Lanes for __m512 {
    const N: usize = 16;

    #[inline(always)]
    fn splat(value: f32) -> Self {
        // SAFETY: AVX-512 F was detected, see the trait.
        unsafe { _mm512_set1_ps(value) }
    }

    #[inline(always)]
    fn load(from: &[f32]) -> Self {
        let from = &from[..16];
        // SAFETY: AVX-512 F was detected, see the trait, and `from` has sixteen floats; any
        // alignment will do.
        unsafe { _mm512_loadu_ps(from.as_ptr()) }
    }

    #[inline(always)]
    unsafe fn load_at(from: &[f32], at: usize) -> Self {
        debug_assert!(at + Self::N <= from.len(), "the caller's promise");
        // SAFETY: the caller promises that `at` is inside of the slice.
        let from = unsafe { from.as_ptr().add(at) };
        // SAFETY: AVX-512 F was detected, see the trait, and the caller promises sixteen floats from here on.
        unsafe { _mm512_loadu_ps(from) }
    }

    #[inline(always)]
    fn store(self, to: &mut [f32]) {
        let to = &mut to[..16];
        // SAFETY: AVX-512 F was detected, see the trait, and `to` has sixteen floats; any alignment
        // will do.
        unsafe { _mm512_storeu_ps(to.as_mut_ptr(), self) }
    }

    #[inline(always)]
    fn plus(self, one: Self, other: Self) -> Self {
        // SAFETY: AVX-512 F was detected, see the trait.
        unsafe { _mm512_fmadd_ps(self, one, other) }
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        // SAFETY: AVX-512 F was detected, see the trait.
        unsafe { _mm512_max_ps(self, other) }
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        // SAFETY: AVX-512 F was detected, see the trait.
        unsafe { _mm512_min_ps(self, other) }
    }

    #[inline(always)]
    fn first(self, n: usize, other: Self) -> Self {
        let inside = if n < 16 { (1_u16 << n) - 1 } else { u16::MAX };
        // SAFETY: AVX-512 F was detected, see the trait.
        unsafe { _mm512_mask_blend_ps(inside, other, self) }
    }
}
