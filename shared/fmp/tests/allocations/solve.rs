//! Checks that the solver allocates no memory from frame to frame except for its results.

use std::sync::Arc;

use fmp::Solver;

use crate::allocations;
use crate::common::{Evidence, Noise, tree};

pub(crate) fn takes_memory_for_the_answer_only() {
    let mut noise = Noise(1);
    let model = tree(&mut noise, 8);
    let sizes = [[40, 50], [37, 46], [20, 25], [9, 12]];
    let solver = Solver::new(Arc::clone(&model));
    for round in 0..6 {
        let evidence = Evidence::new(&mut noise, &model, &sizes);
        let view = evidence.view();
        let found = solver.best(&view, None).unwrap();
        let count = allocations(|| drop(solver.best(&view, None)));
        let again = allocations(|| {
            solver.score(&view, &found, None);
        });
        if round > 0 {
            assert_eq!([count, again], [1, 0]);
        }
    }
}

/// Terms that allocate no memory.
struct Unmoved;

impl fmp::ExtraTerms for Unmoved {
    fn add_position(&self, part: usize, _: usize, first: usize, score: &mut [f32]) -> bool {
        for (cell, it) in score.iter_mut().enumerate() {
            *it -= ((first + cell + part) % 7) as f32 * 0.01;
        }
        true
    }

    fn of_type(&self, _: usize, _: usize) -> f32 {
        0.0
    }

    fn max_gain(&self, _: usize) -> f32 {
        0.0
    }

    fn key(&self, part: usize) -> Option<u64> {
        // The terms of the first parts may change at any time.
        (part > 3).then_some(1)
    }
}

pub(crate) fn takes_memory_for_the_answer_only_again() {
    let mut noise = Noise(2);
    let model = tree(&mut noise, 8);
    let sizes = [[40, 50], [37, 46], [20, 25], [9, 12]];
    let solver = Solver::new(Arc::clone(&model));
    for round in 0..6 {
        let evidence = Evidence::new(&mut noise, &model, &sizes);
        let view = evidence.view();
        let bounds = solver.bounds(&view);
        let view = view.with_bounds(&bounds);
        let mut incremental = solver.incremental(&view);
        let mut guess = solver.best(&view, None);
        for _ in 0..3 {
            let mut found = None;
            let count = allocations(|| found = incremental.best(&Unmoved, guess.as_ref()));
            if round > 2 {
                assert_eq!(count, 1);
            }
            guess = found;
        }
    }
}
