//! Maps from the parts of a model to joints: the file, and the maps made from it.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| properties::joint_file(input));
