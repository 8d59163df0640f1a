//! Writes all files about frames, and at the end the files about the run.

use std::fs;
use std::io;
use std::path::PathBuf;

use messages::Skeletons;
use runfiles::{
    FrameLine, LatencyReport, Line, RunSummary, SmoothReport, Summary, TimesLine, VERSION,
    ViewLine, ViewSummary,
};

use crate::lines::Lines;
use crate::smooth::Smoothing;
use crate::summary::Tally;
use deployment::results::Config;

use crate::{
    Absent, Folder, FolderError, FrameRecord, Latency, Scene, overlay, pose2d, pose3d, times, trc,
};

/// Part whose epipolar lines are drawn.
const EPIPOLAR_PART: usize = 6;
const TRC: &str = "pose3d.trc";
/// Bytes reserved for each file that is written at the end: several times what sixteen views need.
const RESERVED_BYTES: usize = 32 << 10;

/// The files of a run.
#[derive(Debug)]
pub struct Output {
    scene: Scene,
    folder: Folder,
    pose3d_jsonl: Lines,
    pose3d_csv: Lines,
    pose2d_jsonl: Lines,
    times_jsonl: Lines,
    trc_rows: Option<Lines>,
    overlays: Option<PathBuf>,
    epipolar_part: usize,
    latency: Latency,
    tally: Tally,
    smoothing: Option<Smoothing>,
}

