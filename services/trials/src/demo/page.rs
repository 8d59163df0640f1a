//! Content of the demo's HTML page: tables, 3D skeletons, and pictures.

use std::path::Path;

use exports::report::run::{Eye, Mark, Page, Picture, Space, Strip, Table};
use image::codecs::jpeg::JpegEncoder;
use launch::budget;
use skeleton::PARSE14;

use super::report::Report;
use super::run::{Run, VICTIM};
use crate::trial::Point;
use crate::trial::cost::Cost;
use crate::trial::results::FrameResult;
use crate::trial::synthetic::SyntheticDeployment;

const JPEG_QUALITY: u8 = 88;

/// Builds the page.
///
/// * `folder`: the output folder of the run, with the overlays.
pub(super) fn page(
    run: &Run<'_>,
    report: &Report,
    synthetic: &SyntheticDeployment,
    folder: &Path,
) -> Page {
    let clock = Clock::new(run);
    let posed = || run.results.iter().filter(|result| result.is_posed());
    let mut tables = Vec::new();
    if let Some(cost) = &report.cost {
        tables.push(of_cost(cost, &run.cameras[VICTIM]));
    }
    tables.extend([accuracy(report), latency(run), accounts(run)]);
    Page {
        title: "Parallax: the demo".to_owned(),
        lead: format!(
            "{} cameras saw a synthetic person: {} frames at {} per second. {} processes and their supervisor \
             produced {}: {} with a skeleton in space, {} of these from all {} cameras.",
            run.cameras.len(),
            run.n_frames,
            run.rate_hz,
            run.processes.len(),
            plural(run.results.len(), "result"),
            posed().count(),
            posed()
                .filter(|posed| posed.views.iter().all(|view| view.missing.is_none()))
                .count(),
            run.cameras.len(),
        ),
        verdict: None,
        limits: report.limits.clone(),
        space: space(run, synthetic),
        marks: marks(report.cost.as_ref(), &clock),
        tables,
        legend: "Thick lines: the pose that all views agreed on, right orange, left blue. Thin grey lines: the pose that the view \
                 found alone. Pink lines: possible positions of the right wrist according to the other views."
            .to_owned(),
        strips: strips(run, report.cost.as_ref(), folder),
    }
}

fn plural(n: usize, what: &str) -> String {
    format!("{n} {what}{}", if n == 1 { "" } else { "s" })
}

/// Converts times of the run to seconds since the first frame.
struct Clock {
    first_ms: f64,
}

impl Clock {
    fn new(run: &Run<'_>) -> Self {
        let begin = |result: &FrameResult| {
            Some(result.captured_ms()? - 1000.0 * result.frame as f64 / run.rate_hz)
        };
        let first = run.results.iter().filter_map(begin).reduce(f64::min);
        Self {
            first_ms: first.unwrap_or(0.0),
        }
    }

    fn seconds(&self, ms: f64) -> f64 {
        (ms - self.first_ms) / 1000.0
    }
}

fn marks(cost: Option<&Cost>, clock: &Clock) -> Vec<Mark> {
    let Some(killed) = cost.and_then(|cost| cost.killed_at_ms) else {
        return Vec::new();
    };
    let mark = |ms: f64, what: &str| Mark {
        seconds: clock.seconds(ms),
        what: what.to_owned(),
    };
    let back = cost.and_then(|cost| cost.back_ms);
    let back = back.map(|back| mark(killed + back, "back"));
    [mark(killed, "killed")].into_iter().chain(back).collect()
}

fn space(run: &Run<'_>, synthetic: &SyntheticDeployment) -> Space {
    let moment =
        |(result, people): (&FrameResult, &Vec<Vec<Point>>)| exports::report::run::Moment {
            frame: result.frame,
            seconds: result.frame as f64 / run.rate_hz,
            found: people.first().map_or_else(Vec::new, |truth| result.nearest(truth)),
            truth: people.first().cloned().unwrap_or_default(),
            views: result.views.iter().map(|view| view.missing.clone()).collect(),
        };
    let up = synthetic.rig.up_in_world();
    Space {
        joints: PARSE14.joints.iter().map(|joint| joint.name.to_owned()).collect(),
        limbs: PARSE14.limbs.to_vec(),
        eyes: synthetic
            .rig
            .cameras()
            .iter()
            .map(|camera| Eye {
                name: camera.name.clone(),
                at: camera.centre_in_world().coords.into(),
                axis: camera.axis_in_world().into_inner().into(),
            })
            .collect(),
        up: up.map_or([0.0, 0.0, 1.0], |up| up.into_inner().into()),
        moments: run.results.iter().zip(run.truth).map(moment).collect(),
    }
}

