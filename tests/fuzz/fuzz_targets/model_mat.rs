//! Yang & Ramanan's MATLAB models.
#![no_main]

use fmp::Model;
use fmp::files::{describe, mat};

libfuzzer_sys::fuzz_target!(|input: &[u8]| {
    if let Ok(Ok(model)) = mat::parse(input).map(Model::new) {
        assert!(describe(&model).n_filters > 0);
    }
});
