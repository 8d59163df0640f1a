//! Properties of the paper's energy and of its optimiser.

use std::sync::Arc;

use fmp::{Bound, Bounds, Placement, Pose};
use multiview::{EnergyKind, PairEstimate, PairStart, Settings, SwitchBy, ViewPlan};
use nalgebra::Point2;
use proptest::prelude::*;

use crate::oracle;
use crate::planted::{
    FROM_BEST, MIRROR, N_PARTS, N_TYPES, Noise, Scene, camera, layout, lenses, mirrored, settings,
};

pub(crate) const SIZES: [[usize; 2]; 2] = [[6, 8], [4, 5]];
/// Pyramids small enough to try every pose; in the second one, only types can change.
pub(crate) const TINY: [&[[usize; 2]]; 2] = [&[[3, 4], [2, 2]], &[[1, 1]]];
/// Tolerance for single-view scores, which are sums in single precision.
pub(crate) const ROUNDING: f64 = 1e-4;

fn starts() -> impl Strategy<Value = PairStart> {
    (0..4_usize, 0..4_usize, any::<bool>()).prop_map(|(a, b, exchanged)| PairStart {
        candidates: [a, b],
        exchanged,
    })
}

fn parts(estimate: &PairEstimate) -> [(u16, Vec<Placement>); 2] {
    let of = |pose: &Pose| (pose.level, pose.parts.clone());
    estimate.poses.each_ref().map(of)
}

/// Every pose of a view.
pub(crate) fn all_poses(plan: &ViewPlan) -> Vec<Pose> {
    let mut poses = Vec::new();
    for (level, level_layout) in plan.layout().levels.iter().enumerate() {
        let n = level_layout.rows * level_layout.cols * N_TYPES;
        for mut index in 0..n.pow(N_PARTS as u32) {
            let mut next = |count: usize| {
                let digit = index % count;
                index /= count;
                digit
            };
            let parts = (0..N_PARTS).map(|_| Placement {
                mixture: next(N_TYPES) as u8,
                x: next(level_layout.cols) as u16,
                y: next(level_layout.rows) as u16,
            });
            poses.push(Pose {
                score: 0.0,
                level: level as u16,
                parts: parts.collect(),
            });
        }
    }
    poses
}

proptest! {
    /// The bounds were received from another process.
    #[test]
    fn correct_bounds_change_nothing_and_wrong_bounds_do_not_panic(
        seed in any::<u64>(),
        start in starts(),
        values in proptest::collection::vec((-20.0..20.0_f32, 0.0..20.0_f32), 2 * SIZES.len()),
        released: bool,
    ) {
        let scene = Scene::new(seed, 2, &SIZES);
        let energy = if released { EnergyKind::Released } else { EnergyKind::Paper };
        let settings = Settings { energy, ..settings(seed) };
        let evidence = [0, 1].map(|view| scene.views[view].evidence());
        let fuse = |bounds: &[Bounds; 2]| {
            let evidence = [0, 1].map(|view| evidence[view].with_bounds(&bounds[view]));
            scene.fuse_evidence(&settings, [0, 1], start, evidence.each_ref())
        };
        let right = evidence.each_ref().map(|evidence| scene.solver.bounds(evidence));
        prop_assert_eq!(fuse(&right), scene.fuse(&settings, [0, 1], start));
        let bound = |&(best, size): &(f32, f32)| Bound { best, size };
        let values: Vec<Bound> = values.iter().map(bound).collect();
        let wrong = [0, 1].map(|view| Bounds::new(values[view * SIZES.len()..][..SIZES.len()].to_vec()));
        let found = fuse(&wrong);
        prop_assert!(found.iterations.len() <= settings.max_iterations);
    }
}

