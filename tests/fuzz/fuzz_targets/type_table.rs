//! Part-type tables, and the joint of two of them.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| properties::type_table(input));
