//! The page of a run: pictures with skeletons, the 3D skeleton, the report of the run, and its latency.

use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};

use exports::report::run::{Eye, Moment, Page, Picture, Space, Strip, Table, Verdict};
use failure::{ExitKind, Failure, in_file};
use geometry::Rig;
use image::codecs::jpeg::JpegEncoder;
use runfiles::{FrameLine, LatencyReport, Line as _};
use skeleton::JointSet;

/// Name of the page in the folder of a run.
pub const FILE: &str = "report.html";
/// Maximum number of skeletons drawn in the 3D view.
const MOST_MOMENTS: usize = 400;
/// Number of frames whose pictures are shown.
const N_STRIPS: usize = 3;
const JPEG_QUALITY: u8 = 85;

/// Content of the page.
pub(super) struct Content<'a> {
    pub(super) name: &'a str,
    pub(super) verdict: Verdict,
    /// The report as text. Each line becomes a row of a table.
    pub(super) text: &'a str,
    pub(super) latency: Option<&'a LatencyReport>,
    pub(super) cameras: &'a [String],
    pub(super) rig: &'a Rig,
    pub(super) joints: &'static JointSet,
}

/// Writes the page to the folder of the run.
///
/// # Errors
///
/// Fails if the results cannot be read, or the page cannot be written.
pub(super) fn write(folder: &Path, content: &Content<'_>) -> Result<PathBuf, Failure> {
    let file = folder.join(FILE);
    let page = exports::report::run::html(&page(folder, content)?);
    files::replace(&file, page.as_bytes()).map_err(|error| in_file(&file, &error))?;
    Ok(file)
}

fn page(folder: &Path, content: &Content<'_>) -> Result<Page, Failure> {
    let mut tables = vec![reported(content.text)];
    tables.extend(content.latency.map(latency));
    Ok(Page {
        title: format!("Parallax: {}", content.name),
        lead: content.text.lines().next().unwrap_or_default().to_owned(),
        verdict: Some(content.verdict.clone()),
        limits: Vec::new(),
        space: space(folder, content)?,
        marks: Vec::new(),
        tables,
        legend: "Thick lines: the skeleton in space as the view sees it, the right side orange, the left side blue. Thin grey lines: the pose that the view found alone. Pink: where one part must be according to the other views. \
                 All pictures are in overlays/."
            .to_owned(),
        strips: strips(folder, content.cameras),
    })
}

/// Returns the lines of the report as a table: the first column has the keyword, the second the text.
fn reported(text: &str) -> Table {
    let rows = text.lines().skip(1).map(|line| {
        let (word, rest) = line.split_at_checked(16).unwrap_or((line, ""));
        vec![word.trim().to_owned(), rest.trim().to_owned()]
    });
    Table {
        heading: "The run".to_owned(),
        note: String::new(),
        columns: vec![String::new(); 2],
        rows: rows.collect(),
    }
}

fn latency(report: &LatencyReport) -> Table {
    let all = [("capture to result", &report.end_to_end)].into_iter();
    let all = all.chain(report.stages.iter().map(|(stage, latency)| (stage.as_str(), latency)));
    let rows = all.map(|(what, latency)| {
        let numbers = [latency.p50_ms, latency.p99_ms, latency.max_ms].map(|ms| format!("{ms:.1}"));
        [
            vec![what.to_owned(), latency.count.to_string()],
            numbers.into(),
        ]
        .concat()
    });
    Table {
        heading: "Latency".to_owned(),
        note:
            "Times in milliseconds: from capture to result, then the computing time of every stage."
                .to_owned(),
        columns: ["", "measured", "median", "99 of 100", "longest"].map(str::to_owned).into(),
        rows: rows.collect(),
    }
}

