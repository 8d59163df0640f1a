//! The matrix unit of some processors: registers that hold tiles, and products of tiles of bfloat16.

#[cfg(all(target_arch = "x86_64", target_os = "linux"))]
mod linux;
#[cfg(not(all(target_arch = "x86_64", target_os = "linux")))]
mod missing;

#[cfg(all(target_arch = "x86_64", target_os = "linux"))]
use linux as system;
#[cfg(not(all(target_arch = "x86_64", target_os = "linux")))]
use missing as system;

use std::sync::OnceLock;

use crate::tiles::SIDE;

pub(crate) use system::Tiles;

/// Proof that this machine has AMX with bfloat16 and AVX-512, and that this process may use them.
///
/// Can only be had from [`Self::detect`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Amx(());

/// Why bfloat16 cannot be had.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum NoAmx {
    /// The processor, or the virtual machine, does not offer it.
    #[error(
        "this processor has no AMX for bfloat16: amx_tile, amx_bf16, avx512f and avx512vl in \
         /proc/cpuinfo"
    )]
    Processor,
    /// The operating system does not save its registers, or refuses them to this process.
    #[error("the operating system refuses AMX to this process: Linux 5.16 or newer permits it")]
    System,
}

impl Amx {
    /// Looks for it, and asks the operating system for its registers the first time.
    ///
    /// # Errors
    ///
    /// What is missing.
    pub fn detect() -> Result<Self, NoAmx> {
        static FOUND: OnceLock<Result<Amx, NoAmx>> = OnceLock::new();
        *FOUND.get_or_init(|| system::permitted().map(|()| Self(())))
    }

    /// Runs a loop that does nothing but products of tiles, and returns the number of single products
    /// that were added: what the machine could do at most.
    ///
    /// * `rounds`: a microsecond each, or less.
    pub fn peak(self, rounds: usize) -> u64 {
        let tiles = Tiles::new(self);
        tiles.exercise(rounds);
        (rounds * system::PRODUCTS_OF_ROUND * SIDE * SIDE * 2 * SIDE) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_rounds_are_more_products_where_there_are_any() {
        let Ok(amx) = Amx::detect() else { return };
        let [one, three] = [1, 3].map(|rounds| amx.peak(rounds));
        assert!(one > 0 && three == 3 * one);
    }
}
