//! The settings of a run in its recording, and the description of a recording.

use core::fmt::Write as _;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use deployment::paper::{Consistency, Errors};
use deployment::{Deployment, Method, RecordingPlan, Stage};
use failure::{ExitKind, Failure, OrFail as _};
use messages::topic;
use recording::{About, Damaged, Kind, Recording, Without};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::prepare::Prepared;
use crate::resolved::Resolved;
use inputs::Shipped;

/// Maximum number of damaged messages, and maximum number of damaged sections, that are listed as text.
const MAX_LISTED: usize = 10;

/// The settings of a run that its recording contains.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Settings {
    /// The resolved deployment, which every process gets as input.
    pub resolved: Resolved,
    /// Fingerprints (FNV-1a hashes) of the input files, by path. Files that are included in Parallax are listed by name.
    pub files: BTreeMap<PathBuf, u64>,
}

/// Returns the metadata of a recording. The session is 0, because the recording process sets it later.
///
/// # Errors
///
/// Fails if an input file cannot be read.
pub fn about(resolved: &Resolved, plan: &RecordingPlan) -> Result<About, Failure> {
    let settings = Settings {
        files: fingerprints(&resolved.deployment)?,
        resolved: Resolved {
            recording: None,
            ..resolved.clone()
        },
    };
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    Ok(About {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        session: 0,
        began_unix_nanos: since.map_or(0, |since| since.as_nanos() as u64),
        settings: footage::without_passwords(
            &serde_json::to_string(&settings).or_fail(ExitKind::Run)?,
        ),
        without: Without {
            pixels: plan.without_pixels,
            evidence: plan.without_evidence,
        },
    })
}

/// Returns the cameras and joints that a recording shows in Foxglove.
pub fn stage(prepared: &Prepared) -> record::Stage {
    let views = prepared.views.iter();
    record::Stage {
        cameras: views.map(|view| view.framing.camera().clone()).collect(),
        joints: prepared.settings.skeleton.joints,
    }
}

/// Returns fingerprints (FNV-1a) of the input files of a deployment, without its footage.
pub(crate) fn fingerprints(deployment: &Deployment) -> Result<BTreeMap<PathBuf, u64>, Failure> {
    let mut files = BTreeMap::new();
    let paper = &deployment.paper;
    let errors = paper.errors.as_ref();
    let table = errors.and_then(Errors::table);
    for file in [Some(&deployment.rig), table.map(|table| &table.table)].into_iter().flatten() {
        let bytes =
            files::read(file, files::MODEL).map_err(|error| failure::in_file(file, &error))?;
        files.insert(file.clone(), formats::checksum::fnv1a(&bytes));
    }
    let by_paper = deployment.method == Method::Paper;
    let of_paper = [
        (Shipped::Model, paper.model.as_ref()),
        (Shipped::Network, errors.and_then(Errors::network)),
        (
            Shipped::Consistency,
            paper.consistency.as_ref().map(Consistency::file),
        ),
        (Shipped::Orientation, Some(&paper.orientation)),
        (Shipped::Joints, Some(&paper.joint_map)),
    ];
    let of_paper = of_paper.into_iter().filter(|_| by_paper);
    let named = of_paper.filter_map(|(kind, file)| Some((kind, file?.as_path())));
    let named = named.filter(|(_, file)| !deployment::is_none(file));
    let networks = deployment.pose_networks().into_iter();
    for (kind, file) in named.chain(networks.map(|file| (Shipped::PoseNetwork, file))) {
        // In the deployment, the path of every file that is included in Parallax is "shipped".
        let name = if deployment::is_shipped(file) {
            kind.name()
        } else {
            file.to_owned()
        };
        files.insert(name, formats::checksum::fnv1a(&kind.read(file)?));
    }
    Ok(files)
}

/// Scans a recording for its messages.
///
/// # Errors
///
/// Fails if the file cannot be read, or is not a recording.
pub fn open(file: &Path) -> Result<Recording, Failure> {
    let mut input = files::open(file).map_err(|error| failure::in_file(file, &error))?;
    recording::scan(&mut input).map_err(|error| failure::in_file(file, &error))
}

/// Reads the settings of the recorded run.
///
/// # Errors
///
/// Fails if the recording has no settings, or settings of another version.
pub fn settings(file: &Path, recording: &Recording) -> Result<Settings, Failure> {
    let about = recording.about.as_ref();
    let about = about.map_err(|error| failure::in_file(file, error))?;
    serde_json::from_str(&about.settings).map_err(|error| {
        let failure = failure::in_file(file, &error);
        let (theirs, ours) = (&about.version, env!("CARGO_PKG_VERSION"));
        failure.with_hint(format!(
            "recorded by version {theirs}, but this is version {ours}"
        ))
    })
}

/// Returns true if, as far as the file itself shows, it is undamaged and contains every message that was sent.
pub fn is_whole(recording: &Recording) -> bool {
    is_undamaged(recording) && recording.n_lost() == 0
}

/// Returns true if a scan has found the file to be complete and undamaged. The content of the messages is not checked.
pub fn is_undamaged(recording: &Recording) -> bool {
    let extent = &recording.extent;
    extent.is_complete
        && extent.damage.is_empty()
        && extent.n_malformed == 0
        && recording.n_missing() == 0
}

