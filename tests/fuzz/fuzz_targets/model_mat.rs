//! Yang & Ramanan's MATLAB models.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| properties::model_mat(input));
