//! Part-type tables, and the joint of two of them.
#![no_main]

use multiview::Compatibility;

libfuzzer_sys::fuzz_target!(|input: &str| {
    let (there, back) = input.split_once('#').unwrap_or((input, input));
    let tables = [there, back].map(|it| Compatibility::parse(it, &[2, 3]));
    if let [Ok(there), Ok(back)] = tables {
        let (_, disagreement) =
            Compatibility::joint_from_conditionals(&there, &back).expect("the same types");
        assert!((0.0..1.000_001).contains(&disagreement));
    }
});
