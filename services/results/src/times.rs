//! `times.jsonl`: for every frame, the times at which it was captured, solved in each view and turned into a result, and the epochs of the
//! processes.

use messages::Status;
use runfiles::{CameraTimes, PoseTimes, TimesLine, ViewTimes};

use crate::{FrameRecord, Scene};

/// Returns the line of a frame. Values that differ from run to run are only in this file, not in the other files of lines.
pub(crate) fn line(scene: &Scene, record: &FrameRecord) -> TimesLine {
    let pose = &record.skeletons;
    let ms = |nanos: u64| milliseconds(nanos, pose.stamp.session);
    let views = scene.views.iter().zip(&record.views);
    let views = views.map(|(view, record)| {
        let camera = record.frame.filter(|frame| frame.status == Status::OK);
        let times = ViewTimes {
            camera: camera.map(|camera| CameraTimes {
                captured_ms: ms(camera.stamp.captured_at_nanos),
                epoch: camera.stamp.epoch,
                sent_ms: ms(camera.timing.sent_at_nanos),
            }),
            pose: record.pose.map(|pose| PoseTimes {
                epoch: pose.stamp.epoch,
                sent_ms: ms(pose.timing.sent_at_nanos),
            }),
        };
        (view.name.clone(), times)
    });
    TimesLine {
        epoch: pose.stamp.epoch,
        frame: record.frame(),
        sent_ms: ms(pose.timing.sent_at_nanos),
        views: views.collect(),
    }
}

/// Returns the time since `since`, in milliseconds; 0 for earlier times.
fn milliseconds(nanos: u64, since: u64) -> f64 {
    (nanos.saturating_sub(since) / 1000) as f64 / 1000.0
}

#[cfg(test)]
mod tests {
    use messages::{FrameHeader, Stamp, Timing};
    use serde_json::{Value, json};

    use super::*;
    use crate::testing::{record, scene};

    #[test]
    fn times_are_counted_from_the_start_of_the_run_and_epochs_are_distinguished() {
        let mut record = record(7);
        record.skeletons.stamp.session = 1_000_000_000;
        record.skeletons.timing.sent_at_nanos = 1_040_500_000;
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
        let line: Value = serde_json::to_value(line(&scene(), &record)).unwrap();
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
    fn an_unreadable_frame_has_no_capture_time() {
        let mut record = record(0);
        record.views[0].frame = Some(FrameHeader {
            status: Status::NO_FRAME,
            ..FrameHeader::default()
        });
        let line: Value = serde_json::to_value(line(&scene(), &record)).unwrap();
        assert_eq!(line["views"]["left"]["camera"], Value::Null);
    }
}
