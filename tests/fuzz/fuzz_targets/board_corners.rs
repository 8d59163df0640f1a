//! Tables of board corners, as other programs write them.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| properties::board_corners(input));
