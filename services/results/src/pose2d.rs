//! `pose2d.jsonl`: the followed person in every view, before and after fusion, in pixels of the footage.

use messages::{FusedView, MAX_PARTS, Status};
use runfiles::{Facing, FusedPose, Part, SinglePose, TypedPart, ViewLine};

use crate::scene::View;
use crate::{FrameRecord, Scene, own};

/// Returns the lines of one frame, one per view.
///
/// `single` names parts by the side of the image, as the model does. `fused` names them by the side of the body.
/// The names differ if `facing` is `behind`. Types and levels are counted from 1, as in the reference program.
///
/// `sigma_px` has the errors predicted for this frame. `sigma_used` is the age, in frames, of the errors that fusion used for the view: 0
/// for the errors of this frame. It is null if fusion had no errors in time. Every part then counted as usable.
pub(crate) fn lines(scene: &Scene, record: &FrameRecord) -> impl Iterator<Item = ViewLine> {
    (0..scene.views.len()).map(|view| line(scene, record, view))
}

fn line(scene: &Scene, record: &FrameRecord, view: usize) -> ViewLine {
    let it = &scene.views[view];
    let fused = record.fused(view);
    let answer = record.views.get(view).and_then(|view| view.pose.as_ref());
    let status = answer.map_or("nothing came", |answer| answer.status.reason());
    let search = answer.filter(|answer| answer.status == Status::OK);
    let scale = it.source_scale();
    let sigma = record.sigma_px(scene, view);
    ViewLine {
        // Poses from maps use the sides of the body, and there is no information about the sides in each view.
        facing: fused.filter(|_| !scene.has_maps).map(facing),
        frame: record.frame(),
        fused: fused.map(|fused| fused_pose(it, fused)),
        search: search.map(|search| search.searched.name().to_owned()),
        sigma_px: sigma.map(|sigma| sigma.iter().map(|px| f64::from(*px) * scale).collect()),
        sigma_used: record.sigma_used(view),
        single: single(scene, record, view),
        status: status.to_owned(),
        time_s: scene.time_s(record.frame()),
        view: it.name.clone(),
    }
}

fn facing(view: &FusedView) -> Facing {
    if view.exchanged == 1 {
        Facing::Behind
    } else {
        Facing::Front
    }
}

fn fused_pose(view: &View, fused: &FusedView) -> FusedPose {
    let n_parts = (fused.n_parts as usize).min(MAX_PARTS);
    let centres = fused.centres_px[..n_parts].iter();
    let centres = centres.map(|at| view.in_source(*at).map(finite));
    FusedPose {
        energy: finite(fused.energy),
        pairs: fused.n_pairs,
        parts: centres.map(|[x, y]| Part { x, y }).collect(),
    }
}

fn single(scene: &Scene, record: &FrameRecord, view: usize) -> Option<SinglePose> {
    let candidates = record.candidates(scene, view);
    let best = own::followed(scene, record, view)?;
    let it = &scene.views[view];
    let pose = best.pose.as_ref();
    let part = |(part, centre): (usize, &[f64; 2])| {
        let [x, y] = it.in_source(*centre).map(finite);
        let part_type = pose.map(|pose| u64::from(pose.parts[part].mixture) + 1);
        TypedPart { part_type, x, y }
    };
    Some(SinglePose {
        candidates: candidates.len() as u64,
        level: pose.map(|pose| u64::from(pose.level) + 1),
        parts: best.centres_px.iter().enumerate().map(part).collect(),
        score: finite(f64::from(best.score)),
    })
}

fn finite(number: f64) -> Option<f64> {
    Some(number).filter(|value| value.is_finite())
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::*;
    use crate::testing::{record, scene};

    fn lines(record: &FrameRecord) -> Vec<Value> {
        super::lines(&scene(), record)
            .map(|line| serde_json::to_value(line).unwrap())
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
    fn positions_are_in_pixels_of_the_footage() {
        let scene = scene();
        let record = record(0);
        let candidates = record.candidates(&scene, 0);
        let centre = candidates[0].centres_px[0];
        let [x, y] = scene.views[0].in_source(centre);
        let got = lines(&record);
        assert_eq!(got[0]["single"]["parts"][0]["x"], json!(x));
        assert_eq!(got[0]["single"]["parts"][0]["y"], json!(y));
    }

    #[test]
    fn types_and_levels_are_counted_from_one() {
        let got = lines(&record(0));
        assert_eq!(got[0]["single"]["level"], 1);
        assert_eq!(got[0]["single"]["parts"][0]["type"], 1);
    }

    #[test]
    fn a_view_without_a_message_has_a_reason() {
        let mut record = record(0);
        record.views[1].pose = None;
        record.skeletons.people[0].views[1].status = Status::NO_FRAME;
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
