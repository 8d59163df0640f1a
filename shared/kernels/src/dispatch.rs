//! How one body becomes a function for every instruction set.

use crate::isa::{Isa, Kind};

/// A computation that is compiled once for every instruction set.
///
/// [`run`](Self::run) and everything it calls must be `#[inline(always)]`: a body takes on the
/// instruction set of the function that it is inlined into.
pub(crate) trait Body {
    /// Does it.
    fn run(self);
}

/// Runs `body` with the instructions of `isa`.
#[inline]
pub(crate) fn dispatch(isa: Isa, body: impl Body) {
    match isa.0 {
        Kind::Portable => body.run(),
        #[cfg(target_arch = "x86_64")]
        // SAFETY: an `Isa` of this kind only exists where AVX2 and FMA were detected.
        Kind::Avx2 => unsafe { avx2(body) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: an `Isa` of this kind only exists where AVX-512 F and VL were detected.
        Kind::Avx512 => unsafe { avx512(body) },
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn avx2(body: impl Body) {
    body.run();
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma,avx512f,avx512vl")]
fn avx512(body: impl Body) {
    body.run();
}
