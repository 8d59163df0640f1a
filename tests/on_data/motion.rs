//! Tests with motion capture files from c3d.org and other sources: six encodings of one trial, and invalid files.

use std::path::Path;

use formats::c3d::{C3d, C3dError};
use training::datasets::sequences::{MarkerTable, Motion, MotionError, MotionOptions, read_motion};

use crate::shared_dir;

fn read(file: &Path) -> C3d {
    C3d::parse(&std::fs::read(file).unwrap()).unwrap()
}

/// * `step_mm`: resolution of the integer encodings. Floating-point encodings may be more precise.
fn assert_same_points(dir: &Path, files: [&str; 6], step_mm: f64) {
    let trials = files.map(|file| read(&dir.join(file)));
    let first = &trials[0];
    assert!(first.n_frames() > 50 && first.n_points() > 20);
    let mut n_seen = 0;
    for (file, trial) in files.iter().zip(&trials) {
        assert_eq!(trial.labels(), first.labels(), "{file}");
        assert_eq!(trial.rate_hz(), 50.0, "{file}");
        assert_eq!(trial.units(), "mm", "{file}");
        assert_eq!(trial.n_frames(), first.n_frames(), "{file}");
        for frame in 0..first.n_frames() {
            for (got, expected) in trial.frame(frame).iter().zip(first.frame(frame)) {
                assert_eq!(got.is_some(), expected.is_some(), "{file}, frame {frame}");
                if let (Some(got), Some(expected)) = (got, expected) {
                    n_seen += 1;
                    for (got, expected) in got.iter().zip(expected) {
                        assert!(
                            (got - expected).abs() <= step_mm,
                            "{file}: {got} {expected} mm"
                        );
                    }
                }
            }
        }
    }
    println!("{} points in {} files", n_seen, files.len());
    assert!(n_seen > 10_000, "{n_seen}");
}

#[test]
#[ignore = "needs ../shared"]
fn the_six_encodings_of_a_trial_give_the_same_points() {
    let Some(dir) = shared_dir() else { return };
    let dir = dir.join("data/c3d");
    let (pc, dec, sgi) = ("Eb015pi.c3d", "Eb015vi.c3d", "Eb015si.c3d");
    let reals = ["Eb015pr.c3d", "Eb015vr.c3d", "Eb015sr.c3d"];
    let files = [pc, dec, sgi, reals[0], reals[1], reals[2]];
    assert_same_points(&dir.join("sample01"), files, 0.001);
    let files = [
        "pc_int.c3d",
        "DEC_INT.C3D",
        "sgi_int.c3d",
        "pc_real.c3d",
        "Dec_real.c3d",
        "sgi_real.c3d",
    ];
    assert_same_points(&dir.join("sample02"), files, 0.2813);
}

#[test]
#[ignore = "needs ../shared"]
fn files_of_other_laboratories_are_read_and_an_empty_file_is_refused() {
    let Some(dir) = shared_dir() else { return };
    let dir = dir.join("data/c3d/others");
    let walk = read(&dir.join("cmu_02_05.c3d"));
    assert_eq!((walk.n_points(), walk.rate_hz()), (41, 120.0));
    assert_eq!(walk.n_frames(), 1854);
    let span = |axis: usize| {
        let seen = (0..walk.n_frames()).flat_map(|i| walk.frame(i)).flatten();
        seen.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], point| {
            [low.min(point[axis]), high.max(point[axis])]
        })
    };
    let [low, high] = span(2);
    println!(
        "walk: {low:.0} to {high:.0} {} above the floor",
        walk.units()
    );
    assert!(low > 0.0 && (1600.0..1900.0).contains(&high), "a person");
    for file in ["Gait.c3d", "mocap36.c3d", "badParameterOffset.c3d"] {
        let got = C3d::parse(&std::fs::read(dir.join(file)).unwrap());
        match got {
            Ok(it) => println!(
                "{file}: {} frames of {} points, {} {}",
                it.n_frames(),
                it.n_points(),
                it.rate_hz(),
                it.units()
            ),
            Err(error) => println!("{file}: {error}"),
        }
    }
    let empty = C3d::parse(&std::fs::read(dir.join("Empty.c3d")).unwrap());
    assert!(
        matches!(empty, Err(C3dError::Short { got: 0, .. })),
        "{empty:?}"
    );
}

