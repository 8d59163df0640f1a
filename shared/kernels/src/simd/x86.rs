//! AVX2 with FMA, and AVX-512.

use std::arch::x86_64::{
    __m256, __m512, _CMP_LT_OQ, _mm256_add_ps, _mm256_blendv_ps, _mm256_castpd_ps,
    _mm256_castps_pd, _mm256_cmp_ps, _mm256_fmadd_ps, _mm256_loadu_ps, _mm256_max_ps,
    _mm256_min_ps, _mm256_permute2f128_ps, _mm256_set1_ps, _mm256_storeu_ps, _mm256_sub_ps,
    _mm256_unpackhi_pd, _mm256_unpackhi_ps, _mm256_unpacklo_pd, _mm256_unpacklo_ps, _mm512_add_ps,
    _mm512_castpd_ps, _mm512_castps_pd, _mm512_fmadd_ps, _mm512_loadu_ps, _mm512_mask_blend_ps,
    _mm512_mask_storeu_ps, _mm512_max_ps, _mm512_min_ps, _mm512_set1_ps, _mm512_shuffle_f32x4,
    _mm512_storeu_ps, _mm512_sub_ps, _mm512_unpackhi_pd, _mm512_unpackhi_ps, _mm512_unpacklo_pd,
    _mm512_unpacklo_ps,
};

use super::portable::copy_partial;
use super::{Kernel, Row, Simd};

/// AVX2 and FMA. Because of the private field, a value can only be made where these instructions were detected.
#[derive(Debug, Clone, Copy)]
pub(super) struct Avx2(());

/// AVX-512 F and VL. Because of the private field, a value can only be made where these instructions were detected.
#[derive(Debug, Clone, Copy)]
pub(super) struct Avx512(());

#[target_feature(enable = "avx2,fma")]
#[inline(never)]
pub(super) fn run_avx2<K: Kernel>(kernel: K) {
    kernel.run(Avx2(()));
}

#[target_feature(enable = "avx2,fma,avx512f,avx512vl")]
#[inline(never)]
pub(super) fn run_avx512<K: Kernel>(kernel: K) {
    kernel.run(Avx512(()));
}

impl Simd for Avx2 {
    type V = __m256;
    type Square = [__m256; 8];
    const LANES: usize = 8;
    const BLOCK: usize = 6;

    #[inline(always)]
    fn splat(self, value: f32) -> __m256 {
        // SAFETY: `self` only exists where AVX2 was detected.
        unsafe { _mm256_set1_ps(value) }
    }

    #[inline(always)]
    fn load(self, from: &[f32]) -> __m256 {
        let from = &from[..8];
        // SAFETY: `from` has eight floats, and `self` only exists where AVX2 was detected.
        unsafe { _mm256_loadu_ps(from.as_ptr()) }
    }

    #[inline(always)]
    unsafe fn load_at(self, from: &[f32], at: usize) -> __m256 {
        debug_assert!(at + 8 <= from.len(), "the caller's promise");
        // SAFETY: the caller promises that `at` is inside the slice.
        let from = unsafe { from.as_ptr().add(at) };
        // SAFETY: the caller promises that eight floats follow, and `self` only exists where AVX2
        // was detected.
        unsafe { _mm256_loadu_ps(from) }
    }

    #[inline(always)]
    fn store(self, value: __m256, to: &mut [f32]) {
        let to = &mut to[..8];
        // SAFETY: `to` has eight floats, and `self` only exists where AVX2 was detected.
        unsafe { _mm256_storeu_ps(to.as_mut_ptr(), value) };
    }

    #[inline(always)]
    fn store_partial(self, value: __m256, to: &mut [f32]) {
        if to.len() >= 8 {
            return self.store(value, to);
        }
        let mut all = [0.0; 8];
        self.store(value, &mut all);
        copy_partial(&all, to);
    }

    #[inline(always)]
    fn mul_add(self, a: __m256, b: __m256, c: __m256) -> __m256 {
        // SAFETY: `self` only exists where FMA was detected.
        unsafe { _mm256_fmadd_ps(a, b, c) }
    }

    #[inline(always)]
    fn add(self, a: __m256, b: __m256) -> __m256 {
        // SAFETY: `self` only exists where AVX2 was detected.
        unsafe { _mm256_add_ps(a, b) }
    }

    #[inline(always)]
    fn sub(self, a: __m256, b: __m256) -> __m256 {
        // SAFETY: `self` only exists where AVX2 was detected.
        unsafe { _mm256_sub_ps(a, b) }
    }

    #[inline(always)]
    fn plus(self, a: __m256, one: __m256, b: __m256) -> __m256 {
        self.mul_add(a, one, b)
    }

