//! What the processes of a run hold, second by second: memory, descriptors, files; and whether it grows.

use core::ops::Range;
use std::collections::BTreeMap;
use std::fs;
use std::os::unix::fs::MetadataExt as _;
use std::path::Path;

use runtime::Namespace;
use serde::Serialize;
use supervise::Event;

use crate::trial::strike::is_at_work;

/// Nanoseconds between two samples.
const PERIOD: u64 = 1_000_000_000;
/// Fewer samples say nothing.
const LEAST: usize = 9;

/// What a run holds at a moment.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub(super) struct Sample {
    /// Physical memory of all processes but the supervisor that is theirs alone: without files and shared memory, bytes.
    pub memory_bytes: u64,
    /// That of the supervisor, which is never restarted, bytes.
    pub supervisor_memory_bytes: u64,
    /// Open files of all processes, those of the supervisor included.
    pub descriptors: u64,
    /// Files of the deployment, those in shared memory included.
    pub files: u64,
    /// What its files in shared memory take of it, bytes.
    pub shared_bytes: u64,
}

/// Takes samples whenever all processes are at work.
#[derive(Debug, Default)]
pub(super) struct Census {
    /// By name: number, how often it had been restarted, whether it is at work.
    processes: BTreeMap<String, (u32, u32, bool)>,
    taken_at: u64,
    /// And when they were taken.
    samples: Vec<(u64, Sample)>,
}

impl Census {
    /// Takes note of what the supervisor tells.
    ///
    /// * `now`: `runtime::now_nanos`.
    /// * `look`: takes a sample of processes.
    pub(super) fn note(
        &mut self,
        event: &Event<'_>,
        now: u64,
        look: impl FnOnce(&[u32]) -> Sample,
    ) {
        match *event {
            Event::Started {
                process,
                pid,
                epoch,
            } => {
                let state = (pid, epoch, false);
                self.processes.insert(process.to_owned(), state);
            }
            Event::Died { process, .. } => {
                if let Some(it) = self.processes.get_mut(process) {
                    it.2 = false;
                }
            }
            Event::Health { process, health } => {
                if let Some(it) = self.processes.get_mut(process) {
                    it.2 |= is_at_work(process, health, it.1);
                }
            }
            _ => {}
        }
        let is_due = now.saturating_sub(self.taken_at) >= PERIOD;
        if is_due && !self.processes.is_empty() && self.processes.values().all(|it| it.2) {
            self.taken_at = now;
            let pids: Vec<u32> = self.processes.values().map(|it| it.0).collect();
            self.samples.push((now, look(&pids)));
        }
    }

    /// What was held at first and at last, each the median of a third of the samples; none if they are too few.
    pub(super) fn ends(&self) -> Option<[Sample; 2]> {
        let third = self.samples.len() / 3;
        if self.samples.len() < LEAST {
            return None;
        }
        let last = self.samples.len() - third;
        let of = |samples: &[(u64, Sample)]| median(samples.iter().map(|it| it.1));
        Some([of(&self.samples[..third])?, of(&self.samples[last..])?])
    }

    /// What was held in a span of time, `runtime::now_nanos`: the median; none if there is no sample of it.
    pub(super) fn within(&self, span: &Range<u64>) -> Option<Sample> {
        let within = self.samples.iter().filter(|it| span.contains(&it.0));
        median(within.map(|it| it.1))
    }
}

/// Of every number by itself; none of nothing.
fn median(samples: impl Iterator<Item = Sample>) -> Option<Sample> {
    let samples: Vec<Sample> = samples.collect();
    let of = |number: fn(&Sample) -> u64| {
        let mut all: Vec<u64> = samples.iter().map(number).collect();
        all.sort_unstable();
        all.get(all.len() / 2).copied().unwrap_or(0)
    };
    (!samples.is_empty()).then(|| Sample {
        memory_bytes: of(|it| it.memory_bytes),
        supervisor_memory_bytes: of(|it| it.supervisor_memory_bytes),
        descriptors: of(|it| it.descriptors),
        files: of(|it| it.files),
        shared_bytes: of(|it| it.shared_bytes),
    })
}

/// What processes of a deployment hold now, this one being their supervisor.
pub(super) fn look(namespace: &Namespace, pids: &[u32]) -> Sample {
    let own = std::process::id();
    let descriptors = pids.iter().copied().chain([own]).map(descriptors);
    Sample {
        memory_bytes: pids.iter().copied().map(memory).sum(),
        supervisor_memory_bytes: memory(own),
        descriptors: descriptors.sum(),
        files: n_files(namespace),
        shared_bytes: left(namespace).iter().map(|it| shared(it)).sum(),
    }
}

