//! The command line arguments that a supervisor passes to its processes.

use std::ffi::OsString;
use std::path::PathBuf;

use tracing::Level;

use crate::{Delivery, Namespace, NamespaceError, Scheduling};
use failure::{ExitKind, Fault};

/// Reason why the arguments of a service do not come from a supervisor.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum LaunchError {
    /// A required flag is missing.
    #[error("service needs {flag}; services are started by `parallax run`")]
    Missing {
        /// Name of the flag.
        flag: &'static str,
    },
    /// The value of a flag is malformed.
    #[error("{flag} {value:?} is not {expected}")]
    Value {
        /// Name of the flag.
        flag: &'static str,
        /// The given value.
        value: String,
        /// The expected kind of value.
        expected: &'static str,
    },
    /// The namespace is not valid.
    #[error(transparent)]
    Namespace(#[from] NamespaceError),
}

impl Fault for LaunchError {
    fn kind(&self) -> ExitKind {
        ExitKind::Usage
    }
}

/// Data about a deployment that each of its processes needs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Launch {
    /// Location of the deployment's shared memory.
    pub namespace: Namespace,
    /// Unique name of the process in the deployment, for example `pose-2`.
    pub process: String,
    /// Session of the run, which goes into the stamp of every message.
    pub session: u64,
    /// Number of restarts of the process, which goes into the stamp of every message.
    pub epoch: u32,
    /// Behaviour if a receiver is slower than its sender.
    pub delivery: Delivery,
    /// Process id of the supervisor. This process ends when the supervisor ends.
    pub supervisor: Option<u32>,
    /// The least severe events that are logged.
    pub log: Level,
    /// Settings that the process requests from the system's scheduler.
    pub scheduling: Scheduling,
}

const DEPLOYMENT: &str = "--deployment";
const BASE: &str = "--base";
const PROCESS: &str = "--process";
const SESSION: &str = "--session";
const EPOCH: &str = "--epoch";
const DELIVERY: &str = "--delivery";
const SUPERVISOR: &str = "--supervisor";
const LOG: &str = "--log";
const SCHEDULING: &str = "--scheduling";
const FLAGS: [&str; 9] = [
    DEPLOYMENT, BASE, PROCESS, SESSION, EPOCH, DELIVERY, SUPERVISOR, LOG, SCHEDULING,
];

impl Launch {
    /// Returns the arguments that [`from_args`](Self::from_args) parses.
    pub fn to_args(&self) -> Vec<OsString> {
        let delivery = match self.delivery {
            Delivery::Realtime => "realtime",
            Delivery::Lossless => "lossless",
        };
        let mut args: Vec<OsString> = vec![
            DEPLOYMENT.into(),
            self.namespace.name().into(),
            BASE.into(),
            self.namespace.base().into(),
            PROCESS.into(),
            self.process.clone().into(),
            SESSION.into(),
            self.session.to_string().into(),
            EPOCH.into(),
            self.epoch.to_string().into(),
            DELIVERY.into(),
            delivery.into(),
            LOG.into(),
            self.log.as_str().to_ascii_lowercase().into(),
        ];
        if let Some(pid) = self.supervisor {
            args.extend([SUPERVISOR.into(), pid.to_string().into()]);
        }
        if self.scheduling != Scheduling::default() {
            args.extend([SCHEDULING.into(), self.scheduling.to_string().into()]);
        }
        args
    }

