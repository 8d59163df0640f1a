//! One frame with changed evidence, candidates and pairs, processed up to the skeleton.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| properties::wire_fusion(input));
