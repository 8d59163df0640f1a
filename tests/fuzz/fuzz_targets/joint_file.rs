//! Where joints lie among the parts of a model: the file, and the maps that are made of it.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| properties::joint_file(input));
