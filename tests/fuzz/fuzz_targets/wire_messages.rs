//! Messages, each changed in every field.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| properties::wire_messages(input));
