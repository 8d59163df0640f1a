//! The payload of our own model files, under a right checksum.
#![no_main]

use fmp::Model;
use fmp::files::own;

libfuzzer_sys::fuzz_target!(|payload: &[u8]| {
    let hash = payload.iter().fold(0xcbf2_9ce4_8422_2325, |hash, &byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
    });
    let length = payload.len() as u64;
    let header = [&own::MAGIC[..], &[1, 0, 0, 0], &length.to_le_bytes()].concat();
    let file = [&header[..], &hash.to_le_bytes(), payload].concat();
    if let Ok(Ok(model)) = own::decode(&file).map(Model::new) {
        let again = own::encode(&model).expect("small models fit");
        assert_eq!(own::decode(&again).as_ref().ok(), Some(model.spec()));
    }
});
