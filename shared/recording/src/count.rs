//! Number of recorded and of lost messages of each topic.

use core::fmt;
use core::str::FromStr;

/// Name of the metadata record. If a file has several, the last one is valid.
pub(crate) const NAME: &str = "parallax.counts";

/// Counts of the messages of one topic.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Count {
    /// Number of messages written to the file.
    pub recorded: u64,
    /// Number of messages that were sent but not recorded, because they arrived faster than they could be received or written.
    pub lost: u64,
}

impl fmt::Display for Count {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "recorded {}, lost {}", self.recorded, self.lost)
    }
}

impl FromStr for Count {
    type Err = ();

    fn from_str(text: &str) -> Result<Self, ()> {
        let rest = text.strip_prefix("recorded ").ok_or(())?;
        let (recorded, lost) = rest.split_once(", lost ").ok_or(())?;
        let number = |text: &str| text.parse().map_err(drop);
        Ok(Self {
            recorded: number(recorded)?,
            lost: number(lost)?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_count_survives_a_round_trip() {
        let count = Count {
            recorded: 12,
            lost: u64::MAX,
        };
        assert_eq!(count.to_string().parse(), Ok(count));
        for other in [
            "",
            "recorded 1",
            "recorded 1, lost",
            "recorded -1, lost 2",
            "lost 2",
        ] {
            assert_eq!(other.parse::<Count>(), Err(()), "{other}");
        }
    }
}
