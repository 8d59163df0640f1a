//! Translation of WGSL to SPIR-V in which the driver must not fuse a product and a sum into one operation.

use naga::back::spv;
use naga::proc::BoundsCheckPolicies;
use naga::valid::{Capabilities, ValidationFlags, Validator};

/// Index of the first word of the instructions, after the header.
const BEGIN: usize = 5;
/// Opcodes of instructions that declare types and constants. Decorations must come before these.
const TYPES: std::ops::RangeInclusive<u32> = 19..=39;
/// Opcodes of sum, difference and product of numbers, and of the product of a vector and a number.
const ARITHMETIC: [u32; 4] = [129, 131, 133, 142];
/// `OpDecorate`, with its length of three words, and `NoContraction`.
const NO_CONTRACTION: [u32; 2] = [0x3_0047, 42];

/// Translates a kernel, and marks every sum, difference and product as not to be fused.
///
/// # Errors
///
/// Fails if the text is not valid WGSL.
pub(crate) fn from_wgsl(text: &str) -> Result<Vec<u32>, String> {
    let module = naga::front::wgsl::parse_str(text).map_err(|error| error.emit_to_string(text))?;
    let info = Validator::new(ValidationFlags::all(), Capabilities::FLOAT64)
        .validate(&module)
        .map_err(|error| error.emit_to_string(text))?;
    let options = spv::Options {
        lang_version: (1, 3),
        flags: spv::WriterFlags::empty(),
        bounds_check_policies: BoundsCheckPolicies::default(),
        zero_initialize_workgroup_memory: spv::ZeroInitializeWorkgroupMemoryMode::None,
        force_loop_bounding: false,
        ..spv::Options::default()
    };
    let words =
        spv::write_vec(&module, &info, &options, None).map_err(|error| error.to_string())?;
    Ok(decorate(&words))
}

/// Marks the arithmetic of a module as not to be fused.
fn decorate(words: &[u32]) -> Vec<u32> {
    let (mut at, mut types, mut results) = (BEGIN, words.len(), Vec::new());
    while at < words.len() {
        let (operation, length) = (words[at] & 0xffff, (words[at] >> 16) as usize);
        if TYPES.contains(&operation) {
            types = types.min(at);
        }
        if ARITHMETIC.contains(&operation) {
            results.push(words[at + 2]);
        }
        at += length.max(1);
    }
    let mut out = words[..types].to_vec();
    for result in results {
        out.extend([NO_CONTRACTION[0], result, NO_CONTRACTION[1]]);
    }
    out.extend(&words[types..]);
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_sum_and_product_is_decorated_against_contraction() {
        let text = "@group(0) @binding(0) var<storage, read_write> x: array<f32>;
            @compute @workgroup_size(1) fn main() { x[0] = x[0] * x[1] + x[2] - x[3]; }";
        let words = from_wgsl(text).unwrap();
        let marks = words
            .windows(3)
            .filter(|words| words[0] == NO_CONTRACTION[0] && words[2] == NO_CONTRACTION[1]);
        assert_eq!(marks.count(), 3);
    }
}
