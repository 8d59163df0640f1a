//! All annotated people of PARSE and LSP-extended are read without faults.

use training::datasets::{ReadOptions, Sample, Selection, SkeletonTable, read};

use crate::shared_dir;

#[test]
#[ignore = "needs ../shared"]
fn all_people_of_parse_and_lspet_are_valid() {
    let Some(shared) = shared_dir() else { return };
    for (name, n_people) in [("parse", 200), ("lspet", 861)] {
        let people = read(&shared.join("data").join(name), &ReadOptions::default()).unwrap();
        assert!(people.problems.is_empty(), "{:#?}", people.problems);
        assert_eq!(people.people.len(), n_people);
    }
}

#[test]
#[ignore = "needs ../shared"]
fn a_few_joints_are_outside_the_image_by_at_most_two_pixels() {
    let Some(shared) = shared_dir() else { return };
    let strict = ReadOptions {
        outside_px: 0.0,
        ..ReadOptions::default()
    };
    let rows = |name: &str| -> Vec<String> {
        let people = read(&shared.join("data").join(name), &strict).unwrap();
        people.problems.into_iter().map(|problem| problem.row).collect()
    };
    assert_eq!(rows("parse"), ["person 15", "person 135"]);
    assert_eq!(rows("lspet"), ["person 3", "person 835"]);
}

#[test]
#[ignore = "needs ../shared"]
fn parts_of_a_parse_sample_move_with_rotation_and_mirroring() {
    let Some(shared) = shared_dir() else { return };
    let options = ReadOptions {
        without: Some(Selection::from_argument("101-305").unwrap()),
        ..ReadOptions::default()
    };
    let people = read(&shared.join("data/parse"), &options).unwrap().people;
    assert_eq!(people.len(), 100);
    let table = SkeletonTable::published();
    let sample = Sample::read(&people[0]).unwrap();
    let turned = sample.rotated(15.0, footage::Fill::Replicate).unwrap();
    let length = |sample: &Sample| {
        let parts = table.parts_of(&sample.joints);
        (parts[0][0] - parts[13][0]).hypot(parts[0][1] - parts[13][1])
    };
    assert!((length(&turned) - length(&sample)).abs() < 1e-9);
    let mirror = table.joint_mirror();
    let twice = turned.mirrored(mirror).mirrored(mirror);
    assert!(twice.image == turned.image);
    for (a, b) in twice.joints.iter().zip(&turned.joints) {
        assert!((a[0] - b[0]).abs() < 1e-9 && a[1] == b[1]);
    }
}
