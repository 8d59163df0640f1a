//! Section `[runtime]` of a deployment file: which cores processes run on, how urgently, and how they wait.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How processes share the machine. Cores and priorities are given by the name of a service (`pose`) or of one
/// of its processes (`pose-1`), which wins; `run --dry-run` shows the names, and what every process gets.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Runtime {
    /// Stages look for messages without pause: least latency, a whole core each, for machines with cores to spare.
    pub spin: bool,
    /// Cores that a service or one of its processes may run on, `{ pose = [0, 1], fuse-0 = [2] }`.
    pub cores: BTreeMap<String, Vec<usize>>,
    /// Real-time priority of a service or one of its processes, `{ pose = 10 }`, 1 to 99.
    pub priority: BTreeMap<String, u8>,
    /// `fifo` or `round-robin`: which process runs of those with the same real-time priority.
    pub policy: Policy,
    /// Keep in memory what processes have once used.
    pub lock_memory: bool,
}

/// Who runs of those with the same real-time priority.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Policy {
    /// Who came first, until it sleeps.
    #[default]
    Fifo,
    /// All in turn.
    RoundRobin,
}
