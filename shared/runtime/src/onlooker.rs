//! Looking at a deployment that runs, from a process that is no part of it.

use std::fs;
use std::io;

use iceoryx2::prelude::{CallbackProgression, Service as _, ipc};
use iceoryx2::service::ServiceListError;
use messages::{Metrics, topic};

use crate::lock::{ENDING_FILE, LOCK_FILE, living};
use crate::remains::supervisor;
use crate::{Bus, BusError, ExitKind, Fault, Namespace, PortError, ReceiveError, Stop, Subscriber};

/// A deployment cannot be looked at.
#[derive(Debug, thiserror::Error)]
pub enum OnlookerError {
    /// It does not run, or is about to end.
    #[error("deployment {name:?} does not run")]
    NotRunning {
        /// Its name.
        name: String,
    },
    /// Its shared memory cannot be reached.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// What it consists of cannot be found out.
    #[error(
        "cannot list the topics of deployment {name:?}: {}",
        crate::words::said(source)
    )]
    List {
        /// Its name.
        name: String,
        /// Why.
        source: ServiceListError,
    },
    /// Its processes cannot be listened to; as a rule because too many listen already.
    #[error(transparent)]
    Port(#[from] PortError),
    /// What they say cannot be taken in.
    #[error(transparent)]
    Receive(#[from] ReceiveError),
    /// This process cannot be told to stop.
    #[error("cannot prepare to stop")]
    Stop(#[source] io::Error),
}

impl Fault for OnlookerError {
    fn kind(&self) -> ExitKind {
        match self {
            Self::NotRunning { .. } => ExitKind::Usage,
            _ => ExitKind::Run,
        }
    }

    fn hint(&self) -> Option<String> {
        match self {
            Self::NotRunning { .. } => Some("`parallax status` shows what runs".to_owned()),
            Self::Port(_) => Some("at most four may look at a deployment at a time".to_owned()),
            Self::Bus(_) | Self::List { .. } | Self::Receive(_) | Self::Stop(_) => None,
        }
    }
}

/// What is seen of one process.
#[derive(Debug, Clone, Copy)]
pub struct Sighting<'a> {
    /// Its name.
    pub process: &'a str,
    /// Its process id, while it lives.
    pub pid: Option<u32>,
    /// What it has said last, in this life or an earlier one. It comes from another process: check it.
    pub said: Option<&'a Metrics>,
}

/// Looks at a deployment that runs: which processes it consists of, which of them live, and what they
/// say of their times and counts. Nobody waits for an onlooker, and the deployment ends without it; it
/// has to leave then ([`Self::is_over`]), within a second.
#[derive(Debug)]
pub struct Onlooker {
    seats: Vec<Seat>,
    supervisor: u32,
    // Dropped last: its ports are the seats'.
    bus: Bus,
}

#[derive(Debug)]
struct Seat {
    process: String,
    ears: Subscriber<Metrics>,
    pid: Option<u32>,
    said: Option<Metrics>,
}

impl Onlooker {
    /// Begins to look.
    ///
    /// # Errors
    ///
    /// [`OnlookerError`].
    pub fn open(namespace: &Namespace) -> Result<Self, OnlookerError> {
        let not_running = || OnlookerError::NotRunning {
            name: namespace.name().to_owned(),
        };
        // Before anything is opened: opening would make what is not there.
        let supervisor = supervisor_of(namespace).ok_or_else(not_running)?;
        let stop = Stop::new().map_err(OnlookerError::Stop)?;
        let name = format!("onlooker-{}", std::process::id());
        let bus = Bus::open(namespace, &name, &stop)?;
        let mut processes = processes(namespace)?;
        processes.sort();
        let mut waiter = bus.waiter();
        let seats = processes
            .into_iter()
            .map(|process| {
                let ears = bus.subscriber(&topic::metrics(&process), &mut waiter)?;
                Ok(Seat {
                    process,
                    ears,
                    pid: None,
                    said: None,
                })
            })
            .collect::<Result<_, PortError>>();
        let seats = match seats {
            // It has ended meanwhile, and its topics with it.
            Err(PortError::NoSuchTopic { .. }) if supervisor_of(namespace) != Some(supervisor) => {
                return Err(not_running());
            }
            seats => seats?,
        };
        Ok(Self {
            seats,
            supervisor,
            bus,
        })
    }

    /// The process that runs the deployment.
    pub fn supervisor(&self) -> u32 {
        self.supervisor
    }

    /// Looks again.
    ///
    /// # Errors
    ///
    /// [`OnlookerError::Bus`], [`OnlookerError::Receive`].
    pub fn look(&mut self) -> Result<Vec<Sighting<'_>>, OnlookerError> {
        let config = self.bus.namespace().config().map_err(BusError::from)?;
        let living = living(&config);
        for seat in &mut self.seats {
            let its = living.iter().flatten().find(|it| it.0 == seat.process);
            seat.pid = its.map(|it| it.1);
            if let Some(said) = seat.ears.latest()? {
                seat.said = Some(said);
            }
        }
        let sightings = self.seats.iter().map(|it| Sighting {
            process: &it.process,
            pid: it.pid,
            said: it.said.as_ref(),
        });
        Ok(sightings.collect())
    }

    /// Whether the deployment ends, and this has to be dropped.
    pub fn is_over(&self) -> bool {
        supervisor_of(self.bus.namespace()) != Some(self.supervisor)
    }
}

/// Who runs a deployment that does not end yet.
fn supervisor_of(namespace: &Namespace) -> Option<u32> {
    let root = namespace.root();
    if root.join(ENDING_FILE).exists() {
        return None;
    }
    let locks = fs::read_to_string("/proc/locks").unwrap_or_default();
    supervisor(&root.join(LOCK_FILE), &locks)
}

/// The names of all processes that a deployment should have: those it has topics for.
fn processes(namespace: &Namespace) -> Result<Vec<String>, OnlookerError> {
    let config = namespace.config().map_err(BusError::from)?;
    let mut processes = Vec::new();
    let listed = ipc::Service::list(&config, |service| {
        let name = service.static_details.name();
        processes.extend(topic::process_of_metrics(name).map(str::to_owned));
        CallbackProgression::Continue
    });
    listed.map_err(|source| OnlookerError::List {
        name: namespace.name().to_owned(),
        source,
    })?;
    Ok(processes)
}
