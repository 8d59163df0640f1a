//! Everything that is written about a frame, and at the end about the run.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write as _};
use std::path::{Path, PathBuf};

use messages::Status;
use serde::Serialize;
use serde_json::{Value, json};

use crate::latency::Report;
use crate::pose3d::{is_placed, joints};
use crate::{
    Config, Folder, FolderError, FrameRecord, Latency, Scene, overlay, pose2d, pose3d, trc,
};

/// What was seen and what was missed, over the whole run.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Summary {
    /// Results that were received.
    pub frames: u64,
    /// Of these with a skeleton.
    pub frames_with_pose: u64,
    /// Of these without every view of the rig.
    pub frames_with_views_missing: u64,
    /// How often every view was used, by name.
    pub views_used: Vec<(String, u64)>,
    /// Root mean square reprojection error over all joints, pixels of the frame.
    pub reprojection_px: Option<f64>,
    /// Frames of all views that the cameras' side dropped.
    pub frames_dropped_by_capture: u64,
    /// Results whose number was skipped, as far as the recorder can tell.
    pub frames_missed: u64,
    /// Results that came but were not written, because writing was too slow.
    pub frames_not_recorded: u64,
    /// Writes that failed.
    pub writes_failed: u64,
    /// The first of those failures.
    pub first_failure: Option<String>,
}

/// The files of a run.
#[derive(Debug)]
pub struct Output {
    scene: Scene,
    folder: Folder,
    pose3d_jsonl: BufWriter<File>,
    pose3d_csv: BufWriter<File>,
    pose2d_jsonl: BufWriter<File>,
    trc_rows: Option<BufWriter<File>>,
    overlays: Option<PathBuf>,
    epipolar_part: usize,
    latency: Latency,
    summary: Summary,
    views_used: Vec<u64>,
    squared_px: (f64, u64),
    last_frame: Option<u64>,
    dropped: Vec<u64>,
}

