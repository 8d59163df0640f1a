//! Every calibration format that consists of one text file.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| properties::calibration(input));
