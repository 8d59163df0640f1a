//! Plans the processes and topics of a deployment.

use core::time::Duration;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use steps::quality;

use deployment::hosts::Host;
use deployment::{Content, Deployment, Process, Room, Stage, Topology, ViewSize};
use failure::{ExitKind, Failure, OrFail as _};
use messages::{
    EvidenceHeader, FrameHeader, PairPose, People, PictureHeader, Sightings, Skeletons, ViewQuality,
};
use runtime::{Delivery, HEARTBEAT, Limits, MOST_GUESTS, Namespace, TopicPlan, process_topics};
use supervise::{Plan, Policy, ProcessSpec, Role};
use tracing::Level;

use crate::hosts;
use crate::keypoints;
use crate::prepare::{Prepared, framing};
use crate::process::Name;
use crate::programs;
use crate::resolved::Resolved;
use crate::sanity;
use crate::scheduling;
use crate::search_size::SearchSize;
use crate::vertical;

/// Limit on the processor time of an iteration, as a multiple of the longest iteration so far. It applies to main loops whose iterations
/// take similar time (a frame, or a pyramid level of a pair of views).
const MAX_WORK_FACTOR: u32 = 3;
/// Length of the window in which restarts of a process are counted.
const RESTART_WINDOW: Duration = Duration::from_mins(1);

/// Resolves a deployment. Adds generated grey frames to cameras that have only keypoints, reads the metadata of the footage, and checks
/// footage and calibration against each other. Finds the vertical if it is not given, and logs warnings.
///
/// # Errors
///
/// Fails if the footage or the calibration cannot be read, or if joints cannot be located in 3D with them.
pub fn resolve(deployment: &Deployment) -> Result<Resolved, Failure> {
    resolve_on(deployment, None)
}

/// Resolves the part of a deployment that one of its hosts runs. The footage of other hosts' cameras is not read.
///
/// # Errors
///
/// Fails like [`resolve`]. Also fails if the vertical is not given, because all hosts must use the same vertical.
pub fn resolve_on(deployment: &Deployment, host: Option<&Host>) -> Result<Resolved, Failure> {
    let lengths = keypoints::lengths(deployment)?;
    let deployment = &keypoints::with_pictures(deployment.clone(), &lengths)?;
    let deployment = &crate::cameras::settled(deployment)?;
    let is_here = |camera: usize| {
        let name = &deployment.cameras[camera].name;
        host.is_none_or(|host| host.views.contains(name))
    };
    let footage = crate::cameras::footage(deployment, &is_here);
    let found = keypoints::found(deployment)?;
    let mut resolved = Resolved {
        footage: footage?,
        deployment: deployment.clone(),
        search_size: None,
        extra_keypoints: found.extra,
        sides_as_seen: found.as_seen,
        host: host.map(|host| host.name.clone()),
        recording: None,
        replay: None,
    };
    sanity::warn(&resolved, &lengths)?;
    check_names_and_sizes(&resolved, &is_here)?;
    // The vertical is stored in the deployment, so that every process and a replay use the same vertical.
    if let Some(found) = vertical::find(deployment)? {
        if host.is_some() {
            let message = "neither the calibration nor the deployment gives the upward direction";
            let failure = Failure::new(ExitKind::Config, message);
            return Err(failure.with_hint(format!(
                "all hosts must use the same direction: set `up` in the deployment; this host found `up = {:?}`",
                found.up
            )));
        }
        tracing::warn!("{}", found.why);
        resolved.deployment.up = Some(found.up);
    }
    let rig = inputs::rig_of(&resolved.deployment)?;
    resolved.search_size = SearchSize::of(&resolved.deployment, &rig);
    Ok(resolved)
}

/// Refuses cameras that the calibration lacks, and pictures whose size differs from the calibration. This check comes before checks that
/// take a long time.
fn check_names_and_sizes(
    resolved: &Resolved,
    is_here: &dyn Fn(usize) -> bool,
) -> Result<(), Failure> {
    let rig = inputs::rig_of(&resolved.deployment)?;
    for camera in (0..resolved.deployment.cameras.len()).filter(|i| is_here(*i)) {
        framing(resolved, &rig, camera)?;
    }
    Ok(())
}

