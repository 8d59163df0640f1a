//! Tables of expected errors, and thresholds.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| properties::quality_table(input));
