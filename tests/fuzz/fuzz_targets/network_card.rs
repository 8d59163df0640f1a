//! The card of a network that finds keypoints, and the windows that it asks for.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| properties::network_card(input));
