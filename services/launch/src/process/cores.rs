//! Shares the cores of this machine between the processes of a stage.

use deployment::{Stage, Topology};
use pipeline::LookBudget;
use runtime::Delivery;
use steps::pose;

use crate::resolved::Resolved;
use crate::sanity::n_cores;

/// Returns the number of cores for each process of a stage on this machine; `None` if the number of cores is unknown.
pub(super) fn each(topology: &Topology, stage: Stage) -> Option<f64> {
    let cores = n_cores()?;
    let processes = topology.processes().iter();
    let n = processes.filter(|process| process.service == stage.name()).count();
    Some(cores as f64 / n.max(1) as f64)
}

/// Returns the limit for the runs of the network in a view. With `realtime` delivery, it is what the cores manage at the frame rate.
pub(super) fn looks(resolved: &Resolved, topology: &Topology) -> pose::Looks {
    let deployment = &resolved.deployment;
    if let Some(looks) = deployment.network.looks {
        return pose::Looks::Fixed(looks);
    }
    let rate_hz = resolved.frame_rate_hz().filter(|_| resolved.delivery() == Delivery::Realtime);
    let (Some(rate_hz), Some(per_view)) = (rate_hz, each(topology, Stage::Pose)) else {
        return pose::Looks::All;
    };
    let step = deployment.capture.frame_step.max(1);
    pose::Looks::Affordable(LookBudget::new(per_view, step as f64 / rate_hz, step))
}
