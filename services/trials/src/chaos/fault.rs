//! Camera faults, and the expected status of the affected frames.

use messages::Status;

/// A fault of a camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CameraFault {
    /// The camera is disconnected.
    Unplug,
    /// The camera repeats the same picture.
    Freeze,
    /// The camera's clock jumps, goes back and stops.
    Clock,
    /// The pictures have a wrong size.
    Size,
    /// The camera skips every second frame.
    Slow,
    /// The pictures cannot be decoded.
    Damage,
}

impl CameraFault {
    /// All camera faults.
    pub(super) const ALL: [Self; 6] = [
        Self::Unplug,
        Self::Freeze,
        Self::Clock,
        Self::Size,
        Self::Slow,
        Self::Damage,
    ];

    /// Returns the name of the scenario, and its description.
    pub(super) fn name_and_summary(self) -> [&'static str; 2] {
        match self {
            Self::Unplug => [
                "camera-unplug",
                "a camera is unplugged and plugged in again",
            ],
            Self::Freeze => ["camera-freeze", "a camera repeats the same picture"],
            Self::Clock => [
                "camera-clock",
                "the clock of a camera jumps, goes back and stops",
            ],
            Self::Size => ["camera-size", "a camera sends pictures of a different size"],
            Self::Slow => ["camera-slow", "a camera skips every second frame"],
            Self::Damage => [
                "camera-damage",
                "the pictures of a camera cannot be decoded",
            ],
        }
    }

    /// Returns the consecutive faults of the source that make up this fault, with the expected status of the frames of each.
    pub(super) fn parts(self) -> &'static [(&'static str, Status)] {
        match self {
            Self::Unplug => &[("unplug", Status::UNPLUGGED)],
            Self::Freeze => &[("freeze", Status::FROZEN)],
            Self::Clock => &[
                ("jump", Status::CLOCK_JUMPED),
                ("back", Status::TIME_WENT_BACK),
                ("repeat", Status::TIME_REPEATED),
            ],
            Self::Size => &[("size", Status::WRONG_SIZE)],
            Self::Slow => &[("slow", Status::LEFT_OUT)],
            Self::Damage => &[("damage", Status::DAMAGED)],
        }
    }

    /// Returns the setting `fault` of a camera.
    ///
    /// * `span`: the first frame of the fault, and the first frame after it.
    pub(super) fn setting(self, [from, to]: [u64; 2]) -> String {
        let parts = self.parts();
        let each = ((to - from) / parts.len() as u64).max(1);
        let faults = parts.iter().zip(0_u64..);
        let faults = faults.map(|((name, _), nth)| format!("{name}@{}+{each}", from + nth * each));
        faults.collect::<Vec<_>>().join(", ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_fault_is_accepted_as_a_setting() {
        for it in CameraFault::ALL {
            let faults: deployment::capture::Faults = it.setting([40, 60]).parse().unwrap();
            assert!(faults.at(39).is_none() && faults.at(40).is_some(), "{it:?}");
            assert!(faults.at(57).is_some() && faults.at(60).is_none(), "{it:?}");
        }
    }
}