/// Returns the largest height of the person, and the spread of a leg's length, in metres.
fn height_and_leg_noise(motion: &Motion) -> (f64, f64) {
    let norm = |a: [f64; 3], b: [f64; 3]| {
        let square = (0..3).map(|i| (a[i] - b[i]).powi(2));
        square.sum::<f64>().sqrt()
    };
    let tops = motion.joints.iter().map(|joint| joint[13][2] - joint[0][2].min(joint[5][2]));
    let shins = motion
        .joints
        .iter()
        .map(|joint| norm(joint[3], joint[4]) + norm(joint[4], joint[5]));
    let mut shins: Vec<f64> = shins.collect();
    shins.sort_by(f64::total_cmp);
    let at = |share: f64| shins[(share * (shins.len() - 1) as f64) as usize];
    (tops.fold(0.0, f64::max), at(0.9) - at(0.1))
}

#[test]
#[ignore = "needs ../shared"]
fn files_of_three_laboratories_are_converted_by_the_presets() {
    let Some(dir) = shared_dir() else { return };
    let data = dir.join("data");
    let options = MotionOptions::default();
    for (file, n_frames, rate_hz, height) in [
        ("c3d/others/cmu_02_05.c3d", 1854, 120.0, 1.5..1.8),
        ("pose2sim_balancing/reference_0-69.trc", 70, 60.0, 1.3..1.9),
    ] {
        let motion = read_motion(&data.join(file), None, &options).unwrap();
        assert!(motion.toes.is_some(), "{file}");
        assert_eq!(
            (motion.joints.len(), motion.rate_hz),
            (n_frames, rate_hz),
            "{file}"
        );
        let (tall, noise) = height_and_leg_noise(&motion);
        println!(
            "{file}: {tall:.2} m from ankle to head, legs vary by {:.0} mm",
            1000.0 * noise
        );
        assert!(height.contains(&tall), "{file}: {tall}");
        assert!(noise < 0.1, "{file}: {noise}");
    }
    // Markers are missing for more than a second. The error message names these frames, and the frames before the gap can be read.
    let file = data.join("c3d/others/mocap36.c3d");
    let MotionError::Gap { frames, .. } = read_motion(&file, None, &options).unwrap_err() else {
        panic!("a gap")
    };
    println!(
        "mocap36.c3d: no markers in frames {}-{}",
        frames[0], frames[1]
    );
    let before = MotionOptions {
        frames: Some([1, frames[0] - 1]),
        ..options
    };
    let motion = read_motion(&file, None, &before).unwrap();
    let (tall, noise) = height_and_leg_noise(&motion);
    println!("before: {tall:.2} m, legs vary by {:.0} mm", 1000.0 * noise);
    assert!((1.4..1.9).contains(&tall), "{tall}");
}

#[test]
#[ignore = "needs ../shared"]
fn files_without_a_complete_person_are_refused() {
    let Some(dir) = shared_dir() else { return };
    let dir = dir.join("data/c3d");
    for file in ["trc/Knee.trc", "others/Gait.c3d", "sample01/Eb015pr.c3d"] {
        let got = read_motion(&dir.join(file), None, &MotionOptions::default());
        assert!(
            matches!(got, Err(MotionError::NoPreset { .. })),
            "{file}: {got:?}"
        );
    }
    for file in [
        "trc/UpperLimbStatic.trc",
        "trc/Empty.trc",
        "trc/Truncated.trc",
        "trc/markers.trc",
        "others/Empty.c3d",
    ] {
        let got = read_motion(&dir.join(file), None, &MotionOptions::default());
        assert!(
            matches!(got, Err(MotionError::Trc { .. } | MotionError::C3d { .. })),
            "{file}: {got:?}"
        );
    }
    let table = MarkerTable::preset("cmu");
    let got = read_motion(
        &dir.join("others/Gait.c3d"),
        table.as_ref(),
        &MotionOptions::default(),
    );
    assert!(matches!(got, Err(MotionError::Gap { .. })), "{got:?}");
}