fn table<const N: usize>(heading: &str, note: &str, columns: [&str; N]) -> Table {
    Table {
        heading: heading.to_owned(),
        note: note.to_owned(),
        columns: columns.map(str::to_owned).into(),
        rows: Vec::new(),
    }
}

fn number(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(|| "–".to_owned(), |value| format!("{value:.digits$}"))
}

fn of_cost(cost: &Cost, camera: &str) -> Table {
    let note = format!(
        "The process of {camera} was killed (SIGKILL) while it worked. Times are measured from the kill. The camera counts as \
         back when a result uses one of its frames."
    );
    let mut table = table("Cost of the killed camera", &note, ["", ""]);
    let ms = |value: Option<f64>| {
        value.map_or_else(|| "never".to_owned(), |value| format!("{value:.0} ms"))
    };
    let count =
        |value: Option<u64>| value.map_or_else(|| "–".to_owned(), |number| number.to_string());
    table.rows = [
        ("time until the death was noticed", ms(cost.noticed_ms)),
        ("time until the restart", ms(cost.restarted_ms)),
        (
            "time until a frame was used in a result again",
            ms(cost.back_ms),
        ),
        ("last frame before the kill", count(cost.last_frame)),
        ("first frame after the kill", count(cost.first_frame)),
        (
            "frames between these two, not used in any result",
            count(cost.frames_lost),
        ),
        (
            "results of these frames from the other views",
            cost.results_without_it.to_string(),
        ),
        (
            "longest time between two results during the outage",
            ms(cost.longest_pause_ms),
        ),
        (
            "longest time between two results before the kill",
            ms(cost.usual_pause_ms),
        ),
    ]
    .map(|(what, value)| vec![what.to_owned(), value])
    .into();
    table
}

fn accuracy(report: &Report) -> Table {
    let note = "PCP3D at gamma 0.5: share of the segments whose mean end error is at most half their length. MPJPE: mean \
                distance of the joints from the truth.";
    let mut columns = vec![String::new()];
    columns.extend(report.scores.iter().map(|score| score.0.to_owned()));
    let scores = || report.scores.iter().map(|score| &score.1);
    let row = |what: &str, cells: Vec<String>| [vec![what.to_owned()], cells].concat();
    let mut rows = vec![
        row(
            "skeletons",
            scores().map(|score| score.skeletons.to_string()).collect(),
        ),
        row(
            "PCP3D, %",
            scores().map(|score| number(score.pcp3d_percent, 1)).collect(),
        ),
        row(
            "MPJPE, mm",
            scores().map(|score| number(score.mpjpe_mm, 0)).collect(),
        ),
        row(
            "joints not found, %",
            scores().map(|score| number(score.lost_percent, 1)).collect(),
        ),
    ];
    for (nth, (name, _)) in report.scores[0].1.segments.iter().enumerate() {
        let cells = scores().map(|score| number(score.segments[nth].1, 0));
        rows.push(row(&format!("{name}, %"), cells.collect()));
    }
    Table {
        columns,
        rows,
        ..table("Accuracy against the truth", note, [])
    }
}

fn latency(run: &Run<'_>) -> Table {
    let note = "Computing time of each stage in milliseconds. End to end is the time from the capture of a frame to its skeleton \
                in space, including waiting times. Unlike real cameras, these cameras also render their pictures.";
    let mut table = table("Latency", note, ["stage", "frames", "p50", "p99", "max"]);
    let latency = run.report.recorded().latency();
    let rows = latency.into_iter().flat_map(budget::rows);
    table.rows = rows
        .map(|(name, percentiles)| {
            let times = [percentiles.p50_ms, percentiles.p99_ms, percentiles.max_ms]
                .map(|ms| number(Some(ms), 1));
            [
                vec![name.to_owned(), percentiles.count.to_string()],
                times.into(),
            ]
            .concat()
        })
        .collect();
    table
}

fn accounts(run: &Run<'_>) -> Table {
    let note = "Every frame of every view is counted once: used in a result, without a person (empty), too late, skipped for \
                lack of time, lost while its process was away, or unknown because a killed process had it.";
    let columns = [
        "view", "frames", "used", "empty", "late", "skipped", "lost", "unknown",
    ];
    let mut table = table("Frames accounted for", note, columns);
    table.rows = run
        .report
        .views()
        .iter()
        .map(|view| {
            let counts = [
                view.frames,
                view.used,
                view.empty,
                view.late,
                view.dropped,
                view.lost,
                view.unanswered,
            ];
            [
                vec![view.name.clone()],
                counts.map(|count| count.to_string()).into(),
            ]
            .concat()
        })
        .collect();
    table
}

