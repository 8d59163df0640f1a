//! The payload of the checkpoints of trainings, under a right checksum.
#![no_main]

use training::Checkpoint;

libfuzzer_sys::fuzz_target!(|payload: &[u8]| {
    let hash = payload.iter().fold(0xcbf2_9ce4_8422_2325, |hash, &byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
    });
    let length = payload.len() as u64;
    let header = [&b"PLXTRAIN"[..], &[1, 0, 0, 0], &length.to_le_bytes()].concat();
    let file = [&header[..], &hash.to_le_bytes(), payload].concat();
    if let Ok((checkpoint, stamp)) = Checkpoint::from_bytes(&file) {
        let again = checkpoint.to_bytes(stamp).expect("small checkpoints fit");
        let (_, same) = Checkpoint::from_bytes(&again).expect("it was written");
        assert_eq!(same, stamp);
    }
});
