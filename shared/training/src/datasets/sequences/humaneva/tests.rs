//! Tests with a subject's folder in the layout of the data set.

use geometry::files::Format;
use nalgebra::Isometry3;
use testkit::c3d::{Processor, write};

use super::body::tests::person;
use super::*;
use crate::datasets::sequences::tests::{rig, touch};

#[test]
fn the_paper_tests_on_4493_frames_of_each_camera() {
    let n: usize = PAPER_TEST.iter().map(|paper_test| paper_test.n_frames).sum();
    assert_eq!(n, 4493);
    for it in PAPER_TEST {
        assert!(it.n_frames as u64 <= it.last - it.first + 1, "{it:?}");
    }
}

/// S1 walks along x by 1 mm per motion capture frame. One marker is lost at frames 101 to 104.
fn subject(folder: &Path) -> PathBuf {
    let folder = folder.join("S1");
    for inside in ["Image_Data", "Calibration_Data", "Sync_Data", "Mocap_Data"] {
        std::fs::create_dir_all(folder.join(inside)).unwrap();
    }
    let calibrations = folder.join("Calibration_Data");
    geometry::files::write(&calibrations, Format::HumanEva, &rig(&CAMERAS, [640, 480])).unwrap();
    for (camera, image) in [("C1", 20.0), ("C2", 30.0), ("C3", 25.0), ("BW1", 24.0)] {
        let name = format!("Walking_1_({camera})");
        touch(&folder.join("Image_Data").join(format!("{name}.avi")));
        let offset = folder.join("Sync_Data").join(format!("{name}.ofs"));
        std::fs::write(offset, format!("{image}\n100.0\n2.0\n")).unwrap();
    }
    let places: Vec<_> =
        (1..=1300).map(|i| Isometry3::translation(f64::from(i), 0.0, 0.0)).collect();
    let mut walk = person(&places);
    let lost = walk.labels.iter().position(|label| label == "C7").unwrap();
    for frame in 101..=104 {
        walk.frames[frame - 1][lost] = None;
    }
    let mocap = folder.join("Mocap_Data");
    let save = |name: &str, trial| {
        std::fs::write(mocap.join(name), write(trial, Processor::Intel, None)).unwrap();
    };
    save("Walking_1.c3d", &walk);
    save("Static.c3d", &person(&[Isometry3::identity()]));
    let measures = "$LShoulderOffset = 0\n$RShoulderOffset = 0\n";
    std::fs::write(mocap.join("S1.mp"), measures).unwrap();
    folder
}

#[test]
fn a_subject_is_read_with_synchronised_streams() {
    let dir = tempfile::tempdir().unwrap();
    subject(dir.path());
    // The parent folder is the folder of the data set.
    let got = crate::datasets::sequences::read(dir.path(), &Options::default()).unwrap();
    let [walking] = &got[..] else {
        panic!("{} sequences", got.len())
    };
    assert_eq!(
        (walking.name.as_str(), walking.dataset.as_str()),
        ("S1 Walking", "HumanEva")
    );
    assert_eq!(walking.rig.cameras().len(), 3);
    // At motion capture frame 100, the cameras are at frames 20, 30 and 25: C1 began last. Motion capture frame 62 is frame 1 of the
    // trial.
    let first: Vec<u64> = walking.views.iter().map(|view| view.first).collect();
    assert_eq!(first, [0, 10, 5]);
    let numbers: Vec<u64> = walking.frames.iter().map(|frame| frame.number).collect();
    assert_eq!(&numbers[..3], &[6, 7, 8]);
    // Frame f corresponds to motion capture frame 62 + 2 (f - 1), so frames 21 and 22 need the lost frames.
    assert!(!numbers.contains(&21) && !numbers.contains(&22));
    assert_eq!(numbers.len(), 590 - 6 + 1 - 2);
    let frame = &walking.frames[0];
    assert_eq!(frame.index, 5);
    // At motion capture frame 72, the pelvis is 50 mm behind x = 72 mm.
    let pelvis = frame.joints[1].unwrap();
    assert!((pelvis[0] - 0.022).abs() < 1e-6, "{pelvis:?}");
}

#[test]
fn missing_files_are_named() {
    let dir = tempfile::tempdir().unwrap();
    let folder = subject(dir.path());
    std::fs::remove_file(folder.join("Image_Data/Walking_1_(C2).avi")).unwrap();
    let got = crate::datasets::sequences::read(&folder, &Options::default()).unwrap_err();
    assert!(got.to_string().contains("(C2)"), "{got}");
    std::fs::remove_file(folder.join("Mocap_Data/S1.mp")).unwrap();
    touch(&folder.join("Image_Data/Walking_1_(C2).avi"));
    let got = crate::datasets::sequences::read(&folder, &Options::default()).unwrap_err();
    assert!(got.to_string().contains("S1.mp"), "{got}");
    std::fs::remove_file(folder.join("Mocap_Data/Walking_1.c3d")).unwrap();
    let got = crate::datasets::sequences::read(&folder, &Options::default());
    assert!(matches!(got, Err(SequenceError::Unknown { .. })), "{got:?}");
}