proptest! {
    #[test]
    fn the_energy_equals_that_of_the_paper_and_never_decreases(seed: u64, start in starts()) {
        let (scene, settings) = (Scene::new(seed, 2, &SIZES), settings(seed));
        let found = scene.fuse(&settings, [0, 1], start);
        let energy = |poses: &[Pose; 2]| {
            oracle::energy(&scene, &settings, [0, 1], poses.each_ref(), start.exchanged)
        };
        let mut poses = [0, 1].map(|view| scene.views[view].candidates[start.candidates[view]].clone());
        let mut before = energy(&poses) - ROUNDING;
        for iteration in &found.iterations {
            prop_assert!(iteration.score >= before, "{} after {before}", iteration.score);
            poses[iteration.target] = iteration.pose.clone();
            prop_assert!((iteration.score - energy(&poses)).abs() < ROUNDING);
            before = iteration.score;
        }
        prop_assert!(found.converged);
        prop_assert_eq!(&found.poses, &poses);
        prop_assert!((found.energy - energy(&poses)).abs() < ROUNDING);
    }

    #[test]
    fn rounding_neither_lowers_the_energy_nor_makes_it_cycle(seed: u64, start in starts()) {
        let mut scene = Scene::new(seed, 2, &SIZES);
        for view in &mut scene.views {
            // Sums of scores this large are accurate to about a tenth.
            view.values.iter_mut().for_each(|value| *value += 1e6);
        }
        let found = scene.fuse(&settings(seed), [0, 1], start);
        prop_assert!(found.converged);
        let energies: Vec<f64> = found.iterations.iter().map(|iteration| iteration.score).collect();
        prop_assert!(energies.is_sorted(), "{energies:?}");
    }

    #[test]
    fn swapping_the_views_swaps_their_poses(seed: u64, start in starts()) {
        let mut scene = Scene::new(seed, 2, &SIZES);
        // The scene has no tables for the pair (1, 0).
        let settings = Settings { beta: 0.0, ..settings(seed) };
        // A tie would go to the first view in either order.
        scene.views[0].sigma_px = None;
        let there = scene.fuse(&settings, [0, 1], start);
        let [a, b] = start.candidates;
        let back = scene.fuse(&settings, [1, 0], PairStart { candidates: [b, a], ..start });
        prop_assert!((there.energy - back.energy).abs() < ROUNDING);
        let [first, second] = parts(&back);
        prop_assert_eq!(parts(&there), [second, first]);
        let targets = |estimate: &PairEstimate| estimate.iterations.iter().map(|iteration| iteration.target).collect::<Vec<_>>();
        let exchanged: Vec<usize> = targets(&back).into_iter().map(|target| 1 - target).collect();
        prop_assert_eq!(targets(&there), exchanged);
    }

    #[test]
    fn swapping_left_and_right_in_both_views_changes_nothing(seed: u64, start in starts()) {
        let mut scene = Scene::new(seed, 2, &SIZES);
        let settings = Settings { beta: 0.0, ..settings(seed) };
        let plain = scene.fuse(&settings, [0, 1], start);
        scene.views.iter_mut().for_each(crate::planted::View::mirrored);
        let exchanged = scene.fuse(&settings, [0, 1], start);
        prop_assert!((plain.energy - exchanged.energy).abs() < ROUNDING);
        let [first, second] = parts(&exchanged);
        let back = [first, second].map(|(level, parts)| (level, MIRROR.map(|part| parts[part]).to_vec()));
        prop_assert_eq!(parts(&plain), back);
    }

    #[test]
    fn a_mirrored_view_gives_the_same_result_if_its_sides_are_swapped(seed: u64, start in starts()) {
        let mut scene = Scene::new(seed, 2, &SIZES);
        let settings = Settings { beta: 0.0, ..settings(seed) };
        let plain = scene.fuse(&settings, [0, 1], start);
        scene.views[1].mirrored();
        let start = PairStart { exchanged: !start.exchanged, ..start };
        let behind = scene.fuse(&settings, [0, 1], start);
        prop_assert!((plain.energy - behind.energy).abs() < ROUNDING);
        prop_assert_eq!(&plain.active, &behind.active);
        let [first, second] = behind.poses.each_ref();
        let [plain_first, plain_second] = plain.poses.each_ref();
        prop_assert_eq!(&plain_first.parts, &first.parts);
        prop_assert_eq!(&plain_second.parts, &mirrored(second).parts);
    }

    #[test]
    fn parts_that_are_switched_off_have_no_terms(seed: u64, blind in 0..2_usize, start in starts()) {
        let mut scene = Scene::new(seed, 2, &SIZES);
        scene.views[blind].sigma_px = Some(vec![9.0; N_PARTS]);
        let settings = Settings { tau_px: vec![8.0; N_PARTS], ..settings(seed) };
        let found = scene.fuse(&settings, [0, 1], start);
        prop_assert_eq!(&found.active, &[false; N_PARTS]);
        let alone = [0, 1].map(|view| scene.views[view].candidates[0].clone());
        prop_assert_eq!(found.poses.each_ref().map(|pose| &pose.parts), alone.each_ref().map(|pose| &pose.parts));
        let sum: f64 = alone.iter().map(|pose| f64::from(pose.score)).sum();
        prop_assert!((found.energy - sum).abs() < ROUNDING);
    }

    #[test]
    fn with_switching_by_support_the_unreliable_view_follows_the_reliable_one(
        seed: u64,
        blind in 0..2_usize,
        (switch, sees) in prop::sample::select(vec![
            (SwitchBy::Support, 1.0),
            (SwitchBy::Worse, 1.0),
            // Neither view is usable, and one is worse than the other.
            (SwitchBy::Worse, 8.5),
        ]),
        start in starts(),
    ) {
        let mut scene = Scene::new(seed, 2, &SIZES);
        scene.views[blind].sigma_px = Some(vec![9.0; N_PARTS]);
        scene.views[1 - blind].sigma_px = Some(vec![sees; N_PARTS]);
        let all_on = Settings { tau_px: Vec::new(), ..settings(seed) };
        let settings = Settings {
            tau_px: vec![8.0; N_PARTS],
            switch,
            ..all_on.clone()
        };
        let found = scene.fuse(&settings, [0, 1], start);
        prop_assert!(found.converged);
        let alone = &scene.views[1 - blind].candidates[0];
        prop_assert_eq!(&found.poses[1 - blind].parts, &alone.parts, "it has no support");
        let energy = |pose: &Pose| {
            let mut poses = found.poses.clone();
            poses[blind] = pose.clone();
            oracle::own(&scene, blind, pose)
                + oracle::between(&scene, &all_on, [0, 1], poses.each_ref(), start.exchanged)
        };
        let followed = energy(&found.poses[blind]);
        for candidate in &scene.views[blind].candidates {
            prop_assert!(followed >= energy(candidate) - ROUNDING);
        }
    }

    #[test]
    fn with_zero_weight_every_view_keeps_its_own_best_pose(seed: u64, start in starts()) {
        let scene = Scene::new(seed, 2, &SIZES);
        let settings = Settings { alpha: 0.0, beta: 0.0, ..settings(seed) };
        let found = scene.fuse(&settings, [0, 1], start);
        for (view, pose) in scene.views.iter().zip(&found.poses) {
            prop_assert_eq!(&view.candidates[0].parts, &pose.parts);
        }
    }

    #[test]
    fn the_same_scene_at_twice_the_resolution_has_the_same_energy(seed: u64, start in starts()) {
        let mut scene = Scene::new(seed, 2, &SIZES);
        let settings = settings(seed);
        let coarse = scene.fuse(&settings, [0, 1], start);
        for view in &mut scene.views {
            let mut camera = view.plan.camera().clone();
            let inside = &mut camera.intrinsics;
            (inside.fx, inside.fy) = (2.0 * inside.fx, 2.0 * inside.fy);
            // Pixels are counted from the centre of the first one.
            (inside.cx, inside.cy) = (2.0 * inside.cx + 0.5, 2.0 * inside.cy + 0.5);
            inside.size = inside.size.map(|size| 2 * size);
            let model = Arc::clone(scene.solver.model());
            view.plan = ViewPlan::new(camera, model, Arc::new(layout(&SIZES, 8.0)));
        }
        let fine = scene.fuse(&settings, [0, 1], start);
        prop_assert!((coarse.energy - fine.energy).abs() < ROUNDING);
        prop_assert_eq!(parts(&coarse), parts(&fine));
    }

    #[test]
    fn cell_centres_are_undistorted(seed: u64) {
        let scene = Scene::new(seed, 1, &SIZES);
        let plan = &scene.views[0].plan;
        let mut pose = scene.views[0].candidates[0].clone();
        for (level, level_layout) in plan.layout().levels.iter().enumerate() {
            pose.level = level as u16;
            for (cell, ideal) in plan.cells(0, level).iter().enumerate() {
                pose.parts[0].x = (cell % level_layout.cols) as u16;
                pose.parts[0].y = (cell / level_layout.cols) as u16;
                let centre = Point2::from(plan.centres(&pose)[0]);
                let Some(back) = plan.camera().distort_px(&Point2::from(*ideal)) else {
                    prop_assert!(plan.camera().undistorted_px(&centre).is_none());
                    continue;
                };
                prop_assert!((back - centre).norm() < 1e-6);
            }
        }
    }

    #[test]
    fn a_view_without_evidence_is_pulled_to_the_lines_of_the_other(seed: u64, blind in 0..2_usize) {
        let mut scene = Scene::new(seed, 2, &[[12, 16]]);
        let settings = Settings {
            alpha: 1e4,
            beta: 0.0,
            max_distance_cells: 20.0,
            ..Settings::default()
        };
        for (index, view) in scene.views.iter_mut().enumerate() {
            view.sigma_px = None;
            view.values.fill(0.0);
            if index != blind {
                view.add_evidence(1, 1e9);
            }
            view.candidates = vec![scene.solver.best(&view.evidence(), None).unwrap()];
        }
        let found = scene.fuse(&settings, [0, 1], FROM_BEST);
        prop_assert_eq!(&found.poses[1 - blind].parts, &scene.views[1 - blind].candidates[0].parts);
        let best = all_placements(&scene, &settings, blind, &found.poses);
        let got = oracle::between(&scene, &settings, [0, 1], found.poses.each_ref(), false);
        // The springs, 120 at most, are negligible compared with alpha times a cell.
        prop_assert!(got >= best - 500.0, "{got} of {best}");
    }
}

