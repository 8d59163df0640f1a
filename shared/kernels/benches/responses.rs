//! Measures the time to compute the responses of 156 filters of 4x4, 5x5 and 6x6 cells on all levels of images of 172 x 224 and 640 x 480
//! pixels, on one thread. Prints the processor time in milliseconds, the number of operations per second (as counted in the definition),
//! and its share of the measured multiply-add peak. Also prints how much longer plain sums take.
//!
//! `cargo bench -p kernels --bench responses [repetitions]`
#![expect(clippy::print_stdout, reason = "a bench prints its results")]

use std::hint::black_box;

use kernels::{CorrelateWorkspace, FeatureMap, FilterBank, Isa, Level, N_CHANNELS, Peak, Template};
use rustix::time::{ClockId, clock_gettime};

const N_FILTERS: usize = 156;

fn main() {
    let repetitions = std::env::args().find_map(|arg| arg.parse().ok()).unwrap_or(20);
    for isa in Isa::available() {
        // Without fused multiply-add instructions, this takes minutes.
        if isa == Isa::available()[0] && Isa::available().len() > 1 {
            continue;
        }
        for (width, height) in [(172, 224), (640, 480)] {
            for side in [4, 5, 6] {
                measure(isa, [width, height], side, repetitions);
            }
        }
    }
}

/// Processor time of this thread, in seconds.
fn cpu_time() -> f64 {
    let now = clock_gettime(ClockId::ThreadCPUTime);
    now.tv_sec as f64 + now.tv_nsec as f64 * 1e-9
}

/// Shortest processor time of many calls, in seconds.
fn least(repetitions: usize, mut call: impl FnMut()) -> f64 {
    let once = |_| {
        let begin = cpu_time();
        call();
        cpu_time() - begin
    };
    (0..repetitions).map(once).fold(f64::INFINITY, f64::min)
}

/// Sizes `[rows, cols]` of the response maps for ten levels per octave and cells of 4 pixels.
fn sizes([width, height]: [usize; 2], side: usize) -> Vec<[usize; 2]> {
    let shorter = width.min(height) as f64 / 20.0;
    let n = 1 + (10.0 * shorter.log2()).floor() as i32;
    let size = |level: i32| {
        let scale = 2_f64.powf(-f64::from(level) / 10.0) / 4.0;
        [height, width].map(|value| (value as f64 * scale).round() as usize - 2 + side - 1)
    };
    (0..n).map(size).collect()
}

/// Pseudo-random values in 0..1.
fn noise(n: usize) -> Vec<f32> {
    let hash = |value: usize| (value as u32).wrapping_mul(2654435761).rotate_left(13);
    let value = |i| hash(i).wrapping_mul(2246822519) as f32 / u32::MAX as f32;
    (0..n).map(value).collect()
}

fn measure(isa: Isa, image: [usize; 2], side: usize, repetitions: usize) {
    let n_taps = side * side * N_CHANNELS;
    let weights: Vec<f64> = noise(N_FILTERS * n_taps)
        .into_iter()
        .map(|value| f64::from(value) * 0.1 - 0.05)
        .collect();
    let templates: Vec<_> = weights
        .chunks_exact(n_taps)
        .map(|weights| Template {
            rows: side,
            cols: side,
            weights,
        })
        .collect();
    let bank = FilterBank::new(isa, &templates);
    let sizes = sizes(image, side);
    let maps: Vec<_> = sizes
        .iter()
        .map(|size| noise((size[0] + side - 1) * (size[1] + side - 1) * N_CHANNELS))
        .collect();
    let levels = sizes.iter().zip(&maps).map(|(size, cells)| Level {
        map: FeatureMap {
            rows: size[0] + side - 1,
            cols: size[1] + side - 1,
            cells,
        },
        size: *size,
    });
    let area: usize = sizes.iter().map(|[rows, cols]| rows * cols).sum();
    let mut out = vec![0.0; area * N_FILTERS];
    let mut workspace = CorrelateWorkspace::default();
    let mut seconds = |bank: &FilterBank, repetitions| {
        least(repetitions, || {
            let panels = 0..bank.n_panels();
            bank.correlate(panels, levels.clone(), &mut out, &mut workspace);
            black_box(&mut out);
        })
    };
    let plain = seconds(
        &FilterBank::direct(isa, &templates),
        repetitions.div_ceil(4),
    );
    let seconds = seconds(&bank, repetitions);
    let operations = 2.0 * Peak::MultiplyAdd.run(isa, 1) as f64 * 20_000.0;
    let peak = operations
        / least(repetitions.min(10), || {
            black_box(Peak::MultiplyAdd.run(isa, 20_000));
        });
    let speed = (2 * area * n_taps * N_FILTERS) as f64 / seconds;
    println!(
        "{isa:?} {}x{}, {side}x{side}: {:8.3} ms, {:7.1} GFLOP/s of the definition, {:5.1} % of {:.1}, plain sums {:.1} x",
        image[0],
        image[1],
        seconds * 1e3,
        speed / 1e9,
        100.0 * speed / peak,
        peak / 1e9,
        plain / seconds
    );
}
