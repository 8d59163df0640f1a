//! Measures the time from `kill -9` of a sender to the first message of the restarted sender at a running receiver. The supervisor restarts
//! it without a pause, as it does with any process that has worked for a while.
#![expect(clippy::unwrap_used, reason = "a bench fails by panicking")]
#![expect(clippy::print_stdout, reason = "a bench prints its results")]

#[path = "../tests/common/mod.rs"]
mod common;

use std::time::{Duration, Instant};

use common::{Case, Recorded, kill};
use runtime::Delivery;
use supervise::Role;

const ROUNDS: u32 = 30;

fn main() {
    let mut case = Case::new(
        Delivery::Realtime,
        &[
            ("sink", "receive 0", Role::Essential),
            ("source", "send 1000000 1 1", Role::Essential),
        ],
    );
    case.plan.policy.first_pause = Duration::ZERO;
    case.plan.policy.max_restarts = usize::MAX;
    let (mut pid, mut killed) = (0, None);
    let mut millis = Vec::new();
    case.run(|event, stop| match event {
        Recorded::Started(name, started, _) if name == "source" => pid = *started,
        Recorded::Line(name, line) if name == "source" && line == "sent 64" => {
            killed = Some(Instant::now());
            kill("-9", pid);
        }
        Recorded::Line(name, line) if name == "sink" => {
            let begin = format!("got {} ", millis.len() + 1);
            if let Some(at) = killed.filter(|_| line.starts_with(&begin)) {
                millis.push(at.elapsed().as_millis());
                killed = None;
            }
            if millis.len() == ROUNDS as usize {
                stop.request();
            }
        }
        _ => {}
    });
    millis.sort_unstable();
    let (median, longest) = (millis[millis.len() / 2], millis[millis.len() - 1]);
    println!("kill to first message: median {median} ms, longest {longest} ms of {ROUNDS}");
}