/// Returns the best value of the terms alone: each part of `view` is optimised independently, the other
/// view is fixed.
fn all_placements(scene: &Scene, settings: &Settings, view: usize, poses: &[Pose; 2]) -> f64 {
    let level = &scene.views[view].plan.layout().levels[0];
    let with = |part: usize, cell: usize| {
        let mut moved = poses.clone();
        moved[view].parts[part].x = (cell % level.cols) as u16;
        moved[view].parts[part].y = (cell / level.cols) as u16;
        oracle::between(scene, settings, [0, 1], moved.each_ref(), false)
    };
    let now = oracle::between(scene, settings, [0, 1], poses.each_ref(), false);
    let gain = |part: usize| {
        let cells = (0..level.rows * level.cols).map(|cell| with(part, cell) - now);
        cells.fold(0.0, f64::max)
    };
    now + (0..N_PARTS).map(gain).sum::<f64>()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn no_single_view_can_raise_the_energy(seed: u64, start in starts(), sizes in 0..2_usize) {
        let (scene, settings) = (Scene::new(seed, 2, TINY[sizes]), settings(seed));
        let found = scene.fuse(&settings, [0, 1], start);
        prop_assert!(found.converged);
        for view in 0..2 {
            for pose in all_poses(&scene.views[view].plan) {
                let mut poses = found.poses.each_ref();
                poses[view] = &pose;
                let other = oracle::energy(&scene, &settings, [0, 1], poses, start.exchanged);
                prop_assert!(other <= found.energy + ROUNDING, "{other} beats {}", found.energy);
            }
        }
    }
}

