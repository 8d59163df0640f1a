//! The processes of a deployment, who sends to whom, and how much room topics have.
//!
//! One place counts: a topic has as many receivers as there are processes that list it among their inputs.

mod hosts;
mod rooms;
#[cfg(test)]
mod tests;

use std::path::PathBuf;

use messages::topic;
use serde::{Deserialize, Serialize};

use crate::{Deployment, Views};

pub use rooms::{Content, Room, ViewSize};

/// A stage of the pipeline, in the order in which a frame passes them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Stage {
    /// Footage to frames.
    Capture,
    /// Frames to single-view poses and their evidence.
    Pose,
    /// Expected errors.
    Quality,
    /// Pairs of views to their poses.
    Fuse,
    /// Joints in space.
    Triangulate,
}

impl Stage {
    /// All of them, in order.
    pub const ALL: [Self; 5] = [
        Self::Capture,
        Self::Pose,
        Self::Quality,
        Self::Fuse,
        Self::Triangulate,
    ];

    /// The service.
    pub fn name(self) -> &'static str {
        match self {
            Self::Capture => "capture",
            Self::Pose => "pose",
            Self::Quality => "quality",
            Self::Fuse => "fuse",
            Self::Triangulate => "triangulate",
        }
    }

    /// The stage of that name.
    pub fn of_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|known| known.name() == name)
    }
}

/// The process that writes the results.
const RESULTS: &str = "results";
/// The process that records every message.
const RECORD: &str = "record";
/// The process that carries messages between hosts.
const BRIDGE: &str = "bridge";

/// The services whose processes a deployment file may give cores and a priority, each with the largest number of
/// processes, which are numbered. The recording process is not among them: no file says whether it runs.
pub(crate) fn services(deployment: &Deployment) -> Vec<(&'static str, usize)> {
    let n_views = deployment.cameras.len();
    let of_stage = |stage: Stage| match stage {
        Stage::Capture | Stage::Pose | Stage::Quality => n_views,
        Stage::Fuse => deployment.most_workers(),
        Stage::Triangulate => 0,
    };
    let stages = Stage::ALL.map(|stage| (stage.name(), of_stage(stage)));
    stages.into_iter().chain([(RESULTS, 0)]).collect()
}

/// The name of a process in its deployment: `pose-1`, or `results` where there is one of its service alone.
pub(crate) fn process_name(service: &str, index: Option<usize>) -> String {
    index.map_or(service.to_owned(), |index| format!("{service}-{index}"))
}

/// The file that every message of a run is recorded in.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct RecordingPlan {
    /// Its name, absolute.
    pub file: PathBuf,
    /// True if the pixels of frames are left out.
    pub without_pixels: bool,
    /// True if evidence is left out.
    pub without_evidence: bool,
    /// Bytes that may wait to be written, in millions.
    pub queue_mb: u64,
    /// Views whose live cameras' pictures are kept as they came, ascending.
    #[serde(default)]
    pub pictures: Vec<usize>,
    /// True if the messages for Foxglove are left out.
    #[serde(default)]
    pub without_foxglove: bool,
}

/// A recording that stands in for the first stages of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Replay {
    /// Its name, absolute.
    pub file: PathBuf,
    /// The first stage that runs for real.
    pub from: Stage,
    /// How many times as fast as it was recorded; as fast as can be without it.
    pub speed: Option<f64>,
}

/// Reaction of the run to the loss of a process.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// The run fails.
    Essential,
    /// The others of its service go on without it.
    Redundant,
    /// Nothing that the results need is lost.
    Optional,
}

/// One process of a deployment.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Process {
    /// Its name in the deployment: `pose-1`.
    pub name: String,
    /// Service that it runs: a stage, `results`, `record` or `bridge`.
    pub service: &'static str,
    /// The view or the worker, where there is one process for each.
    pub index: Option<usize>,
    /// Reaction of the run when it is lost.
    pub role: Role,
    /// True if it does not run, and its messages of a recording are sent in its place.
    pub is_replayed: bool,
    /// Topics that it subscribes to.
    pub inputs: Vec<String>,
    /// Topics that it publishes.
    pub outputs: Vec<String>,
}

/// All processes of a deployment, and the topics between them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Topology {
    processes: Vec<Process>,
    pairs: Vec<[usize; 2]>,
    n_workers: usize,
    n_views: usize,
    /// True if people are found by networks or keypoints, and solved in space.
    has_maps: bool,
}

