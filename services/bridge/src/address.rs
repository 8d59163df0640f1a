//! Where a link begins and ends, and why there is none.

use crate::keys::KeyFiles;

/// Where to connect to, or to listen, and as whom.
#[derive(Debug, Clone)]
pub struct Address {
    /// The deployment.
    pub deployment: String,
    /// This host.
    pub host: String,
    /// All hosts.
    pub hosts: Vec<String>,
    /// The address of the host that fuses: name or number, and port.
    pub address: String,
    /// True if this host is the one that fuses.
    pub listens: bool,
    /// The keys; none if the deployment is insecure.
    pub keys: Option<KeyFiles>,
}

/// The link cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum LinkError {
    /// It cannot be opened.
    #[error("cannot {what} {address}: {message}")]
    Open {
        /// Connect or listen.
        what: &'static str,
        /// Where.
        address: String,
        /// Why.
        message: String,
    },
    /// A name cannot be used.
    #[error("cannot use {key:?} on the link: {message}")]
    Use {
        /// The name.
        key: String,
        /// Why.
        message: String,
    },
    /// This build has none.
    #[error("this build has no hosts: build with `--features hosts`")]
    NotBuilt,
}
