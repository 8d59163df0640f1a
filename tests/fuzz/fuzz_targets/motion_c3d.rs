//! C3D files, in all encodings.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| properties::motion_c3d(input));