    #[inline(always)]
    fn max(self, a: __m256, b: __m256) -> __m256 {
        // SAFETY: `self` only exists where AVX2 was detected.
        unsafe { _mm256_max_ps(a, b) }
    }

    #[inline(always)]
    fn min(self, a: __m256, b: __m256) -> __m256 {
        // SAFETY: `self` only exists where AVX2 was detected.
        unsafe { _mm256_min_ps(a, b) }
    }

    #[inline(always)]
    fn first(self, n: usize, a: __m256, b: __m256) -> __m256 {
        let numbers = self.load(&[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
        let end = self.splat(n as f32);
        // SAFETY: `self` only exists where AVX2 was detected.
        let inside = unsafe { _mm256_cmp_ps::<_CMP_LT_OQ>(numbers, end) };
        // SAFETY: `self` only exists where AVX2 was detected.
        unsafe { _mm256_blendv_ps(b, a, inside) }
    }

    #[inline(always)]
    fn transposed(self, rows: &[Row], lane: usize) -> [__m256; 8] {
        let mut square = [self.splat(0.0); 8];
        for (value, row) in square.iter_mut().zip(&rows[..8]) {
            *value = self.load(&row.0[lane..]);
        }
        // SAFETY: `self` only exists where AVX2 was detected.
        unsafe { transpose8(&square) }
    }

    #[inline(always)]
    fn apart(self, kernel: impl Kernel) {
        // SAFETY: `self` only exists where AVX2 and FMA were detected.
        unsafe { run_avx2(kernel) }
    }
}

impl Simd for Avx512 {
    type V = __m512;
    type Square = [__m512; 16];
    const LANES: usize = 16;
    const BLOCK: usize = 14;

    #[inline(always)]
    fn splat(self, value: f32) -> __m512 {
        // SAFETY: `self` only exists where AVX-512 F was detected.
        unsafe { _mm512_set1_ps(value) }
    }

    #[inline(always)]
    fn load(self, from: &[f32]) -> __m512 {
        let from = &from[..16];
        // SAFETY: `from` has sixteen floats, and `self` only exists where AVX-512 F was detected.
        unsafe { _mm512_loadu_ps(from.as_ptr()) }
    }

    #[inline(always)]
    unsafe fn load_at(self, from: &[f32], at: usize) -> __m512 {
        debug_assert!(at + 16 <= from.len(), "the caller's promise");
        // SAFETY: the caller promises that `at` is inside the slice.
        let from = unsafe { from.as_ptr().add(at) };
        // SAFETY: the caller promises that sixteen floats follow, and `self` only exists where AVX-512 F
        // was detected.
        unsafe { _mm512_loadu_ps(from) }
    }

    #[inline(always)]
    fn store(self, value: __m512, to: &mut [f32]) {
        let to = &mut to[..16];
        // SAFETY: `to` has sixteen floats, and `self` only exists where AVX-512 F was detected.
        unsafe { _mm512_storeu_ps(to.as_mut_ptr(), value) };
    }

    #[inline(always)]
    fn store_partial(self, value: __m512, to: &mut [f32]) {
        if to.len() >= 16 {
            return self.store(value, to);
        }
        let mask = (1_u16 << to.len()) - 1;
        // SAFETY: the mask has a bit for every float of `to` and no more, and `self` only exists
        // where AVX-512 F was detected.
        unsafe { _mm512_mask_storeu_ps(to.as_mut_ptr(), mask, value) };
    }

    #[inline(always)]
    fn mul_add(self, a: __m512, b: __m512, c: __m512) -> __m512 {
        // SAFETY: `self` only exists where AVX-512 F was detected.
        unsafe { _mm512_fmadd_ps(a, b, c) }
    }

    #[inline(always)]
    fn add(self, a: __m512, b: __m512) -> __m512 {
        // SAFETY: `self` only exists where AVX-512 F was detected.
        unsafe { _mm512_add_ps(a, b) }
    }

    #[inline(always)]
    fn sub(self, a: __m512, b: __m512) -> __m512 {
        // SAFETY: `self` only exists where AVX-512 F was detected.
        unsafe { _mm512_sub_ps(a, b) }
    }

    #[inline(always)]
    fn plus(self, a: __m512, one: __m512, b: __m512) -> __m512 {
        self.mul_add(a, one, b)
    }

    #[inline(always)]
    fn max(self, a: __m512, b: __m512) -> __m512 {
        // SAFETY: `self` only exists where AVX-512 F was detected.
        unsafe { _mm512_max_ps(a, b) }
    }

    #[inline(always)]
    fn min(self, a: __m512, b: __m512) -> __m512 {
        // SAFETY: `self` only exists where AVX-512 F was detected.
        unsafe { _mm512_min_ps(a, b) }
    }

    #[inline(always)]
    fn first(self, n: usize, a: __m512, b: __m512) -> __m512 {
        let inside = if n < 16 { (1_u16 << n) - 1 } else { u16::MAX };
        // SAFETY: `self` only exists where AVX-512 F was detected.
        unsafe { _mm512_mask_blend_ps(inside, b, a) }
    }

    #[inline(always)]
    fn transposed(self, rows: &[Row], lane: usize) -> [__m512; 16] {
        let mut square = [self.splat(0.0); 16];
        for (value, row) in square.iter_mut().zip(&rows[..16]) {
            *value = self.load(&row.0[lane..]);
        }
        // SAFETY: `self` only exists where AVX-512 F was detected.
        unsafe { transpose16(&square) }
    }

    #[inline(always)]
    fn apart(self, kernel: impl Kernel) {
        // SAFETY: `self` only exists where AVX-512 F and VL were detected.
        unsafe { run_avx512(kernel) }
    }
}

/// Transposes each square of 4 x 4 values within the registers, then the arrangement of the squares.
#[target_feature(enable = "avx2,fma")]
#[inline]
fn transpose8(rows: &[__m256; 8]) -> [__m256; 8] {
    let mut columns = [rows[0]; 8];
    let (quads, _) = rows.as_chunks::<4>();
    let [low, high] = [quads[0], quads[1]].map(|[a, b, c, d]| {
        let ab = _mm256_castps_pd(_mm256_unpacklo_ps(a, b));
        let cd = _mm256_castps_pd(_mm256_unpacklo_ps(c, d));
        let ab_high = _mm256_castps_pd(_mm256_unpackhi_ps(a, b));
        let cd_high = _mm256_castps_pd(_mm256_unpackhi_ps(c, d));
        [
            _mm256_castpd_ps(_mm256_unpacklo_pd(ab, cd)),
            _mm256_castpd_ps(_mm256_unpackhi_pd(ab, cd)),
            _mm256_castpd_ps(_mm256_unpacklo_pd(ab_high, cd_high)),
            _mm256_castpd_ps(_mm256_unpackhi_pd(ab_high, cd_high)),
        ]
    });
    for j in 0..4 {
        columns[j] = _mm256_permute2f128_ps::<0x20>(low[j], high[j]);
        columns[4 + j] = _mm256_permute2f128_ps::<0x31>(low[j], high[j]);
    }
    columns
}

/// Does the same as [`transpose8`] for sixteen registers.
#[target_feature(enable = "avx2,fma,avx512f,avx512vl")]
#[inline]
fn transpose16(rows: &[__m512; 16]) -> [__m512; 16] {
    let mut columns = [rows[0]; 16];
    let (quads, _) = rows.as_chunks::<4>();
    let quads = [quads[0], quads[1], quads[2], quads[3]].map(|[a, b, c, d]| {
        let ab = _mm512_castps_pd(_mm512_unpacklo_ps(a, b));
        let cd = _mm512_castps_pd(_mm512_unpacklo_ps(c, d));
        let ab_high = _mm512_castps_pd(_mm512_unpackhi_ps(a, b));
        let cd_high = _mm512_castps_pd(_mm512_unpackhi_ps(c, d));
        [
            _mm512_castpd_ps(_mm512_unpacklo_pd(ab, cd)),
            _mm512_castpd_ps(_mm512_unpackhi_pd(ab, cd)),
            _mm512_castpd_ps(_mm512_unpacklo_pd(ab_high, cd_high)),
            _mm512_castpd_ps(_mm512_unpackhi_pd(ab_high, cd_high)),
        ]
    });
    for j in 0..4 {
        let [a, b, c, d] = [quads[0][j], quads[1][j], quads[2][j], quads[3][j]];
        let ab = _mm512_shuffle_f32x4::<0x44>(a, b);
        let cd = _mm512_shuffle_f32x4::<0x44>(c, d);
        let ab_high = _mm512_shuffle_f32x4::<0xEE>(a, b);
        let cd_high = _mm512_shuffle_f32x4::<0xEE>(c, d);
        columns[j] = _mm512_shuffle_f32x4::<0x88>(ab, cd);
        columns[4 + j] = _mm512_shuffle_f32x4::<0xDD>(ab, cd);
        columns[8 + j] = _mm512_shuffle_f32x4::<0x88>(ab_high, cd_high);
        columns[12 + j] = _mm512_shuffle_f32x4::<0xDD>(ab_high, cd_high);
    }
    columns
}
