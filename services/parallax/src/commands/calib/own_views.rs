//! What every view of a run found by itself, held against a rig.

use std::collections::BTreeMap;
use std::path::Path;

use failure::{ExitKind, Failure, OrFail as _};
use geometry::files::{EpipolarReport, epipolar_check};
use geometry::{Framing, OutSize, Rig, RigWatch, SwapWatch};
use nalgebra::Point2;
use runfiles::{Facing, ViewLine};

/// The points that one camera found in a frame, pixels.
type Points = Vec<[f64; 2]>;

/// How a rig agrees with what views found.
pub(super) struct Agreement {
    /// Epipolar errors of the cameras.
    pub(super) errors: EpipolarReport,
    /// What contradicts the rig, for people.
    pub(super) disagreements: Vec<String>,
}

/// Compares the poses that every view found alone.
///
/// # Errors
///
/// The file cannot be read, or no two views of a frame found somebody by themselves.
pub(super) fn agreement(rig: &Rig, file: &Path) -> Result<Agreement, Failure> {
    let frames = frames(rig, file)?;
    let n_seen = |views: &&Vec<Option<Points>>| views.iter().flatten().count();
    if !frames.iter().any(|views| n_seen(&views) > 1) {
        let message = format!(
            "{}: in no frame did two cameras of the rig find somebody by themselves (`single`), and poses after fusion agree with any rig",
            file.display()
        );
        let hint = "name `pose2d.jsonl` of a run whose cameras have the names of the rig";
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
            "; it may be other two"
        };
        return vec![format!(
            "{} and {} look exchanged: rays of the cameras miss each other by {:.1} degrees, with the footage of the two exchanged by \
             {:.1}{sure}",
            name(swap.views[0]),
            name(swap.views[1]),
            swap.degrees,
            swap.exchanged_degrees
        )];
    }
    if let Some(found) = swaps.contradiction() {
        let likely = found.likely.map_or_else(String::new, |[a, b]| {
            format!(" ({} and {} exchanged would fit best)", name(a), name(b))
        });
        return vec![format!(
            "the cameras contradict each other: rays to the same part miss each other by {:.1} degrees, where up to {:.1} are \
             usual{likely}",
            found.degrees, found.usual_degrees
        )];
    }
    let reported = (0..rig.cameras().len()).filter(|view| moved.is_reported(*view));
    let text = |view: usize| {
        let pixels = |px: Option<f64>| px.map_or_else(|| "?".to_owned(), |px| format!("{px:.1}"));
        format!(
            "{} does not stand where the rig says: cameras differ by {} px with it, by {} px without it",
            name(view),
            pixels(moved.residual_px(view)),
            pixels(moved.without_px(view))
        )
    };
    reported.map(text).collect()
}

/// The parts that every camera of the rig found alone, frame by frame, named by the side of the body where the run knew it.
fn frames(rig: &Rig, file: &Path) -> Result<Vec<Vec<Option<Points>>>, Failure> {
    let cameras = rig.cameras();
    let mut frames = BTreeMap::<u64, Vec<Option<Points>>>::new();
    for line in runfiles::lines::<ViewLine>(&failure::read_text(file)?) {
        let line = line.map_err(|error| failure::in_file(file, &error))?;
        let Some(camera) = cameras.iter().position(|it| it.name == line.view) else {
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
        let views = frames
            .entry(line.frame)
            .or_insert_with(|| vec![None; cameras.len()]);
        views[camera] = Some(parts);
    }
    Ok(frames.into_values().collect())
}