    /// Takes the launch arguments out of a command line, and returns the remaining arguments in order.
    ///
    /// # Errors
    ///
    /// Returns a [`LaunchError`] on failure.
    pub fn from_args(
        args: impl IntoIterator<Item = OsString>,
    ) -> Result<(Self, Vec<OsString>), LaunchError> {
        let mut own: Vec<(&str, OsString)> = Vec::new();
        let mut rest = Vec::new();
        let mut args = args.into_iter();
        while let Some(arg) = args.next() {
            match FLAGS.into_iter().find(|flag| arg == **flag) {
                Some(flag) => {
                    let value = args.next().ok_or(LaunchError::Missing { flag })?;
                    own.push((flag, value));
                }
                None => rest.push(arg),
            }
        }
        let base = Given(&own).path(BASE)?;
        let given = Given(&own);
        let launch = Self {
            namespace: Namespace::below(&given.text(DEPLOYMENT)?, &base)?,
            process: given.text(PROCESS)?,
            session: given.parsed(SESSION, "a number")?,
            epoch: given.parsed(EPOCH, "a number")?,
            delivery: given.delivery()?,
            supervisor: match given.find(SUPERVISOR) {
                Some(_) => Some(given.parsed(SUPERVISOR, "a process id")?),
                None => None,
            },
            log: given.parsed(LOG, "error, warn, info, debug or trace")?,
            scheduling: match given.find(SCHEDULING) {
                Some(_) => given.parsed(
                    SCHEDULING,
                    "cores=0,1 fifo=1 round-robin=1 lock-memory spin",
                )?,
                None => Scheduling::default(),
            },
        };
        Ok((launch, rest))
    }
}

struct Given<'a>(&'a [(&'static str, OsString)]);

impl Given<'_> {
    fn find(&self, flag: &str) -> Option<&OsString> {
        self.0.iter().rev().find(|(name, _)| *name == flag).map(|(_, value)| value)
    }

    fn path(&self, flag: &'static str) -> Result<PathBuf, LaunchError> {
        let value = self.find(flag).ok_or(LaunchError::Missing { flag })?;
        Ok(PathBuf::from(value))
    }

    fn text(&self, flag: &'static str) -> Result<String, LaunchError> {
        let value = self.find(flag).ok_or(LaunchError::Missing { flag })?;
        Ok(value.to_string_lossy().into_owned())
    }

    fn parsed<T: core::str::FromStr>(
        &self,
        flag: &'static str,
        expected: &'static str,
    ) -> Result<T, LaunchError> {
        let value = self.text(flag)?;
        match value.parse() {
            Ok(parsed) => Ok(parsed),
            Err(_) => Err(LaunchError::Value {
                flag,
                value,
                expected,
            }),
        }
    }

    fn delivery(&self) -> Result<Delivery, LaunchError> {
        match self.text(DELIVERY)?.as_str() {
            "realtime" => Ok(Delivery::Realtime),
            "lossless" => Ok(Delivery::Lossless),
            other => Err(LaunchError::Value {
                flag: DELIVERY,
                value: other.to_owned(),
                expected: "realtime or lossless",
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::ffi::OsString;
    use std::path::Path;

    use tracing::Level;

    use super::{Launch, LaunchError};
    use crate::{Delivery, Namespace};

    fn launch() -> Launch {
        Launch {
            namespace: Namespace::below("walk", Path::new("/tmp/x")).unwrap(),
            process: "pose-2".to_owned(),
            session: u64::MAX,
            epoch: 3,
            delivery: Delivery::Lossless,
            supervisor: Some(4711),
            log: Level::DEBUG,
            scheduling: "cores=0,2 fifo=7 spin".parse().unwrap(),
        }
    }

    #[test]
    fn arguments_survive_a_round_trip() {
        let (read, rest) = Launch::from_args(launch().to_args()).unwrap();
        assert_eq!(read, launch());
        assert_eq!(rest, Vec::<OsString>::new());
    }

    #[test]
    fn other_arguments_are_returned_in_order() {
        let mut args: Vec<OsString> = vec!["--view".into(), "2".into()];
        args.extend(launch().to_args());
        args.push("--last".into());
        let (_, rest) = Launch::from_args(args).unwrap();
        assert_eq!(rest, ["--view", "2", "--last"].map(OsString::from));
    }

    #[test]
    fn a_missing_flag_is_named() {
        let args = launch().to_args().split_off(2);
        let error = Launch::from_args(args).unwrap_err();
        assert_eq!(
            error,
            LaunchError::Missing {
                flag: "--deployment"
            }
        );
    }

    #[test]
    fn an_invalid_value_is_named() {
        let mut args = launch().to_args();
        args.extend(["--epoch".into(), "often".into()]);
        let error = Launch::from_args(args).unwrap_err();
        assert_eq!(error.to_string(), "--epoch \"often\" is not a number");
    }
}
