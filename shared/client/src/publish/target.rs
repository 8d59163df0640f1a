//! Targets of datagrams, as the user writes them.

use core::net::{IpAddr, Ipv4Addr, SocketAddr};

/// Content of a datagram.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// One line of JSON.
    Json,
    /// A bundle of Open Sound Control 1.0.
    Osc,
}

/// Receiver of datagrams, and their format.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Target {
    /// Address of the receiver.
    pub address: SocketAddr,
    /// Format of the datagrams.
    pub form: Form,
}

/// A target that cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum TargetError {
    /// The text is not a target.
    #[error(
        "{text:?} is not a target: {why}; expected udp://127.0.0.1:9000, udp://127.0.0.1:9000?format=osc or osc://127.0.0.1:9000"
    )]
    Malformed {
        /// Text as it was written.
        text: String,
        /// Reason why it is malformed.
        why: &'static str,
    },
    /// The target is another machine.
    #[error(
        "{address} is not this machine: skeletons of people would leave this machine unencrypted"
    )]
    Beyond {
        /// Address of the receiver.
        address: SocketAddr,
    },
}

impl Target {
    /// Parses a target: `udp://HOST:PORT`, with `?format=json` or `?format=osc`, or `osc://HOST:PORT`. A host is an IP address or
    /// `localhost`: other names are not looked up.
    ///
    /// # Errors
    ///
    /// Returns [`TargetError::Malformed`] if the text is not a target.
    pub fn parse(text: &str) -> Result<Self, TargetError> {
        let wrong = |why| TargetError::Malformed {
            text: text.to_owned(),
            why,
        };
        let (scheme, rest) = text.split_once("://").ok_or_else(|| wrong("no `udp://`"))?;
        let (place, query) = rest.split_once('?').unwrap_or((rest, ""));
        let form = match (scheme, query) {
            ("udp", "" | "format=json") => Form::Json,
            ("udp", "format=osc") | ("osc", "") => Form::Osc,
            ("udp" | "osc", _) => return Err(wrong("its format is unknown")),
            _ => return Err(wrong("it begins with neither udp:// nor osc://")),
        };
        let place = place.strip_suffix('/').unwrap_or(place);
        let address = match place.strip_prefix("localhost:") {
            Some(port) => {
                let port = port.parse().ok();
                port.map(|port| SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), port))
            }
            None => place.parse().ok(),
        };
        let address = address.ok_or_else(|| wrong("it has no address and port"))?;
        if address.port() == 0 {
            return Err(wrong("port 0"));
        }
        Ok(Self { address, form })
    }

    /// Checks that the target is this machine.
    ///
    /// # Errors
    ///
    /// Returns [`TargetError::Beyond`] if it is another machine.
    pub fn stays_here(&self) -> Result<(), TargetError> {
        let address = self.address;
        if address.ip().is_loopback() {
            Ok(())
        } else {
            Err(TargetError::Beyond { address })
        }
    }
}

impl core::fmt::Display for Target {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let form = match self.form {
            Form::Json => "JSON lines",
            Form::Osc => "OSC",
        };
        write!(f, "{} ({form})", self.address)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn targets_are_parsed() {
        let of =
            |text: &str| Target::parse(text).map(|value| (value.address.to_string(), value.form));
        let loopback = |form| Ok(("127.0.0.1:9000".to_owned(), form));
        assert_eq!(of("udp://127.0.0.1:9000"), loopback(Form::Json));
        assert_eq!(
            of("udp://localhost:9000/?format=json"),
            loopback(Form::Json)
        );
        assert_eq!(of("udp://127.0.0.1:9000?format=osc"), loopback(Form::Osc));
        assert_eq!(of("osc://localhost:9000"), loopback(Form::Osc));
        assert_eq!(of("osc://[::1]:7"), Ok(("[::1]:7".to_owned(), Form::Osc)));
        for wrong in [
            "",
            "127.0.0.1:9000",
            "tcp://127.0.0.1:9000",
            "udp://127.0.0.1",
            "udp://:9000",
            "udp://a.b:9000",
            "udp://127.0.0.1:0",
            "udp://127.0.0.1:70000",
            "udp://127.0.0.1:9000?format=xml",
            "osc://127.0.0.1:9000?a",
        ] {
            let error = Target::parse(wrong).unwrap_err().to_string();
            assert!(error.contains("udp://127.0.0.1:9000"), "{wrong}: {error}");
        }
    }

    #[test]
    fn targets_on_other_machines_are_distinguished() {
        let of = |text: &str| Target::parse(text).unwrap().stays_here();
        assert_eq!(of("udp://127.0.0.2:9000"), Ok(()));
        assert_eq!(of("udp://[::1]:9000"), Ok(()));
        for text in [
            "udp://10.0.0.1:9000",
            "udp://0.0.0.0:9000",
            "udp://255.255.255.255:9",
            "osc://[fe80::1]:9",
        ] {
            assert!(
                matches!(of(text), Err(TargetError::Beyond { .. })),
                "{text}"
            );
        }
    }

    proptest! {
        #[test]
        fn any_text_is_parsed_as_a_target_or_refused(text in "\\PC{0,40}") {
            drop(Target::parse(&text));
            drop(Target::parse(&format!("udp://{text}")));
        }
    }
}
