//! Reads `summary.json` of a run.

use std::io;
use std::path::Path;

use runfiles::{LatencyReport, RunSummary, Summary};
use serde_json::{Value, json};

use super::people::Outside;

/// The summary that the process `results` wrote.
#[derive(Debug)]
pub enum Recorded {
    /// There is no summary of this run.
    Nothing,
    /// The file cannot be read. Contains the reason.
    Unreadable(String),
    /// The summary of this run.
    Written(Box<RunSummary>),
}

impl Recorded {
    /// Reads the summary in the output folder of a run.
    ///
    /// * `session`: the session of the run. A summary of another session counts as missing.
    /// * `cameras`: the cameras of the deployment. The summary must have counts for each camera.
    pub(super) fn read(folder: &Path, session: u64, cameras: &[&str]) -> Self {
        let file = folder.join(RunSummary::FILE);
        let read = match files::read_text(&file, files::SETTINGS) {
            Ok(text) => parse(&text, session, cameras),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(Self::Nothing),
            Err(error) => Err(error.to_string()),
        };
        read.unwrap_or_else(|why| Self::Unreadable(format!("{}: {why}", file.display())))
    }

    /// Returns the counts of the run, if there is a summary.
    pub fn summary(&self) -> Option<&Summary> {
        self.written().map(|written| &written.summary)
    }

    /// Returns the views in which people were too small or too large for the search.
    ///
    /// * `has_size`: true if the deployment sets `capture.size`.
    pub(super) fn outside(&self, has_size: bool) -> Option<Outside> {
        Outside::of(self.written()?, has_size)
    }

    /// Returns the latency report of the run, if there is a summary.
    pub fn latency(&self) -> Option<&LatencyReport> {
        self.written().map(|written| &written.latency)
    }

    /// Returns the reason why there is no summary; `None` if there is one.
    pub(super) fn problem(&self) -> Option<String> {
        match self {
            Self::Nothing => {
                Some("nothing: the process `results` did not write a summary".to_owned())
            }
            Self::Unreadable(why) => Some(format!("the summary cannot be read: {why}")),
            Self::Written(_) => None,
        }
    }

    /// Returns the summary as JSON; null if no summary exists.
    pub(super) fn json(&self) -> Value {
        json!(self.written())
    }

    fn written(&self) -> Option<&RunSummary> {
        match self {
            Self::Written(it) => Some(it),
            Self::Nothing | Self::Unreadable(_) => None,
        }
    }
}

fn parse(text: &str, session: u64, cameras: &[&str]) -> Result<Recorded, String> {
    let found = RunSummary::parse_session(text).map_err(|error| error.to_string())?;
    if found != session {
        return Ok(Recorded::Nothing);
    }
    let run = RunSummary::parse(text).map_err(|error| error.to_string())?;
    let Summary {
        views_present,
        views_missing,
        ..
    } = &run.summary;
    let is_known =
        |name: &str| views_present.contains_key(name) && views_missing.contains_key(name);
    if let Some(name) = cameras.iter().find(|name| !is_known(name)) {
        let fields = "`summary.views_present` and `summary.views_missing`";
        return Err(format!("camera `{name}` is not in {fields}"));
    }
    Ok(Recorded::Written(Box::new(run)))
}

#[cfg(test)]
mod tests {
    use std::fs;

    use runfiles::VERSION;

    use super::*;

    const SESSION: u64 = 7;

    fn run() -> RunSummary {
        RunSummary {
            frame_rate_hz: None,
            joints: "parse14".to_owned(),
            latency: LatencyReport::default(),
            schema_version: VERSION,
            session: SESSION,
            summary: Summary {
                views_present: [("c1".to_owned(), 3)].into(),
                views_missing: [("c1".to_owned(), [].into())].into(),
                ..Summary::default()
            },
            trc_axes: "y up".to_owned(),
            views: Vec::new(),
        }
    }

    fn read(text: &str, cameras: &[&str]) -> Recorded {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join(RunSummary::FILE), text).unwrap();
        Recorded::read(folder.path(), SESSION, cameras)
    }

    #[test]
    fn the_summary_of_another_session_is_ignored() {
        let text = run().to_text().unwrap();
        assert_eq!(read(&text, &["c1"]).written(), Some(&run()));
        let earlier = text.replace("\"session\": 7", "\"session\": 6");
        let earlier = read(&earlier, &["c1"]);
        assert!(matches!(earlier, Recorded::Nothing), "{earlier:?}");
        let folder = tempfile::tempdir().unwrap();
        let none = Recorded::read(folder.path(), SESSION, &["c1"]);
        assert!(matches!(none, Recorded::Nothing), "{none:?}");
    }

    #[test]
    fn a_missing_or_invalid_count_is_an_error_that_names_it() {
        let text = run().to_text().unwrap();
        let cases = [
            (
                text.replace("\"frames_missed\": 0", "\"frames_missed\": null"),
                "summary.frames_missed",
            ),
            (
                text.replace("\"writes_failed\": 0", "\"writes_failed\": \"0\""),
                "summary.writes_failed",
            ),
            (
                text.replace("\"frames_not_recorded\"", "\"not_recorded\""),
                "missing field `frames_not_recorded`",
            ),
            (
                text.replace("\"schema_version\": 2", "\"schema_version\": 9"),
                "version 9",
            ),
            ("{".to_owned(), "EOF"),
        ];
        for (text, expected) in cases {
            let read = read(&text, &["c1"]);
            assert!(read.summary().is_none() && read.json().is_null());
            let problem = read.problem().unwrap();
            assert!(problem.contains(expected), "{problem}");
            assert!(problem.contains("summary.json"), "{problem}");
        }
        let problem = read(&text, &["c1", "c2"]).problem().unwrap();
        assert!(problem.contains("`c2`"), "{problem}");
    }
}
