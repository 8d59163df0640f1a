//! Tests of clusters and their mirror images.

use super::*;

const PARENTS: [Option<usize>; 3] = [None, Some(0), Some(1)];

/// People whose second part is left of, below, or right of the first. The third part is always
/// below the second.
fn people() -> Vec<Vec<[f64; 2]>> {
    let person = |i: usize| {
        let jitter = 0.1 * (i % 7) as f64;
        let arm = [[-5.0, 1.0], [0.2, 5.0], [6.0, 0.0], [6.0, 0.0]][i % 4];
        let second = [10.0 + arm[0] + jitter, 10.0 + arm[1] - jitter];
        vec![[10.0, 10.0], second, [second[0], second[1] + 4.0]]
    };
    (0..40).map(person).collect()
}

fn settings(n_types: usize, types_by: TypesBy) -> Settings {
    Settings {
        n_types,
        types_by,
        cluster_starts: 20,
        ..Settings::default()
    }
}

#[test]
fn clusters_are_sorted_by_size() {
    let types = cluster(&people(), (&PARENTS, None), &settings(3, TypesBy::Parent));
    let of_second: Vec<_> = types.of_person.iter().map(|labels| labels[1]).collect();
    assert_eq!(types.anchors[1][0], [6, 0], "half of the people");
    for (person, label) in of_second.iter().enumerate() {
        assert_eq!(of_second[person % 4], *label, "person {person}");
    }
    assert_eq!(of_second[2], of_second[3]);
    assert_ne!(of_second[0], of_second[1]);
}

#[test]
fn neighbours_distinguish_types_that_the_parent_does_not() {
    let by_parent = cluster(&people(), (&PARENTS, None), &settings(3, TypesBy::Parent));
    assert_eq!(
        by_parent.anchors[2].len(),
        by_parent.anchors[2].iter().len()
    );
    assert!(by_parent.anchors[2].iter().all(|anchor| *anchor == [0, 4]));
    let by_all = cluster(
        &people(),
        (&PARENTS, None),
        &settings(3, TypesBy::Neighbours),
    );
    let spread = |types: &Types| {
        let labels = types.of_person.iter().map(|labels| labels[1]);
        labels.collect::<std::collections::BTreeSet<_>>().len()
    };
    assert_eq!(spread(&by_all), 3);
}

#[test]
fn few_people_have_few_types() {
    let types = cluster(
        &people()[..2],
        (&PARENTS, None),
        &settings(6, TypesBy::Parent),
    );
    assert!(types.anchors.iter().all(|anchor| (1..=2).contains(&anchor.len())));
    let fits = |person: &Vec<usize>| person.iter().zip(&types.anchors).all(|(a, b)| *a < b.len());
    assert!(types.of_person.iter().all(fits));
}

#[test]
fn the_seed_determines_the_result() {
    let people = people();
    let twice = [0, 1].map(|_| cluster(&people, (&PARENTS, None), &settings(2, TypesBy::Parent)));
    assert_eq!(twice[0], twice[1]);
}

/// Parents of the parts of a small body: a root in the middle, one more part, and an arm on either side.
const BODY: [Option<usize>; 4] = [None, Some(0), Some(0), Some(0)];
const SIDES: [usize; 4] = [0, 1, 3, 2];

/// People with different arm positions, and their mirror images.
fn with_mirror_images() -> Vec<Vec<[f64; 2]>> {
    let person = |i: usize| {
        let lean = (i % 5) as f64 - 1.5;
        let right = [[-4.0, 1.0], [-1.0, 5.0], [-3.0, -4.0]][i % 3];
        let left = [[5.0, 0.5], [1.0, 6.0]][i % 2];
        let jitter = 0.07 * (i % 11) as f64;
        vec![
            [0.0, 0.0],
            [lean, 4.0 + jitter],
            [right[0] + jitter, right[1]],
            [left[0], left[1] - jitter],
        ]
    };
    let plain = (0..60).map(person);
    plain
        .flat_map(|person| {
            let mirrored = SIDES.map(|part| [-person[part][0], person[part][1]]).to_vec();
            [person, mirrored]
        })
        .collect()
}

#[test]
fn the_types_of_one_side_mirror_those_of_the_other() {
    let people = with_mirror_images();
    for by in [TypesBy::Parent, TypesBy::Neighbours] {
        let types = cluster(&people, (&BODY, Some(&SIDES)), &settings(4, by));
        let flip = |anchor: &[i32; 2]| [-anchor[0], anchor[1]];
        let flipped: Vec<_> = types.anchors[2].iter().map(flip).collect();
        assert_eq!(types.anchors[3], flipped);
        for middle in [0, 1] {
            for pair in types.anchors[middle].chunks(2) {
                assert_eq!(pair[1], flip(&pair[0]), "part {middle}");
            }
        }
        for pair in types.of_person.chunks(2) {
            assert_eq!([pair[0][2], pair[0][3]], [pair[1][3], pair[1][2]]);
            assert_eq!([pair[0][0] ^ 1, pair[0][1] ^ 1], [pair[1][0], pair[1][1]]);
        }
    }
}

#[test]
fn a_single_type_is_its_own_mirror_image() {
    let people = with_mirror_images();
    let types = cluster(
        &people,
        (&BODY, Some(&SIDES)),
        &settings(1, TypesBy::Parent),
    );
    assert!(types.of_person.iter().flatten().all(|label| *label == 0));
    assert_eq!(types.anchors[1], [[0, 4]]);
}
