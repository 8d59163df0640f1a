//! Payload of our own model files, with a correct checksum.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| properties::model_own(input));