/// Reads all inputs of a deployment, and describes them in one line.
///
/// # Errors
///
/// Fails if an input cannot be read or used.
pub fn check(deployment: &Deployment) -> Result<String, Failure> {
    let resolved = resolve(deployment)?;
    let prepared = Prepared::new(&resolved)?;
    prepared.check_predictions(&resolved)?;
    if let Some(padding) = &prepared.padding {
        tracing::warn!("{padding}");
    }
    if let Some(small) = resolved.search_size.as_ref().and_then(SearchSize::warning) {
        tracing::warn!("{small}");
    }
    let n_frames = if resolved.is_endless() {
        "frames until the run is stopped".to_owned()
    } else {
        format!("{} frames", resolved.n_frames())
    };
    let pairs = match prepared.settings.views {
        _ if deployment.has_maps() => "solved in space".to_owned(),
        pipeline::Views::Pairs => format!("{} pairs", prepared.pairs.len()),
        pipeline::Views::All => "solved at once".to_owned(),
    };
    let size = resolved.search_size.as_ref();
    let size = size.map_or_else(String::new, |size| format!("\n{}", size.text()));
    Ok(format!(
        "{} views, {pairs}, {n_frames}, a model of {} parts{size}",
        prepared.views.len(),
        prepared.model.n_parts()
    ))
}

/// Plans the topics of a deployment.
///
/// * `names`: the names of its processes.
pub(crate) fn topics(resolved: &Resolved, prepared: &Prepared, names: &[String]) -> Vec<TopicPlan> {
    let sizes = prepared.views.iter().enumerate().map(|(view, prepared)| ViewSize {
        picture_bytes: picture_bytes(resolved, view),
        frame_bytes: prepared
            .framing
            .out_size()
            .map(|side| side as usize)
            .iter()
            .product::<usize>()
            * 3,
        evidence_values: if resolved.deployment.has_maps() {
            pipeline::most_values(resolved.deployment.network.people)
        } else {
            prepared.plan.layout().n_responses()
        },
    });
    let delivery = resolved.delivery();
    let held_frames = if resolved.deployment.predicts_errors() && delivery == Delivery::Realtime {
        quality::HELD_REALTIME
    } else {
        1
    };
    let mode = resolved.deployment.capture.mode;
    let sizes: Vec<ViewSize> = sizes.collect();
    let topology = resolved.topology();
    let mut rooms = topology.rooms(mode, &sizes, held_frames);
    if resolved.is_far() {
        // A host with cameras has no topics of fusion or of other views; these are on other hosts.
        let uses = |process: &Process, topic: &String| {
            process.inputs.contains(topic) || process.outputs.contains(topic)
        };
        rooms.retain(|room| topology.processes().iter().any(|process| uses(process, &room.topic)));
    }
    let between = rooms.into_iter().map(|room| topic_of(room, delivery));
    let of_processes = names.iter().flat_map(|name| process_topics(name));
    between.chain(of_processes).collect()
}

/// Returns the maximum size of a live camera's original picture, in bytes, if it is recorded. Pictures in other formats are not larger than
/// RGB pixels, except small pictures whose format contains tables.
fn picture_bytes(resolved: &Resolved, view: usize) -> usize {
    const TABLES: usize = 1 << 16;
    let recording = resolved.recording.as_ref();
    let is_kept = recording.is_some_and(|recording| recording.pictures.contains(&view));
    let size = resolved.footage.get(view).filter(|_| is_kept);
    size.map_or(0, |size| {
        let [width, height] = size.size.map(|side| side as usize);
        width * height * 3 + TABLES
    })
}

