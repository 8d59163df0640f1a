//! Our own annotation file, line by line, and skeletons.
#![no_main]

use datasets::{SkeletonTable, parse_line, to_line};

libfuzzer_sys::fuzz_target!(|input: &str| {
    for line in input.lines() {
        if let Ok((person, name)) = parse_line(line) {
            let again = to_line(&person, name.as_deref()).expect("it was Unicode");
            let (again, same_name) = parse_line(&again).expect("it was written");
            assert_eq!((again.image, again.visible, same_name), (person.image, person.visible, name));
            assert_eq!(format!("{:?}", again.joints), format!("{:?}", person.joints));
        }
    }
    if let Ok(table) = SkeletonTable::parse(input) {
        let joints = vec![[1.0, 2.0]; table.n_joints()];
        assert_eq!(table.parts_of(&joints).len(), table.n_parts());
    }
});
