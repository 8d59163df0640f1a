//! Messages from another host.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| properties::host_messages(input));
