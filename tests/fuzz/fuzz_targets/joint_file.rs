//! The file of a map from the parts of a model to joints, and the maps made from it.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| properties::joint_file(input));
