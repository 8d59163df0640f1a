//! Checks that a search of a part of the pyramid gives the same results there as a search of the whole pyramid.

use std::ops::Range;
use std::sync::Arc;

use fmp::{
    Extractor, Filter, Layout, Model, ModelSpec, N_CHANNELS, PartSpec, Placement, Region,
    Responses, Scope, ScopeError, Solver,
};
use kernels::{FilterBank, Isa, Rgb8View, Template};
use proptest::prelude::*;

use crate::common::{Evidence, Noise, tree};
use crate::other_view::{OtherView, OtherViews};

/// Returns a model with three filters of several sizes on one part.
fn model(noise: &mut Noise, cell_px: usize, interval: usize) -> Arc<Model> {
    let mut filter = |rows: usize, cols: usize| Filter {
        rows,
        cols,
        weights: (0..rows * cols * N_CHANNELS).map(|_| noise.score()).collect(),
    };
    let spec = ModelSpec {
        name: "three filters".to_owned(),
        filters: vec![filter(4, 5), filter(3, 4), filter(2, 2)],
        parts: vec![PartSpec {
            name: "root".to_owned(),
            filter_of_type: vec![0, 1, 2],
            edge: None,
        }],
        root_bias: 0.0,
        interval,
        cell_px,
        threshold: 0.0,
        mirror: None,
    };
    Arc::new(Model::new(spec).unwrap())
}

/// Returns a range of at least one of `n` items, from two fractions.
fn cut(n: usize, shares: [f64; 2]) -> Range<usize> {
    let at = shares.map(|share| (share * n as f64) as usize);
    at[0].min(at[1])..at[0].max(at[1]) + 1
}

type Shares = [[f64; 2]; 3];

fn shares() -> impl Strategy<Value = Shares> {
    let share = || prop_oneof![8 => 0.0..1.0_f64, 1 => Just(0.0), 1 => Just(0.9999)];
    let two = move || [share(), share()];
    [two(), two(), two()]
}

/// Returns a scope from fractions of the levels, the columns and the rows.
fn scope(layout: &Layout, [levels, x, y]: Shares) -> Scope {
    let levels = cut(layout.levels.len(), levels);
    let [x, y] = [(x, 0), (y, 1)].map(|(shares, axis)| {
        let range = cut(layout.image_size[axis], shares);
        [range.start as u32, range.end as u32]
    });
    Scope::new(
        layout,
        levels.start as u16..levels.end as u16,
        Region { x, y },
    )
    .unwrap()
}

