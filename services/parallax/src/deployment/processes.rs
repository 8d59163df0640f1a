//! Section `[runtime]` of a deployment file: which cores processes run on, how urgently, and how they wait.

use std::collections::BTreeMap;

use runtime::{RealTime, Scheduling};
use serde::{Deserialize, Serialize};

/// How processes share the machine. Cores and priorities are given by the name of a service (`pose`) or of one
/// of its processes (`pose-1`), which wins; `run --dry-run` shows the names, and what every process gets.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct Runtime {
    /// Whether the stages between camera and result look for messages without pause.
    pub spin: bool,
    /// Cores that processes may run on, as Linux numbers them from 0.
    pub cores: BTreeMap<String, Vec<usize>>,
    /// Their real-time priorities, 1 to 99.
    pub priority: BTreeMap<String, u8>,
    /// Who runs of those with the same real-time priority.
    pub policy: Policy,
    /// Whether processes keep in memory what they have once used.
    pub lock_memory: bool,
}

/// Who runs of those with the same real-time priority.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Policy {
    /// Who came first, until it sleeps.
    #[default]
    Fifo,
    /// All in turn.
    RoundRobin,
}

/// Those that somebody waits for: a camera waits for its clock, and nobody for the recorder.
const SPINNING: [&str; 4] = ["pose", "quality", "fuse", "triangulate"];

impl Runtime {
    /// What a process asks of the system's scheduler.
    pub(crate) fn of(&self, service: &str, process: &str) -> Scheduling {
        let policy = match self.policy {
            Policy::Fifo => runtime::Policy::Fifo,
            Policy::RoundRobin => runtime::Policy::RoundRobin,
        };
        let cores = self.cores.get(process).or(self.cores.get(service));
        let priority = self.priority.get(process).or(self.priority.get(service));
        Scheduling {
            cores: cores.cloned().unwrap_or_default(),
            real_time: priority.map(|&priority| RealTime { policy, priority }),
            lock_memory: self.lock_memory,
            spin: self.spin && SPINNING.contains(&service),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(text: &str, process: &str) -> String {
        let it: Runtime = toml::from_str(text).unwrap();
        let service = process.split('-').next().unwrap();
        it.of(service, process).to_string()
    }

    #[test]
    fn nothing_is_asked_for_by_default() {
        for process in ["capture-0", "pose-1", "triangulate"] {
            assert_eq!(of("", process), "");
        }
    }

    #[test]
    fn what_is_said_of_a_process_wins_over_what_is_said_of_its_service() {
        let text = "cores = { pose = [0, 1], pose-2 = [3] }\npriority = { pose-2 = 9, fuse = 4 }";
        assert_eq!(of(text, "pose-0"), "cores=0,1");
        assert_eq!(of(text, "pose-2"), "cores=3 fifo=9");
        assert_eq!(of(text, "fuse-0"), "fifo=4");
        assert_eq!(of(text, "results"), "");
    }

    #[test]
    fn who_waits_for_a_clock_and_who_nobody_waits_for_do_not_spin() {
        let text = "spin = true\npolicy = \"round-robin\"\npriority = { capture = 2 }";
        for process in ["pose-0", "quality-0", "fuse-1", "triangulate"] {
            assert_eq!(of(text, process), "spin");
        }
        assert_eq!(of(text, "capture-0"), "round-robin=2");
        assert_eq!(of(text, "results"), "");
    }
}
