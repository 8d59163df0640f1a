//! Our own annotation file, line by line, and skeleton tables.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| properties::people_lines(input));
