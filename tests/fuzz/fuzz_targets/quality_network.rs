//! Networks that predict errors: what their files say of themselves, and the files themselves.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| properties::quality_network(input));
