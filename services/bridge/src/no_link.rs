//! What stands in the place of the link in a build without it: everything says so.

use core::convert::Infallible;
use core::time::Duration;

use crate::keys::KeyFiles;

/// Where to connect to, or to listen, and as whom.
#[derive(Debug, Clone)]
pub struct Address {
    /// The deployment.
    pub deployment: String,
    /// This host.
    pub host: String,
    /// The address of the host that fuses: name or number, and port.
    pub address: String,
    /// Whether this is that host.
    pub listens: bool,
    /// The keys; none if the deployment is insecure.
    pub keys: Option<KeyFiles>,
}

/// The link cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum LinkError {
    /// This build has none.
    #[error("this build has no hosts: build with `--features hosts`")]
    NotBuilt,
}

/// There is none.
#[derive(Debug)]
pub(crate) struct Link(Infallible);

impl Link {
    pub(crate) fn open(_address: &Address) -> Result<Self, LinkError> {
        Err(LinkError::NotBuilt)
    }

    pub(crate) fn send(&self, _key: &str, bytes: Vec<u8>, _is_urgent: bool) {
        drop(bytes);
        match self.0 {}
    }

    pub(crate) fn subscribe(
        &self,
        _key: &str,
        _on: impl Fn(&str, &[u8]) + Send + Sync + 'static,
    ) -> Result<(), LinkError> {
        match self.0 {}
    }

    pub(crate) fn answer(
        &self,
        _key: &str,
        _on: impl Fn() -> Vec<u8> + Send + Sync + 'static,
    ) -> Result<(), LinkError> {
        match self.0 {}
    }

    pub(crate) fn ask(&self, _key: &str, _limit: Duration) -> Option<Vec<u8>> {
        match self.0 {}
    }

    pub(crate) fn close(self) {
        match self.0 {}
    }
}
