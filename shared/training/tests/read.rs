//! Tests with small data sets of every layout, valid and invalid.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::error::Error as _;
use std::fs;
use std::path::Path;

use proptest::prelude::*;
use tempfile::TempDir;
use testkit::mat::{Mat, file};
use training::datasets::{
    DatasetError, FaultKind, People, Person, ReadOptions, Selection, parse_joints, parse_labels,
    read, to_line,
};

const N_JOINTS: usize = 3;

/// Position of a joint of a person, in pixels from 0.
fn joint(person: usize, joint: usize) -> [f64; 2] {
    [
        (5 * person + 2 * joint) as f64,
        10.5 - (person * joint) as f64,
    ]
}

fn joints(person: usize) -> Vec<[f64; 2]> {
    (0..N_JOINTS).map(|i| joint(person, i)).collect()
}

fn write_image(path: &Path) {
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    image::RgbImage::new(40, 20).save(path).unwrap();
}

/// An array of three sizes, with the first index fastest.
fn array(sizes: [usize; 3], value: impl Fn([usize; 3]) -> f64) -> Mat {
    let mut values = Vec::new();
    for plane in 0..sizes[2] {
        for column in 0..sizes[1] {
            values.extend((0..sizes[0]).map(|row| value([row, column, plane])));
        }
    }
    Mat::Numbers(sizes.to_vec(), values)
}

fn labels(n_people: usize) -> Mat {
    array([N_JOINTS, 2, n_people], |[it, axis, person]| {
        joint(person, it)[axis] + 1.0
    })
}

/// Four people in the layout of PARSE.
fn parse_set() -> TempDir {
    let dir = tempfile::tempdir().unwrap();
    fs::write(
        dir.path().join("labels.mat"),
        file("ptsAll", &labels(4), true),
    )
    .unwrap();
    for person in 1..=4 {
        write_image(&dir.path().join(format!("im{person:04}.png")));
    }
    dir
}

fn images(people: &People) -> Vec<String> {
    let name = |person: &Person| person.image.file_name().unwrap().to_string_lossy().into_owned();
    people.people.iter().map(name).collect()
}

fn messages(problems: &People) -> Vec<String> {
    let full = |problem: &training::datasets::Problem| {
        let file = problem.file.file_name().unwrap().to_string_lossy();
        format!("{file}, {}: {}", problem.row, problem.source().unwrap())
    };
    problems.problems.iter().map(full).collect()
}

#[test]
fn the_parse_layout_is_converted_to_pixels_counted_from_0() {
    let dir = parse_set();
    let people = read(dir.path(), &ReadOptions::default()).unwrap();
    assert!(people.problems.is_empty(), "{:?}", people.problems);
    assert_eq!(
        images(&people),
        ["im0001.png", "im0002.png", "im0003.png", "im0004.png"]
    );
    for (number, person) in people.people.iter().enumerate() {
        assert_eq!(person.joints, joints(number));
        assert_eq!(person.visible, [true; N_JOINTS]);
        assert_eq!(person.row, format!("person {}", number + 1));
    }
    let by_file = read(&dir.path().join("labels.mat"), &ReadOptions::default()).unwrap();
    assert_eq!(by_file.people, people.people);
}

#[test]
fn an_array_with_two_dimensions_is_one_person() {
    let Mat::Numbers(_, values) = labels(1) else {
        unreachable!("numbers")
    };
    let one = Mat::Numbers(vec![N_JOINTS, 2], values);
    let people = parse_labels(&file("ptsAll", &one, false)).unwrap();
    assert_eq!(people, [(joints(0), vec![true; N_JOINTS])]);
}

