//! The payload of the checkpoints of trainings, under a right checksum.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| properties::training_checkpoint(input));
