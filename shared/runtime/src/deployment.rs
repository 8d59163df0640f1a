//! All topics of a deployment, their memory, and whether there is room for it.

use std::io;

use messages::{
    EvidenceHeader, FrameHeader, Health, Metrics, PairPose, Pose3d, ViewPose, ViewQuality, topic,
};

use rustix::process::{Resource, getrlimit};

use crate::room::OVERHEAD_BYTES;
use crate::{Delivery, ExitKind, Fault, Limits, TopicPlan, free_shared_memory};

/// Queue of small messages of one subscriber with realtime delivery.
const SMALL_BUFFER_REALTIME: usize = 4;
/// Queue of small messages of one subscriber with lossless delivery.
const SMALL_BUFFER_LOSSLESS: usize = 16;
/// Queue of images or response maps of one subscriber.
const LARGE_BUFFER: usize = 1;
/// Subscribers of small topics beyond those of the deployment: the command line tools.
const SPARE: usize = 2;
/// Observers at the same time, besides the supervisor.
const ONLOOKERS: usize = 4;
/// Open files of every process, besides those of its topics.
const DESCRIPTORS: u64 = 40;
/// Open files per topic in the process that keeps it alive: 6.6 were measured.
const DESCRIPTORS_A_TOPIC: u64 = 7;
/// The parameters that determine the topics of a deployment.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DeploymentPlan {
    /// What happens when a receiver is slower than its sender.
    pub delivery: Delivery,
    /// The views.
    pub views: Vec<ViewPlan>,
    /// Number of fusion processes.
    pub n_workers: usize,
    /// Number of processes that write results.
    pub n_recorders: usize,
    /// Response maps of one view that one process may borrow at the same time.
    pub held: usize,
    /// Images that one process may borrow at the same time.
    pub held_frames: usize,
    /// The names of all processes.
    pub processes: Vec<String>,
}

/// The parameters that determine the topics of one view.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ViewPlan {
    /// Largest image, bytes.
    pub frame_bytes: usize,
    /// Longest response maps, values.
    pub evidence_values: usize,
    /// Fusion processes that read this view.
    pub n_workers: usize,
}

/// There is not enough shared memory for a deployment.
#[derive(Debug, thiserror::Error)]
pub enum PreflightError {
    /// The pools do not fit.
    #[error(
        "deployment needs {} MB of shared memory, {} MB are free in /dev/shm; largest: {largest}",
        .needed_bytes.div_ceil(1_000_000), .free_bytes / 1_000_000
    )]
    TooLarge {
        /// Memory of all pools.
        needed_bytes: u64,
        /// Free memory.
        free_bytes: u64,
        /// The largest topic, with its size.
        largest: String,
    },
    /// A process needs more open files than its limit.
    #[error("deployment needs {needed} open files in one process, the limit is {limit} open files")]
    Descriptors {
        /// Open files of the process that needs most.
        needed: u64,
        /// The limit.
        limit: u64,
    },
    /// The file system of shared memory cannot be queried.
    #[error("cannot tell how much of /dev/shm is free")]
    Unknown(#[source] io::Error),
}

impl Fault for PreflightError {
    fn kind(&self) -> ExitKind {
        ExitKind::Config
    }

    fn hint(&self) -> Option<String> {
        match self {
            Self::TooLarge { needed_bytes, .. } => {
                let megabytes = needed_bytes.div_ceil(1_000_000);
                Some(format!(
                    "use smaller images, a smaller window of levels or fewer workers, or make room: \
                     `mount -o remount,size={megabytes}m /dev/shm`, in Docker --shm-size={megabytes}m \
                     (its default is 64m)"
                ))
            }
            Self::Descriptors { needed, .. } => Some(format!(
                "allow more: `ulimit -n {needed}`, in a systemd unit LimitNOFILE={needed}"
            )),
            Self::Unknown(_) => None,
        }
    }
}

