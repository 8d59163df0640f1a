//! Simulated faults of a camera, and when they happen.

use core::fmt;
use core::str::FromStr;

use serde::{Deserialize, Serialize};

/// A kind of simulated fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FaultKind {
    /// The camera is disconnected.
    Unplug,
    /// The picture no longer changes.
    Freeze,
    /// Every frame has the time of the last frame before the fault.
    Repeat,
    /// The clock goes backwards.
    Back,
    /// The clock jumps ahead by an hour at every frame.
    Jump,
    /// Every second frame is left out.
    Slow,
    /// Pictures have a different size.
    Size,
    /// Pictures cannot be decoded.
    Damage,
    /// The process is stuck in a computation and does not respond.
    Spin,
}

impl FaultKind {
    const ALL: [(Self, &'static str); 9] = [
        (Self::Unplug, "unplug"),
        (Self::Freeze, "freeze"),
        (Self::Repeat, "repeat"),
        (Self::Back, "back"),
        (Self::Jump, "jump"),
        (Self::Slow, "slow"),
        (Self::Size, "size"),
        (Self::Damage, "damage"),
        (Self::Spin, "spin"),
    ];

    /// Returns the name of the fault in settings.
    pub fn name(self) -> &'static str {
        let found = Self::ALL.iter().find(|(kind, _)| *kind == self);
        found.map_or("", |(_, name)| name)
    }
}

/// A fault during a range of frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fault {
    /// Kind of the fault.
    pub kind: FaultKind,
    /// First frame of the fault, counted from 0 in the footage.
    pub from: u64,
    /// Number of frames of the footage.
    pub count: u64,
}

/// A text that is not a list of faults.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "{text:?} is not a fault: expected KIND@FROM+COUNT, for example freeze@30+20, where KIND is one of {}",
    FaultKind::ALL.map(|fault_kind| fault_kind.1).join(", ")
)]
pub struct FaultError {
    /// The text that could not be read.
    pub text: String,
}

/// Faults of one camera, written `freeze@30+20, unplug@80+10`. Each has a kind, a first frame and a number of frames.
///
/// ```
/// let faults: deployment::capture::Faults = "freeze@30+20".parse()?;
/// assert_eq!(faults.at(49).map(|fault| fault.kind), Some(deployment::capture::FaultKind::Freeze));
/// assert_eq!(faults.at(50), None);
/// # Ok::<(), deployment::capture::FaultError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Faults(Vec<Fault>);

impl Faults {
    /// Returns true if there are no faults.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Returns the fault of a frame of the footage; the first in the list if there are several.
    pub fn at(&self, frame: u64) -> Option<Fault> {
        let is_now = |fault: &&Fault| frame >= fault.from && frame - fault.from < fault.count;
        self.0.iter().find(is_now).copied()
    }

    /// Returns the faults for one epoch of the process. [`FaultKind::Spin`] happens in epoch 0 only, because a restarted process may
    /// begin with the same frame.
    #[must_use]
    pub fn of_epoch(&self, epoch: u32) -> Self {
        let happens = |fault: &&Fault| epoch == 0 || fault.kind != FaultKind::Spin;
        Self(self.0.iter().filter(happens).copied().collect())
    }
}

impl FromStr for Fault {
    type Err = FaultError;

    fn from_str(text: &str) -> Result<Self, FaultError> {
        let parse = || {
            let (name, rest) = text.trim().split_once('@')?;
            let (from, count) = rest.split_once('+')?;
            let kind = FaultKind::ALL.iter().find(|fault_kind| fault_kind.1 == name)?.0;
            let [from, count] = [from, count].map(|text| text.parse().ok());
            Some(Self {
                kind,
                from: from?,
                count: count.filter(|count| *count > 0)?,
            })
        };
        parse().ok_or_else(|| FaultError {
            text: text.trim().to_owned(),
        })
    }
}

impl FromStr for Faults {
    type Err = FaultError;

    fn from_str(text: &str) -> Result<Self, FaultError> {
        if text.trim().is_empty() {
            return Ok(Self::default());
        }
        text.split(',').map(str::parse).collect::<Result<_, _>>().map(Self)
    }
}

impl TryFrom<String> for Faults {
    type Error = FaultError;

    fn try_from(text: String) -> Result<Self, FaultError> {
        text.parse()
    }
}

impl From<Faults> for String {
    fn from(faults: Faults) -> Self {
        faults.to_string()
    }
}

impl fmt::Display for Faults {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (nth, fault) in self.0.iter().enumerate() {
            let comma = if nth > 0 { ", " } else { "" };
            write!(
                f,
                "{comma}{}@{}+{}",
                fault.kind.name(),
                fault.from,
                fault.count
            )?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_fault_lasts_for_its_number_of_frames() {
        let faults: Faults = "freeze@3+2, slow@4+9".parse().unwrap();
        let at = |frame| faults.at(frame).map(|fault| fault.kind.name());
        assert_eq!(
            [2, 3, 4, 5, 12, 13].map(at),
            [
                None,
                Some("freeze"),
                Some("freeze"),
                Some("slow"),
                Some("slow"),
                None
            ]
        );
        assert_eq!(Faults::default().at(0), None);
        let once: Faults = "spin@3+1, slow@4+9".parse().unwrap();
        let in_epoch = |epoch| once.of_epoch(epoch).to_string();
        assert_eq!([0, 1].map(in_epoch), ["spin@3+1, slow@4+9", "slow@4+9"]);
        let for_ever: Faults = format!("unplug@1+{}", u64::MAX).parse().unwrap();
        assert!(for_ever.at(u64::MAX).is_some());
    }

    #[test]
    fn an_invalid_fault_is_refused_with_an_example() {
        for text in [
            "melt@3+2",
            "freeze",
            "freeze@3",
            "freeze@3+0",
            "freeze@-1+2",
            "freeze@3+2,",
            "freeze@3+2 slow@1+1",
        ] {
            let error = text.parse::<Faults>().unwrap_err().to_string();
            assert!(
                error.contains("freeze@30+20") && error.contains("unplug"),
                "{text}: {error}"
            );
        }
        assert!(" ".parse::<Faults>().unwrap().is_empty());
    }

    proptest! {
        #[test]
        fn faults_survive_a_round_trip_through_text(all in prop::collection::vec((0..FaultKind::ALL.len(), 0..u64::MAX, 1..u64::MAX), 0..4)) {
            let fault = |(kind, from, count): (usize, u64, u64)| Fault { kind: FaultKind::ALL[kind].0, from, count };
            let faults = Faults(all.into_iter().map(fault).collect());
            prop_assert_eq!(faults.to_string().parse::<Faults>().unwrap(), faults);
        }

        #[test]
        fn any_text_is_parsed_or_refused(text in "((freeze|unplug|slow|size|back)@[0-9]{1,3}(\\+[0-9]{0,2})?,? ?){0,3}[a-z@+0-9, ]{0,2}") {
            if let Ok(faults) = text.parse::<Faults>() {
                prop_assert_eq!(faults.to_string().parse::<Faults>().unwrap(), faults);
            }
        }
    }
}
