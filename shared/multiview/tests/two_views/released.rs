//! Properties of the released energy, and cases in which its optimiser is worse than the paper's.

use fmp::Pose;
use multiview::{EnergyKind, PairEstimate, PairStart, Settings};
use proptest::prelude::*;

use crate::oracle;
use crate::planted::{FROM_BEST, N_PARTS, Scene, mirrored, settings};

const SIZES: [[usize; 2]; 2] = [[6, 8], [4, 5]];

fn released(seed: u64) -> Settings {
    Settings {
        energy: EnergyKind::Released,
        ..settings(seed)
    }
}

fn parts(pose: &Pose) -> (u16, &[fmp::Placement]) {
    (pose.level, &pose.parts)
}

/// Returns true if the last poses of both views equal those of four iterations earlier, but not those of two iterations earlier.
fn cycles(estimate: &PairEstimate) -> bool {
    let [.., a, b, c, d, e, f] = &estimate.iterations[..] else {
        return false;
    };
    let same =
        |a: &multiview::Iteration, b: &multiview::Iteration| parts(&a.pose) == parts(&b.pose);
    same(a, e) && same(b, f) && !(same(c, e) && same(d, f))
}

#[test]
fn the_released_optimiser_can_cycle_where_the_optimiser_of_the_paper_converges() {
    let mut n_cycles = 0;
    for seed in 0..300 {
        let scene = Scene::new(seed, 2, &SIZES);
        let found = scene.fuse(&released(seed), [0, 1], FROM_BEST);
        let settled = found
            .iterations
            .windows(2)
            .position(|pair| pair.iter().all(|iteration| iteration.moved_px <= 0.1));
        assert_eq!(found.converged, settled.is_some(), "seed {seed}");
        let expect = settled.map_or(60, |first| first + 2);
        assert_eq!(found.iterations.len(), expect, "seed {seed}");
        if cycles(&found) {
            n_cycles += 1;
            assert!(!found.converged);
            let paper = scene.fuse(&settings(seed), [0, 1], FROM_BEST);
            assert!(paper.converged, "seed {seed}");
        }
    }
    assert!(n_cycles > 0);
}

#[test]
fn a_part_switched_off_in_the_support_adds_nothing_to_the_target() {
    let mut n_supported = 0;
    for seed in 0..100 {
        let blind = (seed % 2) as usize;
        let mut scene = Scene::new(seed, 2, &SIZES);
        scene.views[blind].sigma_px = Some(vec![9.0; N_PARTS]);
        scene.views[1 - blind].sigma_px = Some(vec![7.0; N_PARTS]);
        let settings = Settings {
            tau_px: vec![8.0; N_PARTS],
            alpha: 0.5,
            ..released(seed)
        };
        let found = scene.fuse(&settings, [0, 1], FROM_BEST);
        assert_eq!(found.active, [blind != 0; N_PARTS]);
        // The view whose support is blind gets the same result as it gets alone.
        let alone = &scene.views[1 - blind].candidates[0];
        assert_eq!(parts(&found.poses[1 - blind]), parts(alone));
        // The blind view has a support, unless no epipolar line crosses its image.
        let gained = found.poses[blind].score - scene.views[blind].candidates[0].score;
        assert!(gained >= 0.0, "{gained}");
        n_supported += usize::from(gained > 0.0);
    }
    assert!(n_supported > 80, "{n_supported} of 100");
}

proptest! {
    #[test]
    fn every_score_agrees_with_the_description(seed: u64, exchanged: bool) {
        let scene = Scene::new(seed, 2, &SIZES);
        let settings = released(seed);
        let start = PairStart { exchanged, ..FROM_BEST };
        let found = scene.fuse(&settings, [0, 1], start);
        let mut poses = [0, 1].map(|view| scene.views[view].candidates[0].clone());
        for iteration in &found.iterations {
            let mut before = poses.clone();
            poses[iteration.target] = iteration.pose.clone();
            let expect = oracle::released(&scene, &settings, iteration.target, &poses, exchanged);
            prop_assert!((iteration.score - expect).abs() < 1e-4, "{} {expect}", iteration.score);
            // None of the candidates is better.
            for other in &scene.views[iteration.target].candidates {
                before[iteration.target] = other.clone();
                let other = oracle::released(&scene, &settings, iteration.target, &before, exchanged);
                prop_assert!(other <= iteration.score + 1e-4);
            }
        }
    }

    #[test]
    fn a_mirrored_view_gives_the_same_result_if_its_sides_are_swapped(seed: u64) {
        let mut scene = Scene::new(seed, 2, &SIZES);
        let settings = Settings { beta: 0.0, ..released(seed) };
        let plain = scene.fuse(&settings, [0, 1], FROM_BEST);
        scene.views[1].mirrored();
        let start = PairStart { exchanged: true, ..FROM_BEST };
        let behind = scene.fuse(&settings, [0, 1], start);
        prop_assert_eq!(&plain.active, &behind.active);
        prop_assert_eq!(parts(&plain.poses[0]), parts(&behind.poses[0]));
        let back = mirrored(&behind.poses[1]);
        prop_assert_eq!(parts(&plain.poses[1]), parts(&back));
    }

    #[test]
    fn with_zero_weight_every_view_keeps_its_own_best_pose(seed: u64) {
        let scene = Scene::new(seed, 2, &SIZES);
        let settings = Settings { alpha: 0.0, beta: 0.0, ..released(seed) };
        let found = scene.fuse(&settings, [0, 1], FROM_BEST);
        prop_assert!(found.converged && found.iterations.len() == 2);
        for (view, pose) in scene.views.iter().zip(&found.poses) {
            prop_assert_eq!(&view.candidates[0].parts, &pose.parts);
        }
    }
}

/// Returns the switches of the first view for given expected errors of every part in the two views.
fn switch_of_first(sigma_px: [f32; 2]) -> bool {
    let mut scene = Scene::new(7, 2, &SIZES);
    for (view, sigma) in scene.views.iter_mut().zip(sigma_px) {
        view.sigma_px = Some(vec![sigma; N_PARTS]);
    }
    let settings = Settings {
        tau_px: vec![8.0; N_PARTS],
        rescue_px: vec![2.0; N_PARTS],
        max_iterations: 0,
        ..released(7)
    };
    scene.fuse(&settings, [0, 1], FROM_BEST).active[0]
}

#[test]
fn the_better_of_two_bad_views_is_switched_on_if_it_is_clearly_better() {
    assert!(!switch_of_first([8.5, 10.0]), "nearly as bad as the other");
    assert!(switch_of_first([8.5, 11.0]), "clearly better");
    assert!(!switch_of_first([11.0, 8.5]), "clearly worse");
    assert!(!switch_of_first([8.5, 7.0]), "the other view is usable");
    assert!(switch_of_first([7.0, 20.0]), "usable itself");
}
