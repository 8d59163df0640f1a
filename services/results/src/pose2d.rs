//! `pose2d.jsonl`: every view, before and after fusion, in pixels of the footage.

use messages::{FusedView, MAX_PARTS, Status};
use serde_json::{Value, json};

use crate::{FrameRecord, Scene};

/// The lines of one frame, one a view, each with its end.
///
/// `single` names parts as the model does, by the side of the image; `fused` by the side of the body:
/// the two differ where `facing` is `behind`. Types and levels count from 1, as in the reference.
///
/// `sigma_px` is what was predicted for this frame. `sigma_used` is what fusion had of the view in time:
/// 0 the same, n what was predicted n frames before, `null` nothing, and every part counted as usable.
pub(crate) fn json_lines(scene: &Scene, record: &FrameRecord) -> String {
    (0..scene.views.len())
        .map(|view| format!("{}\n", line(scene, record, view)))
        .collect::<Vec<_>>()
        .concat()
}

fn line(scene: &Scene, record: &FrameRecord, view: usize) -> Value {
    let pose = &record.pose3d;
    let it = &scene.views[view];
    let fused = pose
        .views
        .get(view)
        .filter(|_| view < pose.n_views as usize);
    let status = record.views.get(view).and_then(|it| it.pose.as_ref());
    let sigma = record.sigma_px(scene, view).map(|sigma| {
        let scale = it.source_scale();
        sigma
            .iter()
            .map(|px| f64::from(*px) * scale)
            .collect::<Vec<_>>()
    });
    json!({
        "frame": pose.stamp.frame,
        "time_s": scene.time_s(pose.stamp.frame),
        "view": it.name,
        "status": status.map_or("nothing came", |it| it.status.reason()),
        "search": status.filter(|it| it.status == Status::OK).map(|it| it.searched.name()),
        "facing": fused.filter(|it| it.status == Status::OK).map(facing),
        "single": single(scene, record, view),
        "fused": fused.filter(|it| it.status == Status::OK).map(|fused| {
            let n = (fused.n_parts as usize).min(MAX_PARTS);
            let centres = fused.centres_px[..n].iter().map(|at| it.in_source(*at));
            json!({
                "energy": fused.energy,
                "pairs": fused.n_pairs,
                "parts": centres.map(|[x, y]| json!({ "x": x, "y": y })).collect::<Vec<_>>(),
            })
        }),
        "sigma_px": sigma,
        "sigma_used": record.sigma_used(view),
    })
}

fn facing(view: &FusedView) -> &'static str {
    if view.exchanged == 1 {
        "behind"
    } else {
        "front"
    }
}

fn single(scene: &Scene, record: &FrameRecord, view: usize) -> Value {
    let candidates = record.candidates(scene, view);
    let Some(best) = candidates.first() else {
        return Value::Null;
    };
    let it = &scene.views[view];
    let parts: Vec<Value> = (0..best.parts.len())
        .map(|part| {
            let [x, y] = it.in_source(best.centre(&scene.model, &it.layout, part));
            json!({ "x": x, "y": y, "type": best.parts[part].mixture + 1 })
        })
        .collect();
    json!({
        "score": best.score,
        "level": best.level + 1,
        "candidates": candidates.len(),
        "parts": parts,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{record, scene};

    fn lines(record: &FrameRecord) -> Vec<Value> {
        json_lines(&scene(), record)
            .lines()
            .map(|it| serde_json::from_str(it).unwrap())
            .collect()
    }

    #[test]
    fn every_view_has_a_line() {
        let got = lines(&record(5));
        assert_eq!(got.len(), 2);
        assert_eq!(got[1]["view"], "right");
        assert_eq!(got[1]["frame"], 5);
    }

    #[test]
    fn pixels_are_those_of_the_footage() {
        let scene = scene();
        let record = record(0);
        let candidates = record.candidates(&scene, 0);
        let centre = candidates[0].centre(&scene.model, &scene.views[0].layout, 0);
        let [x, y] = scene.views[0].in_source(centre);
        let got = lines(&record);
        assert_eq!(got[0]["single"]["parts"][0]["x"], json!(x));
        assert_eq!(got[0]["single"]["parts"][0]["y"], json!(y));
    }

    #[test]
    fn types_and_levels_count_from_one() {
        let got = lines(&record(0));
        assert_eq!(got[0]["single"]["level"], 1);
        assert_eq!(got[0]["single"]["parts"][0]["type"], 1);
    }

    #[test]
    fn a_view_that_sent_nothing_says_so() {
        let mut record = record(0);
        record.views[1].pose = None;
        record.pose3d.views[1].status = Status::NO_FRAME;
        let got = lines(&record);
        assert_eq!(got[1]["status"], "nothing came");
        assert_eq!(got[1]["single"], Value::Null);
        assert_eq!(got[1]["fused"], Value::Null);
    }

    #[test]
    fn a_malformed_message_is_left_out() {
        let mut record = record(0);
        if let Some(pose) = &mut record.views[0].pose {
            pose.candidates[0].level = 999;
        }
        assert_eq!(lines(&record)[0]["single"], Value::Null);
    }
}
