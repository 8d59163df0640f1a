//! A deployment of real processes gives the same bits as one process that does the same.

mod common;

use common::same_bits::OneProcess;
use common::{Case, PLAIN, planted};
use pipeline::EstimatorSettings;

#[test]
fn frames_as_they_are() {
    let case = Case::new("parity", &[20; 3], PLAIN);
    let ended = case.run();
    assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
    OneProcess::default().assert_same(&case, 3, 20);
}

#[test]
fn frames_that_are_turned_resized_and_distorted() {
    let rig = planted::tilted_rig(3);
    let more = "[capture]\nsize = [120, 140]\n[record]\noverlay_every = 0\n";
    let case = Case::seen_by(&rig, "warped", &[20; 3], more);
    let ended = case.run();
    assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
    let one = OneProcess {
        upright_size: Some([120, 140]),
        ..OneProcess::default()
    };
    one.assert_same(&case, 3, 20);
}

#[test]
fn the_released_energy() {
    let more = PLAIN.to_owned() + "energy = \"released\"\n";
    let case = Case::new("released", &[20; 3], &more);
    let ended = case.run();
    assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
    let config = fuse::Config {
        energy: fuse::Energy::Released,
        ..fuse::Config::default()
    };
    let n_candidates = pose::Config::default().candidates;
    let one = OneProcess {
        settings: EstimatorSettings {
            fuse: config.settings(n_candidates, 1.0),
            ..EstimatorSettings::default()
        },
        ..OneProcess::default()
    };
    one.assert_same(&case, 3, 20);
}

#[test]
fn deployments_side_by_side_do_not_meet() {
    let cases = [
        Case::new("left", &[12; 2], PLAIN),
        Case::new("right", &[9; 3], PLAIN),
    ];
    let started = cases
        .each_ref()
        .map(|it| it.start(&["run", "deployment.toml"]));
    for started in started {
        let ended = started.wait();
        assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
    }
    OneProcess::default().assert_same(&cases[0], 2, 12);
    OneProcess::default().assert_same(&cases[1], 3, 9);
    cases.iter().for_each(Case::assert_nothing_left);
}
