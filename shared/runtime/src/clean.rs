//! Clean-up after processes that died.

use core::time::Duration;
use std::collections::BTreeSet;
use std::fs;
use std::os::unix::fs::MetadataExt as _;

use iceoryx2::prelude::{CallbackProgression, Node, NodeState, ipc};

use crate::Bus;

/// Time to wait for another supervisor that is cleaning up at the same time because its run is ending.
const PATIENCE: Duration = Duration::from_millis(100);

/// Mode bit of a file that its owner may write.
const OWNER_WRITES: u32 = 0o200;

/// Releases the shared memory that dead processes hold: their slots in topics, their queues, and the buffer of
/// a dead subscriber that blocks a sender.
///
/// Only the supervisor cleans up: after every death, and from time to time. iceoryx2 0.10 removes a port's tag
/// before it frees the port's slot in its topic, and never frees the slot if the tag is missing. The tag is missing
/// if a cleaning process is killed between the two steps, or if two processes clean up at once. The process
/// that needs the slot could then never start.
#[derive(Debug, Default)]
pub struct Cleaner {
    /// Dead nodes that could not be removed so far.
    stubborn: BTreeSet<u128>,
}

impl Cleaner {
    /// Cleans up. Returns the number of dead processes that were removed.
    ///
    /// If a process is killed while it registers a port, it leaves a file that iceoryx2 0.10 overlooks, and its
    /// node cannot be removed. If clean-up has failed twice, such files are therefore removed first. Complete files
    /// stay, because they record the slots of the process.
    pub fn clean(&mut self, bus: &Bus) -> usize {
        // iceoryx2 may report a node as cleaned although it still exists, so check again.
        let before = dead(bus);
        bus.node().blocking_cleanup_dead_nodes(PATIENCE);
        let mut after = dead(bus);
        let remaining: Vec<u128> = after.intersection(&self.stubborn).copied().collect();
        if !remaining.is_empty() {
            for id in remaining {
                remove_unfinished(bus, id);
            }
            bus.node().blocking_cleanup_dead_nodes(PATIENCE);
            after = dead(bus);
        }
        let n_gone = before.difference(&after).count();
        self.stubborn = after;
        n_gone
    }
}

fn dead(bus: &Bus) -> BTreeSet<u128> {
    let mut dead = BTreeSet::new();
    let listed = Node::<ipc::Service>::list(bus.node().config(), |state| {
        if let NodeState::Dead(_) = &state {
            dead.insert(state.node_id().value());
        }
        CallbackProgression::Continue
    });
    if let Err(error) = listed {
        tracing::debug!(?error, "cannot list the processes of the deployment");
    }
    dead
}

/// Removes the files that a dead node has not finished writing.
///
/// iceoryx2 keeps a file writable for its owner until the file is complete, and registers the node or port of a tag only then.
/// An incomplete tag therefore holds no slot. A complete tag is the only record of its slot: without it, the slot is lost for good.
fn remove_unfinished(bus: &Bus, node: u128) {
    let directory = bus.namespace().root().join("nodes").join(node.to_string());
    let Ok(entries) = fs::read_dir(&directory) else {
        return;
    };
    for entry in entries.flatten() {
        let is_unfinished = |data: fs::Metadata| data.is_file() && data.mode() & OWNER_WRITES != 0;
        if !entry.metadata().is_ok_and(is_unfinished) {
            continue;
        }
        let path = entry.path();
        match fs::remove_file(&path) {
            Ok(()) => tracing::debug!(?path, "an incomplete file of a dead process was removed"),
            Err(error) => {
                tracing::debug!(%error, ?path, "cannot remove an incomplete file of a dead process");
            }
        }
    }
}
