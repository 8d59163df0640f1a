//! Files that a run leaves behind.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| properties::run_files(input));
