//! Compares a rig with the poses that each view of a run found alone.

use std::collections::BTreeMap;
use std::path::Path;

use failure::{ExitKind, Failure, OrFail as _};
use geometry::files::{EpipolarReport, epipolar_check};
use geometry::{Framing, OutSize, Rig, RigWatch, SwapWatch};
use nalgebra::Point2;
use runfiles::{Facing, ViewLine};

/// The points found in one frame of one camera, in pixels.
type Points = Vec<[f64; 2]>;

/// Comparison of a rig with the poses of single views.
pub(super) struct Agreement {
    /// Epipolar errors of the cameras.
    pub(super) errors: EpipolarReport,
    /// Descriptions of contradictions between the rig and the poses, for the user.
    pub(super) disagreements: Vec<String>,
}

/// Compares the rig with the poses that each view found alone.
///
/// # Errors
///
/// Fails if the file cannot be read, or if it has no frame in which two views found a person independently of each other.
pub(super) fn agreement(rig: &Rig, file: &Path) -> Result<Agreement, Failure> {
    let frames = frames(rig, file)?;
    let n_seen = |views: &&Vec<Option<Points>>| views.iter().flatten().count();
    if !frames.iter().any(|views| n_seen(&views) > 1) {
        let message = format!(
            "{}: no frame has single-view poses (`single`) of two cameras of the rig; poses after fusion cannot be used, because they \
             agree with any rig",
            file.display()
        );
        let hint = "pass `pose2d.jsonl` of a run whose cameras have the same names as in the rig";
        return Err(Failure::new(ExitKind::Input, message).with_hint(hint));
    }
    let cameras = rig.cameras();
    let framing = |camera| {
        let framing = Framing::new(
            camera,
            camera.intrinsics.size,
            None,
            OutSize::Scale(1.0),
            0.0,
        );
        framing.or_fail(ExitKind::Calibration)
    };
    let framings = cameras.iter().map(framing).collect::<Result<Vec<_>, _>>()?;
    let n_parts = frames.iter().flatten().flatten().map(Vec::len).max();
    let mirror = (n_parts == Some(skeleton::N_PARTS)).then(|| skeleton::MIRROR.to_vec());
    let mut swaps = SwapWatch::new(framings, mirror);
    let mut moved = RigWatch::new(cameras.to_vec());
    let mut points = Vec::new();
    for views in &frames {
        swaps.note(views);
        moved.note(views);
        let at = |nth: usize| {
            let of_view = |view: &Option<Points>| Some(Point2::from(*view.as_ref()?.get(nth)?));
            views.iter().map(of_view).collect::<Vec<_>>()
        };
        points.extend((0..n_parts.unwrap_or(0)).map(at));
    }
    Ok(Agreement {
        errors: epipolar_check(rig, &points),
        disagreements: disagreements(rig, &swaps, &moved),
    })
}

fn disagreements(rig: &Rig, swaps: &SwapWatch, moved: &RigWatch) -> Vec<String> {
    let name = |view: usize| rig.cameras()[view].name.as_str();
    if let Some(swap) = swaps.swap() {
        let sure = if swap.is_sure {
            ""
        } else {
            "; perhaps two other cameras are swapped instead"
        };
        return vec![format!(
            "the footage of {} and {} seems to be swapped: rays to the same part miss each other by {:.1} degrees, but only by {:.1} \
             degrees if the footage of the two is swapped{sure}",
            name(swap.views[0]),
            name(swap.views[1]),
            swap.degrees,
            swap.exchanged_degrees
        )];
    }
    if let Some(found) = swaps.contradiction() {
        let likely = found.likely.map_or_else(String::new, |[a, b]| {
            format!(" (swapping {} and {} would fit best)", name(a), name(b))
        });
        return vec![format!(
            "the cameras contradict each other: rays to the same part miss each other by {:.1} degrees (normally at most {:.1} \
             degrees){likely}",
            found.degrees, found.usual_degrees
        )];
    }
    let reported = (0..rig.cameras().len()).filter(|view| moved.is_reported(*view));
    let text = |view: usize| {
        let pixels = |px: Option<f64>| px.map_or_else(|| "?".to_owned(), |px| format!("{px:.1}"));
        format!(
            "{} is not where the rig says: the cameras differ by {} px with this camera, and by {} px without it",
            name(view),
            pixels(moved.residual_px(view)),
            pixels(moved.without_px(view))
        )
    };
    reported.map(text).collect()
}

/// Returns the parts that every camera of the rig found alone, frame by frame. If the run has determined which way the person faced, left
/// and right are those of the body.
fn frames(rig: &Rig, file: &Path) -> Result<Vec<Vec<Option<Points>>>, Failure> {
    let cameras = rig.cameras();
    let mut frames = BTreeMap::<u64, Vec<Option<Points>>>::new();
    for line in runfiles::lines::<ViewLine>(&failure::read_text(file)?) {
        let line = line.map_err(|error| failure::in_file(file, &error))?;
        let Some(camera) = cameras.iter().position(|camera| camera.name == line.view) else {
            continue;
        };
        let Some(single) = line.single else { continue };
        let parts = single.parts.iter().map(|part| Some([part.x?, part.y?]));
        let Some(mut parts) = parts.collect::<Option<Points>>() else {
            continue;
        };
        if line.facing == Some(Facing::Behind) && parts.len() == skeleton::N_PARTS {
            parts = skeleton::MIRROR.iter().map(|nth| parts[*nth]).collect();
        }
        let views = frames.entry(line.frame).or_insert_with(|| vec![None; cameras.len()]);
        views[camera] = Some(parts);
    }
    Ok(frames.into_values().collect())
}