fn space(folder: &Path, content: &Content<'_>) -> Result<Space, Failure> {
    let joints = content.joints;
    let eyes = content.rig.cameras().iter().map(|camera| Eye {
        name: camera.name.clone(),
        at: camera.centre_in_world().coords.into(),
        axis: camera.axis_in_world().into_inner().into(),
    });
    let up = content.rig.up_in_world();
    Ok(Space {
        joints: joints.joints.iter().map(|joint| joint.name.to_owned()).collect(),
        limbs: joints.limbs.to_vec(),
        eyes: eyes.collect(),
        up: up.map_or([0.0, 0.0, 1.0], |up| up.into_inner().into()),
        moments: moments(folder, content)?,
    })
}

/// Returns the followed person in as many results as can be drawn, at equal time intervals.
fn moments(folder: &Path, content: &Content<'_>) -> Result<Vec<Moment>, Failure> {
    let path = folder.join(FrameLine::FILE);
    let lines = || -> Result<_, Failure> {
        let file = files::open(&path).map_err(|error| in_file(&path, &error))?;
        Ok(BufReader::new(file).lines())
    };
    let n_lines = lines()?.count();
    let mut moments = Vec::new();
    for text in lines()?.step_by(n_lines.div_ceil(MOST_MOMENTS).max(1)) {
        let text = text.map_err(|error| in_file(&path, &error))?;
        let Some(line) = runfiles::lines::<FrameLine>(&text).next() else {
            continue;
        };
        let line = line.map_err(|error| Failure::new(ExitKind::Run, error))?;
        let person = line.followed();
        let found = content.joints.joints.iter().map(|joint| {
            let placed = person?.joints.get(joint.name)?.placed()?;
            Some(placed.position_m)
        });
        let missing = content.cameras.iter().map(|camera| {
            let why = line.views_missing.get(camera)?;
            Some(why.text().to_owned())
        });
        moments.push(Moment {
            frame: line.frame,
            seconds: line.time_s.unwrap_or(line.frame as f64),
            found: found.collect(),
            truth: Vec::new(),
            views: missing.collect(),
        });
    }
    Ok(moments)
}

/// Returns the overlays of three frames for all views: at the start, in the middle and at the end of the run.
fn strips(folder: &Path, cameras: &[String]) -> Vec<Strip> {
    let overlays = folder.join("overlays");
    let mut names: Vec<String> = cameras
        .iter()
        .filter_map(|camera| std::fs::read_dir(overlays.join(camera)).ok())
        .flatten()
        .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
        .collect();
    names.sort();
    names.dedup();
    let n = names.len().min(N_STRIPS);
    let shown = (0..n).map(|nth| &names[(2 * nth + 1) * names.len() / (2 * n)]);
    let strip = |name: &String| Strip {
        caption: caption(name),
        pictures: cameras
            .iter()
            .map(|camera| Picture {
                caption: camera.clone(),
                jpeg: jpeg(&overlays.join(camera).join(name))
                    .ok_or_else(|| "no picture".to_owned()),
            })
            .collect(),
    };
    shown.map(strip).collect()
}

/// Returns the caption for pictures with a file name such as `000010.png`.
fn caption(name: &str) -> String {
    let number = name.trim_end_matches(".png");
    let number = number.parse().map_or(number.to_owned(), |value: u64| value.to_string());
    format!("frame {number}")
}

fn jpeg(file: &Path) -> Option<Vec<u8>> {
    let bytes = files::read(file, files::PICTURE).ok()?;
    let picture = image::load_from_memory(&bytes).ok()?.into_rgb8();
    let mut jpeg = Vec::new();
    let encoder = JpegEncoder::new_with_quality(&mut jpeg, JPEG_QUALITY);
    picture.write_with_encoder(encoder).ok()?;
    Some(jpeg)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn picture_files_are_named_after_their_frames() {
        assert_eq!(caption("000000.png"), "frame 0");
        assert_eq!(caption("000120.png"), "frame 120");
    }

    #[test]
    fn a_line_of_the_report_becomes_a_row() {
        let table = reported("room: 2 frames\n  3D            2 of 2 frames\n    a reason\n");
        assert_eq!(table.rows[0], ["3D", "2 of 2 frames"]);
        assert_eq!(table.rows.len(), 2);
    }
}
