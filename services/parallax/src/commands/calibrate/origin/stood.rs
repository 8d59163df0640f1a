//! Finds the floor from the people who stand on it in a finished run.

use std::path::Path;

use calibration::people::{Floor, Skeletons, Vertical, floor};
use failure::{ExitKind, Failure};
use geometry::Rig;
use motion::finished::read_lines;
use nalgebra::{Point2, Point3};
use runfiles::{Line as _, ViewLine};
use skeleton::PARSE14;
use statistics::Sorted;
use terminal::output;

/// Largest accepted distance between the projected skeletons of the run and the joints that its cameras saw, as a fraction of the person's
/// size in the picture.
const MOST_OFF: f64 = 0.15;
/// Minimum number of joints seen in pictures for this check.
const LEAST_SEEN: usize = 50;

/// Finds the floor, after checking that the run was made with this rig. If the run has several people, only the followed person is used. It
/// does not matter if this is not always the same person, because all people stand on the same floor.
///
/// * `rate_hz`: frames per second, if the run has no frame rate.
pub(super) fn find(rig: &Rig, run: &Path, rate_hz: Option<f64>) -> Result<Floor, Failure> {
    let mut times_s: Vec<f64> = Vec::new();
    let mut skeletons: Skeletons = Vec::new();
    let mut frames = Vec::new();
    let cut = read_lines(run, |_, line| {
        let time_s = rate_hz.map_or(line.time_s, |rate_hz| Some(line.frame as f64 / rate_hz));
        let time_s = time_s.ok_or_else(|| {
            let message = format!("{}: the frames of the run have no times", run.display());
            Failure::new(ExitKind::Input, message)
                .with_hint("pass the frames per second with --rate")
        })?;
        let person = line.followed();
        let joints = PARSE14.joints.iter().map(|joint| {
            let placed = person?.joints.get(joint.name)?.placed()?;
            Some(Point3::from(placed.position_m))
        });
        if times_s.last().is_none_or(|last| time_s > *last) {
            frames.push(line.frame);
            times_s.push(time_s);
            skeletons.push(joints.collect());
        }
        Ok(())
    })?;
    if let Some(cut) = cut {
        output::message(cut);
    }
    check(rig, run, &frames, &skeletons)?;
    let found = floor(&times_s, &skeletons).ok_or_else(|| {
        let message = format!(
            "{}: none of the {} frames shows a person who stands on a foot",
            run.display(),
            frames.len()
        );
        Failure::new(ExitKind::Degraded, message)
            .with_hint("use a run in which a person walks about, or stands")
    })?;
    if found.vertical == Vertical::Leaning {
        let message =
            "the vertical is not known: nobody stands upright, and all feet are on one spot";
        let hint = "use a run in which a person walks about";
        return Err(Failure::new(ExitKind::Degraded, message).with_hint(hint));
    }
    Ok(found)
}

/// Fails if the skeletons are not where the cameras of this rig saw them, because the run was made with another rig.
fn check(rig: &Rig, run: &Path, frames: &[u64], skeletons: &Skeletons) -> Result<(), Failure> {
    let file = run.join(ViewLine::FILE);
    let text = failure::read_text(&file)?;
    let mut off: Vec<f64> = Vec::new();
    for line in runfiles::lines::<ViewLine>(&text).filter_map(Result::ok) {
        let camera = rig.camera(&line.view).ok_or_else(|| {
            let message = format!("{}: the rig has no camera {:?}", run.display(), line.view);
            Failure::new(ExitKind::Calibration, message).with_hint("give a run of this rig")
        })?;
        let skeleton = frames.binary_search(&line.frame).ok();
        let parts = line.fused.iter().flat_map(|pose| &pose.parts);
        let parts: Option<Vec<[f64; 2]>> = parts.map(|part| Some([part.x?, part.y?])).collect();
        let Some((skeleton, parts)) = skeleton.zip(parts) else {
            continue;
        };
        if parts.len() != skeleton::N_PARTS {
            continue;
        }
        let seen = PARSE14.from_parts(&parts);
        let [low, high] = seen.iter().fold(
            [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]],
            |all, joint| {
                [
                    [0, 1].map(|axis| all[0][axis].min(joint[axis])),
                    [0, 1].map(|axis| all[1][axis].max(joint[axis])),
                ]
            },
        );
        let size = (high[0] - low[0]).max(high[1] - low[1]).max(1.0);
        let both = seen.iter().zip(&skeletons[skeleton]);
        let both = both.filter_map(|(seen, joint)| {
            let projected = camera.project(joint.as_ref()?);
            let away = projected.map(|projected| (projected - Point2::from(*seen)).norm());
            Some(away.unwrap_or(f64::INFINITY) / size)
        });
        off.extend(both);
    }
    let n = off.len();
    let median = Sorted::new(off).upper_median().filter(|_| n >= LEAST_SEEN);
    match median {
        None => {
            let message = format!(
                "{}: only {n} joints were seen, but {LEAST_SEEN} are needed",
                run.display()
            );
            Err(Failure::new(ExitKind::Degraded, message))
        }
        Some(share) if share > MOST_OFF => {
            let message = format!(
                "{}: the run does not belong to this rig: its joints, projected into the cameras, are {:.0} % of the person's size away \
                 from the joints seen there (median; at most {:.0} % is allowed)",
                run.display(),
                100.0 * share,
                100.0 * MOST_OFF
            );
            Err(Failure::new(ExitKind::Degraded, message)
                .with_hint("run a deployment with the current rig, and pass that run"))
        }
        Some(_) => Ok(()),
    }
}
