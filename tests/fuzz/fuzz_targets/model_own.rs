//! The payload of our own model files, under a right checksum.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| properties::model_own(input));