impl DeploymentPlan {
    /// All topics.
    pub fn topics(&self) -> Vec<TopicPlan> {
        let mut topics = Vec::new();
        for (index, view) in self.views.iter().enumerate() {
            // Images: pose, quality and the recorders.
            topics.push(TopicPlan::slices::<u8, FrameHeader>(
                topic::frame(index),
                self.delivery,
                Limits::new(2 + self.n_recorders, LARGE_BUFFER, self.held_frames),
                view.frame_bytes,
            ));
            let evidence = TopicPlan::slices::<f32, EvidenceHeader>(
                topic::evidence(index),
                self.delivery,
                Limits::new(view.n_workers.max(1), LARGE_BUFFER, self.held),
                view.evidence_values,
            );
            // One chunk to write while others are read. These are by far the largest messages: a queued
            // one would cost as much memory again without saving time.
            topics.push(evidence.with_few_chunks(1 + self.held));
            // Poses and expected errors: quality, triangulate, fusion and the recorders.
            let small = self.small(2 + self.n_workers + self.n_recorders);
            topics.push(TopicPlan::messages::<ViewPose>(
                topic::view_pose(index),
                self.delivery,
                small,
            ));
            topics.push(TopicPlan::messages::<ViewQuality>(
                topic::view_quality(index),
                self.delivery,
                small,
            ));
        }
        for worker in 0..self.n_workers {
            // Fusion of all views at once sends a message for every view but one at a time.
            let small = self.small(1 + self.n_recorders);
            let buffer = small.buffer.max(self.views.len());
            topics.push(TopicPlan::messages::<PairPose>(
                topic::pair_pose(worker),
                self.delivery,
                Limits { buffer, ..small },
            ));
        }
        topics.push(TopicPlan::messages::<Pose3d>(
            topic::pose3d(),
            self.delivery,
            self.small(self.n_recorders),
        ));
        topics.extend(self.processes.iter().flat_map(|name| process_topics(name)));
        topics
    }

    fn small(&self, subscribers: usize) -> Limits {
        let buffer = match self.delivery {
            Delivery::Realtime => SMALL_BUFFER_REALTIME,
            Delivery::Lossless => SMALL_BUFFER_LOSSLESS,
        };
        Limits::new(subscribers + SPARE, buffer, 2)
    }
}

/// The topics of a process's heartbeats and metrics: realtime delivery, without wake-up.
pub fn process_topics(process: &str) -> [TopicPlan; 2] {
    let health = TopicPlan::messages::<Health>(
        topic::health(process),
        Delivery::Realtime,
        Limits::new(1 + SPARE, 2, 1),
    );
    let metrics = TopicPlan::messages::<Metrics>(
        topic::metrics(process),
        Delivery::Realtime,
        Limits::new(1 + ONLOOKERS, 1, 1),
    );
    [health.without_wake_up(), metrics.without_wake_up()]
}

/// Checks that the pools of all topics fit into the free part of `/dev/shm`, and that the supervisor, which
/// has all topics open, may open so many files.
///
/// # Errors
///
/// [`PreflightError`].
pub fn preflight(topics: &[TopicPlan]) -> Result<(), PreflightError> {
    if let Some(limit) = getrlimit(Resource::Nofile).current {
        check_descriptors(topics.len() as u64, limit)?;
    }
    check_room(
        topics,
        free_shared_memory().map_err(PreflightError::Unknown)?,
    )
}

fn check_descriptors(n_topics: u64, limit: u64) -> Result<(), PreflightError> {
    let needed = DESCRIPTORS + DESCRIPTORS_A_TOPIC * n_topics;
    if needed <= limit {
        return Ok(());
    }
    Err(PreflightError::Descriptors { needed, limit })
}

/// Shared memory that a deployment with these topics needs, bytes.
pub fn needed_bytes(topics: &[TopicPlan]) -> u64 {
    let pools = topics.iter().map(TopicPlan::pool_bytes);
    let pools = pools.fold(0, u64::saturating_add);
    let of_process = |plan: &&TopicPlan| topic::process_of_metrics(plan.topic()).is_some();
    let n_processes = topics.iter().filter(of_process).count() as u64;
    pools.saturating_add(OVERHEAD_BYTES * n_processes)
}

