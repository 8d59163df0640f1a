//! Addresses of scenes, and lines of their truth files.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| properties::scene_text(input));
