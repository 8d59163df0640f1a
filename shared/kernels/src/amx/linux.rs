//! AMX on Linux. The compiler has no stable intrinsics for it, so the instructions are written in
//! assembly.

use std::arch::asm;
use std::arch::x86_64::{__cpuid_count, _xgetbv};
use std::marker::PhantomData;

use super::{Amx, NoAmx};
use crate::isa::{Isa, Kind};
use crate::tiles::{Block, SIDE, Sums};

/// Products of tiles in a round of [`Tiles::exercise`].
pub(super) const PRODUCTS_OF_ROUND: usize = 64;

/// Bits of CPUID leaf 7.
const AMX_BF16: u32 = 1 << 22;
const AMX_TILE: u32 = 1 << 24;
/// Bits of `XCR0`, the register state that the system saves: tile shapes and tiles.
const TILE_STATE: u64 = 0b11 << 17;
/// System call, its request for a permission, and the state that it is for (Linux,
/// `Documentation/arch/x86/xstate.rst`).
const ARCH_PRCTL: i64 = 158;
const REQUEST_PERMISSION: u64 = 0x1023;
const TILE_DATA: u64 = 18;

/// Asks the processor and the system; the permission holds for all threads of the process.
pub(super) fn permitted() -> Result<(), NoAmx> {
    if Isa::best().0 != Kind::Avx512 {
        return Err(NoAmx::Processor);
    }
    let has = __cpuid_count(7, 0).edx;
    if has & AMX_TILE == 0 || has & AMX_BF16 == 0 {
        return Err(NoAmx::Processor);
    }
    // SAFETY: where AVX-512 was detected the system has enabled `xgetbv`.
    let saved = unsafe { saved_state() };
    if saved & TILE_STATE != TILE_STATE {
        return Err(NoAmx::System);
    }
    let mut answer = ARCH_PRCTL;
    // SAFETY: this request changes nothing but what the process may do; the call reads two registers
    // and overwrites the three that are named.
    unsafe {
        asm!(
            "syscall",
            inlateout("rax") answer,
            in("rdi") REQUEST_PERMISSION,
            in("rsi") TILE_DATA,
            lateout("rcx") _,
            lateout("r11") _,
            options(nostack),
        );
    };
    (answer == 0).then_some(()).ok_or(NoAmx::System)
}

#[target_feature(enable = "xsave")]
fn saved_state() -> u64 {
    // SAFETY: register 0 exists wherever the instruction does.
    unsafe { _xgetbv(0) }
}

/// The shapes of the eight tiles, as `ldtilecfg` reads them (Intel, *Software Developer's Manual*,
/// volume 1, section 18.3).
#[repr(C, align(64))]
struct Shapes {
    palette: u8,
    first_row: u8,
    zero: [u8; 14],
    row_bytes: [u16; 16],
    rows: [u8; 16],
}

static FULL: Shapes = {
    let mut it = Shapes {
        palette: 1,
        first_row: 0,
        zero: [0; 14],
        row_bytes: [0; 16],
        rows: [0; 16],
    };
    let mut tile = 0;
    while tile < 8 {
        it.row_bytes[tile] = 64;
        it.rows[tile] = SIDE as u8;
        tile += 1;
    }
    it
};

/// The tiles of this thread, all of 16 rows of 64 bytes; given back when this is dropped.
pub(crate) struct Tiles {
    /// Tiles are a thread's own.
    _of_this_thread: PhantomData<*const ()>,
}

impl Tiles {
    /// Takes the tiles; no other code of this thread may use them.
    pub(crate) fn new(_: Amx) -> Self {
        // SAFETY: `Amx` proves that the processor has the instruction and that the process may use it,
        // and the 64 bytes that it reads are a valid description.
        unsafe { asm!("ldtilecfg [{}]", in(reg) &raw const FULL, options(nostack, readonly)) };
        Self {
            _of_this_thread: PhantomData,
        }
    }

