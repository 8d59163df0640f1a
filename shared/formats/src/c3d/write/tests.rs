//! Tests that the reader of this crate reads a written file.

use proptest::prelude::*;

use super::*;
use crate::c3d::C3d;

fn heading(labels: &[String], n_frames: u32) -> Heading<'_> {
    Heading {
        rate_hz: 59.94,
        units: "mm",
        up: "+Z",
        labels,
        descriptions: &[],
        n_frames,
        first_frame: 1,
        residual_step: 0.5,
        software: ["test", "1"],
    }
}

fn names(n: usize) -> Vec<String> {
    (0..n).map(|i| format!("point {i}")).collect()
}

fn seen(position: [f64; 3]) -> Marker {
    Marker {
        position,
        residual: 1.0,
        cameras: 0b101,
    }
}

#[test]
fn more_frames_than_16_bits_count_are_read_back() {
    let (labels, n) = (names(1), 70_000_u32);
    let mut file = Vec::new();
    let frames = (0..n).map(|i| vec![Some(seen([f64::from(i), 0.0, 0.0]))]);
    write(&mut file, &heading(&labels, n), frames).unwrap();
    let read = C3d::parse(&file).unwrap();
    assert_eq!(read.n_frames(), 70_000);
    assert_eq!(read.frame(69_999)[0], Some([69_999.0, 0.0, 0.0]));
    // Files from other programs contain only one of these two parameters.
    for name in [&b"LONG_FRAMES"[..], b"ACTUAL_END_FIELD"] {
        let mut one = file.clone();
        let at = one.windows(name.len()).position(|window| window == name);
        one[at.unwrap()] = b'X';
        assert_eq!(C3d::parse(&one).unwrap().n_frames(), 70_000);
    }
}

/// `ezc3d` does not accept a real number here.
#[test]
fn the_number_of_frames_is_written_as_an_integer() {
    for n_frames in [1, 70_000] {
        let bytes = section(&heading(&names(1), n_frames), 3);
        let at = bytes.windows(8).position(|window| window == b"\x06\x01FRAMES");
        let at = at.unwrap() + 10;
        let word = n_frames.min(65_535) as u16;
        assert_eq!(bytes[at..at + 2], [2, 0], "kind and number of sizes");
        assert_eq!(bytes[at + 2..at + 4], word.to_le_bytes());
    }
}

#[test]
fn names_beyond_the_limits_are_cut_or_continued_or_refused() {
    let mut labels = names(300);
    labels[0] = "\u{3b1},\u{e9}\"".to_owned() + &"x".repeat(200);
    let mut file = Vec::new();
    let frame = vec![None; 300];
    write(&mut file, &heading(&labels, 1), [frame]).unwrap();
    let read = C3d::parse(&file).unwrap();
    assert_eq!(
        (read.labels().len(), &read.labels()[299][..]),
        (300, "point 299")
    );
    assert!(
        read.labels()[0].starts_with("?,\u{e9}\"xx") && read.labels()[0].chars().count() == 127
    );
    let many: Vec<String> = (0..3000).map(|_| "x".repeat(100)).collect();
    let error = write(&mut Vec::new(), &heading(&many, 0), []).unwrap_err();
    assert!(error.to_string().contains("3000 points"), "{error}");
}

#[test]
fn an_unannounced_number_of_points_or_frames_is_refused() {
    let labels = names(2);
    let error = write(&mut Vec::new(), &heading(&labels, 2), [vec![None, None]]).unwrap_err();
    assert!(
        error.to_string().contains("1 frames were given, but the heading announces 2"),
        "{error}"
    );
    let error = write(&mut Vec::new(), &heading(&labels, 1), [vec![None]]).unwrap_err();
    assert!(
        error.to_string().contains("1 points, but the heading announces 2"),
        "{error}"
    );
}

#[test]
fn the_fourth_number_encodes_cameras_and_residual() {
    let fourth = |residual: f64| {
        let marker = Marker {
            position: [0.0; 3],
            residual,
            cameras: 0b1000_0011,
        };
        f32::from_le_bytes(*numbers(Some(&marker), 0.5).last_chunk().unwrap())
    };
    assert_eq!(fourth(2.0), 3.0 * 256.0 + 4.0);
    assert_eq!(fourth(1e9), 3.0 * 256.0 + 255.0);
    assert_eq!(fourth(f64::NAN), 3.0 * 256.0);
}

proptest! {
    #[test]
    fn written_data_is_read_back(
        frames in prop::collection::vec(
            prop::collection::vec(prop::option::of(prop::array::uniform3(-1e5..1e5_f64)), 3),
            1..20,
        ),
        first_frame in 1_u32..60_000,
    ) {
        let labels = names(3);
        let heading = Heading { first_frame, ..heading(&labels, frames.len() as u32) };
        let mut file = Vec::new();
        let points = frames.iter().map(|frame| {
            frame.iter().map(|frame| frame.map(seen)).collect()
        });
        write(&mut file, &heading, points).unwrap();
        prop_assert_eq!(file.len() % BLOCK, 0);
        let read = C3d::parse(&file).unwrap();
        prop_assert_eq!(read.labels(), &labels[..]);
        prop_assert_eq!((read.units(), read.rate_hz() as f32), ("mm", 59.94));
        prop_assert_eq!(read.first_frame(), first_frame);
        for (nth, frame) in frames.iter().enumerate() {
            let due: Vec<_> = frame
                .iter()
                .map(|frame| frame.map(|at| at.map(|value| f64::from(value as f32))))
                .collect();
            prop_assert_eq!(read.frame(nth), &due[..]);
        }
    }
}
