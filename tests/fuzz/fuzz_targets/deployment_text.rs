//! Deployment files, together with an option of the command line.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| properties::deployment_text(input));
