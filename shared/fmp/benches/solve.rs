//! Benchmark of finding the best pose of 26 parts with six types each, on all levels of images of 172 x 224 and 640 x 480 pixels in which
//! one person stands out. The pose is computed from the view alone, and as one step of the alternation between two views. The step is
//! measured with and without shortcuts, and with either all terms changed or one in five.
#![expect(clippy::unwrap_used, reason = "a bench fails by panicking")]
#![expect(clippy::print_stdout, reason = "a bench prints its results")]

use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

use fmp::{
    Edge, ExtraTerms, Filter, Layout, Model, ModelSpec, N_CHANNELS, PartSpec, Responses, Solver,
    Spring, Springs,
};
use kernels::Isa;

const N_PARTS: usize = 26;
const N_TYPES: usize = 6;

fn main() {
    let model = Arc::new(Model::new(spec()).unwrap());
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
    for [width, height] in [[172, 224], [640, 480]] {
        let layout = Layout::new(&model, width, height).unwrap();
        let values = planted(&layout);
        let levels: Vec<u16> = (0..layout.levels.len() as u16).collect();
        let evidence = Responses::new(&layout, &values, &levels);
        println!("{width} x {height}, {} levels", levels.len());
        for isa in Isa::available() {
            let solver = Solver::on(isa, Arc::clone(&model));
            let alone = fastest(|| drop(black_box(solver.best(&evidence, None))));
            println!("  {isa:?}: on its own, on one thread, {alone:6.2} ms");
        }
        let solver = Solver::new(Arc::clone(&model));
        steps(&solver, &evidence, "one thread ");
        pool.install(|| steps(&solver, &evidence, "two threads"));
    }
}

fn steps(solver: &Solver, evidence: &Responses<'_>, threads: &str) {
    let best = solver.best(evidence, None).unwrap();
    let bounds = solver.bounds(evidence);
    let evidence = evidence.with_bounds(&bounds);
    let line = |part: usize| f32::from(best.parts[part].y) + 0.4;
    let terms = |round: usize, unchanged: bool| Lines {
        layout: evidence.layout(),
        rows: (0..N_PARTS).map(line).collect(),
        round: (0..N_PARTS)
            .map(|part| if unchanged && part % 5 != 0 { 0 } else { round })
            .collect(),
    };
    let mut round = 0;
    let full = fastest(|| {
        round += 1;
        drop(black_box(
            solver.best(&evidence, Some(&terms(round, false))),
        ));
    });
    let mut incremental = solver.incremental(&evidence);
    let mut least = [full; 2];
    for (least, unchanged) in least.iter_mut().zip([false, true]) {
        *least = fastest(|| {
            round += 1;
            let terms = terms(round, unchanged);
            drop(black_box(incremental.best(&terms, Some(&best))));
        });
    }
    let [pruned, kept] = least;
    println!(
        "  {threads}: one step takes {full:6.2} ms; pruned to {} levels, it takes {pruned:6.2} ms; if four of five terms are also \
         unchanged, it takes {kept:6.2} ms",
        incremental.n_levels()
    );
}

/// Shortest time of many runs, in milliseconds.
fn fastest(mut call: impl FnMut()) -> f64 {
    let time = |_| {
        let begin = Instant::now();
        call();
        begin.elapsed().as_secs_f64() * 1e3
    };
    (0..15).map(time).fold(f64::INFINITY, f64::min)
}

/// Terms that add a horizontal line for every part; the score falls with the distance from the line.
struct Lines<'a> {
    layout: &'a Layout,
    rows: Vec<f32>,
    round: Vec<usize>,
}

impl ExtraTerms for Lines<'_> {
    fn add_position(&self, part: usize, level: usize, first: usize, score: &mut [f32]) -> bool {
        let cols = self.layout.levels[level].cols;
        let line = self.rows[part] + (self.round[part] % 3) as f32 * 0.25;
        for (cell, it) in score.iter_mut().enumerate() {
            let off = ((first + cell) / cols) as f32 - line;
            *it -= 0.002 * off * off;
        }
        true
    }

    fn of_type(&self, _: usize, mixture: usize) -> f32 {
        0.002 * mixture as f32
    }

    fn max_gain(&self, _: usize) -> f32 {
        0.002 * (N_TYPES - 1) as f32
    }

    fn key(&self, part: usize) -> Option<u64> {
        Some(self.round[part] as u64 % 3)
    }
}

/// Returns the specification of a tree of limbs: the parent of each part is the part before it or the part five before it.
fn spec() -> ModelSpec {
    let part = |part: usize| {
        let spring = |k: usize| Spring {
            w: [0.012 + 0.004 * k as f64, 0.002, 0.02, -0.003],
            anchor: [k as i32 - 3, 1],
        };
        let edge = (part > 0).then(|| Edge {
            parent: part.saturating_sub(if part.is_multiple_of(5) { 5 } else { 1 }),
            bias: vec![vec![0.0; N_TYPES]; N_TYPES],
            springs: Springs::PerChildType((0..N_TYPES).map(spring).collect()),
        });
        PartSpec {
            name: format!("part {part}"),
            filter_of_type: (part * N_TYPES..(part + 1) * N_TYPES).collect(),
            edge,
        }
    };
    let filter = Filter {
        rows: 5,
        cols: 5,
        weights: vec![0.0; 25 * N_CHANNELS],
    };
    ModelSpec {
        name: "limbs".to_owned(),
        parts: (0..N_PARTS).map(part).collect(),
        filters: vec![filter; N_PARTS * N_TYPES],
        root_bias: 0.0,
        interval: 10,
        cell_px: 4,
        threshold: 0.0,
        mirror: None,
    }
}

/// Returns noise with the spread of trained responses, except at one position of one level where all parts respond.
fn planted(layout: &Layout) -> Vec<f32> {
    let mut noise = 1_u64;
    let mut next = || {
        noise = noise.wrapping_mul(6364136223846793005).wrapping_add(1);
        (noise >> 40) as f32 / (1 << 24) as f32 * 0.3
    };
    let mut values: Vec<f32> = (0..layout.n_responses()).map(|_| next()).collect();
    let level = layout.levels.len() / 3;
    let it = &layout.levels[level];
    for filter in 0..N_PARTS * N_TYPES {
        let map = &mut values[layout.map_range(level, filter)];
        map[it.rows / 2 * it.cols + it.cols / 2] += 0.3;
    }
    values
}
