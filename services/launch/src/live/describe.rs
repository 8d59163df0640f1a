//! A snapshot of a deployment as JSON.

use messages::{CameraCounts, Cause, UNMEASURED};
use runtime::metrics::{Reading, Timed};
use serde_json::{Map, Value, json};

use super::snapshot::{ProcessSnapshot, Snapshot};

/// Describes a deployment and all its processes as JSON.
pub fn describe(snapshot: &Snapshot) -> Value {
    let processes: Vec<Value> = snapshot.processes.iter().map(process).collect();
    json!({
        "name": snapshot.name,
        "supervisor": snapshot.supervisor,
        "processes": processes,
    })
}

fn process(process: &ProcessSnapshot) -> Value {
    let mut value = json!({
        "process": process.name,
        "pid": process.pid,
        "state": process.state.name(),
        "age_ms": process.reading.as_ref().map(|_| process.age_nanos / 1_000_000),
        "problem": process.problem.map(|problem| problem.to_string()),
        "measured": process.reading.as_ref().map(measured),
    });
    if process.problem.is_none()
        && let Some(fields) = value.as_object_mut()
    {
        fields.remove("problem");
    }
    value
}

/// Returns the metrics of a process since its last start, as JSON.
pub fn measured(reading: &Reading) -> Value {
    let dropped: Map<String, Value> = Cause::ALL
        .into_iter()
        .map(|cause| (key(cause.name()), reading.n_dropped_by(cause).into()))
        .collect();
    let times: Vec<Value> = reading.times.iter().map(timed).collect();
    json!({
        "restarts": reading.restarts,
        "seconds": (reading.at_nanos - reading.began_at_nanos) as f64 / 1e9,
        "view": reading.view.as_ref().map(|view| json!({ "index": view.index, "name": view.name })),
        "finished": reading.is_finished,
        "received": reading.n_received,
        "sent": reading.n_sent,
        "sent_per_second": reading.sent_millihertz as f64 / 1e3,
        "dropped": dropped,
        "queue": reading.queue.map(|queue| queue[0]),
        "longest_queue": reading.queue.map(|queue| queue[1]),
        "memory_bytes": reading.memory_bytes,
        "peak_memory_bytes": reading.peak_memory_bytes,
        "evidence_bytes": reading.evidence_bytes,
        "people": reading.n_people,
        "camera": reading.camera.as_ref().map(camera),
        "times": times,
    })
}

/// Returns the counts of the pictures of a live camera as JSON.
fn camera(it: &CameraCounts) -> Value {
    json!({
        "connections": it.n_connections,
        "made": it.n_made,
        "lost_by_camera": it.n_lost,
        "delivered": it.n_delivered,
        "used": it.n_used,
        "surplus": it.n_surplus,
        "overtaken": it.n_overtaken,
        "refused": it.n_refused,
        "rate_hz": (it.rate_microhertz > 0).then_some(it.rate_microhertz as f64 / 1e6),
        "off_grid_ms": it.off_grid_nanos as f64 / 1e6,
        "skew_ms": measured_value(it.skew_nanos, 1e6),
        "drift_ppm": measured_value(it.drift_ppb, 1e3),
        "delay_ms": measured_value(it.delay_nanos, 1e6),
        "timed_by": it.timed_by.name(),
    })
}

/// Converts a measurement of a camera to a larger unit; null if there is no measurement yet.
fn measured_value(value: i64, per: f64) -> Option<f64> {
    (value != UNMEASURED).then_some(value as f64 / per)
}

fn timed(timed: &Timed) -> Value {
    let ms = |nanos: u64| nanos as f64 / 1e6;
    json!({
        "stage": key(timed.span.name()),
        "view": timed.view,
        "count": timed.count,
        "per_second": timed.millihertz as f64 / 1e3,
        "p50_ms": ms(timed.p50_nanos),
        "p99_ms": ms(timed.p99_nanos),
        "p99_9_ms": ms(timed.p99_9_nanos),
        "max_ms": ms(timed.max_nanos),
    })
}

/// Turns a name into a JSON key, such as `end_to_end`.
fn key(name: &str) -> String {
    name.replace(' ', "_")
}

#[cfg(test)]
mod tests {
    use super::super::snapshot::tests::snapshot;
    use super::*;

    #[test]
    fn every_process_is_listed_with_its_metrics() {
        let value = describe(&snapshot());
        assert_eq!(value["name"], "walk");
        let processes = value["processes"].as_array().unwrap();
        let states: Vec<&str> =
            processes.iter().map(|process| process["state"].as_str().unwrap()).collect();
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
