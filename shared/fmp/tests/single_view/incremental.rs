//! Compares every shortcut of the incremental solver with the full solution.

use std::sync::Arc;

use fmp::{Bound, Bounds, ExtraTerms, Pose, Solver};
use proptest::collection::vec;
use proptest::prelude::*;

use crate::common::{Evidence, Noise, tree};
use crate::other_view::OtherViews;

const SIZES: [[usize; 2]; 5] = [[9, 20], [17, 7], [4, 35], [6, 6], [1, 1]];

/// Sequences of terms made from few seeds, so that terms often stay the same or recur.
fn times(n_parts: usize) -> impl Strategy<Value = Vec<(OtherViews, Guess)>> {
    let scale = prop_oneof![Just(0.0_f32), Just(0.25), Just(1.0), Just(1000.0)];
    let gain = prop_oneof![Just(-1.0_f32), Just(0.0), Just(0.125)];
    let guess = prop_oneof![Just(Guess::None), Just(Guess::Last), Just(Guess::Elsewhere)];
    let once = (
        vec(0..7_u64, n_parts),
        gain,
        prop::bool::weighted(0.8),
        guess,
    );
    (scale, vec(once, 1..6)).prop_map(|(scale, times)| {
        let of_time = |(seeds, gain, known, guess)| {
            let terms = OtherViews {
                seeds,
                gain,
                scale,
                known,
            };
            (terms, guess)
        };
        times.into_iter().map(of_time).collect()
    })
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Guess {
    None,
    Last,
    /// A pose on a level without responses.
    Elsewhere,
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn the_incremental_solver_gives_the_results_of_the_full_one(
        seed in any::<u64>(),
        n_levels in 1..=SIZES.len(),
        offset in prop_oneof![Just(0.0_f32), Just(-40.0), Just(1e5)],
        given: bool,
        threads in 0..3_usize,
        times in times(6),
    ) {
        let mut noise = Noise(seed);
        let model = tree(&mut noise, 6);
        let mut evidence = Evidence::new(&mut noise, &model, &SIZES);
        evidence.values.iter_mut().for_each(|value| *value += offset);
        evidence.levels.truncate(n_levels);
        // Every level scores a little lower than the one before it, so that some levels can be skipped.
        for level in 0..SIZES.len() {
            let maps = evidence.layout.map_range(level, 0).start..evidence.layout.n_responses();
            evidence.values[maps].iter_mut().for_each(|value| *value -= 0.25);
        }
        let mut other = Evidence::new(&mut noise, &model, &SIZES);
        other.levels.truncate(n_levels);
        let solver = Solver::new(Arc::clone(&model));
        let solve = || [&evidence, &other].map(|evidence| check(&solver, evidence, given, &times));
        match threads {
            0 => solve(),
            _ => rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(solve),
        };
    }

    #[test]
    fn a_bound_allows_for_rounding(seed in any::<u64>(), offset in -1e4..1e4_f32, gain in -1.0..1.0_f32) {
        let mut noise = Noise(seed);
        let model = tree(&mut noise, 6);
        let mut evidence = Evidence::new(&mut noise, &model, &SIZES);
        evidence.values.iter_mut().for_each(|value| *value += offset);
        let solver = Solver::new(Arc::clone(&model));
        let (view, terms) = (evidence.view(), Everywhere(gain));
        let want = solver.best(&view, Some(&terms));
        let found = solver.incremental(&view).best(&terms, want.as_ref());
        prop_assert_eq!(bits(found.as_ref()), bits(want.as_ref()));
    }
}

proptest! {
    /// The best pose loses the maximum allowed amount on one part.
    #[test]
    fn a_bound_stays_correct_if_a_term_uses_all_of_its_slack(
        seed in any::<u64>(),
        offset in prop_oneof![Just(0.0_f32), -1e4..1e4_f32],
        part in 0..6_usize,
        term in -8.0..0.0_f32,
    ) {
        let mut noise = Noise(seed);
        let model = tree(&mut noise, 6);
        let mut evidence = Evidence::new(&mut noise, &model, &SIZES);
        evidence.values.iter_mut().for_each(|value| *value += offset);
        let solver = Solver::new(Arc::clone(&model));
        let (view, terms) = (evidence.view(), OnOnePart { part, term });
        let want = solver.best(&view, Some(&terms));
        let found = solver.incremental(&view).best(&terms, want.as_ref());
        prop_assert_eq!(bits(found.as_ref()), bits(want.as_ref()));
    }
}

/// The same term for all placements of one part.
struct OnOnePart {
    part: usize,
    term: f32,
}

impl ExtraTerms for OnOnePart {
    fn add_position(&self, part: usize, _: usize, _: usize, score: &mut [f32]) -> bool {
        if part == self.part {
            for it in score {
                *it += self.term;
            }
        }
        part == self.part
    }

    fn of_type(&self, _: usize, _: usize) -> f32 {
        0.0
    }

    fn max_gain(&self, _: usize) -> f32 {
        0.0
    }
}

proptest! {
    /// The bounds come from another process, and may be wrong.
    #[test]
    fn wrong_bounds_do_not_panic(
        seed in any::<u64>(),
        lies in vec((any::<f32>(), any::<f32>()), SIZES.len()),
        times in times(6),
    ) {
        let mut noise = Noise(seed);
        let model = tree(&mut noise, 6);
        let evidence = Evidence::new(&mut noise, &model, &SIZES);
        let lie = |&(best, size): &(f32, f32)| Bound { best, size };
        let bounds = Bounds::new(lies.iter().map(lie).collect());
        let solver = Solver::new(model);
        let view = evidence.view().with_bounds(&bounds);
        let mut incremental = solver.incremental(&view);
        let mut last: Option<Pose> = None;
        for (terms, _) in &times {
            last = incremental.best(terms, last.as_ref());
            if let Some(pose) = &last {
                // Panics if a part of the pose is not on its level.
                solver.score(&view, pose, Some(terms));
            }
        }
    }
}

/// The same term for all placements, equal to its bound.
struct Everywhere(f32);

impl ExtraTerms for Everywhere {
    fn add_position(&self, _: usize, _: usize, _: usize, score: &mut [f32]) -> bool {
        for it in score {
            *it += self.0;
        }
        true
    }

    fn of_type(&self, _: usize, _: usize) -> f32 {
        0.0
    }

    fn max_gain(&self, _: usize) -> f32 {
        self.0
    }
}

/// Solves the evidence with each set of terms in turn, with and without shortcuts.
fn check(solver: &Solver, evidence: &Evidence, given: bool, times: &[(OtherViews, Guess)]) {
    let view = evidence.view();
    let bounds = solver.bounds(&view);
    let view = if given {
        view.with_bounds(&bounds)
    } else {
        view
    };
    let mut incremental = solver.incremental(&view);
    let mut last: Option<Pose> = None;
    for (terms, guess) in times {
        let elsewhere = last.clone().map(|pose| Pose { level: 4, ..pose });
        let guess = match guess {
            Guess::None => None,
            Guess::Last => last.as_ref(),
            Guess::Elsewhere => elsewhere.as_ref().filter(|_| view.levels().len() < 5),
        };
        let found = incremental.best(terms, guess);
        let want = solver.best(&view, Some(terms));
        assert_eq!(bits(found.as_ref()), bits(want.as_ref()));
        last = found;
    }
}

/// Returns a pose and the bits of its score.
fn bits(pose: Option<&Pose>) -> Option<(u32, Pose)> {
    pose.map(|pose| (pose.score.to_bits(), pose.clone()))
}
