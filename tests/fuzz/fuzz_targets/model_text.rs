//! The authors' text models.
#![no_main]

use fmp::Model;
use fmp::files::{own, text};

libfuzzer_sys::fuzz_target!(|input: &str| {
    if let Ok(Ok(model)) = text::parse(input).map(Model::new) {
        let bytes = own::encode(&model).expect("small models fit");
        assert_eq!(own::decode(&bytes).as_ref().ok(), Some(model.spec()));
    }
});
