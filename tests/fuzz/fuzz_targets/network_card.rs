//! Card of a network that finds keypoints, and the windows that the card defines.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| properties::network_card(input));