/// The output cannot be begun.
#[derive(Debug, thiserror::Error)]
pub enum OutputError {
    /// A file cannot be made.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// The histograms cannot be made.
    #[error("cannot make the latency histograms")]
    Latency(#[from] hdrhistogram::CreationError),
    /// The first line cannot be written.
    #[error("cannot write to the output folder")]
    Write(#[from] io::Error),
}

impl Output {
    /// Begins the files of a run.
    ///
    /// * `n_workers`: fusion processes, for the latency of each.
    /// * `resume`: go on where a killed recorder stopped.
    ///
    /// # Errors
    ///
    /// [`OutputError`].
    pub fn begin(
        scene: Scene,
        config: &Config,
        n_workers: usize,
        mut folder: Folder,
        resume: bool,
    ) -> Result<Self, OutputError> {
        let mut pose3d_csv = folder.file("pose3d.csv")?;
        if !resume {
            writeln!(pose3d_csv, "{}", pose3d::CSV_HEADER)?;
        }
        let trc_rows = if config.trc {
            Some(folder.file("pose3d.trc")?)
        } else {
            None
        };
        let overlays = if config.overlay_every > 0 {
            Some(folder.folder("overlays")?)
        } else {
            None
        };
        let n_views = scene.views.len();
        let earlier = if resume {
            earlier(&folder.part("pose3d.jsonl"), &scene)
        } else {
            Earlier::default()
        };
        Ok(Self {
            pose3d_jsonl: folder.file("pose3d.jsonl")?,
            pose2d_jsonl: folder.file("pose2d.jsonl")?,
            pose3d_csv,
            trc_rows,
            overlays,
            epipolar_part: config.epipolar_part.saturating_sub(1),
            latency: Latency::new(n_workers)?,
            summary: Summary {
                frames: earlier.frames,
                frames_with_pose: earlier.frames_with_pose,
                ..Summary::default()
            },
            views_used: if resume {
                earlier.views_used
            } else {
                vec![0; n_views]
            },
            squared_px: earlier.squared_px,
            last_frame: earlier.last_frame,
            dropped: vec![0; n_views],
            scene,
            folder,
        })
    }

    /// Writes one frame. What fails is counted, and never stops anything.
    pub fn frame(&mut self, record: &FrameRecord) {
        self.count(record);
        self.latency.add(record);
        let (scene, pose) = (&self.scene, &record.pose3d);
        let line = pose3d::json_line(scene, pose);
        let rows = pose3d::csv_rows(scene, pose);
        let lines = pose2d::json_lines(scene, record);
        let row = trc::row(scene, self.summary.frames, pose);
        let outcomes = [
            append(&mut self.pose3d_jsonl, &format!("{line}\n")),
            append(&mut self.pose3d_csv, &rows),
            append(&mut self.pose2d_jsonl, &lines),
            self.trc_rows.as_mut().map_or(Ok(()), |it| append(it, &row)),
        ];
        for outcome in outcomes {
            self.note(outcome);
        }
        for view in 0..self.views_used.len() {
            let outcome = self.draw(record, view);
            self.note(outcome);
        }
    }

    fn draw(&self, record: &FrameRecord, view: usize) -> io::Result<()> {
        let Some(folder) = &self.overlays else {
            return Ok(());
        };
        let Some(canvas) = overlay::draw(&self.scene, record, view, self.epipolar_part) else {
            return Ok(());
        };
        let folder = folder.join(&self.scene.views[view].name);
        fs::create_dir_all(&folder)?;
        let file = folder.join(format!("{:06}.png", record.frame()));
        canvas.save_png(&file).map_err(io::Error::other)
    }

    /// Counts results that came but could not be written in time.
    pub fn missed(&mut self, n: u64) {
        self.summary.frames_not_recorded += n;
    }

    /// The scene that messages are read with.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// What was seen so far.
    pub fn summary(&self) -> Summary {
        let (sum, n) = self.squared_px;
        let names = self.scene.views.iter().map(|it| it.name.clone());
        Summary {
            views_used: names.zip(self.views_used.iter().copied()).collect(),
            reprojection_px: (n > 0).then(|| (sum / n as f64).sqrt()),
            frames_dropped_by_capture: self.dropped.iter().sum(),
            ..self.summary.clone()
        }
    }

    /// Writes what is known of the whole run, and gives every file its name.
    ///
    /// # Errors
    ///
    /// [`OutputError`]; what could be written has been.
    pub fn finish(mut self) -> Result<Summary, OutputError> {
        let report = self.latency.report();
        let outcomes = [
            self.pose3d_jsonl.flush(),
            self.pose3d_csv.flush(),
            self.pose2d_jsonl.flush(),
        ];
        for outcome in outcomes {
            self.note(outcome);
        }
        if let Some(rows) = self.trc_rows.take() {
            drop(rows);
            let outcome = self.head_trc();
            self.note(outcome);
        }
        let summary = self.summary();
        let latency = serde_json::to_value(&report).map_err(io::Error::from)?;
        let whole = self.whole(&summary, &report);
        for (name, value) in [("latency.json", latency), ("summary.json", whole)] {
            writeln!(self.folder.file(name)?, "{value:#}")?;
        }
        self.folder.finish()?;
        Ok(summary)
    }

    /// `pose3d.trc` says first how many rows follow, so its head is written last.
    fn head_trc(&self) -> io::Result<()> {
        let path = self.folder.part("pose3d.trc");
        let rows = fs::read_to_string(&path)?;
        let n_rows = rows.lines().count() as u64;
        fs::write(&path, trc::header(&self.scene, n_rows) + &rows)
    }

    fn whole(&self, summary: &Summary, report: &Report) -> Value {
        let views: Vec<Value> = self
            .scene
            .views
            .iter()
            .map(|it| {
                json!({
                    "name": it.name,
                    "frame_size": it.framing.out_size(),
                    "source_from_frame": it.framing.source_from_output(),
                })
            })
            .collect();
        json!({
            "schema_version": 1,
            "summary": summary,
            "latency": report,
            "views": views,
            "joints": self.scene.joints.name,
            "frame_rate_hz": self.scene.frame_rate_hz,
            "trc_axes": if self.scene.up_in_world.is_some() { "y up" } else { "the world's: the rig does not say which way is up" },
        })
    }

    fn count(&mut self, record: &FrameRecord) {
        let pose = &record.pose3d;
        self.summary.frames += 1;
        let step = self.scene.frame_step.max(1);
        let skipped = self.last_frame.map_or(0, |last| {
            (record.frame().saturating_sub(last) / step).saturating_sub(1)
        });
        self.summary.frames_missed += skipped;
        self.last_frame = Some(record.frame());
        self.summary.frames_with_pose += u64::from(pose.status == Status::OK);
        let n_present = (pose.views_present & mask(self.views_used.len())).count_ones() as usize;
        self.summary.frames_with_views_missing += u64::from(n_present < self.views_used.len());
        for (view, count) in self.views_used.iter_mut().enumerate() {
            *count += u64::from(pose.views_used >> view & 1);
        }
        for (_, joint) in joints(&self.scene, pose) {
            if is_placed(joint) && joint.reprojection_px.is_finite() {
                self.squared_px.0 += joint.reprojection_px.powi(2);
                self.squared_px.1 += 1;
            }
        }
        for (view, it) in record.views.iter().enumerate() {
            if let (Some(count), Some(frame)) = (self.dropped.get_mut(view), &it.frame) {
                *count = frame.n_dropped;
            }
        }
    }

    /// Reports the first failure, counts all.
    fn note(&mut self, outcome: io::Result<()>) {
        if let Err(error) = outcome {
            if self.summary.writes_failed == 0 {
                tracing::error!(%error, "cannot write results; the pipeline goes on, failures are counted");
                self.summary.first_failure = Some(error.to_string());
            }
            self.summary.writes_failed += 1;
        }
    }
}

/// What a killed recorder had written, as far as the summary needs it.
#[derive(Debug, Default)]
struct Earlier {
    frames: u64,
    frames_with_pose: u64,
    views_used: Vec<u64>,
    squared_px: (f64, u64),
    last_frame: Option<u64>,
}

/// Reads `pose3d.jsonl` again; a file that is not there, or a broken line, counts for nothing.
fn earlier(file: &Path, scene: &Scene) -> Earlier {
    let mut earlier = Earlier {
        views_used: vec![0; scene.views.len()],
        ..Earlier::default()
    };
    let text = fs::read_to_string(file).unwrap_or_default();
    for line in text.lines() {
        let Ok(value) = serde_json::from_str::<Value>(line) else {
            continue;
        };
        earlier.frames += 1;
        earlier.frames_with_pose += u64::from(value["status"] == Status::OK.reason());
        earlier.last_frame = value["frame"].as_u64().or(earlier.last_frame);
        let used = value["views_used"].as_array();
        for (count, view) in earlier.views_used.iter_mut().zip(&scene.views) {
            let is_used = used.is_some_and(|it| it.iter().any(|it| *it == view.name.as_str()));
            *count += u64::from(is_used);
        }
        let joints = value["joints"].as_object();
        for px in joints.into_iter().flat_map(|it| it.values()) {
            if let Some(px) = px["reprojection_px"].as_f64() {
                earlier.squared_px.0 += px.powi(2);
                earlier.squared_px.1 += 1;
            }
        }
    }
    earlier
}

fn append(file: &mut BufWriter<File>, text: &str) -> io::Result<()> {
    file.write_all(text.as_bytes())?;
    file.flush()
}

fn mask(n_views: usize) -> u32 {
    u32::MAX
        .checked_shr(32_u32.saturating_sub(n_views as u32))
        .unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{record, scene};

    fn written(records: Vec<FrameRecord>) -> (tempfile::TempDir, Summary) {
        let dir = tempfile::tempdir().unwrap();
        let folder = Folder::open(dir.path(), false).unwrap();
        let mut output = Output::begin(scene(), &Config::default(), 1, folder, false).unwrap();
        for record in records {
            output.frame(&record);
        }
        let summary = output.finish().unwrap();
        (dir, summary)
    }

    fn text(dir: &tempfile::TempDir, name: &str) -> String {
        fs::read_to_string(dir.path().join(name)).unwrap()
    }

    #[test]
    fn all_files_are_there_at_the_end_and_no_part() {
        let (dir, _) = written(vec![record(0), record(2)]);
        let mut names: Vec<String> = fs::read_dir(dir.path())
            .unwrap()
            .map(|it| it.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        let expected = [
            "latency.json",
            "overlays",
            "pose2d.jsonl",
            "pose3d.csv",
            "pose3d.jsonl",
            "pose3d.trc",
            "summary.json",
        ];
        assert_eq!(names, expected);
        assert_eq!(text(&dir, "pose3d.jsonl").lines().count(), 2);
        assert_eq!(text(&dir, "pose3d.csv").lines().count(), 1 + 2 * 14);
        assert_eq!(text(&dir, "pose2d.jsonl").lines().count(), 4);
        let trc = evaluation::Trc::parse(&text(&dir, "pose3d.trc")).unwrap();
        assert_eq!(trc.frames.len(), 2);
    }

    #[test]
    fn skipped_frames_and_missing_views_are_counted() {
        let mut last = record(8);
        last.pose3d.views_present = 0b01;
        // Every second frame is used: 0, 2, (4, 6), 8.
        let (_, summary) = written(vec![record(0), record(2), last]);
        assert_eq!(summary.frames, 3);
        assert_eq!(summary.frames_missed, 2);
        assert_eq!(summary.frames_with_views_missing, 1);
        assert_eq!(
            summary.views_used,
            [("left".to_owned(), 3), ("right".to_owned(), 3)]
        );
        assert!((summary.reprojection_px.unwrap() - 1.5).abs() < 1e-12);
    }

    #[test]
    fn a_restarted_recorder_counts_what_it_had_written() {
        let dir = tempfile::tempdir().unwrap();
        let begin = |resume| {
            let folder = Folder::open(dir.path(), resume).unwrap();
            Output::begin(scene(), &Config::default(), 1, folder, resume).unwrap()
        };
        let mut killed = begin(false);
        killed.frame(&record(0));
        killed.frame(&record(2));
        drop(killed);
        let mut restarted = begin(true);
        restarted.frame(&record(6));
        let summary = restarted.finish().unwrap();
        assert_eq!((summary.frames, summary.frames_with_pose), (3, 3));
        assert_eq!(summary.frames_missed, 1);
        assert_eq!(summary.views_used[0].1, 3);
        assert_eq!(text(&dir, "pose3d.csv").lines().count(), 1 + 3 * 14);
    }

    #[test]
    fn a_full_disk_is_counted_and_stops_nothing() {
        let dir = tempfile::tempdir().unwrap();
        let folder = Folder::open(dir.path(), false).unwrap();
        let mut output = Output::begin(scene(), &Config::default(), 1, folder, false).unwrap();
        output.pose3d_jsonl = BufWriter::new(File::create("/dev/full").unwrap());
        output.frame(&record(0));
        output.frame(&record(2));
        let summary = output.finish().unwrap();
        assert!(summary.writes_failed >= 2, "{summary:?}");
        assert!(summary.first_failure.is_some());
        assert_eq!(text(&dir, "pose3d.csv").lines().count(), 1 + 2 * 14);
    }
}