/// Reads the messages that a replay sends, and returns those whose chunks do not match their checksums.
///
/// * `from`: the first stage that the replay runs.
///
/// # Errors
///
/// Fails if the file cannot be read.
pub fn damaged(
    file: &Path,
    recording: &Recording,
    resolved: &Resolved,
    from: Stage,
) -> Result<Vec<Damaged>, Failure> {
    let topology = resolved.topology();
    let has_frames = topology.receivers_of(&topic::frame(0)) > 0;
    let has_evidence = from <= Stage::Fuse || topology.has_maps();
    let is_replayed = |topic: &str| match Kind::of_topic(topic) {
        Some(Kind::Frame) => from > Stage::Capture && has_frames,
        Some(Kind::Sightings) => from > Stage::Pose,
        Some(Kind::Evidence) => from > Stage::Pose && has_evidence,
        Some(Kind::ViewQuality) => from > Stage::Quality,
        Some(Kind::PairPose | Kind::People) => from > Stage::Fuse,
        // Pictures of cameras are checked when they are read.
        Some(Kind::Skeletons | Kind::Health | Kind::Picture) | None => false,
    };
    let mut input = files::open(file).map_err(|error| failure::in_file(file, &error))?;
    recording::check(&mut input, recording, is_replayed)
        .map_err(|error| failure::in_file(file, &error))
}

/// Describes the damaged messages as text, and lists the first messages. Returns `None` if there are none.
pub fn damaged_text(damaged: &[Damaged]) -> Option<String> {
    let chunks: BTreeSet<u64> = damaged.iter().map(|message| message.chunk).collect();
    let mut text = format!(
        "  {} messages of {} damaged chunks are left out: the chunks do not match their checksums",
        damaged.len(),
        chunks.len()
    );
    let named = damaged.iter().take(MAX_LISTED).map(|message| {
        let frame = message.frame.map_or(String::new(), |frame| format!(", frame {frame}"));
        let Damaged {
            topic,
            offset,
            chunk,
            ..
        } = message;
        format!("\n    {topic}{frame}, at byte {offset}, in the chunk at byte {chunk}")
    });
    text.extend(named);
    if damaged.len() > MAX_LISTED {
        let more = damaged.len() - MAX_LISTED;
        text.extend([format!(
            "\n    and {more} more messages; --json lists all of them"
        )]);
    }
    (!damaged.is_empty()).then_some(text)
}

/// Returns the damaged messages as JSON.
pub fn damaged_json(damaged: &[Damaged]) -> Value {
    let damaged = damaged
        .iter()
        .map(|damaged| json!({ "topic": damaged.topic, "frame": damaged.frame, "offset": damaged.offset, "chunk": damaged.chunk }));
    damaged.collect()
}

/// Describes a recording as text: one line about its content, and one line for each damaged or missing part.
pub fn text(file: &Path, recording: &Recording) -> String {
    let extent = &recording.extent;
    let mut text = format!(
        "{}: {} messages of {} topics, {:.1} MB",
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
        let why = if extent.damage.is_empty() {
            "cut off"
        } else {
            "damaged"
        };
        let [whole, all] = [extent.whole_bytes, extent.file_bytes];
        write!(
            text,
            "\n  incomplete ({why}): read up to byte {whole} of {all}"
        )?;
    }
    for place in extent.damage.iter().take(MAX_LISTED) {
        write!(text, "\n  damaged at byte {}: {}", place.offset, place.what)?;
    }
    if extent.damage.len() > MAX_LISTED {
        let more = extent.damage.len() - MAX_LISTED;
        write!(text, "\n  and at {more} more places")?;
    }
    for (topic, n) in &extent.missing {
        write!(
            text,
            "\n  {topic}: {n} messages are damaged and cannot be found"
        )?;
    }
    if extent.n_malformed > 0 {
        let n = extent.n_malformed;
        write!(
            text,
            "\n  {n} messages do not belong to their topic, and were skipped"
        )?;
    }
    for (topic, it) in recording.counts.iter().filter(|count| count.1.lost > 0) {
        write!(
            text,
            "\n  {topic}: {} recorded, {} lost",
            it.recorded, it.lost
        )?;
    }
    Ok(())
}

/// Describes a recording as JSON.
pub fn json(file: &Path, recording: &Recording) -> Value {
    let extent = &recording.extent;
    let topics = recording.tracks.iter().map(|(topic, track)| {
        let lost = recording.counts.get(topic).map(|count| count.lost);
        let entry = json!({ "messages": track.entries.len(), "lost": lost });
        (topic.clone(), entry)
    });
    json!({
        "file": file,
        "bytes": extent.file_bytes,
        "bytes_read": extent.whole_bytes,
        "complete": extent.is_complete,
        "damage": extent.damage.iter().map(|damage| json!({ "offset": damage.offset, "what": damage.what })).collect::<Vec<_>>(),
        "missing": extent.missing,
        "malformed": extent.n_malformed,
        "messages": recording.n_messages(),
        "lost": recording.n_lost(),
        "topics": topics.collect::<BTreeMap<_, _>>(),
    })
}
