//! Measures the resources of a run every second: memory, descriptors and files.
//!
//! The buffers of a process grow to the size that its largest frame needed, so a process uses more memory the longer it runs. Therefore,
//! resources at the start and at the end of a run are compared between processes of the same age.

use core::ops::Range;
use std::collections::BTreeMap;
use std::fs;
use std::os::unix::fs::MetadataExt as _;
use std::path::Path;

use runtime::Namespace;
use serde::Serialize;
use supervise::Event;

use crate::trial::injection::has_worked;

/// Time between two samples, in nanoseconds.
const PERIOD: u64 = 1_000_000_000;
/// Smallest number of samples from which growth is computed.
const MIN_SAMPLES: usize = 9;

/// Resources in use at one time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub(super) struct ResourceUse {
    /// Anonymous resident memory (`RssAnon`) of all processes except the supervisor, in bytes.
    pub memory_bytes: u64,
    /// Anonymous resident memory of the supervisor, in bytes.
    pub supervisor_memory_bytes: u64,
    /// Open file descriptors of all processes, including the supervisor.
    pub descriptors: u64,
    /// Files of the deployment, including those in shared memory.
    pub files: u64,
    /// Allocated size of the deployment's files in shared memory, in bytes.
    pub shared_bytes: u64,
}

/// Resources in use at one time, and the memory of every process.
#[derive(Debug, Clone, Default)]
pub(super) struct Measured {
    /// Resources of all processes.
    pub used: ResourceUse,
    /// Anonymous resident memory of every process except the supervisor, in the order of the requested ids, in bytes.
    pub memory_bytes: Vec<u64>,
}

/// A measured process.
#[derive(Debug)]
struct Watched {
    pid: u32,
    epoch: u32,
    /// Time at which the process was started (`failure::now_nanos`).
    started_at: u64,
    /// True if the process has worked in this epoch.
    has_worked: bool,
}

/// Resources in use at one time.
#[derive(Debug)]
struct Sample {
    /// Time of the sample (`failure::now_nanos`).
    at: u64,
    used: ResourceUse,
    /// Age class and memory in bytes of every process, in the order of their names.
    processes: Vec<(u32, u64)>,
}

/// Takes a sample in every second in which all processes work.
#[derive(Debug, Default)]
pub(super) struct ResourceMonitor {
    /// Processes by name.
    processes: BTreeMap<String, Watched>,
    taken_at: u64,
    samples: Vec<Sample>,
}

impl ResourceMonitor {
    /// Handles an event of the supervisor, and takes a sample if it is time.
    ///
    /// * `now`: current time (`failure::now_nanos`).
    /// * `measure`: measures the processes with these ids.
    pub(super) fn handle(
        &mut self,
        event: &Event<'_>,
        now: u64,
        measure: impl FnOnce(&[u32]) -> Measured,
    ) {
        match *event {
            Event::Started {
                process,
                pid,
                epoch,
            } => {
                let watched = Watched {
                    pid,
                    epoch,
                    started_at: now,
                    has_worked: false,
                };
                self.processes.insert(process.to_owned(), watched);
            }
            Event::Died { process, .. } => {
                if let Some(it) = self.processes.get_mut(process) {
                    it.has_worked = false;
                }
            }
            Event::Health { process, health } => {
                if let Some(it) = self.processes.get_mut(process) {
                    it.has_worked |= has_worked(process, health, it.epoch);
                }
            }
            _ => {}
        }
        let is_due = now.saturating_sub(self.taken_at) >= PERIOD;
        if is_due
            && !self.processes.is_empty()
            && self.processes.values().all(|value| value.has_worked)
        {
            self.taken_at = now;
            let pids: Vec<u32> = self.processes.values().map(|value| value.pid).collect();
            let Measured { used, memory_bytes } = measure(&pids);
            let ages = self.processes.values();
            let ages = ages.map(|age| age_class(now.saturating_sub(age.started_at)));
            self.samples.push(Sample {
                at: now,
                used,
                processes: ages.zip(memory_bytes).collect(),
            });
        }
    }

    /// Returns the resources at the start and at the end: the medians over the first and the last third of the samples. The memory of
    /// processes is compared at equal ages. Returns `None` if there are too few samples.
    pub(super) fn ends(&self) -> Option<[ResourceUse; 2]> {
        let third = self.samples.len() / 3;
        if self.samples.len() < MIN_SAMPLES {
            return None;
        }
        let last = self.samples.len() - third;
        let ends = [&self.samples[..third], &self.samples[last..]];
        let memory = at_equal_ages(ends);
        let of = |nth: usize| {
            let used = median(ends[nth].iter().map(|end| end.used))?;
            Some(ResourceUse {
                memory_bytes: memory[nth],
                ..used
            })
        };
        Some([of(0)?, of(1)?])
    }

