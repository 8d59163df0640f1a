//! From a deployment to processes and topics.

use core::time::Duration;
use std::ffi::OsString;
use std::io::{IsTerminal as _, Read as _};
use std::path::{Path, PathBuf};

use runtime::{
    Delivery, DeploymentPlan, ExitKind, Failure, HEARTBEAT, Namespace, OrFail as _, Scheduling,
    TopicPlan, now_nanos,
};
use serde::{Deserialize, Serialize};
use supervise::{Plan, Policy, ProcessSpec, Role};
use tracing::Level;

use crate::audience::{Audience, Replay, Stage, Tape};
use crate::deployment::Deployment;
use crate::inputs::{self, Footage};
use crate::prepare::Prepared;
use crate::sanity;
use crate::vertical;

/// A deployment with what was found out about its footage: what every process is given.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Resolved {
    /// The deployment, all paths absolute.
    pub deployment: Deployment,
    /// The footage of every camera.
    pub footage: Vec<Footage>,
    /// The file that every message goes to, if there is one.
    #[serde(default)]
    pub tape: Option<Tape>,
    /// The recording that stands in for the first stages, if there is one.
    #[serde(default)]
    pub replay: Option<Replay>,
}

/// The services, in the order in which a frame passes them.
pub(crate) const SERVICES: [&str; 6] = [
    "capture",
    "pose",
    "quality",
    "fuse",
    "triangulate",
    "results",
];

/// How many times the work of any turn before it a turn may be, where turns are alike: frames, or levels of a pair.
const EVEN: u32 = 3;

