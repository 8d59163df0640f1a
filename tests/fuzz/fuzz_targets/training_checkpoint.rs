//! Payload of training checkpoints, with a correct checksum.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| properties::training_checkpoint(input));