    /// Returns the median of the samples in a span of time; `None` if there are none.
    ///
    /// * `span`: start and end of the span (`failure::now_nanos`).
    pub(super) fn within(&self, span: &Range<u64>) -> Option<ResourceUse> {
        let within = self.samples.iter().filter(|sample| span.contains(&sample.at));
        median(within.map(|within| within.used))
    }
}

/// Returns the class of an age, which is computed from the binary logarithm of the age in seconds. Ages in one class differ by less than a
/// factor of two.
fn age_class(nanos: u64) -> u32 {
    (nanos / 1_000_000_000).checked_ilog2().map_or(0, |exponent| exponent + 1)
}

/// Returns the memory of all processes in two parts of a run, in bytes. The memory of a process is the mean over the age classes that the
/// process had in both parts, with the median of each class. A process without a common age class is left out.
fn at_equal_ages(parts: [&[Sample]; 2]) -> [u64; 2] {
    let n_processes = parts.iter().flat_map(|part| part.iter());
    let n_processes = n_processes.map(|process| process.processes.len()).max().unwrap_or(0);
    let mut sums = [0; 2];
    for process in 0..n_processes {
        let by_class = parts.map(|samples| {
            let mut classes: BTreeMap<u32, Vec<u64>> = BTreeMap::new();
            for (class, memory) in samples.iter().filter_map(|sample| sample.processes.get(process))
            {
                classes.entry(*class).or_default().push(*memory);
            }
            classes
        });
        let both: Vec<u32> = by_class[0]
            .keys()
            .filter(|key| by_class[1].contains_key(key))
            .copied()
            .collect();
        for (sum, classes) in sums.iter_mut().zip(by_class) {
            let medians = both.iter().filter_map(|class| {
                let mut all = classes.get(class)?.clone();
                all.sort_unstable();
                all.get(all.len() / 2).copied()
            });
            *sum += medians.sum::<u64>() / (both.len() as u64).max(1);
        }
    }
    sums
}

/// Returns the median of every field; `None` if there are no samples.
fn median(samples: impl Iterator<Item = ResourceUse>) -> Option<ResourceUse> {
    let samples: Vec<ResourceUse> = samples.collect();
    let of = |number: fn(&ResourceUse) -> u64| {
        let mut all: Vec<u64> = samples.iter().map(number).collect();
        all.sort_unstable();
        all.get(all.len() / 2).copied().unwrap_or(0)
    };
    (!samples.is_empty()).then(|| ResourceUse {
        memory_bytes: of(|used| used.memory_bytes),
        supervisor_memory_bytes: of(|used| used.supervisor_memory_bytes),
        descriptors: of(|used| used.descriptors),
        files: of(|used| used.files),
        shared_bytes: of(|used| used.shared_bytes),
    })
}

/// Measures the resources of a deployment whose supervisor is this process.
///
/// * `pids`: ids of the other processes of the deployment.
pub(super) fn measure(namespace: &Namespace, pids: &[u32]) -> Measured {
    let own = std::process::id();
    let descriptors = pids.iter().copied().chain([own]).map(descriptors);
    let memory_bytes: Vec<u64> = pids.iter().copied().map(memory).collect();
    Measured {
        used: ResourceUse {
            memory_bytes: memory_bytes.iter().sum(),
            supervisor_memory_bytes: memory(own),
            descriptors: descriptors.sum(),
            files: n_files(namespace),
            shared_bytes: shared_files(namespace)
                .iter()
                .map(|shared_file| shared(shared_file))
                .sum(),
        },
        memory_bytes,
    }
}

/// Returns the allocated size of a file in shared memory, in bytes. It is smaller than the file's length if some pages were never written.
fn shared(name: &str) -> u64 {
    let found = fs::metadata(Path::new("/dev/shm").join(name));
    found.map_or(0, |file| file.blocks() * 512)
}

/// Returns the number of a deployment's files, including those in shared memory.
pub(super) fn n_files(namespace: &Namespace) -> u64 {
    shared_files(namespace).len() as u64 + files(namespace.root())
}

/// Returns the names of a deployment's files in shared memory.
pub(super) fn shared_files(namespace: &Namespace) -> Vec<String> {
    let entries = fs::read_dir("/dev/shm").into_iter().flatten().flatten();
    let names = entries.filter_map(|entry| entry.file_name().into_string().ok());
    names.filter(|name| name.starts_with(namespace.prefix())).collect()
}

/// Returns the anonymous resident memory of a process, in bytes; 0 if it has ended.
fn memory(pid: u32) -> u64 {
    let status = fs::read_to_string(format!("/proc/{pid}/status")).unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("RssAnon:"));
    let kib = line.and_then(|line| line.split_whitespace().next()?.parse::<u64>().ok());
    kib.unwrap_or(0) * 1024
}

