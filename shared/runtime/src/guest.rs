//! A program that reads the topics of a deployment without being part of it. It can be moved between threads, and cannot send.

#[cfg(test)]
mod tests;

use core::fmt::Debug;
use core::marker::PhantomData;
use std::fs::{self, File, OpenOptions};
use std::io;
use std::path::Path;
use std::sync::Arc;

use iceoryx2::port::ReceiveError as IoxReceiveError;
use iceoryx2::port::subscriber::SubscriberCreateError;
use iceoryx2::prelude::{
    CallbackProgression, Node, NodeBuilder, NodeName, Service as _, ServiceName,
    SignalHandlingMode, ipc_threadsafe,
};
use iceoryx2::service::builder::publish_subscribe::PublishSubscribeOpenError;
use rustix::fs::{FlockOperation, flock};

use crate::erased::{Reader, Received, Types};
use crate::log::adopt_transport_log;
use crate::observer::{running_supervisor, unless_over};
use crate::payload::{Header, Message};
use crate::service::patiently;
use crate::subscriber::onlooker;
use crate::{LockError, Namespace, NamespaceError, ReceiveError, deployments};
use failure::{ExitKind, Fault};

/// Maximum number of guests ([`Guest`]) of one deployment at the same time.
pub const MOST_GUESTS: usize = 4;
/// Directory of the files that guests lock, one file for each guest.
const SEATS: &str = "guests";

type Transport = ipc_threadsafe::Service;

