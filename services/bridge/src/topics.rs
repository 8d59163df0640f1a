//! Names under which hosts exchange messages.

/// Names for one deployment.
#[derive(Debug, Clone)]
pub(crate) struct Topics(String);

impl Topics {
    pub(crate) fn of(deployment: &str) -> Self {
        Self(format!("parallax/{deployment}"))
    }

    /// Returns the name for frames and results of the views of a host with cameras.
    pub(crate) fn data(&self, host: &str) -> String {
        format!("{}/data/{host}", self.0)
    }

    /// Returns the name for signals to the fusing host.
    pub(crate) fn up(&self, host: &str) -> String {
        format!("{}/up/{host}", self.0)
    }

    /// Returns the name for signals from the fusing host.
    pub(crate) fn down(&self, host: &str) -> String {
        format!("{}/down/{host}", self.0)
    }

    /// Returns the name for introductions.
    pub(crate) fn hello(&self, host: &str) -> String {
        format!("{}/hello/{host}", self.0)
    }

    /// Returns the name for answers to introductions.
    pub(crate) fn answer(&self, host: &str) -> String {
        format!("{}/answer/{host}", self.0)
    }

    /// Returns the name for the state of all hosts.
    pub(crate) fn status(&self) -> String {
        format!("{}/status", self.0)
    }
}

/// Returns the host at the end of a name.
pub(crate) fn host_of(key: &str) -> &str {
    key.rsplit('/').next().unwrap_or_default()
}
