//! Scheduling as text, for users and for the command line of a process.

use core::fmt::{self, Display, Formatter};
use core::str::FromStr;

use super::{Policy, RealTime, Scheduling};

/// A text that is not a scheduling option.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{option:?} is not one of cores=0,1 fifo=1 round-robin=1 lock-memory spin")]
pub struct SchedulingError {
    /// The text of the option.
    pub option: String,
}

impl Display for Scheduling {
    /// Writes options separated by spaces, such as `cores=0,1 fifo=50 lock-memory spin`. Empty if nothing is requested.
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let mut words = Vec::new();
        if !self.cores.is_empty() {
            words.push(format!("cores={}", list(&self.cores)));
        }
        if let Some(RealTime { policy, priority }) = self.real_time {
            words.push(format!("{}={priority}", policy.name()));
        }
        if self.lock_memory {
            words.push("lock-memory".to_owned());
        }
        if self.spin {
            words.push("spin".to_owned());
        }
        f.write_str(&words.join(" "))
    }
}

impl FromStr for Scheduling {
    type Err = SchedulingError;

    fn from_str(text: &str) -> Result<Self, SchedulingError> {
        let mut scheduling = Self::default();
        for option in text.split_whitespace() {
            scheduling.take(option).ok_or_else(|| SchedulingError {
                option: option.to_owned(),
            })?;
        }
        Ok(scheduling)
    }
}

impl Scheduling {
    fn take(&mut self, option: &str) -> Option<()> {
        match option.split_once('=') {
            None if option == "lock-memory" => self.lock_memory = true,
            None if option == "spin" => self.spin = true,
            Some(("cores", list)) => {
                let cores = list.split(',').map(str::parse);
                self.cores = cores.collect::<Result<_, _>>().ok()?;
            }
            Some((name, priority)) => {
                let policy = Policy::ALL.into_iter().find(|policy| policy.name() == name)?;
                let priority = priority.parse().ok()?;
                self.real_time = Some(RealTime { policy, priority });
            }
            None => return None,
        }
        Some(())
    }
}

impl Policy {
    /// All policies.
    pub const ALL: [Self; 2] = [Self::Fifo, Self::RoundRobin];

    /// Returns the name of the policy in settings.
    pub fn name(self) -> &'static str {
        match self {
            Self::Fifo => "fifo",
            Self::RoundRobin => "round-robin",
        }
    }
}

/// Returns numbers separated by commas.
pub(super) fn list(numbers: &[usize]) -> String {
    let numbers: Vec<String> = numbers.iter().map(ToString::to_string).collect();
    if numbers.is_empty() {
        return "none".to_owned();
    }
    numbers.join(",")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn written_text_is_parsed_back() {
        let real_time = [
            None,
            Some((Policy::Fifo, 1)),
            Some((Policy::RoundRobin, 99)),
        ];
        for cores in [vec![], vec![3], vec![0, 1, 17]] {
            for real_time in real_time {
                for (lock_memory, spin) in [(false, false), (true, false), (false, true)] {
                    let scheduling = Scheduling {
                        cores: cores.clone(),
                        real_time: real_time
                            .map(|(policy, priority)| RealTime { policy, priority }),
                        lock_memory,
                        spin,
                    };
                    assert_eq!(scheduling.to_string().parse(), Ok(scheduling));
                }
            }
        }
    }

    #[test]
    fn the_default_is_an_empty_text() {
        assert_eq!(Scheduling::default().to_string(), "");
    }

    #[test]
    fn unknown_options_are_named_in_the_error() {
        for option in [
            "core=1",
            "cores=",
            "cores=1,x",
            "fifo=",
            "fifo=256",
            "spins",
        ] {
            let error = format!("spin {option}").parse::<Scheduling>().unwrap_err();
            assert_eq!(error.option, option);
        }
    }
}
