//! Tests of every simulated fault, and of real failures.

use std::path::Path;

use footage::Canvas;
use proptest::prelude::*;
use tempfile::TempDir;

use super::*;

const SIZE: Size = Size::new(12, 8);

/// Writes images of one colour each, 10 per second.
fn images(n: u8) -> (TempDir, SourceSpec) {
    let folder = tempfile::tempdir().unwrap();
    for nth in 0..n {
        save(folder.path(), nth, SIZE);
    }
    let spec = SourceSpec {
        frame_rate_hz: Some(10.0),
        ..SourceSpec::new(folder.path().to_str().unwrap())
    };
    (folder, spec)
}

fn save(folder: &Path, nth: u8, size: Size) {
    let file = folder.join(format!("{nth:03}.png"));
    Canvas::new(size, [nth, 0, 0]).save_png(&file).unwrap();
}

/// Returns the outcome of every frame: the colour of its picture, or the reason why it is missing.
fn all(supply: &mut Supply) -> Vec<String> {
    let mut all = Vec::new();
    loop {
        let index = supply.index();
        // Frames are half a second apart, so reopening is tried at every frame.
        match supply.step((index + 1) * PAUSE_NANOS) {
            Step::Picture => {
                assert_eq!(supply.pixels().len(), SIZE.rgb_bytes());
                all.push(supply.pixels()[0].to_string());
            }
            Step::Nothing(status) => all.push(status.reason().to_owned()),
            Step::End => return all,
        }
    }
}

fn open(spec: &SourceSpec, faults: &str, is_live: bool) -> Supply {
    Supply::open((spec, None), &faults.parse().unwrap(), is_live, 2).unwrap()
}

/// Returns the outcomes of eight frames with faults.
fn under(faults: &str) -> Vec<String> {
    let (_folder, spec) = images(8);
    let [live, recorded] = [true, false].map(|is_live| all(&mut open(&spec, faults, is_live)));
    assert_eq!(live, recorded, "{faults}");
    live
}

#[test]
fn a_fault_affects_only_its_own_frames() {
    let cases = [
        (
            "unplug@2+3",
            "0, 1, camera gone, camera gone, camera gone, 5, 6, 7",
        ),
        ("size@2+2", "0, 1, wrong size, wrong size, 4, 5, 6, 7"),
        ("damage@1+1", "0, damaged picture, 2, 3, 4, 5, 6, 7"),
        (
            "slow@2+4",
            "0, 1, 2, left out by the camera, 4, left out by the camera, 6, 7",
        ),
        (
            "repeat@2+2",
            "0, 1, repeated timestamp, repeated timestamp, 4, 5, 6, 7",
        ),
        (
            "back@2+2",
            "0, 1, timestamp went back, timestamp went back, 4, 5, 6, 7",
        ),
        (
            "jump@2+2",
            "0, 1, clock jumped, clock jumped, timestamp went back, 5, 6, 7",
        ),
        // The picture repeats, and counts as frozen from its second repetition on.
        (
            "freeze@2+3",
            "0, 1, 1, frozen picture, frozen picture, 5, 6, 7",
        ),
        (
            "damage@0+6",
            "damaged picture, damaged picture, damaged picture, damaged picture, damaged picture, damaged picture, 6, 7",
        ),
    ];
    for (faults, expected) in cases {
        assert_eq!(under(faults).join(", "), expected, "{faults}");
    }
}

#[test]
fn without_a_previous_picture_a_freeze_has_no_effect() {
    assert_eq!(under("freeze@0+2")[..3], ["0", "0", "2"]);
    assert_eq!(
        under("unplug@1+2, freeze@3+2")[1..5],
        ["camera gone", "camera gone", "3", "3"]
    );
}

#[test]
fn bad_files_affect_only_their_own_frames() {
    let (folder, spec) = images(6);
    save(folder.path(), 2, Size::new(6, 4));
    std::fs::write(folder.path().join("003.png"), "no picture").unwrap();
    let got = all(&mut open(&spec, "", false));
    assert_eq!(got, ["0", "1", "wrong size", "damaged picture", "4", "5"]);
}

#[test]
fn recorded_footage_is_abandoned_after_repeated_failures_but_a_camera_is_not() {
    let (folder, spec) = images(7);
    for nth in 1..5 {
        save(folder.path(), nth, Size::new(6, 4));
    }
    let live = all(&mut open(&spec, "", true));
    assert_eq!(live[1..5], ["wrong size"; 4]);
    assert_eq!(live[5..], ["5", "6"]);
    let recorded = all(&mut open(&spec, "", false));
    assert_eq!(recorded[1..], ["wrong size"; 6]);
}

#[test]
fn a_camera_is_not_reopened_at_every_frame() {
    let (folder, spec) = images(6);
    std::fs::write(folder.path().join("001.png"), "no picture").unwrap();
    let mut supply = open(&spec, "", true);
    let steps = [0, 1, 2, PAUSE_NANOS, PAUSE_NANOS + 1].map(|now| supply.step(now));
    let gone = Step::Nothing(Status::DAMAGED);
    assert_eq!(steps, [Step::Picture, gone, gone, gone, Step::Picture]);
    assert_eq!(
        supply.pixels()[0],
        4,
        "its own frame, not the one it stopped at"
    );
}

#[test]
fn a_single_image_repeats_without_being_frozen() {
    let (folder, _) = images(1);
    let spec = SourceSpec {
        count: Some(20),
        ..SourceSpec::new(folder.path().join("000.png").to_str().unwrap())
    };
    assert_eq!(all(&mut open(&spec, "", false)), ["0"; 20]);
}

#[test]
fn faults_apply_to_frame_indices_even_if_only_every_nth_frame_is_read() {
    let (_folder, spec) = images(12);
    let spec = SourceSpec {
        start: 1,
        step: 3,
        ..spec
    };
    let got = all(&mut open(&spec, "unplug@4+1, slow@7+4", false));
    assert_eq!(got, ["1", "camera gone", "7", "left out by the camera"]);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]
    #[test]
    fn every_frame_has_exactly_one_outcome_for_any_faults(
        kinds in prop::collection::vec((0..8_usize, 0..12_u64, 1..8_u64), 0..4),
        skips in prop::collection::vec(0..3_u64, 12), is_live: bool,
    ) {
        const NAMES: [&str; 8] = ["unplug", "freeze", "repeat", "back", "jump", "slow", "size", "damage"];
        let (_folder, spec) = images(12);
        let text: Vec<String> = kinds.iter().map(|(kind, from, n)| format!("{}@{from}+{n}", NAMES[*kind])).collect();
        let mut supply = open(&spec, &text.join(","), is_live);
        let mut n = 0;
        for skip in skips {
            n += supply.skip(skip);
            prop_assert_eq!(supply.index(), n);
            let step = supply.step(n * PAUSE_NANOS);
            if step == Step::Picture {
                let colour = u64::from(supply.pixels()[0]);
                prop_assert!(colour <= n, "a picture of the future");
                let is_late = kinds.iter().any(|(kind, ..)| *kind == 1);
                prop_assert!(colour == n || is_late, "{colour} for {n}");
            }
            n += u64::from(step != Step::End);
        }
        prop_assert!(n <= 12);
    }
}
