//! Cleaning up after processes that died.

use core::time::Duration;
use std::collections::BTreeSet;
use std::fs;

use iceoryx2::prelude::{CallbackProgression, Node, NodeState, ipc};

use crate::Bus;

/// How long another process is given that cleans up the same.
const PATIENCE: Duration = Duration::from_millis(100);

/// Removes what dead processes left in shared memory: their slots in topics, their queues, and the
/// hold that a dead subscriber has on a sender that waits for it.
///
/// Nobody does this by itself while all processes are busy, so the supervisor does: at every death,
/// and from time to time.
#[derive(Debug, Default)]
pub struct Cleaner {
    /// Nodes that were dead and stayed so.
    stubborn: BTreeSet<u128>,
}

impl Cleaner {
    /// Cleans up, and answers how many dead processes are gone for good.
    ///
    /// A process killed while it registers a port leaves a file that iceoryx2 0.10 does not know,
    /// and without which its node cannot be removed. Where clean-up has failed twice these files are
    /// removed first.
    pub fn clean(&mut self, bus: &Bus) -> u64 {
        let mut cleaned = bus.node().blocking_cleanup_dead_nodes(PATIENCE).cleanups;
        let dead = dead(bus);
        let again: BTreeSet<u128> = dead.intersection(&self.stubborn).copied().collect();
        if !again.is_empty() {
            for id in again {
                remove_tags(bus, id);
            }
            cleaned += bus.node().blocking_cleanup_dead_nodes(PATIENCE).cleanups;
        }
        self.stubborn = dead;
        cleaned
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

/// Removes the files by which a dead node held ports and services.
fn remove_tags(bus: &Bus, node: u128) {
    let directory = bus.namespace().root().join("nodes").join(node.to_string());
    let Ok(entries) = fs::read_dir(&directory) else {
        return;
    };
    for path in entries.flatten().map(|entry| entry.path()) {
        let is_tag = path
            .extension()
            .is_some_and(|it| it == "port_tag" || it == "service_tag");
        if is_tag && let Err(error) = fs::remove_file(&path) {
            tracing::debug!(%error, ?path, "cannot remove a tag of a dead process");
        }
    }
    tracing::debug!(?directory, "removed the tags of a dead process");
}
