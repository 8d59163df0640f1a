//! Properties of the optimiser of all views at once.

use fmp::{Pose, Responses};
use multiview::{
    AllViewsEstimate, AllViewsInput, AllViewsStart, PairStart, Settings, ViewInput,
    estimate_all_views,
};
use proptest::prelude::*;

use crate::oracle;
use crate::paper::{ROUNDING, SIZES, TINY, all_poses};
use crate::planted::{Scene, settings};

/// The parameters of a problem, without its seed.
#[derive(Debug, Clone)]
struct Start {
    candidates: Vec<usize>,
    exchanged: Vec<bool>,
    weight: f64,
}

fn starts(n_views: usize) -> impl Strategy<Value = Start> {
    let candidates = prop::collection::vec(0..4_usize, n_views);
    let exchanged = prop::collection::vec(any::<bool>(), n_views);
    let weights = prop::sample::select(vec![1.0, 1.0 / (n_views - 1) as f64]);
    (candidates, exchanged, weights).prop_map(|(candidates, mut exchanged, weight)| {
        exchanged[0] = false;
        Start {
            candidates,
            exchanged,
            weight,
        }
    })
}

fn fuse(scene: &Scene, settings: &Settings, start: &Start) -> AllViewsEstimate {
    let views: Vec<ViewInput<'_>> = scene.views.iter().map(|view| view.input()).collect();
    let evidence: Vec<Responses<'_>> = scene.views.iter().map(|view| view.evidence()).collect();
    let evidence: Vec<&Responses<'_>> = evidence.iter().collect();
    let input = AllViewsInput {
        views: &views,
        tables: &|first, second| ((first, second) == (0, 1)).then_some(&scene.tables),
        weight: start.weight,
    };
    let from = AllViewsStart {
        candidates: &start.candidates,
        exchanged: &start.exchanged,
    };
    estimate_all_views(&scene.solver, settings, &input, &evidence, from)
}

/// Returns the energy of given poses, computed independently.
fn energy(scene: &Scene, settings: &Settings, start: &Start, poses: &[Pose]) -> f64 {
    let n = poses.len();
    let own: f64 = (0..n).map(|view| oracle::own(scene, view, &poses[view])).sum();
    let pairs = (0..n).flat_map(|a| (a + 1..n).map(move |b| [a, b]));
    let between = pairs.map(|[a, b]| {
        let exchanged = start.exchanged[a] != start.exchanged[b];
        oracle::between(scene, settings, [a, b], [&poses[a], &poses[b]], exchanged)
    });
    own + start.weight * between.sum::<f64>()
}

fn first_poses(scene: &Scene, start: &Start) -> Vec<Pose> {
    let candidates = scene.views.iter().zip(&start.candidates);
    candidates
        .map(|(view, &candidate)| view.candidates[candidate].clone())
        .collect()
}

proptest! {
    #[test]
    fn two_views_at_once_give_the_result_of_a_pair(seed: u64, start in starts(2)) {
        let (scene, settings) = (Scene::new(seed, 2, &SIZES), settings(seed));
        let all = fuse(&scene, &settings, &start);
        let from = PairStart {
            candidates: [start.candidates[0], start.candidates[1]],
            exchanged: start.exchanged[1],
        };
        let pair = scene.fuse(&settings, [0, 1], from);
        prop_assert_eq!(&all.iterations, &pair.iterations);
        prop_assert_eq!(&all.poses[..], &pair.poses[..]);
        prop_assert_eq!((all.converged, all.energy), (pair.converged, pair.energy));
    }

    #[test]
    fn the_energy_is_the_sum_over_all_pairs_and_never_decreases(
        seed: u64,
        start in prop::sample::select(vec![3_usize, 4]).prop_flat_map(starts),
    ) {
        let n_views = start.candidates.len();
        let (scene, settings) = (Scene::new(seed, n_views, &SIZES), settings(seed));
        let found = fuse(&scene, &settings, &start);
        let mut poses = first_poses(&scene, &start);
        let mut before = energy(&scene, &settings, &start, &poses) - ROUNDING;
        for iteration in &found.iterations {
            prop_assert!(iteration.score >= before, "{} after {before}", iteration.score);
            poses[iteration.target] = iteration.pose.clone();
            prop_assert!((iteration.score - energy(&scene, &settings, &start, &poses)).abs() < ROUNDING);
            before = iteration.score;
        }
        prop_assert!(found.converged);
        prop_assert_eq!(&found.poses, &poses);
        prop_assert!((found.energy - before).abs() < ROUNDING);
    }

    #[test]
    fn with_zero_weight_every_view_keeps_its_own_best_pose(seed: u64, start in starts(3)) {
        let scene = Scene::new(seed, 3, &SIZES);
        let found = fuse(&scene, &settings(seed), &Start { weight: 0.0, ..start });
        for (view, pose) in scene.views.iter().zip(&found.poses) {
            prop_assert_eq!(&view.candidates[0].parts, &pose.parts);
        }
    }
}

proptest! {
    // Every pose of every view is tried.
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn at_the_end_no_single_view_can_raise_the_energy(
        seed: u64,
        start in starts(3),
        sizes in prop::sample::select(TINY.to_vec()),
    ) {
        let (scene, settings) = (Scene::new(seed, 3, sizes), settings(seed));
        let found = fuse(&scene, &settings, &start);
        for view in 0..3 {
            let mut poses = found.poses.clone();
            for pose in all_poses(&scene.views[view].plan) {
                poses[view] = pose;
                let other = energy(&scene, &settings, &start, &poses);
                prop_assert!(other <= found.energy + ROUNDING, "view {view}: {other}");
            }
        }
    }
}

#[test]
fn a_single_view_keeps_its_start() {
    let scene = Scene::new(3, 1, &SIZES);
    let start = Start {
        candidates: vec![2],
        exchanged: vec![false],
        weight: 1.0,
    };
    let found = fuse(&scene, &settings(3), &start);
    assert_eq!(found.poses, first_poses(&scene, &start));
    assert!(found.converged && found.iterations.is_empty());
}
