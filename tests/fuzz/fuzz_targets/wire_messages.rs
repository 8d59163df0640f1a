//! Messages with arbitrary changes in all fields.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| properties::wire_messages(input));
