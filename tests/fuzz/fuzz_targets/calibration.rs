//! Every calibration format that is one text.
#![no_main]

use geometry::files::{ReadOptions, humaneva, opencv, own, pose2sim, qualisys, umpm};

libfuzzer_sys::fuzz_target!(|input: &str| {
    let options = ReadOptions {
        size: Some([640, 480]),
        ..ReadOptions::default()
    };
    if let Ok(rig) = own::parse(input, &options) {
        assert!(own::parse(&own::write(&rig), &options).is_ok());
    }
    let _pose2sim = pose2sim::parse(input, &options);
    let _qualisys = qualisys::parse(input, &options);
    let _humaneva = humaneva::parse("C1", input, &options);
    let _umpm = umpm::parse("l", input, &options);
    let _opencv = opencv::parse(&[("cam01", input)], &options);
});
