//! `times.jsonl`: when every frame was taken, answered and turned into a result, and by which life of a process.

use messages::Status;
use serde_json::{Map, Value, json};

use crate::{FrameRecord, Scene};

/// One line of `times.jsonl`, with its end: milliseconds since the run was planned (`CLOCK_MONOTONIC`).
///
/// A view is null if nothing of it came; `epoch` counts the restarts of the process that sent. What differs
/// from run to run stands here and in no other file of lines.
pub(crate) fn json_line(scene: &Scene, record: &FrameRecord) -> String {
    let pose = &record.pose3d;
    let views = scene.views.iter().zip(&record.views);
    let ms = |nanos: u64| milliseconds(nanos, pose.stamp.session);
    let views: Map<String, Value> = views
        .map(|(view, it)| {
            let camera = it.frame.filter(|it| it.status == Status::OK).map(|it| {
                json!({
                    "epoch": it.stamp.epoch,
                    "captured_ms": ms(it.stamp.captured_at_nanos),
                    "sent_ms": ms(it.timing.sent_at_nanos),
                })
            });
            let answer = it.pose.map(
                |it| json!({ "epoch": it.stamp.epoch, "sent_ms": ms(it.timing.sent_at_nanos) }),
            );
            (
                view.name.clone(),
                json!({ "camera": camera, "pose": answer }),
            )
        })
        .collect();
    let line = json!({
        "frame": record.frame(),
        "epoch": pose.stamp.epoch,
        "sent_ms": ms(pose.timing.sent_at_nanos),
        "views": views,
    });
    format!("{line}\n")
}

/// Since the beginning; 0 for what was before it.
fn milliseconds(nanos: u64, since: u64) -> f64 {
    (nanos.saturating_sub(since) / 1000) as f64 / 1000.0
}

#[cfg(test)]
mod tests {
    use messages::{FrameHeader, Stamp, Timing};

    use super::*;
    use crate::testing::{record, scene};

    #[test]
    fn times_count_from_the_beginning_of_the_run_and_lives_are_told_apart() {
        let mut record = record(7);
        record.pose3d.stamp.session = 1_000_000_000;
        record.pose3d.timing.sent_at_nanos = 1_040_500_000;
        record.views[1].frame = Some(FrameHeader {
            stamp: Stamp {
                epoch: 2,
                captured_at_nanos: 1_010_000_000,
                ..Stamp::default()
            },
            timing: Timing {
                sent_at_nanos: 1_012_250_000,
                ..Timing::default()
            },
            ..FrameHeader::default()
        });
        record.views[1].pose = None;
        let line: Value = serde_json::from_str(&json_line(&scene(), &record)).unwrap();
        assert_eq!(
            (&line["frame"], &line["sent_ms"]),
            (&json!(7), &json!(40.5))
        );
        let camera = json!({ "epoch": 2, "captured_ms": 10.0, "sent_ms": 12.25 });
        let right = json!({ "camera": camera, "pose": null });
        assert_eq!(line["views"]["right"], right);
        assert_eq!(line["views"]["left"]["camera"], Value::Null);
        assert_eq!(line["views"]["left"]["pose"]["epoch"], 0);
    }

    #[test]
    fn a_frame_that_could_not_be_read_was_not_taken() {
        let mut record = record(0);
        record.views[0].frame = Some(FrameHeader {
            status: Status::NO_FRAME,
            ..FrameHeader::default()
        });
        let line: Value = serde_json::from_str(&json_line(&scene(), &record)).unwrap();
        assert_eq!(line["views"]["left"]["camera"], Value::Null);
    }
}
