//! Benchmark of one picture of one camera, 640x480, four samples per pixel, on one thread: a person walks in front of the cameras of
//! HumanEva. The benchmark also measures what is created only once: the person and the camera's background.
#![expect(clippy::unwrap_used, reason = "a bench fails by panicking")]
#![expect(clippy::print_stdout, reason = "a bench prints its measurements")]

use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

use scene::{Scene, Settings, View};

const ROUNDS: u64 = 40;

fn main() {
    let settings = Settings::default();
    let begin = Instant::now();
    let scene = Arc::new(Scene::new(black_box(&settings)).unwrap());
    let person = begin.elapsed();
    let begin = Instant::now();
    let mut view = View::new(&scene, 0).unwrap();
    let background = begin.elapsed();
    let mut rgb = vec![0; view.size().rgb_bytes()];
    let mut millis: Vec<f64> = (0..ROUNDS)
        .map(|frame| {
            let begin = Instant::now();
            black_box(view.picture(frame, &mut rgb));
            begin.elapsed().as_secs_f64() * 1e3
        })
        .collect();
    millis.sort_by(f64::total_cmp);
    let (least, median) = (millis[0], millis[millis.len() / 2]);
    println!(
        "person {:.0} ms, background {:.0} ms once; a picture {least:.1} ms at best, {median:.1} ms median: {:.0} a second",
        person.as_secs_f64() * 1e3,
        background.as_secs_f64() * 1e3,
        1e3 / least
    );
}
