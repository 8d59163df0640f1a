//! Cleaning up after processes that died.

use core::time::Duration;
use std::collections::BTreeSet;
use std::fs;
use std::os::unix::fs::MetadataExt as _;

use iceoryx2::prelude::{CallbackProgression, Node, NodeState, ipc};

use crate::Bus;

/// How long another supervisor is given that cleans up the same: that of a run which is ending.
const PATIENCE: Duration = Duration::from_millis(100);

/// The mode of a file that its owner may write.
const OWNER_WRITES: u32 = 0o200;

/// Removes what dead processes left in shared memory: their slots in topics, their queues, and the
/// hold that a dead subscriber has on a sender that waits for it.
///
/// Nobody does this by itself, so the supervisor does: at every death, and from time to time. It is the only one
/// that does: iceoryx2 0.10 takes a port's tag away before it frees the port's place in its topic, and leaves the place
/// taken for ever if the tag was gone, be it that the one who cleaned up before was killed between the two, or that
/// two did it at once. Who was to take the place could then never begin.
#[derive(Debug, Default)]
pub struct Cleaner {
    /// Nodes that were dead and stayed so.
    stubborn: BTreeSet<u128>,
}

impl Cleaner {
    /// Cleans up, and answers how many dead processes are gone for good.
    ///
    /// A process killed while it registers a port leaves a file that iceoryx2 0.10 overlooks, so that its
    /// node cannot be removed. Where clean-up has failed twice such files are removed first; those that
    /// were finished stay, for they say what the process held.
    pub fn clean(&mut self, bus: &Bus) -> usize {
        // What iceoryx2 counts as cleaned may stay: it is looked at again.
        let before = dead(bus);
        bus.node().blocking_cleanup_dead_nodes(PATIENCE);
        let mut after = dead(bus);
        let again: Vec<u128> = after.intersection(&self.stubborn).copied().collect();
        if !again.is_empty() {
            for id in again {
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

/// Removes what a dead node had begun to write of itself and not finished. iceoryx2 lets a file be written
/// by its owner until it is complete, and registers the node or port of a tag only then: behind an unfinished tag there
/// is nothing to give back. A finished one is the only trace of a slot; without it the slot is lost for good.
fn remove_unfinished(bus: &Bus, node: u128) {
    let directory = bus.namespace().root().join("nodes").join(node.to_string());
    let Ok(entries) = fs::read_dir(&directory) else {
        return;
    };
    for entry in entries.flatten() {
        let is_unfinished = |it: fs::Metadata| it.is_file() && it.mode() & OWNER_WRITES != 0;
        if !entry.metadata().is_ok_and(is_unfinished) {
            continue;
        }
        let path = entry.path();
        match fs::remove_file(&path) {
            Ok(()) => tracing::debug!(?path, "removed what a dead process had not finished"),
            Err(error) => {
                tracing::debug!(%error, ?path, "cannot remove what a dead process had not finished");
            }
        }
    }
}
