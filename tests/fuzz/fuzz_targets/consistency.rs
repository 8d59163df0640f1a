//! The file of learned consistency between views, and the tables made from it.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| properties::consistency(input));
