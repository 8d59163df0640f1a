//! How exactly responses are computed.

use kernels::{Amx, NoAmx};
use serde::{Deserialize, Serialize};

/// How exactly responses are computed; they are single precision numbers in either case.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Precision {
    /// In single precision, to within the bound of [`kernels::FilterBank::correlate`]: the same bits
    /// on every machine.
    #[default]
    F32,
    /// Features and weights rounded to bfloat16, sums in single precision, to within the bound of
    /// [`kernels::Bf16Bank::correlate`]: faster, less exact, and only on machines with tile
    /// products (AMX). Scores change by some thousandths, so do not compare or fuse them with
    /// scores in single precision.
    Bf16,
}

impl Precision {
    /// Whether this machine has it.
    ///
    /// # Errors
    ///
    /// What is missing.
    pub fn check(self) -> Result<(), NoAmx> {
        match self {
            Self::F32 => Ok(()),
            Self::Bf16 => Amx::detect().map(|_| ()),
        }
    }
}
