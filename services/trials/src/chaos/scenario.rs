//! Scenarios by name.

use launch::SERVICES;

use super::fault::CameraFault;
use super::host_fault::HostFault;
use crate::trial::injection::ProcessFault;

/// Name of the scenario with a camera that was moved after the calibration.
pub(super) const MOVED: &str = "camera-moved";
/// Name of the scenario in which the process `results` is stopped for a while.
pub(super) const STALL: &str = "stall-results";

/// A fault to inject.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scenario {
    /// A fault is injected once into one process of a service.
    Once(ProcessFault, &'static str),
    /// Randomly chosen processes are killed, one after the other.
    Random,
    /// `parallax run` itself is killed.
    Supervisor,
    /// A camera fails for a while.
    Camera(CameraFault),
    /// A camera was moved after the calibration.
    Moved,
    /// The process `results` is stopped for a while.
    Stall,
    /// A fault of the link between two hosts, or of one of the hosts.
    Host(HostFault),
}

impl Scenario {
    /// Returns all scenarios.
    pub fn all() -> Vec<Self> {
        let once = |fault| SERVICES.map(|service| Self::Once(fault, service));
        let mut all = Vec::from(once(ProcessFault::Kill));
        all.push(Self::Random);
        all.extend(once(ProcessFault::Stop));
        // The process `results` is excluded: no stage waits for it, and its work depends on the disk.
        let spinning = SERVICES.into_iter().filter(|service| *service != "results");
        all.extend(spinning.map(|spinning| Self::Once(ProcessFault::Spin, spinning)));
        all.push(Self::Supervisor);
        all.extend(CameraFault::ALL.map(Self::Camera));
        all.extend([Self::Moved, Self::Stall]);
        all.extend(HostFault::ALL.map(Self::Host));
        all
    }

    /// Returns the scenario with the given name, for the command line.
    ///
    /// # Errors
    ///
    /// Fails if there is no scenario with that name; the message is for the user.
    pub fn by_name(name: &str) -> Result<Self, String> {
        let found = Self::all().into_iter().find(|scenario| scenario.name() == name);
        found.ok_or_else(|| "there is no scenario of this name; --list shows all names".to_owned())
    }

    /// Returns the name of the scenario.
    pub fn name(self) -> String {
        match self {
            Self::Once(ProcessFault::Kill, service) => format!("kill-{service}"),
            Self::Once(ProcessFault::Stop, service) => format!("hang-{service}"),
            Self::Once(ProcessFault::Spin, service) => format!("spin-{service}"),
            Self::Random => "kill-random".to_owned(),
            Self::Supervisor => "kill-supervisor".to_owned(),
            Self::Camera(it) => it.name_and_summary()[0].to_owned(),
            Self::Moved => MOVED.to_owned(),
            Self::Stall => STALL.to_owned(),
            Self::Host(it) => it.name_and_summary()[0].to_owned(),
        }
    }

    /// Returns the events of the scenario as text for the user.
    pub fn summary(self) -> String {
        match self {
            Self::Once(ProcessFault::Kill, service) => {
                format!("a {service} process is killed (SIGKILL)")
            }
            Self::Once(ProcessFault::Stop, service) => {
                format!("a {service} process is stopped (SIGSTOP), as if it hung")
            }
            Self::Once(ProcessFault::Spin, service) => {
                format!("a {service} process loops endlessly: it sends heartbeats but does no work")
            }
            Self::Random => "a randomly chosen process is killed every two seconds".to_owned(),
            Self::Supervisor => {
                "`parallax run` itself is killed, and the same deployment is started again"
                    .to_owned()
            }
            Self::Camera(it) => it.name_and_summary()[1].to_owned(),
            Self::Moved => "a camera was rotated by two degrees after the calibration".to_owned(),
            Self::Stall => {
                "the results process is stopped for three seconds, and then continues".to_owned()
            }
            Self::Host(it) => it.name_and_summary()[1].to_owned(),
        }
    }

    /// Returns true if the scenario is possible with the processes of a deployment.
    ///
    /// * `processes`: names of the processes.
    pub fn is_possible(self, processes: &[String]) -> bool {
        match self {
            Self::Once(_, service) => {
                processes.iter().any(|process| service_of(process) == service)
            }
            Self::Random | Self::Supervisor | Self::Camera(_) | Self::Stall => true,
            // Each of the two hosts needs two cameras, and the build must support links between hosts.
            Self::Host(_) => {
                bridge::HAS_LINK
                    && processes.iter().filter(|process| service_of(process) == "capture").count()
                        > 3
            }
            // With fewer than four cameras, the moved camera cannot be identified.
            Self::Moved => {
                processes.iter().filter(|process| service_of(process) == "capture").count() > 3
            }
        }
    }
}

/// Returns the service of a process.
pub(super) fn service_of(process: &str) -> &str {
    process.split_once('-').map_or(process, |parts| parts.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_scenario_has_a_unique_name() {
        let all = Scenario::all();
        assert_eq!(all.len(), 29);
        for it in all {
            assert_eq!(Scenario::by_name(&it.name()), Ok(it));
        }
        Scenario::by_name("kill-nobody").unwrap_err();
    }

    #[test]
    fn a_scenario_is_possible_only_with_its_process() {
        let processes = ["pose-0", "pose-1", "results"].map(str::to_owned);
        let names: Vec<String> = Scenario::all()
            .into_iter()
            .filter(|scenario| scenario.is_possible(&processes))
            .map(Scenario::name)
            .collect();
        let expected = [
            "kill-pose",
            "kill-results",
            "kill-random",
            "hang-pose",
            "hang-results",
            "spin-pose",
            "kill-supervisor",
            "camera-unplug",
            "camera-freeze",
            "camera-clock",
            "camera-size",
            "camera-slow",
            "camera-damage",
            "stall-results",
        ];
        assert_eq!(names, expected);
    }
}
