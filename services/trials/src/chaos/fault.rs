//! How a camera fails, and what is to be said of its frames.

use messages::Status;

/// How a camera fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CameraFault {
    /// It is gone.
    Unplug,
    /// Its picture stays as it is.
    Freeze,
    /// Its clock jumps, goes back and stands still.
    Clock,
    /// Its pictures have another size.
    Size,
    /// It leaves out every second frame.
    Slow,
    /// Its pictures cannot be decoded.
    Damage,
}

impl CameraFault {
    /// All of them.
    pub(super) const ALL: [Self; 6] = [
        Self::Unplug,
        Self::Freeze,
        Self::Clock,
        Self::Size,
        Self::Slow,
        Self::Damage,
    ];

    /// Its name, and what happens, for people.
    pub(super) fn words(self) -> [&'static str; 2] {
        match self {
            Self::Unplug => [
                "camera-unplug",
                "a camera is unplugged, and plugged in again",
            ],
            Self::Freeze => [
                "camera-freeze",
                "a camera gives the same picture again and again",
            ],
            Self::Clock => [
                "camera-clock",
                "the clock of a camera jumps, goes back and stands still",
            ],
            Self::Size => ["camera-size", "a camera gives pictures of another size"],
            Self::Slow => ["camera-slow", "a camera leaves out every second frame"],
            Self::Damage => [
                "camera-damage",
                "the pictures of a camera cannot be decoded",
            ],
        }
    }

    /// Faults of the source that make it up, which share the time, and what is to be said of each.
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

    /// As a setting of a camera.
    ///
    /// * `span`: first frame, and one beyond the last.
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
    fn every_fault_is_one_that_a_camera_can_have() {
        for it in CameraFault::ALL {
            let faults: deployment::capture::Faults = it.setting([40, 60]).parse().unwrap();
            assert!(faults.at(39).is_none() && faults.at(40).is_some(), "{it:?}");
            assert!(faults.at(57).is_some() && faults.at(60).is_none(), "{it:?}");
        }
    }
}