impl Resolved {
    /// Looks at the footage of a deployment, and whether it can be that of its cameras; says what is doubtful.
    pub(crate) fn new(deployment: &Deployment) -> Result<Self, Failure> {
        let footage = inputs::footage(deployment);
        let mut resolved = Self {
            footage: footage.map_err(|it| inputs::of_deployment(it, deployment))?,
            deployment: deployment.clone(),
            tape: None,
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

    /// Frames that will be used.
    pub(crate) fn n_frames(&self) -> u64 {
        self.footage.iter().map(|it| it.n_frames).max().unwrap_or(0)
    }

    /// Frames of the footage per second, where any camera knows.
    pub(crate) fn frame_rate_hz(&self) -> Option<f64> {
        let capture = &self.deployment.capture;
        let step = capture.frame_step as f64;
        let known = self.footage.iter().filter_map(|it| it.frame_rate_hz);
        let all: Vec<f64> = known.map(|it| it * step).collect();
        // Files that contradict each other are overruled by who knows better.
        let agree = all.iter().all(|it| (it / all[0] - 1.0).abs() < 1e-3);
        let given = capture.frame_rate_hz.filter(|_| !agree);
        given.or_else(|| all.first().copied())
    }

    /// Writes it for the user to read.
    pub(crate) fn write(&self, file: &Path) -> Result<(), Failure> {
        std::fs::write(file, self.to_text()?).map_err(|error| inputs::in_file(file, &error))
    }

    /// What every process is given.
    pub(crate) fn to_text(&self) -> Result<String, Failure> {
        serde_json::to_string_pretty(self).or_fail(ExitKind::Run)
    }

    /// Reads what the supervisor has given to this process, in its standard input: the file in the output folder may
    /// be gone or be another run's when a process is started again.
    ///
    /// * `file`: the file of the same content; it is read by a process that was started by hand, without anything in
    ///   its input.
    pub(crate) fn given(file: &Path) -> Result<Self, Failure> {
        let wrong = |error: &dyn core::error::Error| inputs::in_file(file, error);
        let mut text = String::new();
        if !std::io::stdin().is_terminal() {
            let read = std::io::stdin().read_to_string(&mut text);
            read.map_err(|error| wrong(&error))?;
        }
        if text.is_empty() {
            text = inputs::text(file)?;
        }
        serde_json::from_str(&text).map_err(|error| wrong(&error))
    }

    /// What happens when a receiver is slower than its sender.
    pub(crate) fn delivery(&self) -> Delivery {
        match self.deployment.capture.mode {
            capture::Mode::Lossless => Delivery::Lossless,
            capture::Mode::Realtime => Delivery::Realtime,
        }
    }

    /// How long a stage waits for a view that is late.
    pub(crate) fn patience(&self) -> Duration {
        Duration::from_millis(self.deployment.deadline_ms())
    }

    /// Whether a stage runs; if not, a recording stands in for it.
    pub(crate) fn runs(&self, stage: Stage) -> bool {
        self.replay.as_ref().is_none_or(|it| it.from <= stage)
    }

    /// Whether expected errors are predicted from the frames.
    pub(crate) fn has_network(&self) -> bool {
        self.deployment.quality.network.is_some()
    }

    /// Whether there are processes that send expected errors.
    pub(crate) fn has_quality(&self) -> bool {
        self.deployment.quality.table.is_some() || self.has_network()
    }
}

/// How the pairs of views are dealt, and who reads what of whom.
#[derive(Debug, Clone)]
pub(crate) struct Dealing {
    /// Fusion processes.
    pub n_workers: usize,
    /// The pairs; those that tell of all views, where they are solved at once.
    pub pairs: Vec<[usize; 2]>,
}

impl Dealing {
    /// Deals the pairs to at most so many workers.
    pub(crate) fn new(pairs: &[[usize; 2]], most_workers: usize) -> Self {
        Self {
            n_workers: most_workers.min(pairs.len()),
            pairs: pairs.to_vec(),
        }
    }

    /// The pairs of a worker, with their index in the deployment.
    pub(crate) fn of(&self, worker: usize) -> Vec<(usize, [usize; 2])> {
        let its = self.pairs.iter().copied().enumerate();
        its.skip(worker).step_by(self.n_workers.max(1)).collect()
    }

    /// Workers that need the evidence of a view.
    pub(crate) fn readers_of(&self, view: usize) -> usize {
        let reads = |worker: &usize| self.of(*worker).iter().any(|it| it.1.contains(&view));
        (0..self.n_workers).filter(reads).count()
    }
}

/// The topics of a deployment.
pub(crate) fn topics(
    resolved: &Resolved,
    prepared: &Prepared,
    names: Vec<String>,
) -> Vec<TopicPlan> {
    let dealing = Dealing::new(&prepared.pairs, resolved.deployment.fuse.most_workers());
    let audience = Audience::new(resolved, &dealing);
    let views = prepared.views.iter().enumerate();
    let plan = DeploymentPlan {
        delivery: resolved.delivery(),
        views: views
            .map(|(view, it)| runtime::ViewPlan {
                frame_bytes: it
                    .framing
                    .out_size()
                    .map(|side| side as usize)
                    .iter()
                    .product::<usize>()
                    * 3,
                evidence_values: it.plan.layout().n_responses(),
                n_workers: audience.of_evidence(view),
            })
            .collect(),
        n_workers: dealing.n_workers,
        n_recorders: audience.n_recorders(),
        held: 1,
        held_frames: if resolved.has_network() && resolved.delivery() == Delivery::Realtime {
            quality::HELD_REALTIME
        } else {
            1
        },
        processes: names,
    };
    plan.topics()
}

/// The processes of a deployment, consumers first.
///
/// * `file`: the resolved deployment, as the user finds it.
pub(crate) fn processes(resolved: &Resolved, prepared: &Prepared, file: &Path) -> Vec<ProcessSpec> {
    let dealing = Dealing::new(&prepared.pairs, resolved.deployment.fuse.most_workers());
    let n_views = prepared.views.len();
    let n_quality = if resolved.has_quality() { n_views } else { 0 };
    let mut processes = vec![
        process("results", None, Role::Optional, file),
        process("triangulate", None, Role::Essential, file),
    ];
    if resolved.tape.is_some() {
        processes.insert(0, process("record", None, Role::Optional, file));
    }
    for (service, count, role) in [
        ("fuse", dealing.n_workers, Role::Redundant),
        ("quality", n_quality, Role::Optional),
        ("pose", n_views, Role::Redundant),
        ("capture", n_views, Role::Redundant),
    ] {
        processes.extend((0..count).map(|it| process(service, Some(it), role, file)));
    }
    for it in &mut processes {
        it.most_work = most_work(resolved, &it.service);
        it.scheduling = resolved.deployment.runtime.of(&it.service, &it.name);
        stand_in(it, resolved);
    }
    processes
}

/// How many times the work of any turn before it a turn of a service may be; none if that is not known, as of what is
/// written at the end, or where nothing may be lost and so nothing is hurried.
fn most_work(resolved: &Resolved, service: &str) -> Option<u32> {
    if resolved.delivery() == Delivery::Lossless {
        return None;
    }
    match service {
        "capture" | "pose" | "quality" | "fuse" | "triangulate" => Some(EVEN),
        _ => None,
    }
}

/// Makes a process that does not run one that sends what was recorded of it.
fn stand_in(it: &mut ProcessSpec, resolved: &Resolved) {
    let stage = Stage::of_service(&it.service);
    if stage.is_some_and(|stage| !resolved.runs(stage)) {
        it.args
            .extend(["--stage".into(), it.service.clone().into()]);
        "replay".clone_into(&mut it.service);
        it.most_work = None;
    }
}

fn process(service: &str, index: Option<usize>, role: Role, file: &Path) -> ProcessSpec {
    let mut args: Vec<OsString> = vec!["--plan".into(), file.into()];
    if let Some(index) = index {
        args.extend(["--index".into(), index.to_string().into()]);
    }
    ProcessSpec {
        name: index.map_or(service.to_owned(), |it| format!("{service}-{it}")),
        service: service.to_owned(),
        args,
        role,
        scheduling: Scheduling::default(),
        most_work: None,
    }
}

/// What the supervisor is to run.
pub(crate) fn plan(
    resolved: &Resolved,
    prepared: &Prepared,
    file: &Path,
    log: Level,
) -> Result<Plan, Failure> {
    let processes = processes(resolved, prepared, file);
    let names = processes.iter().map(|it| it.name.clone()).collect();
    let settings = &resolved.deployment.supervise;
    Ok(Plan {
        executable: executable()?,
        given: resolved.to_text()?.into_bytes(),
        namespace: Namespace::new(&resolved.deployment.name)?,
        session: now_nanos(),
        delivery: resolved.delivery(),
        topics: topics(resolved, prepared, names),
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pair_has_one_worker() {
        let pairs = pipeline::all_pairs(5);
        for most in 1..12 {
            let dealing = Dealing::new(&pairs, most);
            let mut dealt: Vec<usize> = (0..dealing.n_workers)
                .flat_map(|it| dealing.of(it))
                .map(|it| it.0)
                .collect();
            dealt.sort_unstable();
            assert_eq!(dealt, (0..10).collect::<Vec<_>>(), "{most} workers");
        }
    }

    #[test]
    fn a_view_is_read_by_the_workers_of_its_pairs() {
        let dealing = Dealing::new(&[[0, 1], [0, 2], [1, 2]], 3);
        assert_eq!([0, 1, 2].map(|it| dealing.readers_of(it)), [2, 2, 2]);
        let dealing = Dealing::new(&[[0, 1]], 4);
        assert_eq!([0, 1, 2].map(|it| dealing.readers_of(it)), [1, 1, 0]);
    }

    #[test]
    fn one_camera_has_no_worker() {
        let dealing = Dealing::new(&[], 4);
        assert_eq!(dealing.n_workers, 0);
        assert_eq!(dealing.readers_of(0), 0);
    }
}