#[test]
fn the_third_number_means_hidden_in_lsp_and_visible_in_lsp_extended() {
    const N: usize = 4;
    let flag = |joint: usize| f64::from(u8::from(joint == 1));
    let value = |i: usize, axis: usize, person: usize| match axis {
        2 => flag(i),
        _ => joint(person, i)[axis] + 1.0,
    };
    let original = array([3, N, 2], |[axis, it, person]| value(it, axis, person));
    let extended = array([N, 3, 2], |[it, axis, person]| value(it, axis, person));
    let original = parse_joints(&file("joints", &original, false)).unwrap();
    let extended = parse_joints(&file("joints", &extended, false)).unwrap();
    for person in 0..2 {
        let expected: Vec<_> = (0..N).map(|i| joint(person, i)).collect();
        assert_eq!(original[person].0, expected);
        assert_eq!(extended[person].0, expected);
        assert_eq!(original[person].1, [true, false, true, true]);
        assert_eq!(extended[person].1, [false, true, false, false]);
    }
}

/// Two people in the layout of LSP, with four joints.
fn lsp_set(names: [&str; 2]) -> TempDir {
    let dir = tempfile::tempdir().unwrap();
    let value = |[it, axis, person]: [usize; 3]| match axis {
        2 => 1.0,
        _ => joint(person, it)[axis] + 1.0,
    };
    let bytes = file("joints", &array([4, 3, 2], value), true);
    fs::write(dir.path().join("joints.mat"), bytes).unwrap();
    for name in names {
        write_image(&dir.path().join("images").join(name));
    }
    dir
}

#[test]
fn the_images_of_lsp_are_numbered_with_four_or_five_digits_or_listed() {
    for names in [["im0001.jpg", "im0002.jpg"], ["im00001.jpg", "im00002.jpg"]] {
        let dir = lsp_set(names);
        let people = read(dir.path(), &ReadOptions::default()).unwrap();
        assert_eq!(images(&people), names, "{:?}", people.problems);
    }
    let dir = lsp_set(["a.png", "b.png"]);
    let list = dir.path().join("images.txt");
    fs::write(&list, "b.png\na.png\n").unwrap();
    let people = read(dir.path(), &ReadOptions::default()).unwrap();
    assert_eq!(images(&people), ["b.png", "a.png"]);
    fs::write(&list, "b.png\n").unwrap();
    let error = read(dir.path(), &ReadOptions::default()).unwrap_err();
    assert!(
        error.to_string().ends_with("lists 1 images for 2 people"),
        "{error}"
    );
}

#[test]
fn ranges_and_lists_select_and_exclude_people() {
    let dir = parse_set();
    let list = dir.path().join("test.txt");
    fs::write(&list, "im0003.png\n").unwrap();
    let options = |only: Option<&str>, without: Option<&str>| {
        let selection = |text: &str| Selection::from_argument(text).unwrap();
        ReadOptions {
            only: only.map(selection),
            without: without.map(selection),
            ..ReadOptions::default()
        }
    };
    let read = |only, without| read(dir.path(), &options(only, without));
    assert_eq!(
        images(&read(Some("2-3"), None).unwrap()),
        ["im0002.png", "im0003.png"]
    );
    assert_eq!(
        images(&read(Some("2-4"), list.to_str()).unwrap()),
        ["im0002.png", "im0004.png"]
    );
    assert!(matches!(
        read(None, Some("5-9")).unwrap_err(),
        DatasetError::Select(_)
    ));
}

/// A file of JSON lines with one example of every fault.
fn faulty() -> TempDir {
    let dir = tempfile::tempdir().unwrap();
    write_image(&dir.path().join("photos/a.png"));
    fs::write(dir.path().join("photos/empty.png"), "").unwrap();
    let good = r#"{"image":"photos/a.png","joints":[[1,2],[3,4]],"name":"ann"}"#;
    let lines = [
        good,
        "",
        r#"{"image":"photos/a.png","joints":[[1,2],[3,5]],"name":"ann"}"#,
        good,
        r#"{"image":"photos/a.png","joints":[[1,2],[3,4],[5,6]]}"#,
        r#"{"image":"photos/a.png","joints":[[1,2],null]}"#,
        r#"{"image":"photos/a.png","joints":[[7,2],[7,2]]}"#,
        r#"{"image":"photos/a.png","joints":[[7,2],[50,2]]}"#,
        r#"{"image":"photos/empty.png","joints":[[7,2],[9,2]]}"#,
        r#"{"image":"photos/none.png","joints":[[7,2],[9,2]]}"#,
        r#"{"image":"photos/none.png","joints":[[7,2],[9,3]]}"#,
        "{",
        r#"{"image":"photos/a.png","joints":[[1.5,2],[41,4]]}"#,
    ];
    fs::write(dir.path().join("people.jsonl"), lines.join("\n")).unwrap();
    dir
}

