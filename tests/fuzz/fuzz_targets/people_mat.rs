//! The MATLAB annotations of PARSE and LSP.
#![no_main]

use datasets::{parse_joints, parse_labels};

libfuzzer_sys::fuzz_target!(|input: &[u8]| {
    for people in [parse_labels(input), parse_joints(input)].into_iter().flatten() {
        for (joints, visible) in people {
            assert_eq!(joints.len(), visible.len());
        }
    }
});
