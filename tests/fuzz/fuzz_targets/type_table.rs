//! Part-type tables, each alone and joined with another table.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| properties::type_table(input));
