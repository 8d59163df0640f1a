//! Tests that a deployment of real processes gives the same bits as the same computation in one process.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use crate::common;
use steps::{fuse, pose};

use std::fmt::Write as _;

use common::same_bits::OneProcess;
use common::{Case, PLAIN, planted};
use pipeline::{EstimatorSettings, Views};

#[test]
fn unchanged_frames() {
    let case = Case::new("parity", &[20; 3], PLAIN);
    case.run().ends(0);
    in_pairs().assert_same(&case, 3, 20);
}

#[test]
fn rotated_resized_and_distorted_frames() {
    let rig = planted::tilted_rig(3);
    let more = "[capture]\nsize = [120, 140]\n[results]\noverlay_every = 0\n";
    let case = Case::with_rig(&rig, "warped", &[20; 3], more);
    let ended = case.run();
    // The test figure is only eight pixels high in these frames, so the verdict is "doubtful". Only the bits are compared.
    assert_eq!(ended.status.code(), Some(7), "{}", ended.stderr);
    let one = OneProcess {
        upright_size: Some([120, 140]),
        ..in_pairs()
    };
    one.assert_same(&case, 3, 20);
}

#[test]
fn the_released_energy() {
    let more = PLAIN.to_owned() + "energy = \"released\"\n";
    let case = Case::new("released", &[20; 3], &more);
    case.run().ends(0);
    let config = deployment::paper::Config {
        energy: deployment::paper::Energy::Released,
        ..deployment::paper::Config::default()
    };
    let one = OneProcess {
        settings: EstimatorSettings {
            fuse: fuse::settings(&config, 1.0, None),
            views: Views::Pairs,
            ..EstimatorSettings::default()
        },
        ..OneProcess::default()
    };
    one.assert_same(&case, 3, 20);
}

/// Returns expected errors in multiples of a quarter pixel, different for every part, view and frame.
fn sigma_px(frame: usize, view: usize) -> Vec<f32> {
    let quarters = |part: usize| (part * 7 + frame * 3 + view * 5) % 40;
    (0..26).map(|part| quarters(part) as f32 / 4.0).collect()
}

#[test]
fn parts_switched_off_by_expected_errors() {
    switched_off("expected", "views = \"pairs\"\n", Views::Pairs);
}

#[test]
fn parts_switched_off_with_all_views_at_once() {
    switched_off("expected-at-once", AT_ONCE, Views::All);
}

/// Compares runs with expected errors that switch off parts.
///
/// * `fuse`: additional lines of the section `[paper]`.
fn switched_off(name: &str, fuse: &str, views: Views) {
    let more = PLAIN.to_owned()
        + fuse
        + "tau = { file = \"tau.txt\" }\n[paper.errors]\ntable = \"q.csv\"\nframe_offset = 100\n\
           frame_step = 2\nviews = { a = \"C1\", b = \"C2\" }\n";
    let case = Case::new(name, &[10; 3], &more);
    case.write("tau.txt", format!("# all alike\n{}", "5\n".repeat(26)));
    let parts: Vec<String> = (1..27).map(|part| format!("part_{part}")).collect();
    let mut table = format!("view,frame,{}\n", parts.join(","));
    for (view, name) in ["C1", "C2", "c"].iter().enumerate() {
        for frame in 0..10 {
            let cells: Vec<String> = sigma_px(frame, view).iter().map(f32::to_string).collect();
            writeln!(table, "{name},{},{}", 100 + 2 * frame, cells.join(",")).unwrap();
        }
    }
    case.write("q.csv", table);
    case.run().ends(0);
    let config = deployment::paper::Config {
        tau: deployment::paper::Tau::Given(vec![5.0; 26]),
        ..deployment::paper::Config::default()
    };
    let one = OneProcess {
        settings: EstimatorSettings {
            views,
            fuse: fuse::settings(&config, 1.0, None),
            ..EstimatorSettings::default()
        },
        sigma_px: Some(sigma_px),
        ..OneProcess::default()
    };
    one.assert_same(&case, 3, 10);
}

/// Returns one process that solves pairs of views, as several workers do.
fn in_pairs() -> OneProcess {
    OneProcess {
        settings: EstimatorSettings {
            views: Views::Pairs,
            ..EstimatorSettings::default()
        },
        ..OneProcess::default()
    }
}

/// Returns one process that solves all views at once.
fn at_once() -> OneProcess {
    OneProcess {
        settings: EstimatorSettings {
            views: Views::All,
            ..EstimatorSettings::default()
        },
        ..OneProcess::default()
    }
}

const AT_ONCE: &str = "views = \"all\"\n";

#[test]
fn four_views_at_once() {
    let case = Case::new("at-once", &[12; 4], &format!("{PLAIN}{AT_ONCE}"));
    case.run().ends(0);
    at_once().assert_same(&case, 4, 12);
}

#[test]
fn all_views_at_once_after_the_end_of_the_first_views_footage() {
    let more = format!("{PLAIN}{AT_ONCE}");
    let case = Case::new("at-once-less", &[5, 9, 9], &more);
    case.run().ends(7);
    let one = OneProcess {
        is_missing: Some(|frame, view| view == 0 && frame >= 5),
        ..at_once()
    };
    one.assert_same(&case, 3, 9);
}

#[test]
fn tracked_poses() {
    let case = Case::new(
        "tracked",
        &[20; 3],
        &format!("{PLAIN}search = \"tracked\"\n"),
    );
    case.run().ends(0);
    let config: deployment::paper::Config = toml::from_str("search = \"tracked\"").unwrap();
    let one = OneProcess {
        settings: EstimatorSettings {
            view: pose::settings(&config),
            views: Views::Pairs,
            ..EstimatorSettings::default()
        },
        ..OneProcess::default()
    };
    one.assert_same(&case, 3, 20);
    let lines = case.lines("pose2d.jsonl");
    let n_full = lines.iter().filter(|line| line["search"] == "full").count();
    let n_tracked = lines.iter().filter(|line| line["search"] == "tracked").count();
    // At least frames 0 and 10 are searched in full, in each view.
    assert!(n_full >= 6 && n_tracked > 0, "{n_full} {n_tracked}");
    assert_eq!(n_full + n_tracked, 60);
}

#[test]
fn concurrent_deployments_do_not_interfere() {
    let cases = [
        Case::new("left", &[12; 2], PLAIN),
        Case::new("right", &[9; 3], PLAIN),
    ];
    let started = cases.each_ref().map(|case| case.start(&["run", "deployment.toml"]));
    for started in started {
        started.wait().ends(0);
    }
    in_pairs().assert_same(&cases[0], 2, 12);
    in_pairs().assert_same(&cases[1], 3, 9);
    cases.iter().for_each(Case::assert_nothing_left);
}
