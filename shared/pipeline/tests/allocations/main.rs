//! Counts the allocations of the steps of `fuse` and `triangulate` for a frame, once their buffers exist.
//!
//! The goal of no allocations is not reached. But no allocation is as large as a response map: a frame with four times as many cells
//! allocates no more than a small one. The remaining allocations are the results (the poses of every solution, the joints) and short lists
//! per frame with one entry per view, part, candidate or level. In `triangulate`, each list occurs once for each of the eight assumptions
//! about which of four views see the person from behind. The limits are the measured counts, rounded up. They should be lowered when a list
//! is removed. They apply to test builds, with their additional checks.
//!
//! This test runs without the test harness, because the harness's threads allocate memory too. Everything runs on one thread.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod scene;

use std::alloc::System;
use std::sync::Arc;

use pipeline::{Combine, FuseStep, Others, PairTables, SkeletonSettings, SkeletonStep};
use stats_alloc::{INSTRUMENTED_SYSTEM, Region, StatsAlloc};

use scene::Scene;

#[global_allocator]
static ALLOCATOR: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

/// Number of views of the rig; they form six pairs.
const N_VIEWS: usize = 4;

/// Limit of `fuse`, for each single-view solution.
const MOST_OF_SOLUTION: Count = Count {
    allocations: 13,
    bytes: 5_500,
};

/// Limit of `triangulate`.
const MOST_OF_SKELETON: Count = Count {
    allocations: 580,
    bytes: 250_000,
};

/// Number and total size of the allocations and reallocations of a call.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Count {
    allocations: usize,
    bytes: usize,
}

impl Count {
    fn is_within(self, most: Self, what: &str) {
        assert!(
            self.allocations <= most.allocations && self.bytes <= most.bytes,
            "{what}: {self:?}, at most {most:?}"
        );
    }
}

fn count<T>(call: impl FnOnce() -> T) -> (T, Count) {
    let region = Region::new(ALLOCATOR);
    let answer = call();
    let change = region.change();
    let count = Count {
        allocations: change.allocations + change.reallocations,
        bytes: change.bytes_allocated,
    };
    (answer, count)
}

/// Counts the allocations for a frame of pairs: in `fuse` per single-view solution, and in `triangulate`.
fn of_frame(rows: usize, combine: Combine) -> [Count; 2] {
    let scene = Scene::new(rows, N_VIEWS);
    let settings = multiview::Settings::default();
    let tables = PairTables::default();
    let fuse = FuseStep::new(
        Arc::clone(&scene.model),
        settings,
        scene.plans.clone(),
        tables,
    );
    let settings = SkeletonSettings {
        combine,
        ..SkeletonSettings::default()
    };
    let mut skeleton = SkeletonStep::new(scene.plans.clone(), None, settings);
    let evidence = scene.evidence();
    let mut last = None;
    // The first frames create the buffers.
    for _ in 0..3 {
        let start = fuse.start(&scene.answers, &Others::default());
        let (pairs, of_pairs) = count(|| {
            let pairs = pipeline::all_pairs(N_VIEWS).into_iter();
            let solved = pairs.map(|views| {
                let evidence = views.map(|view| &evidence[view]);
                fuse.pair(views, &scene.answers, evidence, &start).unwrap()
            });
            solved.collect::<Vec<_>>()
        });
        let hypotheses = pairs.iter().flat_map(|pair| &pair.hypotheses);
        let n_solutions: usize = hypotheses.map(|hypothesis| hypothesis.iterations.len()).sum();
        let (_, of_skeleton) = count(|| skeleton.run(&scene.answers, &pairs));
        last = Some((of_pairs, n_solutions, of_skeleton));
    }
    let (of_pairs, n_solutions, of_skeleton) = last.unwrap();
    let of_solution = Count {
        allocations: of_pairs.allocations.div_ceil(n_solutions),
        bytes: of_pairs.bytes.div_ceil(n_solutions),
    };
    [of_solution, of_skeleton]
}

fn main() {
    let (kept, counted) = count(|| std::hint::black_box(vec![1_u8; 100]));
    let expected = Count {
        allocations: 1,
        bytes: kept.len(),
    };
    assert_eq!(counted, expected, "the counter counts");
    for combine in [Combine::Mean, Combine::Consensus] {
        for rows in [24, 48] {
            let [of_solution, of_skeleton] = of_frame(rows, combine);
            let what = format!("{combine:?}, {rows} rows");
            of_solution.is_within(MOST_OF_SOLUTION, &what);
            of_skeleton.is_within(MOST_OF_SKELETON, &what);
        }
    }
}
