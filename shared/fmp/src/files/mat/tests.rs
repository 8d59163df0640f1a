//! Properties and edge cases of the reader of MATLAB models.

use std::error::Error as _;

use proptest::prelude::*;
use testkit::mat::{Mat, compressed_file, file, number, row};

use super::*;
use crate::files::planted::mat::model;
use crate::files::planted::{per_pair, three_parts};

/// One change to a good file.
type Change = fn(&mut Mat);

/// Makes one change to a field of a valid model and returns the error.
fn outcome(spec: &ModelSpec, field: &str, change: impl FnOnce(&mut Mat)) -> String {
    let Mat::Structs(names, mut values) = model(spec) else {
        unreachable!("a model is a struct");
    };
    let at = names.iter().position(|&name| name == field).unwrap();
    change(&mut values[at]);
    match parse(&file("model", &Mat::Structs(names, values), false)) {
        Ok(_) => "fine".to_owned(),
        Err(error) => match error.source() {
            Some(source) => format!("{error}: {source}"),
            None => error.to_string(),
        },
    }
}

/// Returns a field of a part, by its index: 0 `biasid`, 1 `filterid`, 2 `defid`, 3 `parent`.
fn of_part(components: &mut Mat, part: usize, field: usize) -> &mut Mat {
    match components {
        Mat::Cell(cells) => match &mut cells[0] {
            Mat::Structs(_, values) => &mut values[4 * (part - 1) + field],
            _ => unreachable!("components are structs"),
        },
        _ => unreachable!("components lie in a cell"),
    }
}

fn value(structs: &mut Mat, at: usize) -> &mut Mat {
    match structs {
        Mat::Structs(_, values) => &mut values[at],
        _ => unreachable!("an array of structs"),
    }
}

#[test]
fn reads_both_releases_compressed_or_not() {
    for spec in [three_parts(), per_pair()] {
        for compressed in [false, true] {
            let bytes = file("model", &model(&spec), compressed);
            assert_eq!(parse(&bytes).unwrap(), spec);
        }
    }
}

#[test]
fn a_part_with_one_type_is_read_the_same_from_both_releases() {
    let mut spec = three_parts();
    spec.parts[1].filter_of_type.truncate(1);
    let edge = spec.parts[1].edge.as_mut().unwrap();
    edge.bias.iter_mut().for_each(|row| row.truncate(1));
    let crate::Springs::PerChildType(springs) = &mut edge.springs else {
        unreachable!("planted per child type");
    };
    springs.truncate(1);
    let spring = springs[0];
    assert_eq!(parse(&file("model", &model(&spec), false)).unwrap(), spec);
    let pair = crate::Springs::PerTypePair(vec![vec![Some(spring)]; 2]);
    spec.parts[1].edge.as_mut().unwrap().springs = pair;
    assert_eq!(parse(&file("model", &model(&spec), false)).unwrap(), spec);
}

#[test]
fn a_parent_with_one_type_may_exclude_a_type_of_its_child() {
    let mut spec = per_pair();
    spec.parts[0].filter_of_type.truncate(1);
    for part in &mut spec.parts[1..] {
        let edge = part.edge.as_mut().unwrap();
        edge.bias.truncate(1);
        let crate::Springs::PerTypePair(springs) = &mut edge.springs else {
            unreachable!("planted per pair");
        };
        springs.truncate(1);
    }
    assert_eq!(parse(&file("model", &model(&spec), false)).unwrap(), spec);
}

#[test]
fn an_array_whose_sizes_and_values_disagree_is_refused() {
    let expected = "not a readable MATLAB level 5 file: an array of size [1, 2] contains 3 values";
    let said = outcome(&three_parts(), "maxsize", |mat| {
        *mat = Mat::Numbers(vec![1, 2], vec![2.0; 3]);
    });
    assert_eq!(said, expected);
}

#[test]
fn errors_name_the_field() {
    let spec = three_parts();
    let cases: [(&str, &str, Change); 9] = [
        (
            "sbin",
            "`model.sbin` holds 4.5, expected a whole number of at least 0",
            |mat| *mat = number(4.5),
        ),
        ("thresh", "`model.thresh` is 1x2, expected 1x1", |mat| {
            *mat = row(vec![1.0, 2.0]);
        }),
        (
            "interval",
            "`model.interval` is not an array of real numbers",
            |mat| *mat = Mat::Cell(vec![]),
        ),
        (
            "pa",
            "`model.pa` holds 2, expected 1 for part 3, as the components say",
            |mat| *mat = row(vec![0.0, 1.0, 2.0]),
        ),
        (
            "maxsize",
            "`model.maxsize` holds 3, expected 2, the largest filter's side",
            |mat| *mat = row(vec![2.0, 3.0]),
        ),
        ("bias", "`model.bias(2).w` is 1x2, expected 1x1", |mat| {
            *value(mat, 2) = row(vec![0.0; 2]);
        }),
        (
            "filters",
            "`model.filters(3).w` is 2x2x31, expected 2x2x32",
            |mat| *value(mat, 4) = Mat::Numbers(vec![2, 2, 31], vec![0.5; 124]),
        ),
        (
            "filters",
            "`model.filters(1).w` is 17x1x32, expected 16x1x32",
            |mat| *value(mat, 0) = Mat::Numbers(vec![17, 1, 32], vec![0.5; 544]),
        ),
        (
            "defs",
            "`model.defs(1).anchor` holds 1, expected 0 octaves between a part and its parent",
            |mat| *value(mat, 2) = row(vec![1.0, 1.0, 1.0]),
        ),
    ];
    for (field, expected, change) in cases {
        assert_eq!(outcome(&spec, field, change), expected);
    }
}