#[test]
fn every_fault_is_reported_with_file_and_row_and_counted() {
    let dir = faulty();
    let path = dir.path().join("people.jsonl");
    let people = read(&path, &ReadOptions::default()).unwrap();
    let rows: Vec<_> = people.people.iter().map(|person| person.row.as_str()).collect();
    assert_eq!(
        rows,
        ["line 1", "line 13"],
        "1.5 px outside is accepted by default"
    );
    let expected = [
        "people.jsonl, line 3: the name \"ann\" is already used in line 1",
        "people.jsonl, line 4: the same image and joints as line 1",
        "people.jsonl, line 5: 3 joints, expected 2",
        "people.jsonl, line 6: joint 2 is unknown",
        "people.jsonl, line 7: all joints are within 0.000 px of (7.0, 2.0)",
        "people.jsonl, line 8: joint 2 at (50.0, 2.0) is 10.5 px outside the image of 40x20, more than 2",
        "people.jsonl, line 9: the image cannot be used",
        "people.jsonl, line 10: the image cannot be used",
        "people.jsonl, line 11: the image cannot be used",
        "people.jsonl, line 12: not a person: EOF while parsing an object at line 1 column 1",
    ];
    assert_eq!(messages(&people), expected);
    let cause = people.problems[6].source().unwrap().source().unwrap();
    assert!(cause.to_string().ends_with("empty.png is empty (0 bytes)"));
    let counts = people.counts();
    assert_eq!(counts.iter().map(|count| count.1).sum::<usize>(), 10);
    assert!(counts.contains(&(FaultKind::Image, 3)));
}

#[test]
fn the_caller_chooses_which_faults_are_fatal_and_the_margin() {
    let dir = faulty();
    let path = dir.path().join("people.jsonl");
    let fatal = |kinds: &[FaultKind]| {
        let options = ReadOptions {
            fatal: kinds.to_vec(),
            ..ReadOptions::default()
        };
        read(&path, &options)
    };
    fatal(&[FaultKind::NotFinite]).unwrap();
    let error = fatal(&[FaultKind::Image, FaultKind::Count]).unwrap_err();
    assert_eq!(
        error.to_string(),
        "4 of 12 people have a fault of a fatal kind"
    );
    let first = error.source().unwrap().to_string();
    assert!(first.ends_with("people.jsonl, line 5"), "{first}");
    let far = ReadOptions {
        outside_px: 11.0,
        ..ReadOptions::default()
    };
    assert_eq!(read(&path, &far).unwrap().people[1].row, "line 8");
}

#[test]
fn unknown_joints_are_accepted_if_requested() {
    let dir = faulty();
    let path = dir.path().join("some.jsonl");
    let line = r#"{"image":"photos/a.png","joints":[[1,2],null,[3,4]]}"#;
    fs::write(&path, line).unwrap();
    let options = |unknown_joints| ReadOptions {
        unknown_joints,
        ..ReadOptions::default()
    };
    let strict = read(&path, &options(false)).unwrap();
    assert_eq!(strict.counts(), [(FaultKind::Unknown, 1)]);
    let people = read(&path, &options(true)).unwrap().people;
    assert_eq!(people[0].visible, [true, false, true]);
    assert!(people[0].joints[1][0].is_nan());
}