#[cfg(test)]
mod tests {
    use geometry::{Camera, Intrinsics, Lens};
    use nalgebra::{Isometry3, Point3, Vector3};
    use serde_json::json;

    use super::*;

    /// Returns four cameras around a room, with z up.
    fn rig() -> Rig {
        let camera = |nth: usize| {
            let bearing = 0.3 + 1.3 * nth as f64;
            let eye = Point3::new(5.0 * bearing.cos(), 5.0 * bearing.sin(), 1.5);
            let target = Point3::new(0.0, 0.0, 1.0);
            let upright = Isometry3::look_at_rh(&eye, &target, &Vector3::z());
            let half_turn = Isometry3::rotation(Vector3::x() * core::f64::consts::PI);
            Camera {
                name: format!("c{nth}"),
                intrinsics: Intrinsics {
                    fx: 900.0,
                    fy: 900.0,
                    cx: 639.5,
                    cy: 359.5,
                    size: [1280, 720],
                    lens: Lens::default(),
                },
                camera_from_world: half_turn * upright,
            }
        };
        Rig::new((0..4).map(camera).collect(), None, "test").unwrap()
    }

    /// Returns the poses of a walking person as the cameras see them. A camera that sees the person from behind swaps left and right.
    ///
    /// * `shown`: for every camera, the index of the camera from which its pictures really are.
    fn seen(rig: &Rig, shown: [usize; 4]) -> String {
        let mut text = String::new();
        let random = &mut fastrand::Rng::with_seed(5);
        let body: Vec<Vector3<f64>> = (0..skeleton::N_PARTS)
            .map(|_| {
                let mut spread = |reach: f64| reach * (2.0 * random.f64() - 1.0);
                Vector3::new(spread(0.3), spread(0.3), 0.9 + spread(0.8))
            })
            .collect();
        for frame in 0..40 {
            let way = 0.1 * f64::from(frame);
            let at = Vector3::new(way.sin(), 0.6 * (1.7 * way).cos(), 0.0);
            for (nth, name) in rig.cameras().iter().map(|camera| &camera.name).enumerate() {
                let camera = &rig.cameras()[shown[nth]];
                let is_behind = shown[nth] == 3;
                let part = |part: usize| {
                    let part = if is_behind {
                        skeleton::MIRROR[part]
                    } else {
                        part
                    };
                    let pixel = camera.project(&Point3::from(at + body[part])).unwrap();
                    json!({"type": 1, "x": pixel.x + random.f64(), "y": pixel.y + random.f64()})
                };
                let parts: Vec<_> = (0..skeleton::N_PARTS).map(part).collect();
                let line = json!({
                    "facing": if is_behind { "behind" } else { "front" }, "frame": frame, "fused": null, "search": "full",
                    "sigma_px": null, "sigma_used": null, "status": "ok", "time_s": null, "view": name,
                    "single": {"candidates": 1, "level": 1, "parts": parts, "score": 1.0},
                });
                text += &line.to_string();
                text.push('\n');
            }
        }
        text
    }

    #[test]
    fn poses_of_single_views_confirm_a_correct_rig_and_reveal_two_swapped_cameras() {
        let folder = tempfile::tempdir().unwrap();
        let rig = rig();
        let file = folder.path().join("pose2d.jsonl");
        std::fs::write(&file, seen(&rig, [0, 1, 2, 3])).unwrap();
        let right = agreement(&rig, &file).unwrap();
        assert_eq!(right.disagreements, [""; 0]);
        assert!(right.errors.cameras.iter().all(|camera| camera.median_px < 1.5));
        std::fs::write(&file, seen(&rig, [0, 2, 1, 3])).unwrap();
        let wrong = agreement(&rig, &file).unwrap().disagreements.join("; ");
        assert!(
            wrong.contains("the footage of c1 and c2 seems to be swapped"),
            "{wrong}"
        );
    }

    #[test]
    fn poses_after_fusion_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let rig = rig();
        let file = folder.path().join("pose2d.jsonl");
        let lines = seen(&rig, [0, 1, 2, 3]);
        let fused: Vec<String> = lines
            .lines()
            .map(|line| {
                let mut line: serde_json::Value = serde_json::from_str(line).unwrap();
                line["single"] = json!(null);
                line.to_string()
            })
            .collect();
        std::fs::write(&file, fused.join("\n")).unwrap();
        let error = agreement(&rig, &file).err().unwrap();
        assert!(error.to_string().contains("(`single`)"), "{error}");
    }
}
