//! Part-type tables, and two joined tables.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| properties::type_table(input));
