//! The processes of a deployment, the topics between them, and the capacity of the topics.
//!
//! The receivers of a topic are counted in one place only: all processes that list the topic among their inputs.

mod hosts;
mod rooms;
#[cfg(test)]
mod tests;

use std::path::PathBuf;

use messages::topic;
use serde::{Deserialize, Serialize};

use crate::{Deployment, Views};

pub use rooms::{Content, Room, ViewSize};

/// A stage of the pipeline, in the order in which frames pass through.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Stage {
    /// Reads footage and publishes frames.
    Capture,
    /// Finds poses of single views in frames, with their evidence.
    Pose,
    /// Predicts expected errors.
    Quality,
    /// Finds the poses of pairs of views.
    Fuse,
    /// Finds the joints in space.
    Triangulate,
}

impl Stage {
    /// All stages, in order.
    pub const ALL: [Self; 5] = [
        Self::Capture,
        Self::Pose,
        Self::Quality,
        Self::Fuse,
        Self::Triangulate,
    ];

    /// Returns the name of the stage's service.
    pub fn name(self) -> &'static str {
        match self {
            Self::Capture => "capture",
            Self::Pose => "pose",
            Self::Quality => "quality",
            Self::Fuse => "fuse",
            Self::Triangulate => "triangulate",
        }
    }

    /// Returns the stage with a given name.
    pub fn of_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|known| known.name() == name)
    }
}

/// Name of the process that writes the results.
const RESULTS: &str = "results";
/// Name of the process that records every message.
const RECORD: &str = "record";
/// Name of the process that carries messages between hosts.
const BRIDGE: &str = "bridge";

/// Returns the services whose processes a deployment file may assign to cores and give a priority, each with its maximum number of numbered
/// processes. The recording process is not included, because the deployment file does not say whether it runs.
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

/// Returns the name of a process in its deployment: `pose-1`, or `results` if its service has one process only.
pub(crate) fn process_name(service: &str, index: Option<usize>) -> String {
    index.map_or(service.to_owned(), |index| format!("{service}-{index}"))
}

/// Settings of the file that every message of a run is recorded in.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct RecordingPlan {
    /// Absolute path of the file.
    pub file: PathBuf,
    /// True if the pixels of frames are left out.
    pub without_pixels: bool,
    /// True if evidence is left out.
    pub without_evidence: bool,
    /// Maximum size of the messages that wait to be written, in millions of bytes.
    pub queue_mb: u64,
    /// Views, in ascending order, whose live cameras' pictures are recorded in their original form.
    #[serde(default)]
    pub pictures: Vec<usize>,
    /// True if the messages for Foxglove are left out.
    #[serde(default)]
    pub without_foxglove: bool,
}

/// A recording that replaces the first stages of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Replay {
    /// Absolute path of the recording.
    pub file: PathBuf,
    /// First stage that runs instead of being replayed.
    pub from: Stage,
    /// Speed of the replay relative to the recording; `None` for as fast as possible.
    pub speed: Option<f64>,
}

/// Reaction of the run if a process is lost.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// The run fails.
    Essential,
    /// The other processes of its service continue without it.
    Redundant,
    /// The run continues; the results do not need the process.
    Optional,
}

/// One process of a deployment.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Process {
    /// Name of the process in the deployment, such as `pose-1`.
    pub name: String,
    /// Service that the process runs: a stage, `results`, `record` or `bridge`.
    pub service: &'static str,
    /// Index of the view or worker, if the service has one process for each.
    pub index: Option<usize>,
    /// Reaction of the run if the process is lost.
    pub role: Role,
    /// True if the process does not run, and its messages come from a recording.
    pub is_replayed: bool,
    /// Topics that the process subscribes to.
    pub inputs: Vec<String>,
    /// Topics that the process publishes.
    pub outputs: Vec<String>,
}

/// All processes of a deployment, and the topics between them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Topology {
    processes: Vec<Process>,
    pairs: Vec<[usize; 2]>,
    n_workers: usize,
    n_views: usize,
    /// True if networks or keypoints find the people, who are then solved in space.
    has_maps: bool,
}