impl Topology {
    /// The processes of a deployment.
    ///
    /// * `recording`: the file that its messages are recorded in.
    /// * `replay`: the recording that stands in for its first stages.
    pub fn new(
        deployment: &Deployment,
        recording: Option<&RecordingPlan>,
        replay: Option<&Replay>,
    ) -> Self {
        let pairs = pairs(deployment);
        let mut topology = Self {
            processes: Vec::new(),
            n_workers: deployment.most_workers().min(pairs.len()),
            n_views: deployment.cameras.len(),
            has_maps: deployment.has_maps(),
            pairs,
        };
        let is_replayed = |service: &str| {
            let stage = Stage::of_name(service);
            let first = replay.map(|replay| replay.from);
            stage.zip(first).is_some_and(|(stage, first)| stage < first)
        };
        let builder = Builder {
            topology: &topology,
            has_quality: deployment.has_quality(),
            has_network: deployment.predicts_errors(),
            with_evidence: recording.is_some_and(|recording| !recording.without_evidence),
            pictures: recording.map_or(&[], |recording| &recording.pictures),
        };
        let mut processes = builder.processes(recording.is_some());
        for it in &mut processes {
            it.is_replayed = is_replayed(it.service);
            if it.is_replayed {
                it.inputs.clear();
            }
        }
        topology.processes = processes;
        topology
    }

    /// The processes in the order in which they start: receivers before senders.
    pub fn processes(&self) -> &[Process] {
        &self.processes
    }

    /// The process of that name.
    pub fn process(&self, name: &str) -> Option<&Process> {
        self.processes.iter().find(|process| process.name == name)
    }

    /// The processes that send to another: each publishes a topic that it subscribes to.
    pub fn senders_to<'a>(&'a self, receiver: &'a Process) -> impl Iterator<Item = &'a Process> {
        let sends =
            |process: &&Process| process.outputs.iter().any(|out| receiver.inputs.contains(out));
        self.processes.iter().filter(sends)
    }

    /// How many processes subscribe to a topic.
    pub fn receivers_of(&self, topic: &str) -> usize {
        self.count(|process| process.inputs.iter().any(|input| input == topic))
    }

    /// Processes that take everything that leaves the pipeline: `results`, and `record` if there is one.
    pub fn n_recorders(&self) -> usize {
        self.count(|process| [RESULTS, RECORD].contains(&process.service))
    }

    /// Views, and so processes of every service that has one for each view.
    pub fn n_views(&self) -> usize {
        self.n_views
    }

    /// Fusion processes.
    pub fn n_workers(&self) -> usize {
        self.n_workers
    }

    /// Returns true if people are found by networks or keypoints: `fuse` sends who is who, and `triangulate` reads the evidence.
    pub fn has_maps(&self) -> bool {
        self.has_maps
    }

    /// Pairs of views, ascending. Where all views are solved at once: every view but the first with the one before it,
    /// as many as there are messages, and together all views.
    pub fn pairs(&self) -> &[[usize; 2]] {
        &self.pairs
    }

    /// The pairs of a worker, each with its index among [`Topology::pairs`].
    pub fn pairs_of(&self, worker: usize) -> Vec<(usize, [usize; 2])> {
        let indexed = self.pairs.iter().copied().enumerate();
        let step = self.n_workers.max(1);
        indexed.skip(worker).step_by(step).collect()
    }

    /// Workers that read the evidence of a view.
    pub fn workers_on(&self, view: usize) -> usize {
        (0..self.n_workers).filter(|&worker| self.reads(worker, view)).count()
    }

    fn reads(&self, worker: usize, view: usize) -> bool {
        let pairs = self.pairs_of(worker);
        pairs.iter().any(|(_, pair)| pair.contains(&view))
    }

    /// Topics of the fusion processes, by process.
    pub fn fused(&self) -> Vec<String> {
        if self.has_maps {
            return vec![topic::people()];
        }
        (0..self.n_workers).map(topic::pair_pose).collect()
    }

    fn count(&self, is_meant: impl Fn(&Process) -> bool) -> usize {
        self.processes.iter().filter(|process| is_meant(process)).count()
    }
}

/// Facts that decide the inputs and outputs of the processes.
struct Builder<'a> {
    topology: &'a Topology,
    has_quality: bool,
    has_network: bool,
    with_evidence: bool,
    /// Views whose pictures are recorded as they came.
    pictures: &'a [usize],
}

