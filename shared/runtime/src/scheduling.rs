//! CPU affinity, real-time priority and memory locking of a process.
#![expect(
    unsafe_code,
    reason = "sched_setscheduler has no safe binding that takes the number of a priority"
)]

mod denied;
mod text;

use std::io;
use std::thread;

use rustix::mm::{MlockAllFlags, mlockall};
use rustix::process::{Resource, getrlimit, nice};
use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};

pub use denied::{Denied, Refusal};
pub use text::SchedulingError;

/// Settings that a process requests from the system's scheduler. The default requests nothing.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Scheduling {
    /// Cores on which the process may run, numbered from 0 as in Linux. If empty, the process may use the same cores as its parent.
    pub cores: Vec<usize>,
    /// Priority above all processes without real-time priority.
    pub real_time: Option<RealTime>,
    /// Keep used pages in memory (`mlockall`).
    pub lock_memory: bool,
    /// Poll for messages continuously, instead of sleeping until one arrives.
    pub spin: bool,
}

/// A priority above those of all ordinary processes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RealTime {
    /// The order among threads of the same priority.
    pub policy: Policy,
    /// Priority from 1 to 99; among processes that are ready to run, the one with the highest priority runs.
    pub priority: u8,
}

/// The order among threads of the same real-time priority.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Policy {
    /// The first thread runs until it sleeps (`SCHED_FIFO`).
    #[default]
    Fifo,
    /// All threads run in turn (`SCHED_RR`).
    RoundRobin,
}

/// Maximum number of cores that a set of cores can contain.
pub const MAX_CORES: usize = CpuSet::MAX_CPU;

/// The capability to lock any amount of memory (capabilities(7)).
const CAP_IPC_LOCK: u32 = 14;

impl Scheduling {
    /// Applies the requests to the calling thread and the threads that it will start. Call this first in a process. Denied
    /// requests change nothing and are returned.
    pub fn apply(&self) -> Vec<Denied> {
        let memory = if self.lock_memory {
            lock_memory()
        } else {
            None
        };
        [self.apply_to_thread(), memory.into_iter().collect()].concat()
    }

    /// Returns the requests that would be denied if a process started by this process called [`apply`](Self::apply). A short-lived thread
    /// tries the requests, so that this process does not change.
    pub fn rehearse(&self) -> Vec<Denied> {
        let wanted = self.clone();
        let thread = thread::Builder::new().name("rehearsal".to_owned());
        let tried = thread.spawn(move || wanted.apply_to_thread());
        let tried = tried.ok().and_then(|thread| thread.join().ok());
        let memory = self.lock_memory.then(memory_limit).flatten();
        let memory = memory.map(|limit_bytes| Denied::Memory {
            limit_bytes: Some(limit_bytes),
            source: io::ErrorKind::PermissionDenied.into(),
        });
        [tried.unwrap_or_default(), memory.into_iter().collect()].concat()
    }

    /// Returns the requests without the denied ones.
    #[must_use]
    pub fn without(mut self, denied: &[Denied]) -> Self {
        for denial in denied {
            match denial {
                Denied::Cores { allowed, .. } => self.cores.retain(|core| allowed.contains(core)),
                Denied::RealTime { .. } => self.real_time = None,
                Denied::Memory { .. } => self.lock_memory = false,
            }
        }
        self
    }

    fn apply_to_thread(&self) -> Vec<Denied> {
        let real_time = self.real_time.and_then(RealTime::apply);
        let cores = keep_to(&self.cores);
        cores.into_iter().chain(real_time).collect()
    }
}

impl RealTime {
    fn apply(self) -> Option<Denied> {
        let policy = match self.policy {
            Policy::Fifo => libc::SCHED_FIFO,
            Policy::RoundRobin => libc::SCHED_RR,
        };
        let parameters = libc::sched_param {
            sched_priority: i32::from(self.priority),
        };
        // SAFETY: the call only reads `parameters`, which is alive, and changes the scheduling of the
        // calling thread (0).
        let status = unsafe { libc::sched_setscheduler(0, policy, &raw const parameters) };
        (status != 0).then(|| Denied::RealTime {
            asked: self,
            source: io::Error::last_os_error().into(),
        })
    }
}

/// Restricts the calling thread to the requested cores that it may use.
fn keep_to(asked: &[usize]) -> Option<Denied> {
    if asked.is_empty() {
        return None;
    }
    let mut wanted = CpuSet::new();
    for &core in asked.iter().filter(|core| **core < MAX_CORES) {
        wanted.set(core);
    }
    // The system uses only cores that exist and that the process's group may use, if there are any.
    let refusal = sched_setaffinity(None, &wanted).err();
    let allowed = own_cores().unwrap_or_default();
    let are_all = asked.iter().all(|core| allowed.contains(core));
    (refusal.is_some() || !are_all).then(|| Denied::Cores {
        asked: asked.to_vec(),
        allowed,
        source: refusal.map(|error| io::Error::from(error).into()),
    })
}

/// Returns the cores that the calling thread may run on, ascending.
///
/// # Errors
///
/// Fails if the system call fails.
pub fn own_cores() -> io::Result<Vec<usize>> {
    let set = sched_getaffinity(None)?;
    Ok((0..MAX_CORES).filter(|core| set.is_set(*core)).collect())
}

