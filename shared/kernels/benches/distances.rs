//! Measures the time to find the best ends of a bone: for each of 125 positions of one joint, the best of 125 positions of another, on a
//! grid in space.
#![expect(clippy::print_stdout, reason = "a bench prints its results")]

use std::hint::black_box;
use std::time::Instant;

use kernels::{Isa, LengthSpring, ScoredPoints};

/// Number of positions along one side of the grid.
const SIDE: usize = 5;

fn main() {
    let grid = |from: f64| {
        let along = move |nth: usize| from + 0.02 * nth as f64;
        (0..SIDE.pow(3))
            .map(move |nth| [nth % SIDE, nth / SIDE % SIDE, nth / SIDE / SIDE].map(along))
            .collect::<Vec<[f64; 3]>>()
    };
    let (ends, from) = (grid(0.2), grid(0.0));
    let scores: Vec<f64> = (0..ends.len()).map(|i| ((i * 7) % 17) as f64).collect();
    let points = ScoredPoints::new(ends.iter().copied(), &scores);
    let spring = LengthSpring {
        mean: 0.3,
        sd: 0.03,
        weight: 1.0,
        cap: 8.0,
    };
    let n_pairs = (ends.len() * from.len()) as f64;
    let reference = fastest(|| points.best_reference(from.iter().copied(), &spring));
    println!("reference: {:.2} ns a pair", reference / n_pairs);
    for isa in Isa::available() {
        let time = fastest(|| points.best(isa, from.iter().copied(), &spring));
        let (each, ratio) = (time / n_pairs, reference / time);
        println!(
            "{}: {each:.2} ns per pair, {ratio:.1} times as fast",
            isa.name()
        );
    }
}

/// Shortest time of many runs, in nanoseconds.
fn fastest<T>(mut call: impl FnMut() -> T) -> f64 {
    let time = |_| {
        let begin = Instant::now();
        black_box(call());
        begin.elapsed().as_nanos() as f64
    };
    (0..200).map(time).fold(f64::INFINITY, f64::min)
}