impl Topology {
    /// Returns the processes of a deployment.
    ///
    /// * `recording`: the file that records the messages.
    /// * `replay`: the recording that replaces the first stages.
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

    /// Returns the processes in starting order: receivers before senders.
    pub fn processes(&self) -> &[Process] {
        &self.processes
    }

    /// Returns the process with a given name.
    pub fn process(&self, name: &str) -> Option<&Process> {
        self.processes.iter().find(|process| process.name == name)
    }

    /// Returns the processes that publish a topic to which the receiver subscribes.
    pub fn senders_to<'a>(&'a self, receiver: &'a Process) -> impl Iterator<Item = &'a Process> {
        let sends =
            |process: &&Process| process.outputs.iter().any(|out| receiver.inputs.contains(out));
        self.processes.iter().filter(sends)
    }

    /// Returns the number of processes that subscribe to a topic.
    pub fn receivers_of(&self, topic: &str) -> usize {
        self.count(|process| process.inputs.iter().any(|input| input == topic))
    }

    /// Returns the number of processes that receive all output of the pipeline: `results`, and `record` if there is one.
    pub fn n_recorders(&self) -> usize {
        self.count(|process| [RESULTS, RECORD].contains(&process.service))
    }

    /// Returns the number of views. Services with one process per view have this number of processes.
    pub fn n_views(&self) -> usize {
        self.n_views
    }

    /// Returns the number of fusion processes.
    pub fn n_workers(&self) -> usize {
        self.n_workers
    }

    /// Returns true if networks or keypoints find the people. In this case, `fuse` sends the identities of people, and `triangulate` reads
    /// the evidence.
    pub fn has_maps(&self) -> bool {
        self.has_maps
    }

    /// Returns the pairs of views in ascending order.
    ///
    /// If all views are solved at once, each view except the first is paired with the view before it. The number of pairs then equals the
    /// number of messages, and together the pairs contain all views.
    pub fn pairs(&self) -> &[[usize; 2]] {
        &self.pairs
    }

    /// Returns the pairs of a worker, each with its index in [`Topology::pairs`].
    pub fn pairs_of(&self, worker: usize) -> Vec<(usize, [usize; 2])> {
        let indexed = self.pairs.iter().copied().enumerate();
        let step = self.n_workers.max(1);
        indexed.skip(worker).step_by(step).collect()
    }

    /// Returns the number of workers that read the evidence of a view.
    pub fn workers_on(&self, view: usize) -> usize {
        (0..self.n_workers).filter(|&worker| self.reads(worker, view)).count()
    }

    fn reads(&self, worker: usize, view: usize) -> bool {
        let pairs = self.pairs_of(worker);
        pairs.iter().any(|(_, pair)| pair.contains(&view))
    }

    /// Returns the topics that the fusion processes publish, in the order of the processes.
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
    /// Views whose pictures are recorded in their original form.
    pictures: &'a [usize],
}

impl Builder<'_> {
    /// Returns all processes, with none of them replayed.
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
            let outputs = vec![topic::sightings(view), topic::evidence(view)];
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

    /// Returns all topics except evidence.
    fn everything(&self) -> Vec<String> {
        let mut inputs = Vec::new();
        for view in 0..self.topology.n_views {
            inputs.extend([topic::frame(view), topic::sightings(view)]);
            inputs.extend(self.has_quality.then(|| topic::view_quality(view)));
        }
        inputs.extend(self.topology.fused());
        inputs.push(topic::skeletons());
        inputs
    }

    fn triangulate(&self) -> Process {
        let views = || 0..self.topology.n_views;
        let mut inputs: Vec<String> = views().map(topic::sightings).collect();
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
            inputs.push(topic::sightings(view));
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
        let mut inputs = vec![topic::sightings(view)];
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

/// Returns the pairs of views that are fused, in ascending order.
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

/// Returns the indices of two cameras in ascending order.
fn indices(deployment: &Deployment, names: &[String; 2]) -> Option<[usize; 2]> {
    let index = |name: &String| deployment.cameras.iter().position(|camera| camera.name == *name);
    let [first, second] = [index(&names[0])?, index(&names[1])?];
    Some([first.min(second), first.max(second)])
}
