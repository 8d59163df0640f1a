//! Keypoints that other programs wrote into JSON files.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| properties::keypoint_files(input));
