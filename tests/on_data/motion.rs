//! Motion capture files of c3d.org and others: six encodings of one trial, and files that are broken.

use std::path::Path;

use c3d::{C3d, C3dError};

use crate::shared_dir;

fn read(file: &Path) -> C3d {
    C3d::parse(&std::fs::read(file).unwrap()).unwrap()
}

/// * `step_mm`: what the integers count in; reals may hold what was rounded away.
fn assert_same_points(dir: &Path, files: [&str; 6], step_mm: f64) {
    let trials = files.map(|it| read(&dir.join(it)));
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
fn other_laboratories_files_are_read_and_an_empty_one_is_named() {
    let Some(dir) = shared_dir() else { return };
    let dir = dir.join("data/c3d/others");
    let walk = read(&dir.join("cmu_02_05.c3d"));
    assert_eq!((walk.n_points(), walk.rate_hz()), (41, 120.0));
    assert_eq!(walk.n_frames(), 1854);
    let span = |axis: usize| {
        let seen = (0..walk.n_frames()).flat_map(|it| walk.frame(it)).flatten();
        seen.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], it| {
            [low.min(it[axis]), high.max(it[axis])]
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