/// Error if the output cannot be started.
#[derive(Debug, thiserror::Error)]
pub enum OutputError {
    /// A file cannot be created.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// The histograms cannot be created.
    #[error("cannot create the latency histograms")]
    Latency(#[from] hdrhistogram::CreationError),
    /// The first line cannot be written.
    #[error("cannot write to the output folder")]
    Write(#[from] io::Error),
}

impl Output {
    /// Starts the files of a run, and reserves space for the files that are written at the end.
    ///
    /// * `n_workers`: number of fusion processes, for the latency of each.
    /// * `folder`: the output folder. If it is resumed, the files of a killed process are continued.
    ///
    /// # Errors
    ///
    /// Fails with [`OutputError`] if the files cannot be started.
    pub fn begin(
        scene: Scene,
        config: &Config,
        n_workers: usize,
        mut folder: Folder,
    ) -> Result<Self, OutputError> {
        for name in [LatencyReport::FILE, RunSummary::FILE] {
            folder.reserve(name, RESERVED_BYTES)?;
        }
        let mut lines =
            |name| -> Result<Lines, OutputError> { Ok(Lines::new(folder.file(name)?)?) };
        let mut pose3d_csv = lines("pose3d.csv")?;
        if pose3d_csv.is_empty() {
            pose3d_csv.append(&format!("{}\n", pose3d::CSV_HEADER))?;
        }
        let (pose3d_jsonl, pose2d_jsonl) = (lines(FrameLine::FILE)?, lines(ViewLine::FILE)?);
        let times_jsonl = lines(TimesLine::FILE)?;
        let trc_rows = if scene.frame_rate_hz.is_some() {
            Some(lines(TRC)?)
        } else {
            None
        };
        let overlays = if config.overlay_every > 0 {
            Some(folder.folder("overlays")?)
        } else {
            None
        };
        Ok(Self {
            pose3d_jsonl,
            pose2d_jsonl,
            times_jsonl,
            pose3d_csv,
            trc_rows,
            overlays,
            epipolar_part: EPIPOLAR_PART.min(scene.model.n_parts().saturating_sub(1)),
            latency: Latency::new(n_workers)?,
            tally: Tally::resume(&scene, &folder.part(FrameLine::FILE)),
            scene,
            folder,
            smoothing: None,
        })
    }

    /// Also writes smoothed joints.
    ///
    /// # Errors
    ///
    /// Fails with [`OutputError`] if the file cannot be started.
    pub fn smooth(&mut self) -> Result<(), OutputError> {
        let file = self.folder.file(FrameLine::SMOOTHED_FILE)?;
        self.smoothing = Some(Smoothing::begin(&self.scene, file)?);
        self.folder.reserve(SmoothReport::FILE, RESERVED_BYTES)?;
        Ok(())
    }

    /// Returns the first frame without a line; `None` if there are no lines.
    pub fn next_frame(&self) -> Option<u64> {
        let step = self.scene.frame_step.max(1);
        self.tally.last_frame().map(|last_frame| last_frame.saturating_add(step))
    }

    /// Writes frames without a result, with the reason. Also writes earlier frames for which no message came.
    pub fn absent(&mut self, absent: &[Absent]) {
        for it in absent {
            self.fill_up_to(it.frame);
            self.without(it);
        }
    }

    /// Writes lines for frames that were left out because the disk was too slow.
    pub(crate) fn fill_up_to(&mut self, frame: u64) {
        let begin = self.next_frame().unwrap_or(frame);
        for frame in (begin..frame).step_by(self.scene.frame_step.max(1) as usize) {
            self.without(&Absent {
                frame,
                reason: "its result could not be written".to_owned(),
                views: Vec::new(),
            });
        }
    }

    fn without(&mut self, absent: &Absent) {
        let scene = &self.scene;
        let nothing = pose3d::nothing(absent.frame);
        let line = pose3d::absent_line(scene, absent);
        if self.begin_frame(line) {
            self.tally.without(absent.frame);
            self.rows(&nothing);
        }
    }

    /// Writes the line of a frame. If that fails, nothing else of the frame is written, and the frame does not count as written.
    fn begin_frame(&mut self, line: FrameLine) -> bool {
        let smoothed = self.smoothing.as_mut().map_or(Ok(()), |smoothing| smoothing.frame(&line));
        let written = append(&mut self.pose3d_jsonl, [line]);
        let is_written = written.is_ok();
        self.note(smoothed);
        self.note(written);
        is_written
    }

    /// Writes the rows of a frame to the tables.
    fn rows(&mut self, frame: &Skeletons) {
        let row = trc::row(&self.scene, self.tally.n_lines(), frame);
        let rows = self.pose3d_csv.append(&pose3d::csv_rows(&self.scene, frame));
        let row = self.trc_rows.as_mut().map_or(Ok(()), |rows| rows.append(&row));
        self.note(rows);
        self.note(row);
    }

    /// Writes one frame. Failures are counted, but do not stop the run.
    pub fn frame(&mut self, record: &FrameRecord) {
        self.fill_up_to(record.frame());
        self.latency.add(record);
        if !self.begin_frame(pose3d::line(&self.scene, record)) {
            return self.tally.missed(1);
        }
        self.tally.add(&self.scene, record);
        self.rows(&record.skeletons);
        let outcomes = [
            append(&mut self.pose2d_jsonl, pose2d::lines(&self.scene, record)),
            append(&mut self.times_jsonl, [times::line(&self.scene, record)]),
        ];
        for outcome in outcomes {
            self.note(outcome);
        }
        for view in 0..self.scene.views.len() {
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

    /// Counts results that were received but could not be written in time.
    pub fn missed(&mut self, n: u64) {
        self.tally.missed(n);
    }

    /// Returns the summary so far.
    pub fn summary(&self) -> Summary {
        self.tally.summary()
    }

    /// Writes the files about the whole run, and gives every file its final name. Failures are counted, and all other files are still
    /// written.
    ///
    /// * `session`: session of the run.
    pub fn finish(mut self, session: u64) -> Summary {
        let report = self.latency.report();
        self.leave_incomplete();
        if self.trc_rows.take().is_some() {
            let outcome = self.head_trc();
            if outcome.is_err() {
                self.folder.leave(TRC);
            }
            self.note(outcome);
        }
        self.fill(LatencyReport::FILE, report.to_text());
        if let Some(smoothing) = self.smoothing.take() {
            self.fill(SmoothReport::FILE, smoothing.report().to_text());
        }
        let whole = self.whole(self.summary(), report, session);
        self.fill(RunSummary::FILE, whole.to_text());
        self.folder.remove_smoothed();
        for error in self.folder.finish() {
            let is_first = self.tally.failed(&error);
            tracing::error!(%error, is_first, "a file keeps its temporary name");
        }
        self.tally.summary()
    }

    /// Leaves files that lack lines under their temporary names.
    fn leave_incomplete(&mut self) {
        let files = [
            (FrameLine::FILE, Some(&self.pose3d_jsonl)),
            ("pose3d.csv", Some(&self.pose3d_csv)),
            (ViewLine::FILE, Some(&self.pose2d_jsonl)),
            (TimesLine::FILE, Some(&self.times_jsonl)),
            (TRC, self.trc_rows.as_ref()),
        ];
        for (name, lines) in files {
            if lines.is_some_and(Lines::lacks_some) {
                self.folder.leave(name);
            }
        }
    }

    /// Writes the head of `pose3d.trc`. It contains the number of rows, so it is written last.
    fn head_trc(&self) -> io::Result<()> {
        let text = files::read_text(&self.folder.part(TRC), files::RESULTS)?;
        let rows = trc::rows(&text);
        let n_rows = rows.lines().count() as u64;
        // Without a rate there are no rows, so the value does not matter.
        let rate_hz = self.scene.frame_rate_hz.unwrap_or_default();
        let text = trc::header(&self.scene, rate_hz, n_rows) + rows;
        self.folder.rewrite(TRC, &text)
    }

    fn fill(&mut self, name: &str, text: Result<String, serde_json::Error>) {
        let outcome = text.map_err(io::Error::from);
        let outcome = outcome.and_then(|text| self.folder.fill(name, &text));
        self.note(outcome);
    }

    fn whole(&self, summary: Summary, latency: LatencyReport, session: u64) -> RunSummary {
        let scene = &self.scene;
        let views = scene.views.iter().map(|view| ViewSummary {
            frame_size: view.framing.out_size(),
            name: view.name.clone(),
            source_from_frame: view.framing.source_from_output(),
        });
        let axes = match scene.up_in_world {
            Some(_) => "y up",
            None => "the axes of the world, because the rig does not give the upward direction",
        };
        RunSummary {
            frame_rate_hz: scene.frame_rate_hz,
            joints: scene.joints.name.to_owned(),
            latency,
            schema_version: VERSION,
            session,
            summary,
            trc_axes: axes.to_owned(),
            views: views.collect(),
        }
    }

    /// Counts all failures, and logs the first.
    fn note(&mut self, outcome: io::Result<()>) {
        if let Err(error) = outcome
            && self.tally.failed(&error)
        {
            tracing::error!(%error, "cannot write results; the pipeline continues, and failures are counted");
        }
    }
}

/// Appends all lines, or none.
fn append<L: Line>(file: &mut Lines, lines: impl IntoIterator<Item = L>) -> io::Result<()> {
    let mut text = String::new();
    for line in lines {
        text += &runfiles::to_line(&line)?;
    }
    file.append(&text)
}

#[cfg(test)]
mod tests;
