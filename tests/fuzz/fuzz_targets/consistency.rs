//! What was learned about several views: the file, and the tables that are made of it.
#![no_main]

use consistency::{Appearance, Learned};

libfuzzer_sys::fuzz_target!(|input: &str| {
    let Ok(learned) = Learned::parse(input) else {
        return;
    };
    let again = learned.write().expect("its numbers are finite");
    assert_eq!(Learned::parse(&again).expect("it was written"), learned);
    for appearance in [Appearance::Joint, Appearance::Lift] {
        let tables = learned.by_angle(appearance);
        for angle in [-3.5, -1.0, 0.0, 1.0, 3.5] {
            if let Some(it) = tables.at(angle) {
                assert!(it.joint.value(0, 0, 0).is_finite());
            }
        }
        for rig in &learned.rigs {
            let _tables = learned.of_rig(&rig.name, &["c1", "c2"], appearance);
        }
    }
});
