//! Everything that is written about a frame, and at the end about the run.

use std::fs;
use std::io;
use std::path::PathBuf;

use runfiles::{
    FrameLine, LatencyReport, Line, RunSummary, SmoothLine, SmoothReport, Summary, TimesLine,
    VERSION, ViewLine, ViewSummary,
};

use crate::lines::Lines;
use crate::smooth::Smoothing;
use crate::summary::Tally;
use deployment::results::Config;

use crate::{
    Absent, Folder, FolderError, FrameRecord, Latency, Scene, overlay, pose2d, pose3d, times, trc,
};

const TRC: &str = "pose3d.trc";
/// Bytes reserved for the files written at the end: several times what sixteen views need.
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
    /// Begins the files of a run. Room for those written at its end is reserved now.
    ///
    /// * `n_workers`: fusion processes, for the latency of each.
    /// * `folder`: where; what a killed recorder left there is gone on with if it is resumed.
    ///
    /// # Errors
    ///
    /// [`OutputError`].
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
        let has_trc = config.trc && scene.frame_rate_hz.is_some();
        let trc_rows = if has_trc { Some(lines(TRC)?) } else { None };
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
            epipolar_part: config.epipolar_part.saturating_sub(1),
            latency: Latency::new(n_workers)?,
            tally: Tally::resume(&scene, &folder.part(FrameLine::FILE)),
            scene,
            folder,
            smoothing: None,
        })
    }

    /// Also writes smoothed joints, if the settings ask for them.
    ///
    /// # Errors
    ///
    /// [`OutputError`].
    pub fn smooth(&mut self, settings: &deployment::smooth::Config) -> Result<(), OutputError> {
        let (scene, folder) = (&self.scene, &mut self.folder);
        let file = || folder.file(SmoothLine::FILE).map_err(io::Error::other);
        self.smoothing = Smoothing::begin(scene, settings, file)?;
        if self.smoothing.is_some() {
            self.folder.reserve(SmoothReport::FILE, RESERVED_BYTES)?;
        }
        Ok(())
    }

    /// The first frame that has no line yet; none if there is no line.
    pub fn next_frame(&self) -> Option<u64> {
        let step = self.scene.frame_step.max(1);
        self.tally.last_frame().map(|it| it.saturating_add(step))
    }

    /// Writes frames without a result, with the reason. Frames before them that no message was about are written, too.
    pub fn absent(&mut self, absent: &[Absent]) {
        for it in absent {
            self.fill_up_to(it.frame);
            self.without(it);
        }
    }

    /// What waited for the disk too long was left out.
    fn fill_up_to(&mut self, frame: u64) {
        let begin = self.next_frame().unwrap_or(frame);
        for frame in (begin..frame).step_by(self.scene.frame_step.max(1) as usize) {
            self.without(&Absent {
                frame,
                reason: "writing was too slow".to_owned(),
                views: Vec::new(),
            });
        }
    }

    fn without(&mut self, it: &Absent) {
        self.tally.without(it.frame);
        let scene = &self.scene;
        let nothing = pose3d::nothing(scene, it.frame);
        let line = pose3d::absent_line(scene, it);
        let rows = pose3d::csv_rows(scene, &nothing);
        let row = trc::row(scene, self.tally.n_lines(), &nothing);
        let smoothed = self.smoothing.as_mut().map_or(Ok(()), |it| it.frame(&line));
        let outcomes = [
            smoothed,
            append(&mut self.pose3d_jsonl, [line]),
            self.pose3d_csv.append(&rows),
            self.trc_rows.as_mut().map_or(Ok(()), |it| it.append(&row)),
        ];
        for outcome in outcomes {
            self.note(outcome);
        }
    }

    /// Writes one frame. What fails is counted, and never stops anything.
    pub fn frame(&mut self, record: &FrameRecord) {
        self.fill_up_to(record.frame());
        self.tally.add(&self.scene, record);
        self.latency.add(record);
        let (scene, pose) = (&self.scene, &record.pose3d);
        let line = pose3d::line(scene, record);
        let rows = pose3d::csv_rows(scene, pose);
        let row = trc::row(scene, self.tally.n_lines(), pose);
        let smoothed = self.smoothing.as_mut().map_or(Ok(()), |it| it.frame(&line));
        let outcomes = [
            smoothed,
            append(&mut self.pose3d_jsonl, [line]),
            self.pose3d_csv.append(&rows),
            append(&mut self.pose2d_jsonl, pose2d::lines(scene, record)),
            append(&mut self.times_jsonl, [times::line(scene, record)]),
            self.trc_rows.as_mut().map_or(Ok(()), |it| it.append(&row)),
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

    /// Counts results that came but could not be written in time.
    pub fn missed(&mut self, n: u64) {
        self.tally.missed(n);
    }

    /// The scene that messages are read with.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// What was seen so far.
    pub fn summary(&self) -> Summary {
        self.tally.summary()
    }

    /// Writes what is known of the whole run, and gives every file its name. What fails is counted:
    /// whatever there is room for is there.
    ///
    /// * `session`: the run.
    pub fn finish(mut self, session: u64) -> Summary {
        let report = self.latency.report();
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
            tracing::error!(%error, is_first, "a file keeps the name of a part");
        }
        self.tally.summary()
    }

    /// The head of `pose3d.trc` holds the number of rows, so it is written last.
    fn head_trc(&self) -> io::Result<()> {
        let (path, headed) = (self.folder.part(TRC), self.folder.part("pose3d.trc.head"));
        let rows = fs::read_to_string(&path)?;
        let n_rows = rows.lines().count() as u64;
        // Without a rate there are no rows.
        let rate_hz = self.scene.frame_rate_hz.unwrap_or_default();
        let written = fs::write(&headed, trc::header(&self.scene, rate_hz, n_rows) + &rows);
        if let Err(error) = written {
            // The rows stay as they are.
            fs::remove_file(&headed)?;
            return Err(error);
        }
        fs::rename(&headed, &path)
    }

    fn fill(&mut self, name: &str, text: Result<String, serde_json::Error>) {
        let outcome = text.map_err(io::Error::from);
        let outcome = outcome.and_then(|text| self.folder.fill(name, &text));
        self.note(outcome);
    }

    fn whole(&self, summary: Summary, latency: LatencyReport, session: u64) -> RunSummary {
        let scene = &self.scene;
        let views = scene.views.iter().map(|it| ViewSummary {
            frame_size: it.framing.out_size(),
            name: it.name.clone(),
            source_from_frame: it.framing.source_from_output(),
        });
        let axes = match scene.up_in_world {
            Some(_) => "y up",
            None => "the world's: the rig does not say which way is up",
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

    /// Reports the first failure, counts all.
    fn note(&mut self, outcome: io::Result<()>) {
        if let Err(error) = outcome
            && self.tally.failed(&error)
        {
            tracing::error!(%error, "cannot write results; the pipeline goes on, failures are counted");
        }
    }
}

/// Appends lines, all or none.
fn append<L: Line>(file: &mut Lines, lines: impl IntoIterator<Item = L>) -> io::Result<()> {
    let mut text = String::new();
    for line in lines {
        text += &runfiles::to_line(&line)?;
    }
    file.append(&text)
}

#[cfg(test)]
mod tests {
    use messages::{Searched, Status};
    use serde_json::{Value, json};

    use super::*;
    use crate::Missing;
    use crate::testing::{record, scene};

    fn written(records: Vec<FrameRecord>) -> (tempfile::TempDir, Summary) {
        let dir = tempfile::tempdir().unwrap();
        let folder = Folder::open(dir.path(), false).unwrap();
        let mut output = Output::begin(scene(), &Config::default(), 1, folder).unwrap();
        for record in records {
            output.frame(&record);
        }
        let summary = output.finish(1);
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
            "times.jsonl",
        ];
        assert_eq!(names, expected);
        assert_eq!(text(&dir, "pose3d.jsonl").lines().count(), 2);
        assert_eq!(text(&dir, "pose3d.csv").lines().count(), 1 + 2 * 14);
        assert_eq!(text(&dir, "pose2d.jsonl").lines().count(), 4);
        let trc = ::trc::Trc::parse(&text(&dir, "pose3d.trc")).unwrap();
        assert_eq!(trc.frames.len(), 2);
    }

    #[test]
    fn a_file_that_must_say_the_rate_is_not_written_where_nothing_tells_it() {
        let dir = tempfile::tempdir().unwrap();
        let folder = Folder::open(dir.path(), false).unwrap();
        let scene = Scene {
            frame_rate_hz: None,
            ..scene()
        };
        let mut output = Output::begin(scene, &Config::default(), 1, folder).unwrap();
        output.frame(&record(0));
        assert_eq!(output.finish(1).writes_failed, 0);
        assert!(!dir.path().join("pose3d.trc").exists());
    }

    #[test]
    fn skipped_frames_and_missing_views_are_counted() {
        let mut last = record(8);
        last.pose3d.views_present = 0b01;
        last.views[1].missing = Some(Missing::Late);
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
    fn searches_and_the_bytes_of_their_evidence_are_counted_by_view() {
        let searched = |frame, searched, evidence_bytes| {
            let mut it = record(frame);
            let pose = it.views[1].pose.as_mut().unwrap();
            (pose.searched, pose.evidence_bytes) = (searched, evidence_bytes);
            it
        };
        let mut without = record(6);
        without.views[1].pose.as_mut().unwrap().status = Status::NO_FRAME;
        let (dir, summary) = written(vec![
            searched(0, Searched::FULL, 1000),
            searched(2, Searched::TRACKED, 200),
            searched(4, Searched::TRACKED, 300),
            without,
        ]);
        let of_right = [("full".to_owned(), 1), ("tracked".to_owned(), 2)];
        assert_eq!(summary.searches["right"], of_right.into());
        assert_eq!(summary.searches["left"], [("full".to_owned(), 4)].into());
        assert_eq!(summary.evidence_bytes_per_frame["right"], 500);
        let text = text(&dir, "pose2d.jsonl");
        let lines = text
            .lines()
            .map(|it| serde_json::from_str::<Value>(it).unwrap());
        let said: Vec<Value> = lines.map(|it| it["search"].clone()).collect();
        assert_eq!(said[3], "tracked");
        assert_eq!(said[7], Value::Null, "there was no frame");
    }

    #[test]
    fn a_restarted_recorder_counts_what_it_had_written() {
        let dir = tempfile::tempdir().unwrap();
        let begin = |resume| {
            let folder = Folder::open(dir.path(), resume).unwrap();
            Output::begin(scene(), &Config::default(), 1, folder).unwrap()
        };
        let mut killed = begin(false);
        killed.frame(&record(0));
        killed.frame(&record(2));
        drop(killed);
        let mut restarted = begin(true);
        restarted.frame(&record(6));
        let summary = restarted.finish(1);
        assert_eq!((summary.frames, summary.frames_with_pose), (3, 3));
        assert_eq!(summary.frames_missed, 1);
        assert_eq!(summary.views_used[0].1, 3);
        assert_eq!(text(&dir, "pose3d.csv").lines().count(), 1 + 4 * 14);
    }

    #[test]
    fn every_frame_has_a_line_a_row_of_every_joint_and_one_for_opensim() {
        let dir = tempfile::tempdir().unwrap();
        let folder = Folder::open(dir.path(), false).unwrap();
        let mut output = Output::begin(scene(), &Config::default(), 1, folder).unwrap();
        let absent = |frame| Absent {
            frame,
            reason: "dropped".to_owned(),
            views: vec![Missing::Dropped; 2],
        };
        output.absent(&[absent(0)]);
        output.frame(&record(2));
        // 4 was handed on and not taken: the queue was full.
        output.absent(&[absent(6)]);
        output.frame(&record(8));
        output.absent(&[absent(10)]);
        let summary = output.finish(1);
        assert_eq!((summary.frames, summary.frames_missed), (2, 4));
        let lines = text(&dir, "pose3d.jsonl");
        let lines = lines.lines().map(|it| serde_json::from_str(it).unwrap());
        let lines: Vec<Value> = lines.collect();
        let told = |it: &Value| {
            (
                it["frame"].as_u64(),
                it["reason"].as_str().map(str::to_owned),
            )
        };
        let dropped = Some("dropped".to_owned());
        let expected = [
            (Some(0), dropped.clone()),
            (Some(2), None),
            (Some(4), Some("writing was too slow".to_owned())),
            (Some(6), dropped.clone()),
            (Some(8), None),
            (Some(10), dropped),
        ];
        assert_eq!(lines.iter().map(told).collect::<Vec<_>>(), expected);
        assert_eq!(
            lines[0]["views_missing"],
            json!({ "left": "dropped", "right": "dropped" })
        );
        assert_eq!(text(&dir, "pose3d.csv").lines().count(), 1 + 6 * 14);
        let trc = ::trc::Trc::parse(&text(&dir, "pose3d.trc")).unwrap();
        assert_eq!(trc.frames.len(), 6);
    }

    #[test]
    fn a_full_disk_is_counted_and_stops_nothing() {
        let dir = tempfile::tempdir().unwrap();
        let folder = Folder::open(dir.path(), false).unwrap();
        let mut output = Output::begin(scene(), &Config::default(), 1, folder).unwrap();
        output.pose3d_jsonl = Lines::new(fs::File::create("/dev/full").unwrap()).unwrap();
        output.frame(&record(0));
        output.frame(&record(2));
        let summary = output.finish(1);
        assert!(summary.writes_failed >= 2, "{summary:?}");
        assert!(summary.first_failure.is_some());
        assert_eq!(text(&dir, "pose3d.csv").lines().count(), 1 + 2 * 14);
    }
}