/// What a file takes of shared memory, which is less than its size where nobody has written.
fn shared(name: &str) -> u64 {
    let found = fs::metadata(Path::new("/dev/shm").join(name));
    found.map_or(0, |it| it.blocks() * 512)
}

/// Files of a deployment, those in shared memory included.
pub(super) fn n_files(namespace: &Namespace) -> u64 {
    left(namespace).len() as u64 + files(namespace.root())
}

/// What lies in shared memory of a deployment.
pub(super) fn left(namespace: &Namespace) -> Vec<String> {
    let entries = fs::read_dir("/dev/shm").into_iter().flatten().flatten();
    let names = entries.filter_map(|it| it.file_name().into_string().ok());
    names
        .filter(|it| it.starts_with(namespace.prefix()))
        .collect()
}

/// 0 for a process that has just ended.
fn memory(pid: u32) -> u64 {
    let status = fs::read_to_string(format!("/proc/{pid}/status")).unwrap_or_default();
    let line = status.lines().find_map(|it| it.strip_prefix("RssAnon:"));
    let kib = line.and_then(|it| it.split_whitespace().next()?.parse::<u64>().ok());
    kib.unwrap_or(0) * 1024
}

fn descriptors(pid: u32) -> u64 {
    fs::read_dir(format!("/proc/{pid}/fd")).map_or(0, |it| it.count() as u64)
}

fn files(folder: &Path) -> u64 {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let counts = entries.map(|it| match it.file_type() {
        Ok(kind) if kind.is_dir() => files(&it.path()),
        _ => 1,
    });
    counts.sum()
}

#[cfg(test)]
mod tests {
    use messages::Health;
    use supervise::Death;

    use super::*;

    fn say(census: &mut Census, process: &str, epoch: u32, seconds: u64) {
        let health = Health {
            epoch,
            n_sent: 1,
            ..Health::default()
        };
        let event = Event::Health {
            process,
            health: &health,
        };
        census.note(&event, seconds * PERIOD, |pids| Sample {
            files: seconds,
            descriptors: pids.len() as u64,
            ..Sample::default()
        });
    }

    fn start(census: &mut Census, process: &str, epoch: u32) {
        let event = Event::Started {
            process,
            pid: 7,
            epoch,
        };
        census.note(&event, 0, |_| Sample::default());
    }

    #[test]
    fn a_sample_is_taken_every_second_in_which_all_are_at_work() {
        let mut census = Census::default();
        start(&mut census, "a", 0);
        start(&mut census, "b", 0);
        say(&mut census, "a", 0, 1);
        assert_eq!(census.samples, [], "b has done nothing yet");
        say(&mut census, "b", 0, 2);
        say(&mut census, "a", 0, 2);
        let died = Event::Died {
            process: "a",
            death: Death::Signal { number: 9 },
        };
        census.note(&died, 0, |_| Sample::default());
        say(&mut census, "b", 0, 3);
        start(&mut census, "a", 1);
        say(&mut census, "a", 0, 4);
        say(&mut census, "a", 1, 5);
        let taken: Vec<_> = census
            .samples
            .iter()
            .map(|it| (it.1.files, it.1.descriptors))
            .collect();
        assert_eq!(taken, [(2, 2), (5, 2)]);
        let within = |span: Range<u64>| census.within(&(span.start * PERIOD..span.end * PERIOD));
        assert_eq!(within(3..6).map(|it| it.files), Some(5));
        assert_eq!(within(3..5), None);
    }

    #[test]
    fn first_and_last_are_medians_that_no_single_sample_moves() {
        let mut census = Census::default();
        start(&mut census, "a", 0);
        for seconds in [1, 2, 3, 4, 5, 6, 7, 8] {
            say(&mut census, "a", 0, seconds);
        }
        assert_eq!(census.ends(), None, "too few");
        say(&mut census, "a", 0, 900);
        let files = census.ends().unwrap().map(|it| it.files);
        assert_eq!(files, [2, 8]);
    }

    #[test]
    fn this_process_holds_something() {
        let namespace = Namespace::below("nobody", &std::env::temp_dir().join("px-none")).unwrap();
        let sample = look(&namespace, &[std::process::id()]);
        assert!(sample.memory_bytes > 100_000, "{sample:?}");
        assert!(sample.descriptors >= 2 * 3, "{sample:?}");
        assert_eq!(sample.files, 0);
    }
}
