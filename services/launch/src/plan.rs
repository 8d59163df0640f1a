//! From a deployment to the processes and topics that the supervisor runs.

use core::time::Duration;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

use deployment::{Content, Deployment, Process, Room, Stage, Topology, ViewSize};
use messages::{EvidenceHeader, FrameHeader, PairPose, Pose3d, ViewPose, ViewQuality};
use runtime::{
    Delivery, ExitKind, Failure, HEARTBEAT, Limits, Namespace, OrFail as _, TopicPlan, now_nanos,
    process_topics,
};
use supervise::{Plan, Policy, ProcessSpec, Role};
use tracing::Level;

use crate::inputs;
use crate::prepare::Prepared;
use crate::process::Name;
use crate::resolved::Resolved;
use crate::sanity;
use crate::scheduling;
use crate::vertical;

/// How many times the work of any turn before it a turn may be, where turns are alike: frames, or levels of a pair.
const EVEN: u32 = 3;

/// Looks at the footage of a deployment, and whether it can be that of its cameras; says what is doubtful.
///
/// # Errors
///
/// Footage or calibration cannot be read, or cannot give joints in space.
pub fn resolve(deployment: &Deployment) -> Result<Resolved, Failure> {
    let footage = inputs::footage(deployment);
    let mut resolved = Resolved {
        footage: footage.map_err(|it| inputs::of_deployment(it, deployment))?,
        deployment: deployment.clone(),
        recording: None,
        replay: None,
    };
    sanity::warn(&resolved)?;
    // Of the processes none has to find it again, and a replay takes the same.
    if let Some(found) = vertical::find(deployment)? {
        tracing::warn!("{}", found.why);
        resolved.deployment.up = Some(found.up);
    }
    Ok(resolved)
}

/// Reads everything that the deployment names, and says what it is.
///
/// # Errors
///
/// Something that the deployment names cannot be read or used.
pub fn check(deployment: &Deployment) -> Result<String, Failure> {
    let resolved = resolve(deployment)?;
    let prepared = Prepared::new(&resolved)?;
    prepared.check_predictions(&resolved)?;
    if let Some(padding) = &prepared.padding {
        tracing::warn!("{padding}");
    }
    let n_frames = resolved.n_frames();
    let solved_in = match prepared.settings.views {
        pipeline::Views::Pairs => format!("{} pairs", prepared.pairs.len()),
        pipeline::Views::All => "solved at once".to_owned(),
    };
    Ok(format!(
        "{} views, {solved_in}, {n_frames} frames, a model of {} parts",
        prepared.views.len(),
        prepared.model.n_parts()
    ))
}

/// The topics of a deployment.
pub(crate) fn topics(resolved: &Resolved, prepared: &Prepared, names: &[String]) -> Vec<TopicPlan> {
    let sizes = prepared.views.iter().map(|it| ViewSize {
        frame_bytes: it
            .framing
            .out_size()
            .map(|side| side as usize)
            .iter()
            .product::<usize>()
            * 3,
        evidence_values: it.plan.layout().n_responses(),
    });
    let delivery = resolved.delivery();
    let held_frames = if resolved.deployment.has_network() && delivery == Delivery::Realtime {
        quality::HELD_REALTIME
    } else {
        1
    };
    let mode = resolved.deployment.capture.mode;
    let sizes: Vec<ViewSize> = sizes.collect();
    let rooms = resolved.topology().rooms(mode, &sizes, held_frames);
    let between = rooms.into_iter().map(|it| topic_of(it, delivery));
    let of_processes = names.iter().flat_map(|it| process_topics(it));
    between.chain(of_processes).collect()
}

/// A topic with that room.
fn topic_of(room: Room, delivery: Delivery) -> TopicPlan {
    let limits = Limits::new(room.receivers, room.queued, room.borrowed);
    let (topic, longest) = (room.topic, room.longest);
    let plan = match room.content {
        Content::Frame => TopicPlan::slices::<u8, FrameHeader>(topic, delivery, limits, longest),
        Content::Evidence => {
            TopicPlan::slices::<f32, EvidenceHeader>(topic, delivery, limits, longest)
        }
        Content::ViewPose => TopicPlan::messages::<ViewPose>(topic, delivery, limits),
        Content::ViewQuality => TopicPlan::messages::<ViewQuality>(topic, delivery, limits),
        Content::PairPose => TopicPlan::messages::<PairPose>(topic, delivery, limits),
        Content::Pose3d => TopicPlan::messages::<Pose3d>(topic, delivery, limits),
    };
    match room.usual {
        Some(usual) => plan.with_few_chunks(usual),
        None => plan,
    }
}

/// The processes of a deployment, receivers before senders.
///
/// * `file`: the resolved deployment, as the user finds it.
fn processes(resolved: &Resolved, file: &Path) -> Vec<ProcessSpec> {
    let topology = resolved.topology();
    let processes = topology.processes().iter();
    processes
        .map(|it| process(it, &topology, resolved, file))
        .collect()
}

fn process(it: &Process, topology: &Topology, resolved: &Resolved, file: &Path) -> ProcessSpec {
    let mut args: Vec<OsString> = vec!["--plan".into(), file.into()];
    if let Some(index) = it.index {
        args.extend(["--index".into(), index.to_string().into()]);
    }
    if it.is_replayed {
        args.extend(["--stage".into(), it.service.into()]);
    }
    let is_hurried = resolved.delivery() == Delivery::Realtime && !it.is_replayed;
    let is_even = Stage::of_name(it.service).is_some();
    let service = if it.is_replayed {
        Name::Replay.name()
    } else {
        it.service
    };
    ProcessSpec {
        name: it.name.clone(),
        service: service.to_owned(),
        args,
        role: match it.role {
            deployment::Role::Essential => Role::Essential,
            deployment::Role::Redundant => Role::Redundant,
            deployment::Role::Optional => Role::Optional,
        },
        senders: topology.senders_to(it).map(|it| it.name.clone()).collect(),
        scheduling: scheduling::asked(&resolved.deployment.runtime, it.service, &it.name),
        // Not known of what is written at the end; and where nothing may be lost nothing is hurried.
        most_work: (is_hurried && is_even).then_some(EVEN),
    }
}

/// What the supervisor is to run.
pub(crate) fn plan(
    resolved: &Resolved,
    prepared: &Prepared,
    file: &Path,
    log: Level,
) -> Result<Plan, Failure> {
    let processes = processes(resolved, file);
    let names: Vec<String> = processes.iter().map(|it| it.name.clone()).collect();
    let settings = &resolved.deployment.supervise;
    Ok(Plan {
        executable: executable()?,
        given: resolved.to_text()?.into_bytes(),
        namespace: Namespace::new(&resolved.deployment.name)?,
        session: now_nanos(),
        delivery: resolved.delivery(),
        topics: topics(resolved, prepared, &names),
        processes,
        policy: Policy {
            max_restarts: settings.max_restarts as usize,
            restart_window: Duration::from_secs(settings.restart_window_s),
            hang_limit: Duration::from_secs(resolved.deployment.hang_limit_s()),
            stopped_limit: HEARTBEAT * settings.missed_beats,
            ..Policy::default()
        },
        log,
    })
}

/// This program, which becomes any of the services.
fn executable() -> Result<PathBuf, Failure> {
    std::env::current_exe().or_fail(ExitKind::Run)
}