/// Locks all pages, present and future, into memory.
fn lock_memory() -> Option<Denied> {
    if let Some(limit_bytes) = memory_limit() {
        // With a limit on locked memory, the call would succeed now, but a later allocation would fail.
        return Some(Denied::Memory {
            limit_bytes: Some(limit_bytes),
            source: io::ErrorKind::PermissionDenied.into(),
        });
    }
    // `ONFAULT` locks only the used chunks of a pool.
    let flags = MlockAllFlags::CURRENT | MlockAllFlags::FUTURE | MlockAllFlags::ONFAULT;
    mlockall(flags).err().map(|error| Denied::Memory {
        limit_bytes: None,
        source: io::Error::from(error).into(),
    })
}

/// Returns the amount of memory that this process may lock, in bytes; `None` if there is no limit.
fn memory_limit() -> Option<u64> {
    let limit = getrlimit(Resource::Memlock).current?;
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    (!has_capability(&status, CAP_IPC_LOCK)).then_some(limit)
}

/// Returns true if a process has a capability according to `/proc/PID/status`.
fn has_capability(status: &str, capability: u32) -> bool {
    let effective = status.lines().find_map(|line| line.strip_prefix("CapEff:"));
    let mask = effective.and_then(|digits| u64::from_str_radix(digits.trim(), 16).ok());
    mask.is_some_and(|mask| mask >> capability & 1 == 1)
}

/// Nice value of an onlooker, or of a thread whose work can wait. It gives two fifths of the processor time of an ordinary process. With
/// less, an onlooker could not follow a run that uses all processors.
const WAY: i32 = 4;

/// Lowers the priority of this thread, and of the threads that it starts from now on, so that other threads run first if processors are
/// scarce. It cannot be undone. To lower a whole process, call this before any thread is started.
pub fn give_way() {
    if let Err(error) = nice(WAY) {
        tracing::debug!(%error, "cannot give way to other processes");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs a function on a separate thread, because changes to the scheduling of a thread are not undone.
    fn on_a_thread<T: Send + 'static>(body: impl FnOnce() -> T + Send + 'static) -> T {
        let thread = thread::Builder::new().spawn(body).unwrap();
        thread.join().unwrap()
    }

    #[test]
    fn a_thread_and_its_children_run_on_the_requested_cores() {
        let last = *own_cores().unwrap().last().unwrap();
        let scheduling = Scheduling {
            cores: vec![last],
            ..Scheduling::default()
        };
        let got = on_a_thread(move || {
            let denied = scheduling.apply();
            (
                denied,
                own_cores().unwrap(),
                on_a_thread(own_cores).unwrap(),
            )
        });
        assert_eq!(got, (vec![], vec![last], vec![last]));
        assert!(
            own_cores().unwrap().contains(&last),
            "this thread is not restricted"
        );
    }

    #[test]
    fn missing_cores_are_reported_and_the_others_used() {
        let first = own_cores().unwrap()[0];
        let none = MAX_CORES + 7;
        let scheduling = Scheduling {
            cores: vec![first, none],
            ..Scheduling::default()
        };
        let asked = scheduling.clone();
        let (denied, cores) = on_a_thread(move || (asked.apply(), own_cores().unwrap()));
        assert_eq!(cores, [first]);
        let [Denied::Cores { asked, .. }] = &denied[..] else {
            panic!("{denied:?}")
        };
        assert_eq!(asked, &[first, none]);
        assert_eq!(scheduling.without(&denied).cores, [first]);
    }

    #[test]
    fn a_dry_run_of_scheduling_returns_the_same_denials_and_changes_nothing() {
        let scheduling = Scheduling {
            cores: vec![own_cores().unwrap()[0], MAX_CORES],
            real_time: Some(RealTime {
                policy: Policy::RoundRobin,
                priority: 1,
            }),
            ..Scheduling::default()
        };
        let before = own_cores().unwrap();
        let rehearsed = scheduling.rehearse();
        assert_eq!(own_cores().unwrap(), before);
        let asked = scheduling.clone();
        assert_eq!(rehearsed, on_a_thread(move || asked.apply()));
        let rest = scheduling.without(&rehearsed);
        assert_eq!(
            on_a_thread(move || rest.apply()),
            [],
            "what is left is granted"
        );
    }

    #[test]
    fn an_invalid_priority_is_denied() {
        let real_time = Some(RealTime {
            policy: Policy::Fifo,
            priority: 200,
        });
        let scheduling = Scheduling {
            real_time,
            ..Scheduling::default()
        };
        let denied = scheduling.rehearse();
        assert!(
            matches!(denied[..], [Denied::RealTime { .. }]),
            "{denied:?}"
        );
        assert_eq!(scheduling.without(&denied), Scheduling::default());
    }

    #[test]
    fn capabilities_are_decoded_from_the_mask() {
        let status = "Name:\tx\nCapPrm:\tffffffffffffffff\nCapEff:\t0000000000004000\n";
        assert!(has_capability(status, 14));
        assert!(!has_capability(status, 13) && !has_capability(status, 15));
        assert!(!has_capability("", 14));
    }
}
