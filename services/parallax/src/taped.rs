//! What a recording says about its run, and what is said about a recording.

use core::fmt::Write as _;
use std::collections::BTreeMap;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use recording::{About, Recording, Without};
use runtime::{ExitKind, Failure, OrFail as _};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::audience::Tape;
use crate::deployment::Deployment;
use crate::inputs;
use crate::plan::Resolved;
use crate::shipped::{self, Shipped};

/// The settings of a run, as they stand in its recording.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Settings {
    /// What every process was given.
    pub resolved: Resolved,
    /// Fingerprints of the files that they read, by name.
    pub files: BTreeMap<PathBuf, u64>,
}

/// What the recording of a run says about itself; the process that writes it adds the session.
pub(crate) fn about(resolved: &Resolved, tape: &Tape) -> Result<About, Failure> {
    let settings = Settings {
        files: fingerprints(&resolved.deployment)?,
        resolved: Resolved {
            tape: None,
            ..resolved.clone()
        },
    };
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    Ok(About {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        session: 0,
        began_unix_nanos: since.map_or(0, |it| it.as_nanos() as u64),
        settings: serde_json::to_string(&settings).or_fail(ExitKind::Run)?,
        without: Without {
            pixels: tape.without_pixels,
            evidence: tape.without_evidence,
        },
    })
}

/// Fingerprints of the files that a deployment names, but for its footage.
pub(crate) fn fingerprints(deployment: &Deployment) -> Result<BTreeMap<PathBuf, u64>, Failure> {
    let mut files = BTreeMap::new();
    for file in [Some(&deployment.rig), deployment.quality.table.as_ref()]
        .into_iter()
        .flatten()
    {
        let bytes = std::fs::read(file).map_err(|error| inputs::in_file(file, &error))?;
        files.insert(file.clone(), inputs::fingerprint(&bytes));
    }
    for (kind, file) in [
        (Shipped::Model, &deployment.model),
        (Shipped::Network, &deployment.quality.network),
        (Shipped::Consistency, &deployment.fuse.consistency),
    ] {
        let Some(file) = file else { continue };
        // Files that ship may be several, and have one name.
        let name = if shipped::is_one(file) {
            kind.name()
        } else {
            file.clone()
        };
        files.insert(name, inputs::fingerprint(&kind.read(file)?));
    }
    Ok(files)
}

/// Finds all messages of a recording.
pub(crate) fn open(file: &Path) -> Result<Recording, Failure> {
    let mut input = File::open(file).map_err(|error| inputs::in_file(file, &error))?;
    recording::scan(&mut input).map_err(|error| inputs::in_file(file, &error))
}

/// Whether everything that was sent is in the file, as far as the file can say.
pub(crate) fn is_whole(recording: &Recording) -> bool {
    recording.extent.is_complete && recording.n_lost() == 0 && recording.extent.n_malformed == 0
}

/// What a file holds, for people: a line, and another for each thing that is wrong with it.
pub(crate) fn text(file: &Path, recording: &Recording) -> String {
    let extent = &recording.extent;
    let mut text = format!(
        "{}: {} messages of {} topics in {:.1} MB",
        file.display(),
        recording.n_messages(),
        recording.tracks.len(),
        extent.file_bytes as f64 / 1e6
    );
    // Writing to a string cannot fail.
    let _infallible = write_flaws(&mut text, recording);
    text
}

fn write_flaws(text: &mut String, recording: &Recording) -> core::fmt::Result {
    let extent = &recording.extent;
    if !extent.is_complete {
        let why = extent.damage.unwrap_or("cut off");
        let [whole, all] = [extent.whole_bytes, extent.file_bytes];
        write!(
            text,
            "\n  not complete: {why}; read up to byte {whole} of {all}"
        )?;
    }
    if extent.n_malformed > 0 {
        let n = extent.n_malformed;
        write!(
            text,
            "\n  {n} messages are none of their topic's, and were passed over"
        )?;
    }
    for (topic, it) in recording.counts.iter().filter(|it| it.1.lost > 0) {
        write!(
            text,
            "\n  {topic}: {} recorded, {} lost",
            it.recorded, it.lost
        )?;
    }
    Ok(())
}

/// The same for programs.
pub(crate) fn json(file: &Path, recording: &Recording) -> Value {
    let extent = &recording.extent;
    let topics = recording.tracks.iter().map(|(topic, it)| {
        let lost = recording.counts.get(topic).map(|it| it.lost);
        let entry = json!({ "messages": it.entries.len(), "lost": lost });
        (topic.clone(), entry)
    });
    json!({
        "file": file,
        "bytes": extent.file_bytes,
        "bytes_read": extent.whole_bytes,
        "complete": extent.is_complete,
        "damage": extent.damage,
        "malformed": extent.n_malformed,
        "messages": recording.n_messages(),
        "lost": recording.n_lost(),
        "topics": topics.collect::<BTreeMap<_, _>>(),
    })
}
