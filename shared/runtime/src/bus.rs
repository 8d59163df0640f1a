//! A process's connection to the shared memory of its deployment.

use core::time::Duration;
use std::sync::Arc;

use iceoryx2::config::Config;
use iceoryx2::port::notifier::Notifier;
use iceoryx2::prelude::{
    FilePath, Node, NodeBuilder, NodeName, SemanticString as _, SignalHandlingMode, ipc,
};

use crate::bus_error::BusError;
use crate::log::adopt_transport_log;
use crate::room::{OVERHEAD_BYTES, note_room};
use crate::service::{self, PortError};
use crate::topic::{Topic, TopicPlan};
use crate::{Copies, Namespace, Progress, free_shared_memory, private};
use failure::Stop;

/// Default time for which a sender waits if a receiver has no room for the message.
const PATIENCE: Duration = Duration::from_mins(2);

/// A process's connection to the shared memory of its deployment. It creates the ports of the process.
#[derive(Debug)]
pub struct Bus {
    node: Arc<Node<ipc::Service>>,
    namespace: Namespace,
    process: String,
    stop: Stop,
    progress: Progress,
    copies: Copies,
    patience: Duration,
    spins: bool,
    looks_on: bool,
}

impl Bus {
    /// Registers this process in the deployment.
    ///
    /// * `process`: its unique name in the deployment, for example `pose-2`.
    /// * `stop`: the stop request, which ends every wait.
    ///
    /// # Errors
    ///
    /// Returns [`BusError::Full`], [`BusError::Privacy`], [`BusError::Directory`], [`BusError::Namespace`], [`BusError::Node`] or
    /// [`BusError::Name`].
    pub fn open(namespace: &Namespace, process: &str, stop: &Stop) -> Result<Self, BusError> {
        check_room(process, free_shared_memory().unwrap_or(u64::MAX))?;
        let config = prepare(namespace)?;
        let name = NodeName::new(process).ok().ok_or_else(|| BusError::Name {
            name: process.to_owned(),
        })?;
        let node = NodeBuilder::new()
            .name(&name)
            .config(&config)
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<ipc::Service>()
            .inspect_err(note_room)
            .map_err(|source| BusError::Node {
                process: process.to_owned(),
                root: namespace.root().to_owned(),
                source,
            })?;
        private::shared_memory(namespace)?;
        Ok(Self {
            node: Arc::new(node),
            namespace: namespace.clone(),
            process: process.to_owned(),
            stop: stop.clone(),
            progress: Progress::default(),
            copies: Copies::default(),
            patience: PATIENCE,
            spins: false,
            looks_on: false,
        })
    }

    /// Sets how long a sender waits for a receiver that has no room, before sending fails. The default is two minutes.
    #[must_use]
    pub fn with_patience(mut self, patience: Duration) -> Self {
        self.patience = patience;
        self
    }

    /// Sets whether waiters of this bus poll continuously, instead of sleeping until a message arrives.
    ///
    /// A receiver that polls occupies a core, but receives messages within one or two microseconds. The default is to sleep.
    #[must_use]
    pub fn with_spin(mut self, spins: bool) -> Self {
        self.spins = spins;
        self
    }

    /// Makes this process an onlooker, which receives messages without affecting the senders: no sender wakes it, waits for room in its
    /// queues, or counts it among its receivers.
    ///
    /// An onlooker polls. Even with lossless delivery, it misses messages that do not fit into its queues.
    #[must_use]
    pub fn as_onlooker(mut self) -> Self {
        self.looks_on = true;
        self
    }

    pub(crate) fn looks_on(&self) -> bool {
        self.looks_on
    }

    /// Returns the namespace of the deployment.
    pub fn namespace(&self) -> &Namespace {
        &self.namespace
    }

    /// Returns the name of this process in the deployment.
    pub fn process(&self) -> &str {
        &self.process
    }