#[test]
fn errors_name_the_part() {
    let cases: [(&str, Change); 7] = [
        (
            "`model.components{1}(2).parent` holds 9, expected 0 to 3",
            |mat| *of_part(mat, 2, 3) = number(9.0),
        ),
        (
            "`model.components{1}(2).biasid` is 1x2, expected 2x2",
            |mat| *of_part(mat, 2, 0) = row(vec![1.0; 2]),
        ),
        (
            "`model.components{1}(3).defid` is 1x3, expected 2x2",
            |mat| *of_part(mat, 3, 2) = row(vec![1.0; 3]),
        ),
        (
            "an index in the components refers to an entry that does not exist: part 3 names spring 5, but the model has only 4",
            |mat| *of_part(mat, 3, 2) = row(vec![1.0, 5.0]),
        ),
        (
            "an index in the components refers to an entry that does not exist: part 1 names bias 0, but the model has only 9",
            |mat| *of_part(mat, 1, 0) = number(0.0),
        ),
        ("`model.components` is 1x2, expected 1x1", |mat| {
            *mat = Mat::Cell(vec![number(1.0); 2]);
        }),
        ("`model.components` is not a cell array", |mat| {
            *mat = number(1.0);
        }),
    ];
    for (expected, change) in cases {
        assert_eq!(outcome(&three_parts(), "components", change), expected);
    }
}

#[test]
fn missing_fields_are_named() {
    let said = |bytes: &[u8]| parse(bytes).unwrap_err().to_string();
    assert_eq!(
        said(&file("other", &model(&three_parts()), false)),
        "`model` is missing"
    );
    let Mat::Structs(mut names, values) = model(&three_parts()) else {
        unreachable!("a model is a struct");
    };
    names[1] = "filter";
    let renamed = file("model", &Mat::Structs(names, values), true);
    assert_eq!(said(&renamed), "`model.filters` is missing");
}

#[test]
fn errors_of_the_container_are_reported() {
    let said = |bytes: &[u8]| match parse(bytes).unwrap_err() {
        MatError::Container(error) => error.to_string(),
        other => other.to_string(),
    };
    let good = file("model", &model(&three_parts()), false);
    let mut bytes = good.clone();
    bytes[126..128].copy_from_slice(b"MI");
    let expected = "the header's endian mark is \"MI\", expected \"IM\" (little-endian)";
    assert_eq!(said(&bytes), expected);
    bytes[..10].copy_from_slice(b"MATLAB 7.3");
    let expected = "the file is of MATLAB version 7.3: save it again with `save -v7`";
    assert_eq!(said(&bytes), expected);
    assert_eq!(
        said(&good[..100]),
        "the file ends within the header: 100 bytes left, 128 needed"
    );
    let n = good.len() - 136;
    let expected = format!(
        "the file ends within a variable: {} bytes left, {n} needed",
        n - 1
    );
    assert_eq!(said(&good[..good.len() - 1]), expected);
    let mut compressed = file("model", &model(&three_parts()), true);
    compressed[300] ^= 0xff;
    assert_eq!(said(&compressed), "a compressed variable is damaged");
}

#[test]
fn a_decompression_bomb_is_rejected() {
    let bytes = compressed_file(&vec![0; (64 << 20) + 1]);
    assert!(bytes.len() < 1 << 18);
    assert!(matches!(
        parse(&bytes),
        Err(MatError::Container(ContainerError::TooMuch {
            what: "bytes",
            ..
        }))
    ));
}

#[test]
fn the_nesting_of_cells_is_limited() {
    let deep = (0..100).fold(number(1.0), |it, _| Mat::Cell(vec![it]));
    assert!(matches!(
        parse(&file("model", &deep, false)),
        Err(MatError::Container(ContainerError::TooMuch {
            limit: 8,
            ..
        }))
    ));
}

proptest! {
    #[test]
    fn a_truncated_file_is_refused(part in 0.0..1.0, compressed: bool) {
        let bytes = file("model", &model(&per_pair()), compressed);
        let kept = (bytes.len() as f64 * part) as usize;
        prop_assert!(parse(&bytes[..kept]).is_err());
    }

    #[test]
    fn a_damaged_file_never_panics(part in 0.0..1.0, to: [u8; 4], n in 1_usize..4) {
        let mut bytes = file("model", &model(&per_pair()), false);
        let at = (bytes.len() as f64 * part) as usize;
        let end = (at + n).min(bytes.len());
        bytes[at..end].copy_from_slice(&to[..end - at]);
        if let Ok(spec) = parse(&bytes) {
            let _model = Model::new(spec);
        }
    }
}