impl Builder<'_> {
    /// All processes, none of them replayed.
    fn processes(&self, is_recorded: bool) -> Vec<Process> {
        let views = || 0..self.topology.n_views;
        let mut processes = Vec::new();
        if is_recorded {
            let bulk = views().filter(|_| self.with_evidence).map(topic::evidence);
            let inputs = self.everything().into_iter().chain(bulk);
            let inputs = inputs.chain(self.pictures.iter().copied().map(topic::picture));
            processes.push(process(
                RECORD,
                None,
                Role::Optional,
                inputs.collect(),
                vec![],
            ));
        }
        processes.push(process(
            RESULTS,
            None,
            Role::Optional,
            self.everything(),
            vec![],
        ));
        processes.push(self.triangulate());
        processes.extend((0..self.topology.n_workers).map(|worker| self.fuse(worker)));
        if self.has_quality {
            processes.extend(views().map(|view| self.quality(view)));
        }
        processes.extend(views().map(|view| {
            let outputs = vec![topic::view_pose(view), topic::evidence(view)];
            process(
                Stage::Pose.name(),
                Some(view),
                Role::Redundant,
                vec![topic::frame(view)],
                outputs,
            )
        }));
        processes.extend(views().map(|view| self.capture(view)));
        processes
    }

    fn capture(&self, view: usize) -> Process {
        let mut outputs = vec![topic::frame(view)];
        let is_kept = self.pictures.contains(&view);
        outputs.extend(is_kept.then(|| topic::picture(view)));
        let service = Stage::Capture.name();
        process(service, Some(view), Role::Redundant, vec![], outputs)
    }

    /// All topics but evidence.
    fn everything(&self) -> Vec<String> {
        let mut inputs = Vec::new();
        for view in 0..self.topology.n_views {
            inputs.extend([topic::frame(view), topic::view_pose(view)]);
            inputs.extend(self.has_quality.then(|| topic::view_quality(view)));
        }
        inputs.extend(self.topology.fused());
        inputs.push(topic::skeletons());
        inputs
    }

    fn triangulate(&self) -> Process {
        let views = || 0..self.topology.n_views;
        let mut inputs: Vec<String> = views().map(topic::view_pose).collect();
        inputs.extend(self.topology.fused());
        if self.topology.has_maps {
            inputs.extend(views().map(topic::evidence));
        }
        let service = Stage::Triangulate.name();
        process(
            service,
            None,
            Role::Essential,
            inputs,
            vec![topic::skeletons()],
        )
    }

    fn fuse(&self, worker: usize) -> Process {
        let mut inputs = Vec::new();
        for view in 0..self.topology.n_views {
            inputs.push(topic::view_pose(view));
            let reads = !self.topology.has_maps && self.topology.reads(worker, view);
            inputs.extend(reads.then(|| topic::evidence(view)));
            inputs.extend(self.has_quality.then(|| topic::view_quality(view)));
        }
        let outputs = if self.topology.has_maps {
            vec![topic::people()]
        } else {
            vec![topic::pair_pose(worker)]
        };
        let service = Stage::Fuse.name();
        process(service, Some(worker), Role::Redundant, inputs, outputs)
    }

    fn quality(&self, view: usize) -> Process {
        let mut inputs = vec![topic::view_pose(view)];
        inputs.extend(self.has_network.then(|| topic::frame(view)));
        let outputs = vec![topic::view_quality(view)];
        let service = Stage::Quality.name();
        process(service, Some(view), Role::Optional, inputs, outputs)
    }
}

fn process(
    service: &'static str,
    index: Option<usize>,
    role: Role,
    inputs: Vec<String>,
    outputs: Vec<String>,
) -> Process {
    Process {
        name: process_name(service, index),
        service,
        index,
        role,
        is_replayed: false,
        inputs,
        outputs,
    }
}

/// The pairs of views that are fused, ascending.
fn pairs(deployment: &Deployment) -> Vec<[usize; 2]> {
    let n_views = deployment.cameras.len();
    if deployment.views() != Views::Pairs {
        return (1..n_views).map(|view| [view - 1, view]).collect();
    }
    let mut pairs: Vec<[usize; 2]> = if deployment.paper.pairs.is_empty() {
        let with_first = |first| (first + 1..n_views).map(move |second| [first, second]);
        (0..n_views).flat_map(with_first).collect()
    } else {
        let named = deployment.paper.pairs.iter();
        named.filter_map(|names| indices(deployment, names)).collect()
    };
    pairs.sort_unstable();
    pairs.dedup();
    pairs
}

/// The two cameras, ascending.
fn indices(deployment: &Deployment, names: &[String; 2]) -> Option<[usize; 2]> {
    let index = |name: &String| deployment.cameras.iter().position(|camera| camera.name == *name);
    let [first, second] = [index(&names[0])?, index(&names[1])?];
    Some([first.min(second), first.max(second)])
}
