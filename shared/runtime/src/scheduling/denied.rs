//! Scheduling requests that the system denies, and remedies.

use std::io;

use super::{Policy, RealTime, text};

/// A request that the system has denied. The process can continue without it.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Denied {
    /// The process may not use all requested cores.
    #[error(
        "cannot run on cores {}: only {} may be used", text::list(.asked), text::list(.allowed)
    )]
    Cores {
        /// Requested cores.
        asked: Vec<usize>,
        /// Cores that the process may use.
        allowed: Vec<usize>,
        /// Cause of the error, if the system call failed.
        #[source]
        source: Option<Refusal>,
    },
    /// The process may not use the real-time priority.
    #[error("cannot run at real-time priority {} ({})", .asked.priority, .asked.policy.system_name())]
    RealTime {
        /// Requested priority.
        asked: RealTime,
        /// Cause of the error.
        #[source]
        source: Refusal,
    },
    /// The process may not lock memory, or not enough of it.
    #[error("cannot lock memory{}", limit(.limit_bytes.as_ref()))]
    Memory {
        /// Maximum amount of memory, in bytes; `None` if the limit is not the reason.
        limit_bytes: Option<u64>,
        /// Cause of the error.
        #[source]
        source: Refusal,
    },
}

/// Error of the system.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{text}")]
pub struct Refusal {
    text: String,
}

impl From<io::Error> for Refusal {
    fn from(error: io::Error) -> Self {
        Self {
            text: error.to_string(),
        }
    }
}

impl From<io::ErrorKind> for Refusal {
    fn from(kind: io::ErrorKind) -> Self {
        Self {
            text: kind.to_string(),
        }
    }
}

impl Denied {
    /// Returns a remedy that the user can try.
    pub fn hint(&self) -> &'static str {
        match self {
            Self::Cores { .. } => {
                "name cores of this machine that the process's container, slice or `taskset` allows (`nproc`, `taskset -cp $$`)"
            }
            Self::RealTime { .. } => {
                "`ulimit -r 99` (root or /etc/security/limits.conf: rtprio), systemd LimitRTPRIO=99, Docker --cap-add=SYS_NICE, or `setcap cap_sys_nice+ep` on the executable"
            }
            Self::Memory { .. } => {
                "`ulimit -l unlimited` (root or /etc/security/limits.conf: memlock), systemd LimitMEMLOCK=infinity, Docker --cap-add=IPC_LOCK"
            }
        }
    }
}

impl Policy {
    /// Returns the name of the policy in Linux.
    pub fn system_name(self) -> &'static str {
        match self {
            Self::Fifo => "SCHED_FIFO",
            Self::RoundRobin => "SCHED_RR",
        }
    }
}

fn limit(bytes: Option<&u64>) -> String {
    bytes.map_or_else(String::new, |limit| format!(" beyond {limit} bytes"))
}
