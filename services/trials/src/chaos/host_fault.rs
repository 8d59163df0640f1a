//! Faults of a host or of the link to it.

/// A fault of a host or its link.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HostFault {
    /// The link is cut for three seconds.
    Cut,
    /// The host with cameras is killed and restarted.
    Kill,
}

impl HostFault {
    /// Both faults.
    pub(super) const ALL: [Self; 2] = [Self::Cut, Self::Kill];

    /// Returns the name of the scenario, and its description.
    pub(super) fn name_and_summary(self) -> [&'static str; 2] {
        match self {
            Self::Cut => [
                "cut-link",
                "the link between two hosts on this machine is cut for three seconds",
            ],
            Self::Kill => [
                "kill-host",
                "one of two hosts on this machine, the one with cameras, is killed and started again",
            ],
        }
    }
}
