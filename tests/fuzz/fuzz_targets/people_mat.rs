//! The MATLAB annotations of PARSE and LSP.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| properties::people_mat(input));