#[test]
fn the_optimiser_continues_while_only_types_change() {
    let sizes = [[1, 1]];
    for seed in 0..300 {
        let scene = Scene::new(seed, 2, &sizes);
        let settings = Settings {
            beta: 3.0,
            ..Settings::default()
        };
        let found = scene.fuse(&settings, [0, 1], FROM_BEST);
        for view in 0..2 {
            for pose in all_poses(&scene.views[view].plan) {
                let mut poses = found.poses.each_ref();
                poses[view] = &pose;
                let other = oracle::energy(&scene, &settings, [0, 1], poses, false);
                assert!(other <= found.energy + ROUNDING, "seed {seed}");
            }
        }
    }
}

#[test]
fn a_support_whose_pixel_cannot_be_undistorted_has_no_effect() {
    for seed in 0..20 {
        let mut scene = Scene::new(seed, 2, &SIZES);
        let layout = Arc::new(layout(&SIZES, 4.0));
        let corners_unseen = camera(0.1, 0.5, layout.image_size, lenses()[3]);
        let model = Arc::clone(scene.solver.model());
        scene.views[0].plan = ViewPlan::new(corners_unseen, model, layout);
        scene.views[0].candidates[0] = Pose {
            score: 0.0,
            level: 0,
            parts: vec![Placement::default(); N_PARTS],
        };
        scene.views[0].sigma_px = Some(vec![1.0; N_PARTS]);
        scene.views[1].sigma_px = Some(vec![2.0; N_PARTS]);
        let settings = Settings {
            alpha: 3.0,
            beta: 0.0,
            max_distance_cells: f64::INFINITY,
            ..Settings::default()
        };
        let elsewhere = PairStart {
            candidates: [0, 1],
            exchanged: false,
        };
        let found = scene.fuse(&settings, [0, 1], elsewhere);
        assert_eq!(found.iterations[0].target, 1);
        let alone = &scene.views[1].candidates[0];
        assert_eq!(found.iterations[0].pose.parts, alone.parts, "seed {seed}");
    }
}