fn descriptors(pid: u32) -> u64 {
    fs::read_dir(format!("/proc/{pid}/fd")).map_or(0, |entry| entry.count() as u64)
}

fn files(folder: &Path) -> u64 {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let counts = entries.map(|entry| match entry.file_type() {
        Ok(kind) if kind.is_dir() => files(&entry.path()),
        _ => 1,
    });
    counts.sum()
}

#[cfg(test)]
mod tests {
    use messages::Health;
    use supervise::Death;

    use super::*;

    fn health_at(monitor: &mut ResourceMonitor, process: &str, epoch: u32, seconds: u64) {
        let health = Health {
            epoch,
            n_sent: 1,
            ..Health::default()
        };
        let event = Event::Health {
            process,
            health: &health,
        };
        monitor.handle(&event, seconds * PERIOD, |pids| Measured {
            used: ResourceUse {
                files: seconds,
                descriptors: pids.len() as u64,
                ..ResourceUse::default()
            },
            memory_bytes: vec![0; pids.len()],
        });
    }

    fn start(monitor: &mut ResourceMonitor, process: &str, epoch: u32) {
        let event = Event::Started {
            process,
            pid: 7,
            epoch,
        };
        monitor.handle(&event, 0, |_| Measured::default());
    }

    #[test]
    fn a_sample_is_taken_every_second_in_which_all_processes_work() {
        let mut monitor = ResourceMonitor::default();
        start(&mut monitor, "a", 0);
        start(&mut monitor, "b", 0);
        health_at(&mut monitor, "a", 0, 1);
        assert!(monitor.samples.is_empty(), "b has not worked yet");
        health_at(&mut monitor, "b", 0, 2);
        health_at(&mut monitor, "a", 0, 2);
        let died = Event::Died {
            process: "a",
            death: Death::Signal { number: 9 },
        };
        monitor.handle(&died, 0, |_| Measured::default());
        health_at(&mut monitor, "b", 0, 3);
        start(&mut monitor, "a", 1);
        health_at(&mut monitor, "a", 0, 4);
        health_at(&mut monitor, "a", 1, 5);
        let taken: Vec<_> = monitor
            .samples
            .iter()
            .map(|sample| (sample.used.files, sample.used.descriptors))
            .collect();
        assert_eq!(taken, [(2, 2), (5, 2)]);
        let within = |span: Range<u64>| monitor.within(&(span.start * PERIOD..span.end * PERIOD));
        assert_eq!(within(3..6).map(|used| used.files), Some(5));
        assert_eq!(within(3..5), None);
    }

    /// Returns a sample of one process.
    fn sample(age_s: u64, memory: u64) -> Sample {
        Sample {
            at: 0,
            used: ResourceUse::default(),
            processes: vec![(age_class(age_s * PERIOD), memory)],
        }
    }

    #[test]
    fn memory_is_compared_at_equal_process_ages() {
        // The process is killed often at first, but not at the end. Its memory depends only on its age.
        let young = [(1, 50), (5, 60), (1, 50), (2, 55)].map(|(age, memory)| sample(age, memory));
        let old = [(5, 60), (20, 120), (100, 180)].map(|(age, memory)| sample(age, memory));
        assert_eq!(at_equal_ages([&young, &old]), [60, 60]);
        // Every restarted process uses more memory than the one before, because of data that earlier processes left behind.
        let leaking = [(1, 90), (2, 95), (5, 100)].map(|(age, memory)| sample(age, memory));
        assert_eq!(at_equal_ages([&young, &leaking]), [55, 95]);
        let older = [(50, 90)].map(|(age, memory)| sample(age, memory));
        assert_eq!(at_equal_ages([&young, &older]), [0, 0], "no age in common");
    }

    #[test]
    fn a_single_sample_does_not_affect_start_and_end_values() {
        let mut monitor = ResourceMonitor::default();
        start(&mut monitor, "a", 0);
        for seconds in [1, 2, 3, 4, 5, 6, 7, 8] {
            health_at(&mut monitor, "a", 0, seconds);
        }
        assert_eq!(monitor.ends(), None, "too few");
        health_at(&mut monitor, "a", 0, 900);
        let files = monitor.ends().unwrap().map(|end| end.files);
        assert_eq!(files, [2, 8]);
    }

    #[test]
    fn resource_use_of_this_process_is_measured() {
        let namespace = Namespace::below("nobody", &std::env::temp_dir().join("px-none")).unwrap();
        let sample = measure(&namespace, &[std::process::id()]).used;
        assert!(sample.memory_bytes > 100_000, "{sample:?}");
        assert!(sample.descriptors >= 2 * 3, "{sample:?}");
        assert_eq!(sample.files, 0);
    }
}