#[test]
fn numbers_that_are_not_finite_are_faults() {
    let dir = parse_set();
    let value = |[it, axis, person]: [usize; 3]| match (it, axis, person) {
        (2, 1, 2) => f64::INFINITY,
        (1, 0, 1) | (0, _, 3) => f64::NAN,
        _ => joint(person, it)[axis] + 1.0,
    };
    let bytes = file("ptsAll", &array([N_JOINTS, 2, 4], value), false);
    fs::write(dir.path().join("labels.mat"), bytes).unwrap();
    let people = read(dir.path(), &ReadOptions::default()).unwrap();
    let expected = [
        "labels.mat, person 2: joint 2 is at (NaN, 9.5), expected two finite numbers",
        "labels.mat, person 3: joint 3 is at (14, inf), expected two finite numbers",
        "labels.mat, person 4: joint 1 is unknown",
    ];
    assert_eq!(messages(&people), expected);
    assert_eq!(people.people.len(), 1);
}

#[test]
fn the_number_of_joints_can_be_required() {
    let dir = parse_set();
    let options = ReadOptions {
        n_joints: Some(14),
        ..ReadOptions::default()
    };
    let people = read(dir.path(), &options).unwrap();
    assert_eq!(people.counts(), [(FaultKind::Count, 4)]);
}

#[test]
fn other_files_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let read = |name: &str| read(&dir.path().join(name), &ReadOptions::default()).unwrap_err();
    assert!(matches!(read(""), DatasetError::Unrecognised { .. }));
    assert!(matches!(read("a.txt"), DatasetError::Unrecognised { .. }));
    assert!(matches!(read("a.jsonl"), DatasetError::Io { .. }));
    fs::write(dir.path().join("labels.mat"), "MATLAB").unwrap();
    assert!(matches!(read(""), DatasetError::Mat { .. }));
    fs::write(dir.path().join("joints.mat"), "MATLAB").unwrap();
    assert!(matches!(read(""), DatasetError::Ambiguous { .. }));
    let bytes = file("points", &labels(1), false);
    assert_eq!(
        parse_labels(&bytes).unwrap_err().to_string(),
        "the file contains no array of real numbers called `ptsAll`"
    );
    let bytes = file("joints", &array([4, 2, 2], |_| 0.5), false);
    assert_eq!(
        parse_joints(&bytes).unwrap_err().to_string(),
        "`joints` is 4x2x2, expected 3 x joints x people, or joints x 3 x people"
    );
}

proptest! {
    #[test]
    fn a_data_set_written_as_lines_reads_back_unchanged(unknown in 0..12_usize) {
        let dir = parse_set();
        let mut people = read(dir.path(), &ReadOptions::default()).unwrap().people;
        people[unknown / 3].joints[unknown % 3] = [f64::NAN; 2];
        people[unknown / 3].visible[unknown % 3] = false;
        let lines: Vec<String> = people
            .iter()
            .map(|person| {
                let image = person.image.file_name().unwrap().into();
                to_line(&Person { image, ..person.clone() }, None).unwrap()
            })
            .collect();
        let path = dir.path().join("people.jsonl");
        fs::write(&path, lines.join("\n")).unwrap();
        let options = ReadOptions { unknown_joints: true, ..ReadOptions::default() };
        let read_back = read(&path, &options).unwrap();
        prop_assert_eq!(read_back.people.len(), 4);
        for (read, written) in read_back.people.iter().zip(&people) {
            prop_assert_eq!(&read.image, &written.image);
            prop_assert_eq!(&read.visible, &written.visible);
            prop_assert_eq!(format!("{:?}", read.joints), format!("{:?}", written.joints));
        }
    }

    #[test]
    fn damaged_files_do_not_panic(at in 0..400_usize, to: u8, end in 0..600_usize) {
        for (name, parse) in [
            ("ptsAll", parse_labels as fn(&[u8]) -> _),
            ("joints", parse_joints as fn(&[u8]) -> _),
        ] {
            let mut bytes = file(name, &labels(2), false);
            if let Some(byte) = bytes.get_mut(at) {
                *byte = to;
            }
            bytes.truncate(end.max(1));
            drop(parse(&bytes));
        }
    }
}
