//! Transfers messages of views between the hosts of a deployment. The bridge takes messages from shared memory on one host, and writes them
//! into loaned shared memory on another. All other processes work as on a single machine.
//!
//! | host | what its bridge does | where |
//! |---|---|---|
//! | a host with cameras | sends frames as JPEG, or poses with their maps as Gaussians; replaces a waiting message by a newer one | `far` |
//! | the fusing host | publishes the received messages for the frames of its run, and reports why a message is missing | `near` |
//!
//! The link uses Zenoh, behind the feature `zenoh`. The messages and the rules for them are in [`hosts`], which has no side effects.
#![forbid(unsafe_code)]

mod address;
mod far;
pub mod hosts;
mod job;
mod join;
mod jpeg;
mod keys;
mod maps;
mod near;
mod one_thread;
mod timing;
mod topics;

#[cfg(feature = "zenoh")]
mod link;
#[cfg(not(feature = "zenoh"))]
#[path = "no_link.rs"]
mod link;

pub use address::{Address, LinkError};
pub use job::{Far, Job, Near, NearHost, Role};
pub use join::{JoinError, join, status};
pub use keys::{KeyError, KeyFiles, make_keys};
pub use maps::ViewMaps;
pub use one_thread::{ONE_THREAD, has_one_thread};

use failure::Failure;
use runtime::Service;

/// True if this build can transfer messages between hosts.
pub const HAS_LINK: bool = cfg!(feature = "zenoh");

/// Transfers messages until the run ends or a stop is requested.
///
/// # Errors
///
/// Fails if the link cannot be opened, or the files of another host differ. Also fails with errors of the transport.
pub fn run(service: &Service, job: &Job) -> Result<(), Failure> {
    if job.address.keys.is_none() {
        tracing::warn!(
            "link.insecure = true: anyone on the network can read the pictures of this deployment, and send false ones"
        );
    }
    match &job.role {
        Role::Far(role) => far::run(service, job, role),
        Role::Near(role) => near::run(service, job, role),
    }
}
