//! The introduction of a host with cameras, and the answer of the fusing host. Both are sent as JSON, because they are short and
//! infrequent.

use serde::{Deserialize, Serialize};

use crate::hosts::VERSION;
use crate::hosts::fingerprint::{Difference, Fingerprint};

/// Maximum length of an introduction or answer, in bytes.
const MOST_BYTES: usize = 1 << 16;

/// Introduction of a host that wants to join a run.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Hello {
    /// [`crate::hosts::VERSION`] of the host.
    pub version: u16,
    /// Name of the host.
    pub host: String,
    /// Start time of the host's bridge.
    pub origin: u64,
    /// Fingerprint of the host's files and settings.
    pub fingerprint: Fingerprint,
}

/// The answer to a [`Hello`].
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Answer {
    /// The host may join the run.
    Welcome(Welcome),
    /// The host may not join, for these reasons. In each difference, `here` is the fusing host.
    Refused(Vec<Difference>),
}

/// Facts about the run that a host with cameras needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Welcome {
    /// Start time of the bridge of the fusing host.
    pub origin: u64,
    /// Session of the run: the time from which its frame times are counted, by the clock of the fusing host, in nanoseconds.
    pub session: u64,
}

/// Error for bytes that are not an introduction or answer.
#[derive(Debug, thiserror::Error)]
pub enum HelloError {
    /// There are too many bytes.
    #[error("the message has {0} bytes, but at most {MOST_BYTES} are allowed")]
    Long(usize),
    /// The content is not an introduction or answer.
    #[error("the message is not a valid introduction or answer")]
    Json(#[from] serde_json::Error),
}

impl Hello {
    /// Returns the introduction as bytes.
    pub fn to_bytes(&self) -> Vec<u8> {
        serde_json::to_vec(self).unwrap_or_default()
    }

    /// Parses an introduction.
    ///
    /// # Errors
    ///
    /// Fails with [`HelloError`] if the bytes are not an introduction.
    pub fn parse(bytes: &[u8]) -> Result<Self, HelloError> {
        Ok(serde_json::from_slice(short(bytes)?)?)
    }

    /// Returns the answer to this introduction.
    ///
    /// * `is_known`: true if the deployment has a host of this name with cameras.
    /// * `ours`: fingerprint of the fusing host.
    pub fn answer(&self, is_known: bool, ours: &Fingerprint, welcome: Welcome) -> Answer {
        let mut differences = Vec::new();
        if self.version != VERSION {
            differences.push(Difference {
                what: "the version of the link".to_owned(),
                here: VERSION.to_string(),
                there: self.version.to_string(),
            });
        }
        if !is_known {
            differences.push(Difference {
                what: "the list of hosts with cameras".to_owned(),
                here: format!("without {:?}", self.host),
                there: format!("with {:?}", self.host),
            });
        }
        differences.extend(ours.differences(&self.fingerprint));
        if differences.is_empty() {
            Answer::Welcome(welcome)
        } else {
            Answer::Refused(differences)
        }
    }
}

impl Answer {
    /// Returns the answer as bytes.
    pub fn to_bytes(&self) -> Vec<u8> {
        serde_json::to_vec(self).unwrap_or_default()
    }

    /// Parses an answer.
    ///
    /// # Errors
    ///
    /// Fails with [`HelloError`] if the bytes are not an answer.
    pub fn parse(bytes: &[u8]) -> Result<Self, HelloError> {
        Ok(serde_json::from_slice(short(bytes)?)?)
    }
}

fn short(bytes: &[u8]) -> Result<&[u8], HelloError> {
    if bytes.len() > MOST_BYTES {
        return Err(HelloError::Long(bytes.len()));
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hello(model: &[u8]) -> Hello {
        let mut fingerprint = Fingerprint::default();
        fingerprint.add("model", model);
        Hello {
            version: VERSION,
            host: "far".to_owned(),
            origin: 5,
            fingerprint,
        }
    }

    const WELCOME: Welcome = Welcome {
        origin: 1,
        session: 2,
    };

    #[test]
    fn equal_files_are_accepted_and_different_files_are_refused_with_both_hashes() {
        let ours = hello(b"a").fingerprint;
        let read = |answer: &Answer| Answer::parse(&answer.to_bytes()).unwrap();
        let same = Hello::parse(&hello(b"a").to_bytes()).unwrap();
        let answer = same.answer(true, &ours, WELCOME);
        assert_eq!(read(&answer), Answer::Welcome(WELCOME));
        let Answer::Refused(why) = read(&hello(b"b").answer(true, &ours, WELCOME)) else {
            panic!("welcome");
        };
        assert_eq!(why[0].what, "model");
        assert_ne!(why[0].here, why[0].there);
    }

    #[test]
    fn an_unknown_host_and_another_version_are_refused() {
        let ours = hello(b"a").fingerprint;
        let Answer::Refused(why) = hello(b"a").answer(false, &ours, WELCOME) else {
            panic!("welcome");
        };
        assert!(why[0].to_string().contains("far"));
        let mut other = hello(b"a");
        other.version = 9;
        assert!(matches!(
            other.answer(true, &ours, WELCOME),
            Answer::Refused(_)
        ));
    }

    #[test]
    fn bytes_that_are_not_an_introduction_are_refused() {
        let long = vec![b' '; 70_000];
        for bytes in [&b""[..], b"{}", b"[1", b"\xff\xfe", &long] {
            assert!(Hello::parse(bytes).is_err() && Answer::parse(bytes).is_err());
        }
    }
}
