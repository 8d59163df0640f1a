//! The learned consistency of several views: the file, and the tables that are made of it.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| properties::consistency(input));
