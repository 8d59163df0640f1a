//! Every calibration format that is one text.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| properties::calibration(input));
