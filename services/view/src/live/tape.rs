//! A recording requested by a page.

use core::sync::atomic::{AtomicBool, Ordering};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Instant;

use deployment::RecordingPlan;
use failure::{ExitKind, Failure, OrFail as _, Stop};
use launch::{Prepared, Resolved, recorded};
use record::{Job, Kept, Topics};
use runtime::{Bus, Namespace};
use serde_json::{Value, json};

use crate::board::{Board, Weight};
use crate::date;

/// Largest amount of data that may wait to be written, in millions of bytes.
const QUEUE_MB: u64 = 128;

/// A recording in progress, in its own thread.
#[derive(Debug)]
pub(crate) struct Tape {
    file: PathBuf,
    began: Instant,
    stop: Arc<AtomicBool>,
    thread: JoinHandle<Result<Kept, Failure>>,
}

impl Tape {
    /// Starts to record into the folder of the results: all messages except evidence and the cameras' original pictures.
    ///
    /// # Errors
    ///
    /// Fails if the settings and files of the run cannot be read, or the thread cannot be started.
    pub(crate) fn start(
        namespace: &Namespace,
        resolved: &Resolved,
        session: u64,
    ) -> Result<Self, Failure> {
        let name = format!("recording-{}.mcap", date::stamp(date::unix_ms()));
        let file = resolved.deployment.output.join(name);
        let plan = RecordingPlan {
            file: file.clone(),
            without_evidence: true,
            queue_mb: QUEUE_MB,
            ..RecordingPlan::default()
        };
        let topology = resolved.topology();
        let processes = topology.processes().iter().map(|process| process.name.clone());
        let job = Job {
            file: file.clone(),
            about: recorded::about(resolved, &plan)?,
            topics: Topics {
                n_views: topology.n_views(),
                fused: topology.fused(),
                has_quality: resolved.deployment.has_quality(),
                pictures: Vec::new(),
                processes: processes.collect(),
                elsewhere: topology.topics_elsewhere(),
            },
            queue_bytes: plan.queue_mb * 1_000_000,
            foxglove: Some(recorded::stage(&Prepared::new(resolved)?)),
        };
        let stop = Arc::new(AtomicBool::new(false));
        let (asked, namespace) = (Arc::clone(&stop), namespace.clone());
        let record = move || {
            let own = Stop::new().or_fail(ExitKind::Run)?;
            let name = format!("view-record-{}", std::process::id());
            let bus = Bus::open(&namespace, &name, &own)?.as_onlooker();
            record::look_on(&bus, session, job, || asked.load(Ordering::Relaxed))
        };
        let thread = std::thread::Builder::new().name("record".to_owned());
        Ok(Self {
            file,
            began: Instant::now(),
            stop,
            thread: thread.spawn(record).or_fail(ExitKind::Run)?,
        })
    }

    /// Returns the path of the file.
    pub(crate) fn file(&self) -> &Path {
        &self.file
    }

    /// Returns true if the recording has ended on its own.
    pub(crate) fn is_finished(&self) -> bool {
        self.thread.is_finished()
    }

    /// Ends the recording, and reports its result as an event.
    pub(crate) fn finish(self, board: &Board) {
        self.stop.store(true, Ordering::Relaxed);
        let file = self.file.display();
        match self.thread.join() {
            Ok(Ok(Kept { n_lost: 0 })) => {
                board.event(Weight::Note, &format!("recorded to {file}"));
            }
            Ok(Ok(Kept { n_lost })) => {
                let what = format!("recorded to {file}, without {n_lost} messages");
                board.event(Weight::Warning, &what);
            }
            Ok(Err(why)) => board.event(Weight::Error, &format!("cannot record: {why}")),
            Err(_panic) => board.event(Weight::Error, "the recording failed"),
        }
    }

    /// Returns the state of the recording for the page.
    pub(crate) fn json(&self) -> Value {
        let bytes = std::fs::metadata(&self.file).map_or(0, |metadata| metadata.len());
        json!({
            "file": self.file.display().to_string(), "bytes": bytes,
            "seconds": self.began.elapsed().as_secs(),
        })
    }
}
