//! Networks that predict errors: the metadata of their files, and the files themselves.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| properties::quality_network(input));