    /// Products of tiles that are held already.
    #[expect(
        clippy::unused_self,
        reason = "the value proves that the tiles are configured"
    )]
    pub(super) fn exercise(&self, rounds: usize) {
        let products = rounds * PRODUCTS_OF_ROUND / 4;
        if products == 0 {
            return;
        }
        // SAFETY: the tiles have shapes, and the loop touches nothing but them and its counter.
        unsafe {
            asm!(
                "tilezero tmm4",
                "tilezero tmm5",
                "tilezero tmm6",
                "tilezero tmm7",
                "2:",
                "tdpbf16ps tmm0, tmm4, tmm6",
                "tdpbf16ps tmm1, tmm4, tmm7",
                "tdpbf16ps tmm2, tmm5, tmm6",
                "tdpbf16ps tmm3, tmm5, tmm7",
                "dec {n}",
                "jnz 2b",
                n = inout(reg) products => _,
                out("tmm0") _, out("tmm1") _, out("tmm2") _, out("tmm3") _,
                out("tmm4") _, out("tmm5") _, out("tmm6") _, out("tmm7") _,
                options(nostack, nomem),
            );
        };
    }

    /// Writes the sums of 32 cells with 32 filters: two tiles of cells by two of weights.
    ///
    /// # Panics
    ///
    /// If cells or weights end too early.
    #[expect(
        clippy::unused_self,
        reason = "the value proves that the tiles are configured"
    )]
    pub(crate) fn sums(&self, job: &Sums<'_>, out: &mut Block) {
        let [rows, cols] = job.filter;
        assert!(rows > 0 && cols > 0, "a filter has cells");
        assert!(
            job.cells.len() >= (rows - 1) * job.stride + cols - 1 + 2 * SIDE,
            "two tiles of cells under the last filter cell"
        );
        assert_eq!(
            job.weights.len(),
            rows * cols,
            "weights for every filter cell"
        );
        // SAFETY: the tiles have shapes. Cells are read from `row + r stride + c` to 31 after it, r below
        // `rows` and c below `cols`, which lie in `job.cells`; weights a pair of tiles for each of these,
        // as many as there are; what is written are the 32 rows of 32 floats of `out`.
        unsafe {
            asm!(
                "tilezero tmm0",
                "tilezero tmm1",
                "tilezero tmm2",
                "tilezero tmm3",
                "2:",
                "mov {cell}, {row}",
                "mov {left}, {cols}",
                "3:",
                "tileloadd tmm4, [{cell} + {line}*1]",
                "tileloadd tmm6, [{weight} + {line}*1]",
                "tileloadd tmm7, [{weight} + {line}*1 + 1024]",
                "tileloadd tmm5, [{cell} + {line}*1 + 1024]",
                "tdpbf16ps tmm0, tmm4, tmm6",
                "tdpbf16ps tmm1, tmm4, tmm7",
                "tdpbf16ps tmm2, tmm5, tmm6",
                "tdpbf16ps tmm3, tmm5, tmm7",
                "add {cell}, 64",
                "add {weight}, 2048",
                "dec {left}",
                "jnz 3b",
                "add {row}, {stride}",
                "dec {rows}",
                "jnz 2b",
                "add {line}, {line}",
                "tilestored [{out} + {line}*1], tmm0",
                "tilestored [{out} + {line}*1 + 64], tmm1",
                "tilestored [{out} + {line}*1 + 2048], tmm2",
                "tilestored [{out} + {line}*1 + 2112], tmm3",
                cell = out(reg) _,
                left = out(reg) _,
                row = inout(reg) job.cells.as_ptr() => _,
                rows = inout(reg) rows => _,
                cols = in(reg) cols,
                stride = in(reg) 64 * job.stride,
                weight = inout(reg) job.weights.as_ptr() => _,
                line = inout(reg) 64_usize => _,
                out = in(reg) out.as_mut_ptr(),
                out("tmm0") _, out("tmm1") _, out("tmm2") _, out("tmm3") _,
                out("tmm4") _, out("tmm5") _, out("tmm6") _, out("tmm7") _,
                options(nostack),
            );
        };
    }
}

impl Drop for Tiles {
    fn drop(&mut self) {
        // SAFETY: a `Tiles` is only created from an `Amx`.
        unsafe { asm!("tilerelease", options(nostack, nomem)) };
    }
}
