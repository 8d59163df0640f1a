//! The instruction sets and precisions of the bench.

use fmp::Precision;
use kernels::Isa;

/// An instruction set, and the precision of the filters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Arithmetic {
    pub(crate) isa: Isa,
    pub(crate) precision: Precision,
}

impl Arithmetic {
    /// All that this machine has, slowest first.
    pub(crate) fn available() -> Vec<Self> {
        let all = Isa::available().into_iter();
        let exact = all.map(|isa| (isa, Precision::F32));
        let rounded = Precision::Bf16;
        let rounded = rounded.check().map(|()| (Isa::best(), rounded));
        exact
            .chain(rounded)
            .map(|(isa, precision)| Self { isa, precision })
            .collect()
    }

    /// The name in the table.
    pub(crate) fn name(self) -> &'static str {
        match self.precision {
            Precision::F32 => self.isa.name(),
            Precision::Bf16 => "bf16",
        }
    }
}