fn check_room(topics: &[TopicPlan], free_bytes: u64) -> Result<(), PreflightError> {
    let needed_bytes = needed_bytes(topics);
    if needed_bytes <= free_bytes {
        return Ok(());
    }
    let largest = topics.iter().max_by_key(|plan| plan.pool_bytes());
    Err(PreflightError::TooLarge {
        needed_bytes,
        free_bytes,
        largest: largest.map_or_else(String::new, |plan| {
            format!("{} with {} MB", plan.topic(), plan.pool_bytes() / 1_000_000)
        }),
    })
}

#[cfg(test)]
mod tests {
    use super::{DeploymentPlan, PreflightError, ViewPlan, check_descriptors, check_room};
    use crate::{Delivery, Fault as _};

    fn plan() -> DeploymentPlan {
        DeploymentPlan {
            delivery: Delivery::Realtime,
            views: vec![
                ViewPlan {
                    frame_bytes: 272 * 480 * 3,
                    evidence_values: 10_000_000,
                    n_workers: 2,
                };
                4
            ],
            n_workers: 2,
            n_recorders: 1,
            held: 2,
            held_frames: 2,
            processes: (0..12).map(|index| format!("process-{index}")).collect(),
        }
    }

    #[test]
    fn chunks_are_subscribers_times_queued_and_borrowed_plus_one_loan() {
        let topics = plan().topics();
        let evidence = topics
            .iter()
            .find(|it| it.topic() == "evidence/v3/0")
            .unwrap();
        // 2 workers x (1 queued + 2 borrowed) + 1 loan, of 40 MB and the headers.
        let chunk = 40_000_000 + 1152;
        assert_eq!(evidence.pool_bytes(), 7 * chunk);
    }

    #[test]
    fn with_lossless_delivery_evidence_takes_one_chunk_more_than_borrowed() {
        let plan = DeploymentPlan {
            delivery: Delivery::Lossless,
            ..plan()
        };
        let topics = plan.topics();
        let mut evidence = topics
            .iter()
            .filter(|it| it.topic().starts_with("evidence/"));
        assert!(evidence.all(|it| it.pool_bytes() == 3 * (40_000_000 + 1152)));
    }

    #[test]
    fn every_topic_has_its_own_name() {
        let mut names: Vec<_> = plan()
            .topics()
            .iter()
            .map(|it| it.topic().to_owned())
            .collect();
        let n = names.len();
        assert_eq!(n, 4 * 4 + 2 + 1 + 2 * 12);
        names.sort();
        names.dedup();
        assert_eq!(names.len(), n);
    }

    #[test]
    fn a_deployment_that_does_not_fit_is_refused_with_the_numbers() {
        let topics = plan().topics();
        let error = check_room(&topics, 64 << 20).unwrap_err();
        let PreflightError::TooLarge {
            needed_bytes,
            free_bytes,
            ..
        } = &error
        else {
            panic!("{error}");
        };
        assert!(*needed_bytes > 4 * 7 * 40_000_000, "{needed_bytes}");
        assert_eq!(*free_bytes, 64 << 20);
        assert!(error.to_string().contains("67 MB are free"), "{error}");
        assert!(error.to_string().contains("evidence/v3/"), "{error}");
        assert!(error.hint().unwrap().contains("--shm-size"), "{error}");
    }

    #[test]
    fn too_few_open_files_are_refused_with_the_numbers() {
        check_descriptors(10, 110).unwrap();
        let error = check_descriptors(10, 109).unwrap_err();
        let expected =
            "deployment needs 110 open files in one process, the limit is 109 open files";
        assert_eq!(error.to_string(), expected);
        assert!(error.hint().unwrap().contains("ulimit -n 110"));
    }

    #[test]
    fn exactly_enough_memory_is_accepted() {
        let topics = plan().topics();
        let PreflightError::TooLarge { needed_bytes, .. } = check_room(&topics, 0).unwrap_err()
        else {
            panic!("must not fit into nothing");
        };
        check_room(&topics, needed_bytes).unwrap();
        check_room(&topics, needed_bytes - 1).unwrap_err();
    }
}
