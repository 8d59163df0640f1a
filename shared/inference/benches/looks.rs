//! Measures the time of one run of the built-in network, or of another file, with each library in turn: Parallax itself, `rten`, and ONNX
//! Runtime if its library is given.
//!
//! `cargo bench -p inference --features ort --bench looks -- [--onnx-runtime libonnxruntime.so] [network.onnx]`
#![cfg_attr(
    not(feature = "ort"),
    expect(clippy::panic, reason = "a bench fails by panicking")
)]
#![expect(
    clippy::print_stdout,
    clippy::unwrap_used,
    reason = "a bench prints its results and fails by panicking"
)]

use std::path::{Path, PathBuf};

use inference::{Input, Session, Side, Values};
use rustix::time::{ClockId, clock_gettime};

const SHIPPED: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../../configs/models/person.pose.onnx"
);
const ROUNDS: usize = 200;

fn main() {
    let mut args = std::env::args().skip(1).filter(|arg| arg != "--bench");
    let (mut library, mut file) = (None, PathBuf::from(SHIPPED));
    let mut rounds = ROUNDS;
    while let Some(arg) = args.next() {
        match arg.as_str() {
            "--onnx-runtime" => library = args.next().map(PathBuf::from),
            "--test" => rounds = 1,
            _ => file = arg.into(),
        }
    }
    let bytes = std::fs::read(&file).unwrap();
    let begin = processor_time();
    let own = (
        Session::parse(bytes.clone()).unwrap(),
        processor_time() - begin,
    );
    let begin = processor_time();
    let rten = Session::parse_by_rten(bytes.clone()).unwrap();
    let rten = (rten, processor_time() - begin);
    let begin = processor_time();
    let third = library.map(|library| by_onnx_runtime(&library, &bytes));
    let third = third.map(|session| (session, processor_time() - begin));
    let sessions: Vec<(Session, f64)> = [own, rten].into_iter().chain(third).collect();
    let mut times = vec![Vec::new(); sessions.len()];
    let n = sessions.len();
    for round in 0..rounds {
        // Each library is the first to run equally often.
        for at in (0..n).map(|at| (at + round) % n) {
            times[at].push(time(&sessions[at].0));
        }
    }
    println!(
        "processor time of loading the network and of one run, in milliseconds, over {rounds} rounds"
    );
    println!(" load  least  median  library");
    let columns: Vec<[f64; 2]> = times.iter_mut().map(|all| least_and_median(all)).collect();
    for ((session, load), [least, median]) in sessions.iter().zip(&columns) {
        println!(
            "{load:5.1}  {least:5.2}  {median:6.2}  {}",
            session.run_by()
        );
    }
    for ((session, _), [least, median]) in sessions.iter().zip(&columns).skip(1) {
        let [by_least, by_median] = [columns[0][0] / least, columns[0][1] / median];
        println!(
            "built in : {} = {by_least:.2} (least), {by_median:.2} (median)",
            session.run_by()
        );
    }
}

#[cfg(feature = "ort")]
fn by_onnx_runtime(library: &Path, bytes: &[u8]) -> Session {
    let runtime = inference::OnnxRuntime::load(library).unwrap();
    Session::parse_with(&runtime, bytes).unwrap()
}

#[cfg(not(feature = "ort"))]
fn by_onnx_runtime(_library: &Path, _bytes: &[u8]) -> Session {
    panic!("--onnx-runtime needs a build with --features ort")
}

fn time(session: &Session) -> f64 {
    let description = session.description();
    let input = &description.inputs[0];
    let sides = input.sides.iter().map(|side| match side {
        Side::Fixed(side) => *side,
        Side::Named(_) => 1,
    });
    let shape: Vec<usize> = sides.collect();
    let n = shape.iter().product();
    let picture: Vec<f32> = (0..n).map(|at: usize| (at * 7 % 255) as f32 / 128.0 - 1.0).collect();
    let input = Input {
        name: &input.name,
        shape: &shape,
        values: Values::F32(&picture),
    };
    let outputs: Vec<&str> = description.outputs.iter().map(|port| port.name.as_str()).collect();
    let begin = processor_time();
    session.run(&[input], &outputs, &mut |_output| {}).unwrap();
    processor_time() - begin
}

/// Processor time of all threads of the process, in milliseconds. Other programs affect processor time less than wall-clock time.
fn processor_time() -> f64 {
    let now = clock_gettime(ClockId::ProcessCPUTime);
    now.tv_sec as f64 * 1e3 + now.tv_nsec as f64 * 1e-6
}

fn least_and_median(times: &mut [f64]) -> [f64; 2] {
    times.sort_by(f64::total_cmp);
    [times[0], times[times.len() / 2]]
}