/// Returns rows of pictures with overlays: the frames that [`chosen`] returns, in all views.
fn strips(run: &Run<'_>, cost: Option<&Cost>, folder: &Path) -> Vec<Strip> {
    let file = |camera: &String, frame: u64| {
        folder.join("overlays").join(camera).join(format!("{frame:06}.png"))
    };
    let is_drawn = |result: &&FrameResult| {
        run.cameras.iter().any(|camera| file(camera, result.frame).exists())
    };
    let drawn: Vec<&FrameResult> = run.results.iter().filter(is_drawn).collect();
    let shown = chosen(&drawn, cost.and_then(|cost| cost.last_frame));
    let picture = |result: &FrameResult, view: usize| Picture {
        caption: run.cameras[view].clone(),
        jpeg: jpeg(&file(&run.cameras[view], result.frame)).map_err(|_none| {
            let why = result.views[view].missing.as_deref();
            why.unwrap_or("no picture").to_owned()
        }),
    };
    let strip = |result: &&FrameResult| Strip {
        caption: format!(
            "frame {}, {:.1} s",
            result.frame,
            result.frame as f64 / run.rate_hz
        ),
        pictures: (0..run.cameras.len()).map(|view| picture(result, view)).collect(),
    };
    shown.iter().map(strip).collect()
}

/// Returns the frames to show: the first complete frame, the last complete frame before the kill, the first frame without the killed
/// camera, and the last complete frame.
///
/// * `drawn`: the frames with overlays.
/// * `killed_at`: the last frame of the killed camera before the kill.
fn chosen<'a>(drawn: &[&'a FrameResult], killed_at: Option<u64>) -> Vec<&'a FrameResult> {
    let middle = drawn.get(drawn.len() / 2).map_or(0, |drawn| drawn.frame);
    let killed_at = killed_at.unwrap_or(middle);
    let is_complete =
        |result: &&&FrameResult| result.views.iter().all(|view| view.missing.is_none());
    let (before, after): (Vec<&FrameResult>, Vec<&FrameResult>) =
        drawn.iter().partition(|result| result.frame <= killed_at);
    let without = after.iter().find(|result| result.views[VICTIM].missing.is_some());
    let four = [
        before.iter().find(is_complete),
        before.iter().rev().find(is_complete),
        without,
        after.iter().rev().find(is_complete),
    ];
    let mut shown: Vec<&FrameResult> = four.into_iter().flatten().copied().collect();
    shown.dedup_by_key(|result| result.frame);
    shown
}

/// Reads an overlay as JPEG.
fn jpeg(file: &Path) -> Result<Vec<u8>, image::ImageError> {
    let picture = image::open(file)?.into_rgb8();
    let mut bytes = Vec::new();
    picture.write_with_encoder(JpegEncoder::new_with_quality(&mut bytes, JPEG_QUALITY))?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trial::results::ViewResult;

    /// Returns a frame with overlays, either with all four cameras, or without the killed one.
    fn drawn(frame: u64, is_complete: bool) -> FrameResult {
        let mut views = vec![ViewResult::default(); 4];
        views[VICTIM].missing = (!is_complete).then(|| "process lost".to_owned());
        FrameResult {
            frame,
            epoch: 0,
            sent_ms: 0.0,
            people: Vec::new(),
            views,
        }
    }

    fn frames(of: &[(u64, bool)], killed_at: Option<u64>) -> Vec<u64> {
        let results: Vec<FrameResult> = of.iter().map(|frame| drawn(frame.0, frame.1)).collect();
        let all: Vec<&FrameResult> = results.iter().collect();
        chosen(&all, killed_at).iter().map(|result| result.frame).collect()
    }

    #[test]
    fn frames_before_during_and_after_the_absence_are_shown() {
        let run = [
            (0, true),
            (4, true),
            (8, false),
            (12, true),
            (44, false),
            (48, false),
            (52, true),
            (96, true),
        ];
        assert_eq!(frames(&run, Some(40)), [0, 12, 44, 96]);
    }

    #[test]
    fn few_overlays_give_few_strips_without_duplicates() {
        assert_eq!(frames(&[], Some(40)), [0; 0]);
        assert_eq!(frames(&[(4, true)], Some(40)), [4]);
        assert_eq!(frames(&[(0, true), (4, true), (8, true)], None), [0, 4, 8]);
    }
}
