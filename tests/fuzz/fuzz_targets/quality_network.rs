//! Networks that predict errors: what their files say of themselves, and the files themselves.
#![no_main]

use viewquality::{Card, Network};

libfuzzer_sys::fuzz_target!(|input: &[u8]| {
    if let Ok(text) = core::str::from_utf8(input) {
        let entries = text.lines().filter_map(|it| it.split_once('='));
        if let Ok(card) = Card::parse(entries, 2) {
            let entries = card.entries();
            let entries = entries.iter().map(|(name, it)| (*name, it.as_str()));
            assert_eq!(Card::parse(entries, 2), Ok(card));
        }
    }
    let _outcome = Network::parse(input.to_vec(), 2);
});
