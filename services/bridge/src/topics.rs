//! The names that hosts talk under.

/// The names of a deployment.
#[derive(Debug, Clone)]
pub(crate) struct Topics(String);

impl Topics {
    pub(crate) fn of(deployment: &str) -> Self {
        Self(format!("parallax/{deployment}"))
    }

    /// Frames and results of the views of a host with cameras.
    pub(crate) fn data(&self, host: &str) -> String {
        format!("{}/data/{host}", self.0)
    }

    /// Signals to the host that fuses.
    pub(crate) fn up(&self, host: &str) -> String {
        format!("{}/up/{host}", self.0)
    }

    /// Signals from the host that fuses.
    pub(crate) fn down(&self, host: &str) -> String {
        format!("{}/down/{host}", self.0)
    }

    /// Introductions.
    pub(crate) fn hello(&self, host: &str) -> String {
        format!("{}/hello/{host}", self.0)
    }

    /// Their answers.
    pub(crate) fn answer(&self, host: &str) -> String {
        format!("{}/answer/{host}", self.0)
    }

    /// The state of all hosts.
    pub(crate) fn status(&self) -> String {
        format!("{}/status", self.0)
    }
}

/// The host at the end of a name.
pub(crate) fn host_of(key: &str) -> &str {
    key.rsplit('/').next().unwrap_or_default()
}
