//! Compiles plain loops into one function per instruction set.

use crate::isa::Isa;
use crate::simd::{Kernel, Simd};

/// A computation that is compiled once for every instruction set and vectorised by the
/// compiler.
///
/// [`run`](Self::run) and everything it calls must be `#[inline(always)]`: a body uses the
/// instruction set of the function into which it is inlined.
pub trait Body {
    /// Runs the computation.
    fn run(self);
}

/// Runs `body` with the instructions of `isa`.
#[inline]
pub fn dispatch(isa: Isa, body: impl Body) {
    isa.run(Plain(body));
}

/// A kernel that does not use registers explicitly.
struct Plain<B>(B);

impl<B: Body> Kernel for Plain<B> {
    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        self.0.run();
    }
}