/// Returns the responses of a scope, and the responses of the whole image on the same cells.
fn both(
    extractor: &Extractor,
    (image, layout): (Rgb8View<'_>, &Layout),
    scope: &Scope,
) -> [Vec<f32>; 2] {
    let mut whole = vec![f32::NAN; layout.n_responses()];
    extractor.responses(image, layout, &mut whole);
    let mut got = vec![f32::NAN; layout.n_values(scope)];
    extractor.responses_in(image, layout, scope, &mut got);
    let mut want = Vec::new();
    for level in scope.levels() {
        let window = layout.window(scope, usize::from(level));
        for filter in 0..layout.n_filters {
            let map = &whole[layout.map_range(usize::from(level), filter)];
            let cols = layout.levels[usize::from(level)].cols;
            for row in map.chunks_exact(cols).skip(window.top).take(window.rows) {
                want.extend_from_slice(&row[window.left..][..window.cols]);
            }
        }
    }
    [got, want]
}

/// Returns the maximum difference between the response of the scope and that of the whole image, for every response.
///
/// It is the sum of the bounds of [`FilterBank::correlate`] for the two, with the largest possible feature values. An orientation feature
/// is half of the sum of four clipped entries, a texture feature is a weighted sum of eighteen, and the padding feature is 1.
fn bounds(model: &Model, layout: &Layout, scope: &Scope) -> Vec<f64> {
    let filters = &model.spec().filters;
    let templates: Vec<_> = filters
        .iter()
        .map(|filter| Template {
            rows: filter.rows,
            cols: filter.cols,
            weights: &filter.weights,
        })
        .collect();
    let bank = FilterBank::new(Isa::best(), &templates);
    let largest = |channel: usize| match channel {
        0..27 => 0.4,
        27..31 => 0.2357 * 18.0 * 0.2,
        _ => 1.0,
    };
    let mut bounds = Vec::new();
    for level in scope.levels().map(usize::from) {
        let (window, it) = (layout.window(scope, level), layout.levels[level]);
        for (panel, filter) in filters.iter().enumerate() {
            let weights = filter.weights.iter().enumerate();
            let size: f64 = weights.map(|(at, it)| it.abs() * largest(at % N_CHANNELS)).sum();
            let factors = [[window.rows, window.cols], [it.rows, it.cols]]
                .map(|size| bank.error_factor(panel, size));
            let bound = (factors[0] + factors[1]) * size;
            bounds.extend(std::iter::repeat_n(bound, window.rows * window.cols));
        }
    }
    bounds
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Plain sums of equal features are bit-identical, so equal sums show that the features are equal.
    #[test]
    fn features_in_a_scope_equal_those_of_the_whole_image(
        size in [90..230_usize, 90..200_usize],
        interval in 1..5_usize,
        cell in 0..3_usize,
        shares in shares(),
        seed in any::<u64>(),
    ) {
        let mut noise = Noise(seed);
        let model = model(&mut noise, [2, 4, 8][cell], interval);
        let layout = Layout::new(&model, size[0], size[1]).unwrap();
        let pixels: Vec<u8> = (0..3 * size[0] * size[1]).map(|_| noise.next() as u8).collect();
        let image = Rgb8View::new(size[0], size[1], &pixels).unwrap();
        let scope = scope(&layout, shares);
        let [got, want] = both(&Extractor::direct(Arc::clone(&model)), (image, &layout), &scope);
        prop_assert!(got == want, "{:?}", scope);
        // Tiles begin at other cells, so they round differently.
        let [got, want] = both(&Extractor::new(Arc::clone(&model)), (image, &layout), &scope);
        let bounds = bounds(&model, &layout, &scope);
        for ((got, want), bound) in got.iter().zip(&want).zip(bounds) {
            prop_assert!(f64::from(got - want).abs() < bound, "{} {} {}", got, want, bound);
        }
    }

    #[test]
    fn a_scope_over_whole_levels_equals_the_full_search_bit_for_bit(
        size in [90..160_usize, 90..160_usize],
        cell_px in 2..6_usize,
        levels in [0.0..1.0_f64, 0.0..1.0],
        seed in any::<u64>(),
    ) {
        let mut noise = Noise(seed);
        let model = model(&mut noise, cell_px, 3);
        let layout = Layout::new(&model, size[0], size[1]).unwrap();
        let pixels: Vec<u8> = (0..3 * size[0] * size[1]).map(|_| noise.next() as u8).collect();
        let image = Rgb8View::new(size[0], size[1], &pixels).unwrap();
        let extractor = Extractor::new(Arc::clone(&model));
        let all = Scope::whole(&layout);
        for levels in [cut(layout.levels.len(), levels), 0..layout.levels.len()] {
            let levels = levels.start as u16..levels.end as u16;
            let scope = Scope::new(&layout, levels, all.region()).unwrap();
            let [got, want] = both(&extractor, (image, &layout), &scope);
            prop_assert!(got == want, "{:?}", scope);
        }
    }

    #[test]
    fn a_window_contains_every_cell_whose_centre_lies_in_the_region(shares in shares(), seed: u64) {
        let model = model(&mut Noise(seed), 4, 3);
        let layout = Layout::new(&model, 150, 170).unwrap();
        let scope = scope(&layout, shares);
        let Region { x: [x1, x2], y: [y1, y2] } = scope.region();
        for level in 0..layout.levels.len() {
            let window = layout.window(&scope, level);
            let it = layout.levels[level];
            prop_assert!(window.top + window.rows <= it.rows && window.left + window.cols <= it.cols);
            for (y, x) in (0..it.rows).flat_map(|y| (0..it.cols).map(move |x| (y, x))) {
                let at = Placement { x: x as u16, y: y as u16, mixture: 0 };
                let [px, py] = layout.centre(level, model.max_filter(), at);
                let inside = |at: f64, begin: u32, end: u32| {
                    (f64::from(begin)..=f64::from(end - 1)).contains(&at)
                };
                let is_inside = inside(px, x1, x2) && inside(py, y1, y2);
                prop_assert!(!is_inside || window.contains(at), "{} {:?}", level, at);
            }
        }
    }

    /// A scope gives the same result as impossible scores on all cells outside it.
    #[test]
    fn the_solver_finds_the_best_pose_among_the_cells_that_have_values(
        seed in 0..1_u64 << 32,
        shares in shares(),
        n_parts in 1..6_usize,
    ) {
        let mut noise = Noise(seed);
        let model = tree(&mut noise, n_parts);
        let mut evidence = Evidence::new(&mut noise, &model, &[[25, 26], [17, 18], [12, 9], [3, 5]]);
        let scope = scope(&evidence.layout, shares);
        let mut values = Vec::new();
        for level in 0..evidence.layout.levels.len() {
            let window = evidence.layout.window(&scope, level);
            let cols = evidence.layout.levels[level].cols;
            let offered = scope.levels().contains(&(level as u16));
            for filter in 0..model.n_filters() {
                for (cell, at) in evidence.layout.map_range(level, filter).enumerate() {
                    let at = (Placement { x: (cell % cols) as u16, y: (cell / cols) as u16, mixture: 0 }, at);
                    if offered && window.contains(at.0) {
                        values.push(evidence.values[at.1]);
                    } else {
                        evidence.values[at.1] = f32::NEG_INFINITY;
                    }
                }
            }
        }
        prop_assert_eq!(values.len(), evidence.layout.n_values(&scope));
        let levels: Vec<u16> = scope.levels().collect();
        let part = Responses::within(&evidence.layout, &values, &levels, scope);
        let solver = Solver::new(Arc::clone(&model));
        let other = OtherView(seed);
        prop_assert_eq!(solver.distinct(&part, 4, 0.5), solver.distinct(&evidence.view(), 4, 0.5));
        for extra in [None, Some(&other as &dyn fmp::ExtraTerms)] {
            let want = solver.best(&evidence.view(), extra);
            let got = solver.best(&part, extra);
            prop_assert_eq!(&got, &want);
            if let Some(pose) = got {
                prop_assert!(part.covers(&pose));
                prop_assert_eq!(solver.score(&part, &pose, extra), pose.score);
            }
        }
        let mut incremental = solver.incremental(&part);
        let mut guess = solver.best(&evidence.view(), None);
        for round in 0..3 {
            let seeds = (0..n_parts as u64).map(|i| seed ^ (i * round / 2)).collect();
            let others = OtherViews { seeds, gain: 0.5, scale: 0.3, known: true };
            let want = solver.best(&evidence.view(), Some(&others));
            // A guess may be at cells that have no value now.
            prop_assert_eq!(&incremental.best(&others, guess.as_ref()), &want);
            guess = guess.map(|mut guess| {
                guess.parts[0].x = 0;
                guess
            });
        }
    }
}

#[test]
fn refuses_scopes_outside_of_the_layout() {
    let model = model(&mut Noise(1), 4, 3);
    let layout = Layout::new(&model, 100, 120).unwrap();
    let region = Region {
        x: [0, 100],
        y: [20, 60],
    };
    let levels = Scope::new(&layout, 3..3, region);
    assert!(matches!(levels, Err(ScopeError::Levels { .. })));
    let n_levels = layout.levels.len() as u16;
    let levels = Scope::new(&layout, 3..n_levels + 1, region);
    assert!(matches!(levels, Err(ScopeError::Levels { .. })));
    for x in [[0, 101], [40, 40]] {
        let got = Scope::new(&layout, 0..1, Region { x, ..region }).unwrap_err();
        let [begin, end] = x;
        assert_eq!(
            got,
            ScopeError::Region {
                begin,
                end,
                side: 100
            }
        );
    }
}
