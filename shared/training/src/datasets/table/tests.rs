//! Properties of skeletons, and the errors of invalid ones.

use std::error::Error as _;
use std::path::Path;

use proptest::prelude::*;
use skeleton::PARSE14;

use super::*;

fn upper_body() -> SkeletonTable {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    SkeletonTable::read(&root.join("configs/skeletons/upper-body.toml")).unwrap()
}

type Change = fn(&mut SkeletonSpec);

/// Returns the error after one change to the published skeleton.
fn error_after(change: impl FnOnce(&mut SkeletonSpec)) -> String {
    let mut spec = SkeletonTable::published().0;
    change(&mut spec);
    SkeletonTable::new(spec).unwrap_err().to_string()
}

#[test]
fn the_published_skeleton_is_valid() {
    let published = SkeletonTable::published();
    assert_eq!(
        SkeletonTable::new(published.spec().clone()).as_ref(),
        Ok(&published)
    );
    assert_eq!((published.n_parts(), published.n_joints()), (26, 14));
}

#[test]
fn the_upper_body_file_agrees_with_the_published_skeleton() {
    let (upper, published) = (upper_body(), SkeletonTable::published());
    assert_eq!(upper.n_parts(), 18);
    let place = |table: &SkeletonTable, part: usize| {
        let spec = table.spec();
        let mut weights: Vec<(String, i64)> = spec.weights[part]
            .iter()
            .map(|&(joint, it)| {
                (
                    spec.joint_names[joint].clone(),
                    (it * 1000.0).round() as i64,
                )
            })
            .collect();
        weights.sort();
        weights
    };
    for (part, name) in upper.names().iter().enumerate() {
        let same = published.names().iter().position(|other| other == name).unwrap();
        let parent = |table: &SkeletonTable, part: usize| {
            table.parent()[part].map(|folder| table.names()[folder].clone())
        };
        assert_eq!(parent(&upper, part), parent(&published, same), "{name}");
        assert_eq!(place(&upper, part), place(&published, same), "{name}");
    }
}

#[test]
fn errors_of_invalid_skeletons_have_name_and_number() {
    let cases: [(&str, Change); 12] = [
        ("the skeleton has 0 parts, expected 1 to 64", |table| {
            table.names.clear();
        }),
        ("there are 25 parents, expected 26", |table| {
            table.parent.pop();
        }),
        ("parts 1 and 3 are both called \"head\"", |table| {
            table.names[2] = "head".to_owned();
        }),
        (
            "part 1 (head) has a parent: the first part, and no other, is the root",
            |table| table.parent[0] = Some(1),
        ),
        (
            "part 3 (right shoulder) has no parent: the first part, and no other, is the root",
            |table| table.parent[2] = None,
        ),
        (
            "part 3 (right shoulder) has part 3 as its parent, which does not come before it",
            |table| table.parent[2] = Some(2),
        ),
        (
            "the mirror of part 15 (left shoulder) is part 3, but part 3 does not exist or has another mirror",
            |table| table.mirror[2] = 2,
        ),
        (
            "the mirror of joint 14 (head) is joint 100, but joint 100 does not exist or has another mirror",
            |table| table.joint_mirror[13] = 99,
        ),
        (
            "the mirror of part 4 (right upper arm) is not a child of the mirror of its parent",
            |table| {
                table.mirror[2] = 2;
                table.mirror[14] = 14;
                table.weights[2] = vec![(12, 1.0)];
                table.weights[14] = vec![(12, 1.0)];
            },
        ),
        (
            "part 4 (right upper arm) and its mirror image left upper arm are not between corresponding joints",
            |table| table.weights[3] = vec![(8, 0.4), (7, 0.6)],
        ),
        (
            "part 2 (neck) uses joint 15, but there are only 14 joints",
            |table| {
                table.weights[1] = vec![(14, 1.0)];
            },
        ),
        (
            "the weights of part 2 (neck) add up to 0.9, expected 1",
            |table| table.weights[1] = vec![(12, 0.9)],
        ),
    ];
    for (expected, change) in cases {
        assert_eq!(error_after(change), expected);
    }
    assert!(error_after(|table| table.weights[1] = vec![(12, f64::NAN)]).contains("add up to NaN"));
}

#[test]
fn invalid_skeleton_files_are_refused() {
    const FILE: &str = "joints = [\"a\", \"b\"]\njoint_mirror = [[\"a\", \"b\"]]\n\
                        [[part]]\nname = \"r\"\njoints = { a = 0.5, b = 0.5 }\n";
    SkeletonTable::parse(FILE).unwrap();
    let cases = [
        (
            "a = 0.5",
            "c = 0.5",
            "the part \"r\" names the joint \"c\", which does not exist",
        ),
        (
            "[[\"a\", \"b\"]]",
            "[[\"a\", \"b\"], [\"b\", \"a\"]]",
            "the joint \"b\" is in two pairs of `joint_mirror`",
        ),
        (
            "[[\"a\", \"b\"]]",
            "[[\"a\", \"x\"]]",
            "`joint_mirror` names the joint \"x\", which does not exist",
        ),
        (
            "name = \"r\"",
            "name = \"r\"\nparent = \"q\"",
            "the part \"r\" names the part \"q\", which does not exist",
        ),
        ("a = 0.5", "a = 0.25", "the skeleton is invalid"),
        ("joints = {", "joint = {", "not a skeleton"),
    ];
    for (from, to, expected) in cases {
        let error = SkeletonTable::parse(&FILE.replace(from, to)).unwrap_err();
        assert_eq!(error.to_string(), expected);
        let is_outer = expected.starts_with("the skeleton") || expected.starts_with("not a");
        assert_eq!(error.source().is_some(), is_outer);
    }
}

proptest! {
    #[test]
    fn joints_are_recovered_from_the_parts(
        joints in prop::collection::vec((-500.0..500.0, -500.0..500.0), 14),
    ) {
        let joints: Vec<_> = joints.into_iter().map(|(x, y)| [x, y]).collect();
        let parts = SkeletonTable::published().parts_of(&joints);
        prop_assert_eq!(PARSE14.from_parts(&parts), joints);
    }

    #[test]
    fn the_parts_of_a_mirrored_person_are_the_mirrored_parts(
        joints in prop::collection::vec((-500.0..500.0, -500.0..500.0), 14),
    ) {
        for table in [SkeletonTable::published(), upper_body()] {
            let joints: Vec<[f64; 2]> = joints.iter().map(|&(x, y)| [x, y]).collect();
            let flipped = |joint: [f64; 2]| [-joint[0], joint[1]];
            let mirrored: Vec<_> = table.joint_mirror().iter().map(|&joint_mirror| flipped(joints[joint_mirror])).collect();
            let parts = table.parts_of(&joints);
            let expected: Vec<_> = table.mirror().iter().map(|&mirror| flipped(parts[mirror])).collect();
            for (a, b) in table.parts_of(&mirrored).iter().zip(expected) {
                prop_assert!((a[0] - b[0]).hypot(a[1] - b[1]) < 1e-9);
            }
        }
    }

    #[test]
    fn no_text_panics(text: String) {
        drop(SkeletonTable::parse(&text));
    }
}
