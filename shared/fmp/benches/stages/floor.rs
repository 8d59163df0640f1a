//! Lower limits of the time of every stage: the time of its arithmetic alone, at the peak rate of the machine.

use fmp::{LevelLayout, N_CHANNELS, Springs};
use kernels::{Isa, Peak};
use serde::Serialize;

use crate::clock::Clock;
use crate::readable::Ranges;
use crate::stages::StageTimes;
use crate::workload::Workload;

/// The lower limits of all stages.
pub(crate) struct Floors {
    pub(crate) ms: StageTimes,
    /// The peak rates from which the limits were computed.
    pub(crate) peaks: Peaks,
}

/// Number of single-precision operations that one thread performs per nanosecond.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Peaks {
    pub(crate) isa: &'static str,
    pub(crate) multiply_add: f64,
    pub(crate) max_plus: f64,
}

impl Floors {
    /// Counts the operations of the stages, and measures the peak rates.
    pub(crate) fn new(workload: &Workload, ranges: &Ranges, isa: Isa, quick: bool) -> Self {
        let n = if quick { 300 } else { 3000 };
        let [multiply_add, max_plus] =
            [Peak::MultiplyAdd, Peak::MaxPlus].map(|peak| per_ms(quick, || peak.run(isa, n)));
        Self {
            peaks: Peaks {
                isa: isa.name(),
                multiply_add: multiply_add * 1e-6,
                max_plus: max_plus * 1e-6,
            },
            ms: StageTimes {
                shrink: shrinking(workload) / multiply_add,
                hog: describing(workload) / multiply_add,
                filters: products(workload, &[8, 10]) / multiply_add,
                messages: candidates(workload, ranges) / max_plus,
            },
        }
    }
}

/// Returns the number of single-precision operations that one thread performs per millisecond.
fn per_ms(quick: bool, run: impl Fn() -> u64) -> f64 {
    let clock = Clock::new(1, quick);
    let mut n = 0;
    let times = clock.measure(|| n = run());
    n as f64 / times.min
}

fn pixels(it: &LevelLayout) -> f64 {
    (it.image_size[0] * it.image_size[1]) as f64
}

/// Returns the number of multiplications and additions of resizing and halving; one double-precision operation counts as two.
fn shrinking(workload: &Workload) -> f64 {
    let [width, height] = workload.layout.image_size.map(|image_size| image_size as f64);
    let level = |(at, it): (usize, &LevelLayout)| {
        let [w, h] = it.image_size.map(|image_size| image_size as f64);
        let taps = if at < workload.model.spec().interval {
            let overlapped = |from: f64, to: f64| if from > to { from / to + 1.0 } else { 1.0 };
            h * width * overlapped(height, h) + h * w * overlapped(width, w)
        } else {
            (2.0 + 1.0) * 5.0 * w * h
        };
        3.0 * taps * 2.0 * 2.0
    };
    workload.layout.levels.iter().enumerate().map(level).sum()
}

/// Returns the number of operations of the features. Each pixel needs the gradient in three planes, nine scalar products with comparisons
/// in double precision, and four weighted contributions to cells. Each cell needs 27 values under four norms.
fn describing(workload: &Workload) -> f64 {
    let per_pixel = 2.0 * (3.0 * 9.0 + 9.0 * 7.0 + 10.0) + 4.0 * 2.0;
    let cell = (workload.model.spec().cell_px as f64).powi(2);
    let per_cell = 27.0 * 4.0 * 3.0;
    let levels = workload.layout.levels.iter();
    levels.map(|level| pixels(level) * (per_pixel + per_cell / cell)).sum()
}

/// Returns the number of multiply-adds of the filters in the cheapest known form: either directly, or by tiles that are transformed and
/// multiplied point by point (the transforms are not counted).
///
/// * `tiles`: sides of the available tiles, in cells.
fn products(workload: &Workload, tiles: &[usize]) -> f64 {
    let per_cell = |side: usize| {
        let tiled = tiles.iter().copied().filter(|tile| *tile > side);
        let tiled = tiled.map(|tile| (tile as f64 / (tile + 1 - side) as f64).powi(2));
        tiled.fold((side * side) as f64, f64::min) * N_CHANNELS as f64
    };
    let filters = workload.model.spec().filters.iter();
    let filters: f64 = filters.map(|filter| per_cell(filter.rows.max(filter.cols))).sum();
    let levels = workload.layout.levels.iter();
    levels.map(|level| (level.rows * level.cols) as f64 * filters).sum()
}

/// Returns the number of candidates that must be compared. They are counted in both passes of every transform, within the window that
/// contains every possible best candidate, and in the choice among the child's types.
fn candidates(workload: &Workload, ranges: &Ranges) -> f64 {
    let window = |range: f64, quadratic: f64, side: usize| {
        (2.0 * (range / quadratic).sqrt() + 1.0).min(side as f64)
    };
    let mut total = 0.0;
    for it in &workload.layout.levels {
        let cells = (it.rows * it.cols) as f64;
        for (part, ranges) in workload.model.spec().parts.iter().zip(ranges) {
            let Some(edge) = &part.edge else { continue };
            let Springs::PerChildType(springs) = &edge.springs else {
                continue;
            };
            for (spring, range) in springs.iter().zip(ranges) {
                total += cells * window(*range, spring.w[0], it.cols);
                total += cells * window(*range, spring.w[2], it.rows);
            }
            total += cells * (edge.bias.len() * springs.len()) as f64;
        }
    }
    total
}