    /// Returns the parts that another thread needs to create its own ports.
    pub(crate) fn parts(&self) -> BusParts {
        BusParts {
            node: Arc::clone(&self.node),
            namespace: self.namespace.clone(),
            process: self.process.clone(),
            stop: self.stop.clone(),
        }
    }

    /// Returns the stop request that ends every wait.
    pub fn stop(&self) -> &Stop {
        &self.stop
    }

    /// Returns the counter of the process's main loop.
    pub fn progress(&self) -> &Progress {
        &self.progress
    }

    /// Returns the count of bytes that the ports of this bus have copied, not counting heartbeats.
    pub fn copies(&self) -> &Copies {
        &self.copies
    }

    pub(crate) fn spins(&self) -> bool {
        self.spins
    }

    pub(crate) fn patience(&self) -> Duration {
        self.patience
    }

    /// Creates topics, which exist as long as the returned handles are kept or a port of the topic is open.
    ///
    /// The supervisor calls this once, before it starts processes. Ports can only open existing topics. The
    /// quality of service is therefore defined in one place, and topics outlive the processes that use them.
    ///
    /// # Errors
    ///
    /// Returns [`BusError::Create`], [`BusError::CreateWakeUp`] or [`BusError::Name`].
    pub fn create_topics(&self, plans: &[TopicPlan]) -> Result<Vec<Topic>, BusError> {
        plans.iter().map(|plan| plan.create(&self.node)).collect()
    }

    pub(crate) fn notifier(&self, name: &str) -> Result<Notifier<ipc::Service>, PortError> {
        service::open_wake_up(&self.node, name)?
            .notifier_builder()
            .create()
            .inspect_err(note_room)
            .map_err(|source| PortError::Notifier {
                topic: name.to_owned(),
                source,
            })
    }

    pub(crate) fn node(&self) -> &Node<ipc::Service> {
        &self.node
    }
}

/// The parts of a [`Bus`] that can move to another thread.
pub(crate) struct BusParts {
    node: Arc<Node<ipc::Service>>,
    namespace: Namespace,
    process: String,
    stop: Stop,
}

impl BusParts {
    /// Returns a bus with separate counters, because work of the other thread is not progress of the main loop.
    pub(crate) fn into_bus(self) -> Bus {
        Bus {
            node: self.node,
            namespace: self.namespace,
            process: self.process,
            stop: self.stop,
            progress: Progress::default(),
            copies: Copies::default(),
            patience: PATIENCE,
            spins: false,
            looks_on: false,
        }
    }
}

fn check_room(process: &str, free_bytes: u64) -> Result<(), BusError> {
    if free_bytes >= OVERHEAD_BYTES {
        return Ok(());
    }
    Err(BusError::Full {
        process: process.to_owned(),
        needed_bytes: OVERHEAD_BYTES,
        free_bytes,
    })
}

/// Creates the directory of a deployment and configures iceoryx2 to use it.
pub(crate) fn prepare(namespace: &Namespace) -> Result<Config, BusError> {
    adopt_transport_log();
    let config = namespace.config()?;
    let path = namespace.config_file();
    let directory = |source| BusError::Directory {
        path: path.clone(),
        source,
    };
    private::Root::open(namespace)?;
    if let Some(parent) = path.parent() {
        std::fs::create_dir_all(parent).map_err(directory)?;
    }
    if !path.exists() {
        // The file is replaced in one step, so that no process ever reads an incomplete file.
        files::replace(&path, namespace.config_text().as_bytes()).map_err(directory)?;
    }
    // If a node died before it had written its configuration, its clean-up uses the global configuration of the cleaning process
    // (iceoryx2 0.10, node/mod.rs). The global configuration must therefore be the same.
    if let Ok(file) = FilePath::new(path.as_os_str().as_encoded_bytes())
        && let Err(error) = Config::setup_global_config_from_file(&file)
    {
        tracing::warn!(%error, "cannot set the global configuration of iceoryx2");
    }
    Ok(config)
}
