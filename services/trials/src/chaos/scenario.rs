//! The faults that can be asked for, by name.

use launch::SERVICES;

use super::fault::CameraFault;
use crate::trial::strike::Blow;

/// The name of the scenario in which a camera was moved.
pub(super) const MOVED: &str = "camera-moved";
/// The name of the scenario in which the recorder stops reading.
pub(super) const STALL: &str = "stall-results";

/// A fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scenario {
    /// One process of a service is struck once.
    Once(Blow, &'static str),
    /// Processes chosen at random are killed, one after the other.
    Random,
    /// `parallax run` itself is killed.
    Supervisor,
    /// A camera fails for some time.
    Camera(CameraFault),
    /// A camera was moved after the calibration.
    Moved,
    /// The recorder stops reading for some time.
    Stall,
}

impl Scenario {
    /// All of them.
    pub fn all() -> Vec<Self> {
        let once = |blow| SERVICES.map(|it| Self::Once(blow, it));
        let mut all = Vec::from(once(Blow::Kill));
        all.push(Self::Random);
        all.extend(once(Blow::Stop));
        // The recorder works for nobody, and is as slow as its disk.
        let spinning = SERVICES.into_iter().filter(|it| *it != "results");
        all.extend(spinning.map(|it| Self::Once(Blow::Spin, it)));
        all.push(Self::Supervisor);
        all.extend(CameraFault::ALL.map(Self::Camera));
        all.extend([Self::Moved, Self::Stall]);
        all
    }

    /// The one of a name, for the command line.
    ///
    /// # Errors
    ///
    /// There is none of that name: in words, for people.
    pub fn by_name(name: &str) -> Result<Self, String> {
        let found = Self::all().into_iter().find(|it| it.name() == name);
        found.ok_or_else(|| "there is none of this name; --list names them all".to_owned())
    }

    /// Its name.
    pub fn name(self) -> String {
        match self {
            Self::Once(Blow::Kill, service) => format!("kill-{service}"),
            Self::Once(Blow::Stop, service) => format!("hang-{service}"),
            Self::Once(Blow::Spin, service) => format!("spin-{service}"),
            Self::Random => "kill-random".to_owned(),
            Self::Supervisor => "kill-supervisor".to_owned(),
            Self::Camera(it) => it.words()[0].to_owned(),
            Self::Moved => MOVED.to_owned(),
            Self::Stall => STALL.to_owned(),
        }
    }

    /// What happens, for people.
    pub fn says(self) -> String {
        match self {
            Self::Once(Blow::Kill, service) => format!("a {service} process is killed (SIGKILL)"),
            Self::Once(Blow::Stop, service) => {
                format!("a {service} process is stopped (SIGSTOP), as if it hung")
            }
            Self::Once(Blow::Spin, service) => {
                format!(
                    "a {service} process computes for ever, with signs of life but without work"
                )
            }
            Self::Random => "a process chosen at random is killed every two seconds".to_owned(),
            Self::Supervisor => {
                "`parallax run` itself is killed, and the same deployment started again".to_owned()
            }
            Self::Camera(it) => it.words()[1].to_owned(),
            Self::Moved => "a camera was turned by two degrees after the calibration".to_owned(),
            Self::Stall => {
                "the results process stands still for three seconds, and goes on".to_owned()
            }
        }
    }

    /// Whether a deployment has the processes for it.
    pub fn is_possible(self, processes: &[String]) -> bool {
        match self {
            Self::Once(_, service) => processes.iter().any(|it| service_of(it) == service),
            Self::Random | Self::Supervisor | Self::Camera(_) | Self::Stall => true,
            // Of fewer than four cameras nobody can tell which it is.
            Self::Moved => {
                processes
                    .iter()
                    .filter(|it| service_of(it) == "capture")
                    .count()
                    > 3
            }
        }
    }
}

/// The service of a process.
pub(super) fn service_of(process: &str) -> &str {
    process.split_once('-').map_or(process, |it| it.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_scenario_is_found_by_its_name_and_no_two_share_one() {
        let all = Scenario::all();
        assert_eq!(all.len(), 27);
        for it in all {
            assert_eq!(Scenario::by_name(&it.name()), Ok(it));
        }
        Scenario::by_name("kill-nobody").unwrap_err();
    }

    #[test]
    fn who_is_not_there_cannot_be_struck() {
        let processes = ["pose-0", "pose-1", "results"].map(str::to_owned);
        let names: Vec<String> = Scenario::all()
            .into_iter()
            .filter(|it| it.is_possible(&processes))
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