#[test]
fn an_expected_error_at_the_threshold_is_not_above_it() {
    let mut scene = Scene::new(1, 2, &SIZES);
    scene.views[0].sigma_px = Some(vec![8.0, 8.1, 7.0]);
    scene.views[1].sigma_px = Some(vec![8.0, 8.0, 9.0]);
    let mut settings = settings(1);
    settings.tau_px = vec![8.0; N_PARTS];
    let found = scene.fuse(&settings, [0, 1], FROM_BEST);
    assert_eq!(found.active, [true, false, false]);
}

#[test]
fn thresholds_of_a_prediction_are_used_if_the_settings_have_none() {
    let mut scene = Scene::new(1, 2, &SIZES);
    scene.views[0].sigma_px = Some(vec![5.0; N_PARTS]);
    scene.views[1].sigma_px = Some(vec![5.0; N_PARTS]);
    scene.views[1].tau_px = Some(vec![4.0, 5.0, 6.0]);
    let mut settings = settings(1);
    let found = scene.fuse(&settings, [0, 1], FROM_BEST);
    assert_eq!(found.active, [false, true, true], "the other view has none");
    settings.tau_px = vec![9.0, 9.0, 1.0];
    let found = scene.fuse(&settings, [0, 1], FROM_BEST);
    assert_eq!(found.active, [true, true, false]);
}

/// Returns which view is the first support.
fn first_support(sigma_px: [Option<[f32; N_PARTS]>; 2], seed: u64) -> (usize, usize) {
    let mut scene = Scene::new(seed, 2, &SIZES);
    for (view, sigma) in scene.views.iter_mut().zip(sigma_px) {
        view.sigma_px = sigma.map(|sigma_px| sigma_px.to_vec());
    }
    let found = scene.fuse(&settings(seed), [0, 1], FROM_BEST);
    let [a, b] = [0, 1].map(|view| scene.views[view].candidates[0].score);
    (1 - found.iterations[0].target, usize::from(b > a))
}

#[test]
fn the_first_support_is_the_view_with_lower_expected_error() {
    for seed in 0..20 {
        let good = Some([1.0, 2.0, 2.5]);
        // The largest error of a part does not matter.
        let bad = Some([2.0, 2.0, 2.0]);
        assert_eq!(first_support([good, bad], seed).0, 0);
        assert_eq!(first_support([bad, good], seed).0, 1);
        assert_eq!(first_support([bad, bad], seed).0, 0, "a tie");
    }
}

#[test]
fn without_expected_errors_the_first_support_is_the_view_with_higher_score() {
    let mut counts = [0, 0];
    for seed in 0..20 {
        for sigma in [[None, None], [None, Some([1.0; 3])], [Some([1.0; 3]), None]] {
            let (first, higher) = first_support(sigma, seed);
            assert_eq!(first, higher);
            counts[first] += 1;
        }
    }
    assert!(counts.iter().all(|count| *count > 0), "{counts:?}");
}

#[test]
fn without_iterations_the_start_is_returned() {
    let (scene, mut settings) = (Scene::new(1, 2, &SIZES), settings(1));
    settings.max_iterations = 0;
    let start = PairStart {
        candidates: [2, 1],
        exchanged: true,
    };
    let found = scene.fuse(&settings, [0, 1], start);
    assert!(!found.converged && found.iterations.is_empty());
    assert_eq!(found.poses[0], scene.views[0].candidates[2]);
    let expect = oracle::energy(&scene, &settings, [0, 1], found.poses.each_ref(), true);
    assert!((found.energy - expect).abs() < ROUNDING);
}

#[test]
fn the_noise_has_the_expected_mean() {
    let mut noise = Noise(3);
    let mean = (0..1000).map(|_| noise.unit()).sum::<f64>() / 1000.0;
    assert!((mean - 0.5).abs() < 0.05, "{mean}");
}
