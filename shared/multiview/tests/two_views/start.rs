//! Compares the choice of candidates and swaps with all combinations.

use multiview::{Settings, TypeTables, ViewInput, choose_start, rank_starts};
use proptest::prelude::*;

use crate::oracle;
use crate::planted::{Scene, View, settings};

const SIZES: [[usize; 2]; 2] = [[6, 8], [4, 5]];

fn chosen(scene: &Scene, settings: &Settings) -> multiview::Start {
    let inputs: Vec<ViewInput<'_>> = scene.views.iter().map(View::input).collect();
    let tables =
        |a: usize, b: usize| -> Option<&TypeTables> { ((a, b) == (0, 1)).then_some(&scene.tables) };
    choose_start(settings, &inputs, &tables)
}

fn ranked(scene: &Scene, settings: &Settings) -> Vec<multiview::Start> {
    let inputs: Vec<ViewInput<'_>> = scene.views.iter().map(View::input).collect();
    let tables =
        |a: usize, b: usize| -> Option<&TypeTables> { ((a, b) == (0, 1)).then_some(&scene.tables) };
    rank_starts(settings, &inputs, &tables)
}

/// Returns the sum of eq. 3 over all pairs.
fn energy(scene: &Scene, settings: &Settings, candidates: &[usize], exchanged: &[bool]) -> f64 {
    let n = candidates.len();
    let pairs = (0..n).flat_map(|a| (a + 1..n).map(move |b| [a, b]));
    pairs
        .map(|views| {
            let poses = views.map(|view| &scene.views[view].candidates[candidates[view]]);
            let opposite = exchanged[views[0]] != exchanged[views[1]];
            oracle::energy(scene, settings, views, poses, opposite)
        })
        .sum()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn ranked_starts_are_the_best_under_every_assumption_and_the_first_is_the_start(
        seed: u64,
        facing: bool,
    ) {
        let scene = Scene::new(seed, 3, &SIZES);
        let settings = Settings { facing, n_candidates: 3, ..settings(seed) };
        let starts = ranked(&scene, &settings);
        prop_assert_eq!(starts.len(), if facing { 4 } else { 1 });
        prop_assert!(starts.is_sorted_by(|a, b| a.energy >= b.energy));
        prop_assert!((starts[0].energy - chosen(&scene, &settings).energy).abs() < 1e-4);
        let mut patterns: Vec<&Vec<bool>> = starts.iter().map(|start| &start.exchanged).collect();
        patterns.sort();
        patterns.dedup();
        prop_assert_eq!(patterns.len(), starts.len(), "every assumption once");
        for start in &starts {
            for index in 0..27 {
                let candidates = [index % 3, index / 3 % 3, index / 9];
                let other = energy(&scene, &settings, &candidates, &start.exchanged);
                prop_assert!(other <= start.energy + 1e-4, "{candidates:?}");
            }
        }
    }

    #[test]
    fn the_start_is_the_best_combination(seed: u64, facing: bool) {
        let scene = Scene::new(seed, 3, &SIZES);
        let settings = Settings { facing, n_candidates: 3, ..settings(seed) };
        let start = chosen(&scene, &settings);
        let energy_of_start = energy(&scene, &settings, &start.candidates, &start.exchanged);
        prop_assert!((start.energy - energy_of_start).abs() < 1e-4);
        prop_assert!(!start.exchanged[0], "exchanges are relative to the first view");
        let n_exchanges = if facing { 4 } else { 1 };
        for index in 0..27 * n_exchanges {
            let candidates = [index % 3, index / 3 % 3, index / 9 % 3];
            let exchanged = [false, index / 27 % 2 == 1, index / 54 == 1];
            let other = energy(&scene, &settings, &candidates, &exchanged);
            prop_assert!(other <= start.energy + 1e-4, "{candidates:?} {exchanged:?}");
        }
    }

    #[test]
    fn with_one_candidate_the_start_equals_that_of_the_paper(seed: u64) {
        let scene = Scene::new(seed, 3, &SIZES);
        let settings = Settings { facing: false, n_candidates: 1, ..settings(seed) };
        let start = chosen(&scene, &settings);
        prop_assert_eq!((start.candidates, start.exchanged), (vec![0; 3], vec![false; 3]));
    }
}

#[test]
fn a_single_view_starts_from_its_best_pose() {
    let scene = Scene::new(5, 1, &SIZES);
    let start = chosen(&scene, &settings(5));
    assert_eq!((start.candidates, start.exchanged), (vec![0], vec![false]));
    let best = f64::from(scene.views[0].candidates[0].score);
    assert_eq!(start.energy, best);
}
