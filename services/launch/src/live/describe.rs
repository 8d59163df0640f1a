//! Times and counts for programs.

use messages::Cause;
use metrics::{Reading, Timed};
use serde_json::{Map, Value, json};

use super::board::{Board, Member};

/// A deployment and all of its processes.
pub fn describe(board: &Board) -> Value {
    let members: Vec<Value> = board.members.iter().map(member).collect();
    json!({
        "name": board.name,
        "supervisor": board.supervisor,
        "processes": members,
    })
}

fn member(it: &Member) -> Value {
    let mut told = json!({
        "process": it.process,
        "pid": it.pid,
        "state": it.standing.name(),
        "age_ms": it.reading.as_ref().map(|_| it.age_nanos / 1_000_000),
        "problem": it.problem.map(|it| it.to_string()),
        "measured": it.reading.as_ref().map(measured),
    });
    if it.problem.is_none()
        && let Some(told) = told.as_object_mut()
    {
        told.remove("problem");
    }
    told
}

/// What one life of a process has said of itself.
pub fn measured(it: &Reading) -> Value {
    let dropped: Map<String, Value> = Cause::ALL
        .into_iter()
        .map(|cause| (key(cause.name()), it.n_dropped_by(cause).into()))
        .collect();
    let times: Vec<Value> = it.times.iter().map(timed).collect();
    json!({
        "restarts": it.restarts,
        "seconds": (it.at_nanos - it.began_at_nanos) as f64 / 1e9,
        "view": it.view.as_ref().map(|it| json!({ "index": it.index, "name": it.name })),
        "finished": it.is_finished,
        "received": it.n_received,
        "sent": it.n_sent,
        "sent_per_second": it.sent_millihertz as f64 / 1e3,
        "dropped": dropped,
        "queue": it.queue.map(|it| it[0]),
        "longest_queue": it.queue.map(|it| it[1]),
        "memory_bytes": it.memory_bytes,
        "peak_memory_bytes": it.peak_memory_bytes,
        "evidence_bytes": it.evidence_bytes,
        "times": times,
    })
}

fn timed(it: &Timed) -> Value {
    let ms = |nanos: u64| nanos as f64 / 1e6;
    json!({
        "stage": key(it.span.name()),
        "view": it.view,
        "count": it.count,
        "per_second": it.millihertz as f64 / 1e3,
        "p50_ms": ms(it.p50_nanos),
        "p99_ms": ms(it.p99_nanos),
        "p99_9_ms": ms(it.p99_9_nanos),
        "max_ms": ms(it.max_nanos),
    })
}

/// A name as a key: `end_to_end`.
fn key(name: &str) -> String {
    name.replace(' ', "_")
}

#[cfg(test)]
mod tests {
    use super::super::board::tests::board;
    use super::*;

    #[test]
    fn every_process_is_there_with_what_it_said() {
        let told = describe(&board());
        assert_eq!(told["name"], "walk");
        let processes = told["processes"].as_array().unwrap();
        let states: Vec<&str> = processes
            .iter()
            .map(|it| it["state"].as_str().unwrap())
            .collect();
        assert_eq!(states, ["begins", "dead", "runs", "runs"]);
        assert_eq!(processes[0]["measured"], Value::Null);
        let pose = &processes[2]["measured"];
        assert_eq!(pose["view"], json!({ "index": 0, "name": "left" }));
        assert_eq!(pose["dropped"]["late"], 3);
        assert_eq!(pose["dropped"]["behind_clock"], 0);
        assert_eq!(pose["sent_per_second"], 19.96);
        assert_eq!(pose["seconds"], 6.0);
        let computing = &pose["times"][1];
        assert_eq!(computing["stage"], "computing");
        assert_eq!(computing["count"], 100);
        let p50 = computing["p50_ms"].as_f64().unwrap();
        assert!((p50 - 50.0).abs() < 1.0, "{p50}");
    }
}