/// Reason why a deployment cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum GuestError {
    /// The deployment is not running, or is about to end.
    #[error("deployment {name:?} does not run; {}", running_ones(.running))]
    NotRunning {
        /// Name of the deployment.
        name: String,
        /// Names of the deployments that are running.
        running: Vec<String>,
    },
    /// The deployment is already read by the maximum number of programs.
    #[error("{most} programs already read deployment {name:?}, which is the limit: {}", .guests.join(", "))]
    Full {
        /// Name of the deployment.
        name: String,
        /// Maximum number of programs.
        most: usize,
        /// Process ids of the programs that read the deployment.
        guests: Vec<String>,
    },
    /// The deployment has no such topic.
    #[error("deployment {name:?} has no topic {topic:?}")]
    NoSuchTopic {
        /// Name of the deployment.
        name: String,
        /// Name of the topic.
        topic: String,
    },
    /// The messages of a topic have a different version from the one that this program reads.
    #[error(
        "deployment {name:?} sends {topic:?} version {theirs}, but this program reads version {ours}"
    )]
    Version {
        /// Name of the deployment.
        name: String,
        /// Name of the topic without the version.
        topic: String,
        /// Version of the deployment.
        theirs: String,
        /// Version of this program.
        ours: String,
    },
    /// The topic carries another type of message with the same version.
    #[error("topic {topic:?} of deployment {name:?} does not carry {expected}")]
    WrongType {
        /// Name of the deployment.
        name: String,
        /// Name of the topic.
        topic: String,
        /// The type that was expected.
        expected: &'static str,
    },
    /// The text is not a valid name of a deployment.
    #[error(transparent)]
    Namespace(#[from] NamespaceError),
    /// The other deployments cannot be listed.
    #[error(transparent)]
    Lock(#[from] LockError),
    /// A file in the directory of the deployment cannot be used.
    #[error("cannot use the directory of deployment {name:?}")]
    Directory {
        /// Name of the deployment.
        name: String,
        /// Cause of the error.
        #[source]
        source: io::Error,
    },
    /// The transport failed.
    #[error("cannot read deployment {name:?}: {what}")]
    Transport {
        /// Name of the deployment.
        name: String,
        /// Action that failed, and the reason.
        what: String,
    },
}

impl Fault for GuestError {
    fn kind(&self) -> ExitKind {
        match self {
            Self::NotRunning { .. } | Self::Namespace(_) => ExitKind::Usage,
            _ => ExitKind::Run,
        }
    }

    fn hint(&self) -> Option<String> {
        match self {
            Self::Version { .. } | Self::WrongType { .. } => Some(
                "build this program and the deployment from the same version of Parallax"
                    .to_owned(),
            ),
            Self::Full { .. } => {
                Some("end one of them; a program that was killed no longer counts".to_owned())
            }
            _ => None,
        }
    }
}

fn running_ones(running: &[String]) -> String {
    if running.is_empty() {
        "none does".to_owned()
    } else {
        format!("running: {}", running.join(", "))
    }
}

/// A program that reads the topics of a running deployment.
///
/// A guest cannot send. No sender waits for it, wakes it, or counts it among its receivers. The deployment does not wait for guests when it
/// ends. So drop the guest, its ports and their messages within a second after [`Self::is_over`] returns true. The next run of the
/// deployment cannot start before that.
#[derive(Debug)]
pub struct Guest {
    node: Arc<Node<Transport>>,
    namespace: Namespace,
    supervisor: u32,
    _seat: File,
}

impl Guest {
    /// Connects to a running deployment.
    ///
    /// # Errors
    ///
    /// Returns [`GuestError::NotRunning`], [`GuestError::Full`], [`GuestError::Directory`] or [`GuestError::Transport`].
    pub fn open(namespace: &Namespace) -> Result<Self, GuestError> {
        let name = namespace.name();
        // Checked before anything is opened, because opening creates files.
        let Some(supervisor) = running_supervisor(namespace) else {
            return Err(not_running(name));
        };
        Self::open_of(namespace, supervisor)
            .map_err(|error| unless_over((namespace, supervisor), error, || not_running(name)))
    }

    fn open_of(namespace: &Namespace, supervisor: u32) -> Result<Self, GuestError> {
        let name = namespace.name();
        let seat = seat(namespace)?;
        let failed = |what: String| GuestError::Transport {
            name: name.to_owned(),
            what,
        };
        adopt_transport_log();
        let config = namespace.config()?;
        let node_name = NodeName::new(&format!("guest-{}", std::process::id()))
            .map_err(|error| failed(format!("its name: {error:?}")))?;
        let node = NodeBuilder::new()
            .name(&node_name)
            .config(&config)
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<Transport>()
            .map_err(|error| failed(format!("it cannot be registered: {error:?}")))?;
        Ok(Self {
            node: Arc::new(node),
            namespace: namespace.clone(),
            supervisor,
            _seat: seat,
        })
    }

    /// Returns the namespace of the deployment.
    pub fn namespace(&self) -> &Namespace {
        &self.namespace
    }

    /// Returns true if the deployment is ending. In that case, drop this guest, its ports and their messages.
    pub fn is_over(&self) -> bool {
        running_supervisor(&self.namespace) != Some(self.supervisor)
    }

    /// Subscribes to a topic. A topic of messages has arrays `[E]` of one element and the header `()`.
    ///
    /// # Errors
    ///
    /// Returns [`GuestError::NoSuchTopic`], [`GuestError::Version`], [`GuestError::WrongType`], [`GuestError::Full`] or
    /// [`GuestError::Transport`]. Returns [`GuestError::NotRunning`] if the deployment has ended.
    pub fn port<E: Message, H: Header>(&self, topic: &str) -> Result<GuestPort<E, H>, GuestError> {
        let run = (&self.namespace, self.supervisor);
        let reader = self
            .reader(topic, &Types::new::<E, H>())
            .map_err(|error| unless_over(run, error, || not_running(self.namespace.name())))?;
        Ok(GuestPort {
            topic: Arc::from(topic),
            reader,
            types: PhantomData,
        })
    }

    fn reader(&self, topic: &str, types: &Types) -> Result<Reader<Transport>, GuestError> {
        let deployment = || self.namespace.name().to_owned();
        let failed = |what: String| GuestError::Transport {
            name: deployment(),
            what,
        };
        let name = ServiceName::new(topic)
            .map_err(|error| failed(format!("the name of topic {topic:?}: {error:?}")))?;
        let attempt = || types.builder(&self.node, &name).open();
        let in_flux = |error: &PublishSubscribeOpenError| {
            matches!(
                error,
                PublishSubscribeOpenError::ServiceInCorruptedState
                    | PublishSubscribeOpenError::HangsInCreation
            )
        };
        let messages = patiently(attempt, in_flux).map_err(|error| match error {
            PublishSubscribeOpenError::DoesNotExist => self.absent(topic),
            PublishSubscribeOpenError::IncompatibleTypes => GuestError::WrongType {
                name: deployment(),
                topic: topic.to_owned(),
                expected: types.name(),
            },
            error => failed(format!("topic {topic:?}: {error:?}")),
        })?;
        let subscriber = messages.subscriber_builder().name(&onlooker()).create();
        let subscriber = subscriber.map_err(|error| match error {
            SubscriberCreateError::ExceedsMaxSupportedSubscribers => GuestError::Full {
                name: deployment(),
                most: MOST_GUESTS,
                guests: vec![format!("topic {topic:?} has no room for another receiver")],
            },
            error => failed(format!("topic {topic:?}: {error:?}")),
        })?;
        Ok(Reader::new(subscriber, types))
    }

    /// Returns the reason why a topic is missing: the deployment has another version of it, or has not created it yet.
    fn absent(&self, topic: &str) -> GuestError {
        let name = self.namespace.name();
        let (ours, all) = (parts_of(topic), self.topics());
        let theirs = all.iter().filter_map(|other| parts_of(other));
        let other = ours.and_then(|ours| {
            // A topic of the same version has been created since the check.
            let mut others = theirs
                .filter(|theirs| (theirs.0, theirs.2) == (ours.0, ours.2) && theirs.1 != ours.1);
            Some((ours, others.next()?))
        });
        match other {
            Some((ours, theirs)) => GuestError::Version {
                name: name.to_owned(),
                topic: ours.0.to_owned(),
                theirs: theirs.1.to_owned(),
                ours: ours.1.to_owned(),
            },
            None => GuestError::NoSuchTopic {
                name: name.to_owned(),
                topic: topic.to_owned(),
            },
        }
    }

    /// Returns the names of all topics; empty if they cannot be listed.
    fn topics(&self) -> Vec<String> {
        let mut topics = Vec::new();
        let Ok(config) = self.namespace.config() else {
            return topics;
        };
        let listed = Transport::list(&config, |service| {
            topics.push(service.static_details.name().to_string());
            CallbackProgression::Continue
        });
        if let Err(error) = listed {
            tracing::debug!(?error, "cannot list the topics of the deployment");
        }
        topics
    }
}

/// The receiving end of a topic.
#[derive(Debug)]
pub struct GuestPort<E: Message, H: Header> {
    topic: Arc<str>,
    reader: Reader<Transport>,
    types: PhantomData<(E, H)>,
}

impl<E: Message, H: Header> GuestPort<E, H> {
    /// Takes the oldest waiting message, if there is one. The message's memory is held until the message is dropped.
    ///
    /// # Errors
    ///
    /// Returns [`ReceiveError::TooManyHeld`] or [`ReceiveError::Transport`].
    pub fn receive(&self) -> Result<Option<Seen<E, H>>, ReceiveError> {
        let topic = || Arc::clone(&self.topic);
        match self.reader.receive() {
            Ok(received) => Ok(received.map(|received| Seen {
                received,
                types: PhantomData,
            })),
            Err(IoxReceiveError::ExceedsMaxBorrows) => {
                Err(ReceiveError::TooManyHeld { topic: topic() })
            }
            Err(source) => Err(ReceiveError::Transport {
                topic: topic(),
                source,
            }),
        }
    }
}

/// A message in shared memory. Its sender does not overwrite it while this value is held.
#[derive(Debug)]
pub struct Seen<E: Message, H: Header> {
    received: Received<Transport>,
    types: PhantomData<(E, H)>,
}

impl<E: Message, H: Header> Seen<E, H> {
    /// Returns the array, or an array of one message.
    pub fn payload(&self) -> &[E] {
        self.received.payload::<E, H>()
    }

    /// Returns the header. Check it against the array before use, because it comes from another process.
    pub fn header(&self) -> &H {
        self.received.header::<E, H>()
    }
}

/// Returns the names of this user's running deployments.
///
/// # Errors
///
/// Returns a [`LockError`] on failure.
pub fn running_deployments() -> Result<Vec<String>, LockError> {
    let all = deployments(&Namespace::usual_base())?.into_iter();
    let running = all.filter(|deployment| deployment.supervisor.is_some());
    Ok(running.map(|running| running.namespace.name().to_owned()).collect())
}

fn not_running(name: &str) -> GuestError {
    GuestError::NotRunning {
        name: name.to_owned(),
        running: running_deployments().unwrap_or_default(),
    }
}

/// Splits the name of a topic such as `frame/v1/0` into its subject, its version, and the view or process.
fn parts_of(topic: &str) -> Option<(&str, &str, &str)> {
    let (about, rest) = topic.split_once("/v")?;
    let (version, whose) = rest.split_once('/').unwrap_or((rest, ""));
    Some((about, version, whose))
}

/// Takes one of the limited places for guests. The place is a locked file, which the system unlocks when this process ends for any reason.
fn seat(namespace: &Namespace) -> Result<File, GuestError> {
    let name = || namespace.name().to_owned();
    let failed = |source| GuestError::Directory {
        name: name(),
        source,
    };
    let folder = namespace.root().join(SEATS);
    if let Err(error) = fs::create_dir(&folder)
        && error.kind() != io::ErrorKind::AlreadyExists
    {
        // The deployment may have ended in the meantime.
        let is_gone = error.kind() == io::ErrorKind::NotFound;
        return Err(if is_gone {
            not_running(namespace.name())
        } else {
            failed(error)
        });
    }
    let mut guests = Vec::new();
    for nth in 0..MOST_GUESTS {
        let path = folder.join(nth.to_string());
        let file = open_seat(&path).map_err(failed)?;
        match flock(&file, FlockOperation::NonBlockingLockExclusive) {
            Ok(()) => {
                let written = fs::write(&path, std::process::id().to_string());
                written.map_err(failed)?;
                return Ok(file);
            }
            Err(rustix::io::Errno::WOULDBLOCK) => {
                let pid = fs::read_to_string(&path).unwrap_or_default();
                guests.push(format!("process {pid}"));
            }
            Err(error) => return Err(failed(error.into())),
        }
    }
    Err(GuestError::Full {
        name: name(),
        most: MOST_GUESTS,
        guests,
    })
}

fn open_seat(path: &Path) -> io::Result<File> {
    let mut options = OpenOptions::new();
    let options = options.create(true).truncate(false).read(true).write(true);
    options.open(path)
}
