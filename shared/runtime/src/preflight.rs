//! Checks that there is room for the topics of a deployment, and lists the topics that every process has.

use std::io;

use messages::{Health, Metrics, topic};
use rustix::process::{Resource, getrlimit};

use crate::room::OVERHEAD_BYTES;
use crate::{Delivery, Limits, TopicPlan, free_shared_memory};
use failure::{ExitKind, Fault};

/// Maximum number of onlookers at the same time.
const ONLOOKERS: usize = 4;
/// Number of open files of every process, not counting the files of its topics.
const DESCRIPTORS: u64 = 40;
/// Number of open files per topic, in the process that keeps the topic alive. 6.6 files per topic were measured.
const DESCRIPTORS_A_TOPIC: u64 = 7;

/// Smallest stack of the main thread, in bytes.
const STACK: u64 = 1 << 20;

/// Reason why the system has no room for a deployment.
#[derive(Debug, thiserror::Error)]
pub enum PreflightError {
    /// The pools do not fit into shared memory.
    #[error(
        "deployment needs {} MB of shared memory, but only {} MB are free in /dev/shm; largest: {largest}",
        .needed_bytes.div_ceil(1_000_000), .free_bytes / 1_000_000
    )]
    TooLarge {
        /// Size of all pools, in bytes.
        needed_bytes: u64,
        /// Size of the free memory, in bytes.
        free_bytes: u64,
        /// The largest topic, with its size.
        largest: String,
    },
    /// A process needs more open files than its limit allows.
    #[error(
        "deployment needs {needed} open files in one process, but the limit is {limit} open files"
    )]
    Descriptors {
        /// Number of open files of the process that needs the most.
        needed: u64,
        /// Maximum number of open files.
        limit: u64,
    },
    /// The limit for the stack of a process is too small.
    #[error("the limit for the stack of a process is {} KB, but it needs {} KB", .limit / 1024, STACK / 1024)]
    Stack {
        /// Maximum size of the stack, in bytes.
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
            Self::Stack { .. } => Some("allow more: `ulimit -s 8192`".to_owned()),
            Self::Unknown(_) => None,
        }
    }
}

/// Returns the topics of a process's heartbeats and metrics: realtime delivery, without wake-up.
pub fn process_topics(process: &str) -> [TopicPlan; 2] {
    let health = TopicPlan::messages::<Health>(
        topic::health(process),
        Delivery::Realtime,
        Limits::new(2, 2, 1).with_onlookers(ONLOOKERS),
    );
    let metrics = TopicPlan::messages::<Metrics>(
        topic::metrics(process),
        Delivery::Realtime,
        Limits::new(1, 1, 1).with_onlookers(ONLOOKERS),
    );
    [health.without_wake_up(), metrics.without_wake_up()]
}

/// Checks that the pools of all topics fit into the free part of `/dev/shm`. Also checks that the supervisor, which keeps all topics open,
/// is allowed to open enough files.
///
/// # Errors
///
/// Returns a [`PreflightError`] on failure.
pub fn preflight(topics: &[TopicPlan]) -> Result<(), PreflightError> {
    if let Some(limit) = getrlimit(Resource::Nofile).current {
        check_descriptors(topics.len() as u64, limit)?;
    }
    if let Some(limit) = getrlimit(Resource::Stack).current.filter(|current| *current < STACK) {
        return Err(PreflightError::Stack { limit });
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

/// Returns the size of the shared memory that a deployment with these topics needs, in bytes.
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
    use messages::EvidenceHeader;

    use super::*;

    /// Bytes of a chunk besides its values.
    const HEADERS: u64 = size_of::<EvidenceHeader>() as u64 + 64;

    /// Returns the topic of response maps of 40 MB that two processes read, each of which borrows two of them.
    fn evidence(view: usize, delivery: Delivery) -> TopicPlan {
        let limits = Limits::new(2, 1, 2);
        let name = topic::evidence(view);
        TopicPlan::slices::<f32, EvidenceHeader>(name, delivery, limits, 10_000_000)
            .with_few_chunks(3)
    }

    fn topics() -> Vec<TopicPlan> {
        let evidence = (0..4).map(|view| evidence(view, Delivery::Realtime));
        let processes = (0..12).flat_map(|i| process_topics(&format!("process-{i}")));
        evidence.chain(processes).collect()
    }

    #[test]
    fn the_number_of_chunks_is_subscribers_times_queued_and_borrowed_plus_one_loan() {
        // 2 workers x (1 queued + 2 borrowed) + 1 loan, of 40 MB and the headers.
        let chunk = 40_000_000 + HEADERS;
        assert_eq!(evidence(0, Delivery::Realtime).pool_bytes(), 7 * chunk);
    }

    #[test]
    fn with_lossless_delivery_evidence_needs_one_chunk_more_than_the_receivers_hold() {
        let bytes = evidence(0, Delivery::Lossless).pool_bytes();
        assert_eq!(bytes, 3 * (40_000_000 + HEADERS));
    }

    #[test]
    fn a_deployment_that_does_not_fit_is_refused_with_the_numbers() {
        let topics = topics();
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
        assert!(error.to_string().contains("evidence/v5/"), "{error}");
        assert!(error.hint().unwrap().contains("--shm-size"), "{error}");
    }

    #[test]
    fn too_few_open_files_are_refused_with_the_numbers() {
        check_descriptors(10, 110).unwrap();
        let error = check_descriptors(10, 109).unwrap_err();
        let expected =
            "deployment needs 110 open files in one process, but the limit is 109 open files";
        assert_eq!(error.to_string(), expected);
        assert!(error.hint().unwrap().contains("ulimit -n 110"));
    }

    #[test]
    fn exactly_enough_memory_is_accepted() {
        let topics = topics();
        let PreflightError::TooLarge { needed_bytes, .. } = check_room(&topics, 0).unwrap_err()
        else {
            panic!("must not fit into nothing");
        };
        check_room(&topics, needed_bytes).unwrap();
        check_room(&topics, needed_bytes - 1).unwrap_err();
    }
}
