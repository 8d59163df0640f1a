//! Measures the time of one max-sum message between a part and its parent with six types each, for typical distances of trained springs.
//! The grids are the largest level of an image of 172 x 224 pixels, the level one octave below it, and the same two levels for 640 x 480
//! pixels.
#![expect(clippy::print_stdout, reason = "a bench prints its results")]

use std::hint::black_box;
use std::time::Instant;

use kernels::{
    ChildScores, Grid, Isa, MessageRule, MessageWorkspace, OwnScores, Peak, ScoreBuffer,
    ScoreRange, Spring, transform_f64,
};

const N_TYPES: usize = 6;
const GRIDS: [[usize; 2]; 4] = [[58, 45], [30, 24], [122, 162], [62, 82]];

fn main() {
    let rule = rule();
    for isa in Isa::available() {
        let peak = (0..20).map(|_| rate(|| Peak::MaxPlus.run(isa, 2_000) as usize));
        let peak = peak.fold(0.0, f64::max);
        println!("{isa:?}: {peak:.1} candidates/ns in registers");
        for [rows, cols] in GRIDS {
            measure(isa, &rule, Grid { rows, cols }, peak);
        }
    }
}

/// Number of candidates evaluated per nanosecond.
fn rate(call: impl FnOnce() -> usize) -> f64 {
    let begin = Instant::now();
    let n = black_box(call());
    n as f64 / begin.elapsed().as_nanos().max(1) as f64
}

/// Shortest time of many runs, in microseconds.
fn fastest(n: usize, mut call: impl FnMut()) -> f64 {
    let time = |_| {
        let begin = Instant::now();
        call();
        begin.elapsed().as_secs_f64() * 1e6
    };
    (0..n).map(time).fold(f64::INFINITY, f64::min)
}

fn springs() -> Vec<(usize, Spring)> {
    let spring = |k: usize| Spring {
        w: [0.012 + 0.004 * k as f64, 0.002 * k as f64, 0.02, -0.003],
        anchor: [k as i32 - 3, 2],
    };
    (0..N_TYPES).map(|k| (k, spring(k))).collect()
}

fn bias(l: usize, k: usize) -> f32 {
    ((l * 5 + k * 3) % 7) as f32 * -0.02
}

fn rule() -> MessageRule {
    let choices = (0..N_TYPES).map(|l| (0..N_TYPES).map(|k| (k, bias(l, k))).collect());
    MessageRule::new(N_TYPES, springs(), choices.collect())
}

/// Synthetic responses with the same spread as the responses of trained filters.
fn maps(grid: Grid) -> Vec<Vec<f32>> {
    let mut noise = 1_u64;
    let mut next = || {
        noise = noise.wrapping_mul(6364136223846793005).wrapping_add(1);
        (noise >> 40) as f32 / (1 << 24) as f32 * 0.3
    };
    let map = |_| (0..grid.rows * grid.cols).map(|_| next()).collect();
    (0..N_TYPES).map(map).collect()
}

fn measure(isa: Isa, rule: &MessageRule, grid: Grid, peak: f64) {
    let maps = maps(grid);
    let mut child = ScoreBuffer::default();
    child.resize(grid.len(N_TYPES) + grid.margin());
    child.scores_mut().fill(f32::NEG_INFINITY);
    let mut ranges = [ScoreRange::NONE; N_TYPES];
    let mut own = |ranges: &mut [ScoreRange]| {
        let planes = child.scores_mut().chunks_exact_mut(grid.len(1));
        for ((map, plane), range) in maps.iter().zip(planes).zip(ranges) {
            let own = OwnScores {
                map,
                term: None,
                constant: None,
            };
            *range = own.write(isa, grid, plane);
        }
    };
    let layout = fastest(200, || own(&mut ranges));
    let mut parent = ScoreBuffer::default();
    parent.resize(grid.len(N_TYPES));
    parent.scores_mut().fill(0.0);
    let mut of_parent = ranges;
    let mut workspace = MessageWorkspace::default();
    let child = ChildScores {
        grid,
        planes: child.scores(),
        ranges: &ranges,
    };
    let micros = fastest(400, || {
        let parent = (parent.scores_mut(), &mut of_parent[..]);
        rule.add_message(isa, child, parent, &mut workspace);
    });
    let slow = fastest(5, || reference(&maps, grid));
    let biases = N_TYPES * N_TYPES * grid.rows * grid.cols;
    let n = workspace.n_candidates(rule, grid) + biases;
    let speed = n as f64 / micros / 1e3;
    println!(
        "  {:3} x {:3}: {micros:7.1} us, plus {layout:5.1} us for the layout of the child; {:5.0} times as fast as the reference; \
         {speed:5.1} candidates/ns = {:3.0} % of registers",
        grid.rows,
        grid.cols,
        slow / micros,
        100.0 * speed / peak
    );
}

/// The same transforms in double precision, computed along lower envelopes.
fn reference(maps: &[Vec<f32>], grid: Grid) {
    let springs = springs();
    let transformed = maps.iter().zip(&springs).map(|(map, (_, spring))| {
        let plane: Vec<f64> = map.iter().copied().map(f64::from).collect();
        transform_f64(&plane, [grid.rows, grid.cols], spring).score
    });
    let transformed: Vec<_> = transformed.collect();
    for l in 0..N_TYPES {
        let best = |cell: usize| {
            let scores = transformed.iter().enumerate();
            let scores = scores.map(|(k, it)| it[cell] + f64::from(bias(l, k)));
            scores.fold(f64::NEG_INFINITY, f64::max)
        };
        let message: Vec<_> = (0..grid.rows * grid.cols).map(best).collect();
        black_box(message);
    }
}
