//! Addresses of links, and errors of links.

use crate::keys::KeyFiles;

/// Address to connect to or to listen on, with the names and keys of the hosts.
#[derive(Debug, Clone)]
pub struct Address {
    /// Name of the deployment.
    pub deployment: String,
    /// Name of this host.
    pub host: String,
    /// Names of all hosts.
    pub hosts: Vec<String>,
    /// Address of the fusing host: name or number, and port.
    pub address: String,
    /// True if this host is the fusing host.
    pub listens: bool,
    /// The keys; `None` if the deployment is insecure.
    pub keys: Option<KeyFiles>,
}

/// Error if the link cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum LinkError {
    /// The link cannot be opened.
    #[error("cannot {what} {address}: {message}")]
    Open {
        /// Attempted action: connect or listen.
        what: &'static str,
        /// Address of the link.
        address: String,
        /// Reason for the failure.
        message: String,
    },
    /// A name cannot be used.
    #[error("cannot use {key:?} on the link: {message}")]
    Use {
        /// Name that cannot be used.
        key: String,
        /// Reason for the failure.
        message: String,
    },
    /// This build has no link between hosts.
    #[error("this build does not support hosts: build with `--features hosts`")]
    NotBuilt,
}
