//! A separate deployment for every test, which leaves no files behind.
#![allow(dead_code, reason = "every test file uses a part of it")]

use std::path::Path;
use std::sync::atomic::{AtomicU32, Ordering};

use failure::Stop;
use runtime::{Bus, DeploymentLock, Namespace, Topic, TopicPlan};

/// The fields are dropped in this order: first the topics, then the lock, because dropping the lock removes all files.
pub(crate) struct Deployment {
    stop: Stop,
    _topics: Vec<Topic>,
    _bus: Bus,
    lock: DeploymentLock,
    _base: tempfile::TempDir,
}

impl Deployment {
    pub(crate) fn new(plans: &[TopicPlan]) -> Self {
        let base = tempfile::Builder::new().prefix("px").tempdir_in("/dev/shm").unwrap();
        let lock = namespace(base.path()).acquire().unwrap();
        let stop = Stop::new().unwrap();
        let bus = Bus::open(lock.namespace(), "supervisor", &stop).unwrap();
        Self {
            stop,
            _topics: bus.create_topics(plans).unwrap(),
            _bus: bus,
            lock,
            _base: base,
        }
    }

    pub(crate) fn bus(&self, process: &str) -> Bus {
        Bus::open(self.lock.namespace(), process, &self.stop).unwrap()
    }

    pub(crate) fn stop(&self) -> &Stop {
        &self.stop
    }

    /// Returns the names and process ids of the registered processes.
    pub(crate) fn alive(&self) -> Vec<String> {
        let base = self.namespace().base();
        let all = runtime::deployments(base).unwrap();
        let own = |remains: &runtime::Remains| remains.namespace == *self.namespace();
        all.into_iter().find(own).unwrap().processes
    }

    pub(crate) fn namespace(&self) -> &Namespace {
        self.lock.namespace()
    }
}

pub(crate) fn namespace(base: &Path) -> Namespace {
    static COUNT: AtomicU32 = AtomicU32::new(0);
    let n = COUNT.fetch_add(1, Ordering::Relaxed);
    Namespace::below(&format!("t{n}"), base).unwrap()
}

/// Returns the files of a deployment in shared memory.
pub(crate) fn shared_memory(namespace: &Namespace) -> Vec<String> {
    std::fs::read_dir("/dev/shm")
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|name| name.starts_with(namespace.prefix()))
        .collect()
}
