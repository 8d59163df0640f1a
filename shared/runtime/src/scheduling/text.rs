//! Scheduling in words: what users see of it, and what a process is told on its command line.

use core::fmt::{self, Display, Formatter};
use core::str::FromStr;

use super::{Policy, RealTime, Scheduling};

/// A text that says nothing about scheduling.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{word:?} is none of cores=0,1 fifo=1 round-robin=1 lock-memory spin")]
pub struct SchedulingError {
    /// The word.
    pub word: String,
}

impl Display for Scheduling {
    /// Words with spaces between them, `cores=0,1 fifo=50 lock-memory spin`; nothing if nothing is asked for.
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
        let mut it = Self::default();
        for word in text.split_whitespace() {
            it.take(word).ok_or_else(|| SchedulingError {
                word: word.to_owned(),
            })?;
        }
        Ok(it)
    }
}

impl Scheduling {
    fn take(&mut self, word: &str) -> Option<()> {
        match word.split_once('=') {
            None if word == "lock-memory" => self.lock_memory = true,
            None if word == "spin" => self.spin = true,
            Some(("cores", list)) => {
                let cores = list.split(',').map(str::parse);
                self.cores = cores.collect::<Result<_, _>>().ok()?;
            }
            Some((name, priority)) => {
                let policy = Policy::ALL.into_iter().find(|it| it.name() == name)?;
                let priority = priority.parse().ok()?;
                self.real_time = Some(RealTime { policy, priority });
            }
            None => return None,
        }
        Some(())
    }
}

impl Policy {
    /// All.
    pub const ALL: [Self; 2] = [Self::Fifo, Self::RoundRobin];

    /// As users write it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Fifo => "fifo",
            Self::RoundRobin => "round-robin",
        }
    }
}

/// Numbers with commas between them.
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
    fn what_is_written_is_read_again() {
        let real_time = [
            None,
            Some((Policy::Fifo, 1)),
            Some((Policy::RoundRobin, 99)),
        ];
        for cores in [vec![], vec![3], vec![0, 1, 17]] {
            for real_time in real_time {
                for (lock_memory, spin) in [(false, false), (true, false), (false, true)] {
                    let it = Scheduling {
                        cores: cores.clone(),
                        real_time: real_time
                            .map(|(policy, priority)| RealTime { policy, priority }),
                        lock_memory,
                        spin,
                    };
                    assert_eq!(it.to_string().parse(), Ok(it));
                }
            }
        }
    }

    #[test]
    fn who_asks_for_nothing_says_nothing() {
        assert_eq!(Scheduling::default().to_string(), "");
    }

    #[test]
    fn other_words_are_refused_by_name() {
        for word in [
            "core=1",
            "cores=",
            "cores=1,x",
            "fifo=",
            "fifo=256",
            "spins",
        ] {
            let error = format!("spin {word}").parse::<Scheduling>().unwrap_err();
            assert_eq!(error.word, word);
        }
    }
}
