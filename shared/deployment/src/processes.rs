//! Section `[runtime]` of a deployment file: cores, priorities and waiting of the processes.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How processes share the machine. Cores and priorities are given by the name of a service (`pose`) or of one of its processes
/// (`pose-1`). The name of a process takes precedence. `run --dry-run` shows the names, and the cores and priority of every process.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Runtime {
    /// Poll for messages without sleeping; gives the lowest latency, but occupies a whole core for each stage.
    pub spin: bool,
    /// Cores that a service or one of its processes may run on, such as `{ pose = [0, 1], fuse-0 = [2] }`.
    pub cores: BTreeMap<String, Vec<usize>>,
    /// Real-time priority of a service or one of its processes, 1 to 99, such as `{ pose = 10 }`.
    pub priority: BTreeMap<String, u8>,
    /// Number of threads of each pose process.
    pub threads: usize,
    /// Prevent the memory of processes from being swapped out.
    pub lock_memory: bool,
}

impl Default for Runtime {
    fn default() -> Self {
        Self {
            spin: false,
            cores: BTreeMap::new(),
            priority: BTreeMap::new(),
            threads: 1,
            lock_memory: false,
        }
    }
}
