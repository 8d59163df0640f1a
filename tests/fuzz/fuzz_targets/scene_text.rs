//! Addresses of scenes, and lines of their truth.
#![no_main]

use scene::Address;
use scene::truth::{Frame, Header};

libfuzzer_sys::fuzz_target!(|input: &str| {
    if let Ok(address) = Address::parse(input) {
        assert_eq!(Address::parse(&address.to_string()).expect("it was written"), address);
    }
    let mut lines = input.lines();
    if let Some(Ok(header)) = lines.next().map(Header::parse) {
        for line in lines {
            if let Ok(frame) = Frame::parse(line, &header) {
                let again = frame.to_line().expect("numbers of JSON are finite");
                assert_eq!(Frame::parse(&again, &header).expect("it was written"), frame);
            }
        }
    }
});