/// Returns the plan of a topic with the given limits and message sizes.
fn topic_of(room: Room, delivery: Delivery) -> TopicPlan {
    let limits = Limits::new(room.receivers, room.queued, room.borrowed);
    // A topic that allows onlookers (observing programs) must have room for the user's own programs.
    let guests = if room.onlookers > 0 { MOST_GUESTS } else { 0 };
    let limits = limits.with_onlookers(room.onlookers + guests);
    let (topic, longest) = (room.topic, room.longest);
    let plan = match room.content {
        Content::Frame => TopicPlan::slices::<u8, FrameHeader>(topic, delivery, limits, longest),
        Content::Picture => {
            TopicPlan::slices::<u8, PictureHeader>(topic, delivery, limits, longest)
        }
        Content::Evidence => {
            TopicPlan::slices::<f32, EvidenceHeader>(topic, delivery, limits, longest)
        }
        Content::Sightings => TopicPlan::messages::<Sightings>(topic, delivery, limits),
        Content::ViewQuality => TopicPlan::messages::<ViewQuality>(topic, delivery, limits),
        Content::PairPose => TopicPlan::messages::<PairPose>(topic, delivery, limits),
        Content::People => TopicPlan::messages::<People>(topic, delivery, limits),
        Content::Skeletons => TopicPlan::messages::<Skeletons>(topic, delivery, limits),
    };
    match room.usual {
        Some(usual) => plan.with_few_chunks(usual),
        None => plan,
    }
}

/// Plans the processes of a deployment, receivers before senders.
///
/// * `file`: path of the resolved deployment in the output folder.
fn processes(resolved: &Resolved, file: &Path) -> Vec<ProcessSpec> {
    let topology = resolved.topology();
    let processes = topology.processes().iter();
    processes.map(|each| process(each, &topology, resolved, file)).collect()
}

fn process(
    process: &Process,
    topology: &Topology,
    resolved: &Resolved,
    file: &Path,
) -> ProcessSpec {
    let mut args: Vec<OsString> = vec!["--plan".into(), file.into()];
    if let Some(index) = process.index {
        args.extend(["--index".into(), index.to_string().into()]);
    }
    if process.is_replayed {
        args.extend(["--stage".into(), process.service.into()]);
    }
    let is_realtime = resolved.delivery() == Delivery::Realtime && !process.is_replayed;
    let is_comparable = Stage::of_name(process.service).is_some();
    let service = if process.is_replayed {
        Name::Replay.name()
    } else {
        process.service
    };
    ProcessSpec {
        name: process.name.clone(),
        service: service.to_owned(),
        args,
        role: match process.role {
            deployment::Role::Essential => Role::Essential,
            deployment::Role::Redundant => Role::Redundant,
            deployment::Role::Optional => Role::Optional,
        },
        senders: topology.senders_to(process).map(|sender| sender.name.clone()).collect(),
        scheduling: scheduling::requested(
            &resolved.deployment.runtime,
            process.service,
            &process.name,
        ),
        // Stages that write files have no limit, because their work varies. With lossless delivery, no stage has a limit, because there are
        // no deadlines.
        most_work: (is_realtime && is_comparable).then_some(MAX_WORK_FACTOR),
        completes_files: ["results", "record"].contains(&process.service),
    }
}

/// Plans a run of the supervisor.
///
/// * `file`: path of the resolved deployment in the output folder.
/// * `log`: the log level of the processes.
/// * `session`: start of the run.
pub(crate) fn plan(
    resolved: &Resolved,
    prepared: &Prepared,
    file: &Path,
    (log, session): (Level, u64),
) -> Result<Plan, Failure> {
    let processes = processes(resolved, file);
    let names: Vec<String> = processes.iter().map(|process| process.name.clone()).collect();
    let settings = &resolved.deployment.supervise;
    let hang_limit = Duration::from_secs(resolved.deployment.hang_limit_s());
    Ok(Plan {
        executable: executable()?,
        given: resolved.to_text()?.into_bytes(),
        description: programs::description(resolved, prepared, session)?.into_bytes(),
        namespace: Namespace::new(&hosts::namespace(resolved))?,
        session,
        delivery: resolved.delivery(),
        topics: topics(resolved, prepared, &names),
        processes,
        policy: Policy {
            max_restarts: settings.max_restarts as usize,
            restart_window: RESTART_WINDOW,
            hang_limit,
            startup_limit: Policy::default().startup_limit.max(hang_limit),
            stopped_limit: HEARTBEAT * settings.missed_beats,
            ..Policy::default()
        },
        log,
    })
}

/// Returns the path of this executable, which runs every service.
fn executable() -> Result<PathBuf, Failure> {
    std::env::current_exe().or_fail(ExitKind::Run)
}
