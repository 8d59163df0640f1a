//! Tests of the reader on files with known content.

use proptest::prelude::*;
use testkit::c3d::{PROCESSORS, Processor, Trial, write};

use super::{C3d, C3dError};

fn trial() -> Trial {
    Trial {
        rate_hz: 120.0,
        units: "mm".to_owned(),
        labels: ["S1:HEDO", "LFWT", "RFWT"].map(str::to_owned).to_vec(),
        frames: vec![
            vec![Some([1.0, -2.5, 1000.0]), None, Some([0.0, 0.0, 0.0])],
            vec![
                Some([2.0, 3.0, -999.5]),
                Some([7.5, 8.0, 9.0]),
                Some([0.5; 3]),
            ],
        ],
        n_analog: 3,
    }
}

/// Returns the six encodings of a trial.
fn encodings(trial: &Trial) -> Vec<Vec<u8>> {
    let of = |processor| [Some(0.5), None].map(|scale| write(trial, processor, scale));
    PROCESSORS.into_iter().flat_map(of).collect()
}

#[test]
fn all_six_encodings_hold_the_same_points() {
    let trial = trial();
    for file in encodings(&trial) {
        let got = C3d::parse(&file).unwrap();
        assert_eq!((got.n_frames(), got.n_points()), (2, 3));
        assert_eq!((got.rate_hz(), got.units()), (120.0, "mm"));
        assert_eq!(got.labels(), trial.labels);
        for (frame, points) in trial.frames.iter().enumerate() {
            assert_eq!(got.frame(frame), points);
        }
    }
}

#[test]
fn a_point_is_found_with_and_without_the_name_of_its_subject() {
    let file = write(&trial(), Processor::Intel, None);
    let got = C3d::parse(&file).unwrap();
    assert_eq!(got.point("HEDO"), Some(0));
    assert_eq!(got.point("S1:HEDO"), Some(0));
    assert_eq!(got.point("RFWT"), Some(2));
    assert_eq!(got.point("none"), None);
}

#[test]
fn more_than_255_names_are_read_from_several_parameters() {
    let n = 600;
    let trial = Trial {
        labels: (0..n).map(|i| format!("P{i}")).collect(),
        frames: vec![vec![Some([1.0; 3]); n]],
        ..trial()
    };
    let got = C3d::parse(&write(&trial, Processor::Mips, None)).unwrap();
    assert_eq!(got.point("P599"), Some(599));
}

#[test]
fn unknown_units_have_no_length() {
    for (units, metres) in [
        ("mm", Some(0.001)),
        ("M", Some(1.0)),
        ("", Some(0.001)),
        ("ell", None),
    ] {
        let units = units.to_owned();
        let trial = Trial { units, ..trial() };
        let got = C3d::parse(&write(&trial, Processor::Intel, None)).unwrap();
        assert_eq!(got.metres_per_unit(), metres);
    }
}

#[test]
fn an_empty_file_is_reported_as_too_short() {
    let got = C3d::parse(&[]);
    assert!(
        matches!(got, Err(C3dError::Short { got: 0, .. })),
        "{got:?}"
    );
}

#[test]
fn another_format_is_named() {
    let got = C3d::parse(b"RIFF....AVI LIST");
    assert_eq!(got, Err(C3dError::NotC3d { got: b'I' }));
}

/// Parses a valid file with some bytes replaced.
fn with(at: usize, bytes: &[u8]) -> Result<C3d, C3dError> {
    let mut file = write(&trial(), Processor::Intel, None);
    file[at..at + bytes.len()].copy_from_slice(bytes);
    C3d::parse(&file)
}

#[test]
fn an_unknown_processor_is_named() {
    assert_eq!(with(515, &[0]), Err(C3dError::Processor { code: 0 }));
}

#[test]
fn a_scale_of_zero_is_refused() {
    assert_eq!(with(12, &[0; 4]), Err(C3dError::Scale { value: 0.0 }));
}

#[test]
fn frames_in_the_wrong_order_are_refused() {
    let (first, last) = (9, 2);
    assert_eq!(with(6, &[9]), Err(C3dError::Frames { first, last }));
}

#[test]
fn missing_frames_are_an_error() {
    let got = with(8, &[3]);
    let what = "the last frame";
    assert!(
        matches!(got, Err(C3dError::Short { what: it, .. }) if it == what),
        "{got:?}"
    );
}

#[test]
fn a_parameter_of_an_unknown_kind_is_refused() {
    // The name and the link of USED follow the header and the group (2 + 5 + 2 + 1 bytes).
    let got = with(512 + 4 + 10 + 8, &[3]);
    assert!(matches!(got, Err(C3dError::Parameter { .. })), "{got:?}");
}

#[test]
fn a_link_beyond_its_section_is_ignored() {
    // The link of USED follows the header, the group and its own name.
    let got = with(512 + 4 + 10 + 6, &[0xff, 0x7f]).unwrap();
    assert_eq!(got.labels(), trial().labels);
}

proptest! {
    #[test]
    fn a_written_c3d_trial_is_read_back(
        points in prop::collection::vec(prop::option::of(prop::array::uniform3(-3000..3000_i32)), 12),
        n_analog in 0..5_u16,
    ) {
        let point = |raw: &Option<[i32; 3]>| raw.map(|coordinates| coordinates.map(|value| f64::from(value) * 0.25));
        let frames = points.chunks(3).map(|chunk| chunk.iter().map(point).collect()).collect();
        let trial = Trial { frames, n_analog, ..trial() };
        for processor in PROCESSORS {
            for scale in [Some(0.25), None] {
                let got = C3d::parse(&write(&trial, processor, scale)).unwrap();
                for (frame, points) in trial.frames.iter().enumerate() {
                    prop_assert_eq!(got.frame(frame), points);
                }
            }
        }
    }

    #[test]
    fn changed_bytes_neither_panic_nor_add_points(
        which in 0..6_usize,
        changes in prop::collection::vec((0..1200_usize, any::<u8>()), 1..6),
    ) {
        let mut file = encodings(&trial()).swap_remove(which);
        for (at, byte) in changes {
            let at = at % file.len();
            file[at] = byte;
        }
        if let Ok(got) = C3d::parse(&file) {
            prop_assert!(8 * got.n_points() * got.n_frames() <= file.len() || got.n_points() == 0);
            prop_assert!(got.labels().len() <= got.n_points());
        }
    }

    #[test]
    fn a_truncated_file_is_refused(which in 0..6_usize, share in 0.0..1.0_f64) {
        let file = encodings(&trial()).swap_remove(which);
        let n = (share * file.len() as f64) as usize;
        prop_assert!(C3d::parse(&file[..n]).is_err());
    }

    #[test]
    fn no_bytes_make_the_reader_panic(bytes in prop::collection::vec(any::<u8>(), 0..2000)) {
        drop(C3d::parse(&bytes));
        let mut marked = bytes;
        if marked.len() > 515 {
            marked[..2].copy_from_slice(&[2, 0x50]);
            marked[515] = 84;
            drop(C3d::parse(&marked));
        }
    }
}
