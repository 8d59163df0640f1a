//! The link between hosts: Zenoh with explicit addresses, over TLS with certificates on both sides.

use core::time::Duration;
use std::path::Path;

use serde_json::{Value, json};
use zenoh::Wait as _;
use zenoh::qos::{CongestionControl, Priority};

use crate::address::{Address, LinkError};
use crate::one_thread::has_one_thread;
use crate::topics::Topics;

/// Time without any message after which a link counts as broken.
const LEASE: Duration = Duration::from_secs(2);

/// An open link.
#[derive(Debug)]
pub(crate) struct Link(zenoh::Session);

impl Link {
    /// Opens the link. A host that connects does not wait for the other host: it keeps trying.
    pub(crate) fn open(address: &Address) -> Result<Self, LinkError> {
        let failed = |message: String| LinkError::Open {
            what: if address.listens {
                "listen at"
            } else {
                "connect to"
            },
            address: address.address.clone(),
            message,
        };
        if address.keys.is_some() && !has_one_thread() {
            tracing::warn!("the link has several threads: if a host dies, this process may crash");
        }
        let config = zenoh::Config::from_json5(&config(address).to_string());
        let config = config.map_err(|error| failed(error.to_string()))?;
        let session = zenoh::open(config).wait();
        Ok(Self(session.map_err(|error| failed(error.to_string()))?))
    }

    /// Sends a message, or drops it if there is no space. Messages that must not be lost are acknowledged.
    pub(crate) fn send(&self, key: &str, bytes: Vec<u8>, is_urgent: bool) {
        let priority = if is_urgent {
            Priority::RealTime
        } else {
            Priority::Data
        };
        let put = self.0.put(key, bytes);
        let put = put.congestion_control(CongestionControl::Drop).priority(priority).express(true);
        if let Err(error) = put.wait() {
            tracing::debug!(%error, key, "a message cannot be sent");
        }
    }

    /// Calls `on` with every message under a name, until the link is closed.
    pub(crate) fn subscribe(
        &self,
        key: &str,
        on: impl Fn(&str, &[u8]) + Send + Sync + 'static,
    ) -> Result<(), LinkError> {
        let declared = self.0.declare_subscriber(key).callback(move |sample| {
            on(sample.key_expr().as_str(), &sample.payload().to_bytes());
        });
        let declared = declared.background().wait();
        declared.map_err(|error| LinkError::Use {
            key: key.to_owned(),
            message: error.to_string(),
        })
    }

    /// Answers requests under a name.
    pub(crate) fn answer(
        &self,
        key: &str,
        on: impl Fn() -> Vec<u8> + Send + Sync + 'static,
    ) -> Result<(), LinkError> {
        let own = key.to_owned();
        let declared = self.0.declare_queryable(key).callback(move |query| {
            if let Err(error) = query.reply(own.as_str(), on()).wait() {
                tracing::debug!(%error, "a query cannot be answered");
            }
        });
        let declared = declared.background().wait();
        declared.map_err(|error| LinkError::Use {
            key: key.to_owned(),
            message: error.to_string(),
        })
    }

    /// Sends a request under a name, and returns the first answer within a time limit.
    pub(crate) fn ask(&self, key: &str, limit: Duration) -> Option<Vec<u8>> {
        let answers = self.0.get(key).timeout(limit).wait().ok()?;
        let answer = answers.recv_timeout(limit).ok().flatten()?;
        let sample = answer.into_result().ok()?;
        Some(sample.payload().to_bytes().into_owned())
    }

    /// Closes the link.
    pub(crate) fn close(self) {
        if let Err(error) = self.0.close().wait() {
            tracing::debug!(%error, "the link cannot be closed");
        }
    }
}

/// Returns the settings of Zenoh. No host searches the network for other hosts or announces itself, and only the fusing host
/// listens.
fn config(address: &Address) -> Value {
    let text = |path: &Path| Value::from(path.display().to_string());
    let protocol = if address.keys.is_some() { "tls" } else { "tcp" };
    let at = format!("{protocol}/{}", address.address);
    let [listen, connect] = if address.listens {
        [vec![at], vec![]]
    } else {
        [vec![], vec![at]]
    };
    let tls = address.keys.as_ref().map(|keys| {
        json!({
            "root_ca_certificate": text(&keys.authority),
            "listen_certificate": text(&keys.certificate),
            "listen_private_key": text(&keys.key),
            "connect_certificate": text(&keys.certificate),
            "connect_private_key": text(&keys.key),
            "enable_mtls": true,
            "verify_name_on_connect": true,
        })
    });
    let mut link = json!({ "tx": { "lease": LEASE.as_millis() as u64, "keep_alive": 4 } });
    if let Some(tls) = tls {
        link["protocols"] = json!(["tls"]);
        link["tls"] = tls;
    } else {
        link["protocols"] = json!(["tcp"]);
    }
    let mut config = json!({
        "mode": "peer",
        "listen": { "endpoints": listen },
        "connect": {
            "endpoints": connect,
            "timeout_ms": -1,
            "exit_on_failure": false,
            "retry": { "period_init_ms": 200, "period_max_ms": 1000, "period_increase_factor": 1.5 },
        },
        "scouting": { "multicast": { "enabled": false }, "gossip": { "enabled": false } },
        "transport": { "link": link },
    });
    if address.listens && address.keys.is_some() {
        config["access_control"] = access(address);
    }
    config
}

/// Returns the access rules of the fusing host. Every host may only send its own messages, according to the common name of its
/// certificate. With the keys of one host, nobody can send messages for another host.
fn access(address: &Address) -> Value {
    let topics = Topics::of(&address.deployment);
    let everything = [
        "put",
        "delete",
        "declare_subscriber",
        "query",
        "declare_queryable",
        "reply",
        "liveliness_token",
        "declare_liveliness_subscriber",
        "liveliness_query",
    ];
    let mut rules = vec![json!({
        "id": "out",
        "permission": "allow",
        "flows": ["egress"],
        "messages": everything,
        "key_exprs": ["**"],
    })];
    let mut subjects = vec![json!({ "id": "anybody" })];
    let mut policies = vec![json!({ "rules": ["out"], "subjects": ["anybody"] })];
    for host in &address.hosts {
        let said = format!("said by {host}");
        let heard = format!("heard by {host}");
        rules.push(json!({
            "id": said,
            "permission": "allow",
            "flows": ["ingress"],
            "messages": ["put"],
            "key_exprs": [topics.data(host), topics.up(host), topics.hello(host)],
        }));
        rules.push(json!({
            "id": heard,
            "permission": "allow",
            "flows": ["ingress"],
            "messages": ["declare_subscriber", "query"],
            "key_exprs": [topics.down(host), topics.answer(host), topics.status()],
        }));
        subjects.push(json!({ "id": host, "cert_common_names": [host] }));
        policies.push(json!({ "rules": [said, heard], "subjects": [host] }));
    }
    json!({
        "enabled": true,
        "default_permission": "deny",
        "rules": rules,
        "subjects": subjects,
        "policies": policies,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::keys::KeyFiles;

    fn address(listens: bool, keys: bool) -> Address {
        let file = |name: &str| format!("/k/{name}").into();
        Address {
            deployment: "a".to_owned(),
            host: "desk".to_owned(),
            hosts: vec!["desk".to_owned(), "rack".to_owned()],
            address: "10.0.0.1:7447".to_owned(),
            listens,
            keys: keys.then(|| KeyFiles {
                authority: file("ca.pem"),
                certificate: file("desk.pem"),
                key: file("desk.key"),
            }),
        }
    }

    #[test]
    fn only_the_fusing_host_listens_and_with_keys_it_accepts_tls_only() {
        for listens in [true, false] {
            for keys in [true, false] {
                let text = config(&address(listens, keys));
                let at = format!("{}/10.0.0.1:7447", if keys { "tls" } else { "tcp" });
                let expected = if listens {
                    [json!([at]), json!([])]
                } else {
                    [json!([]), json!([at])]
                };
                let got = ["listen", "connect"].map(|name| text[name]["endpoints"].clone());
                assert_eq!(got, expected);
                let tls = &text["transport"]["link"]["tls"];
                assert_eq!(tls["enable_mtls"].as_bool(), keys.then_some(true));
                zenoh::Config::from_json5(&text.to_string()).unwrap();
                let is_checked = !text["access_control"].is_null();
                assert_eq!(is_checked, listens && keys, "who speaks for whom");
            }
        }
    }

    /// Returns a free port of this machine.
    fn port() -> u16 {
        let listener = std::net::TcpListener::bind(("127.0.0.1", 0)).unwrap();
        listener.local_addr().unwrap().port()
    }

    #[test]
    fn a_host_may_only_send_and_receive_its_own_topics() {
        let folder = tempfile::tempdir().unwrap();
        let names = ["desk", "rack", "shelf"];
        let of_desk = vec!["127.0.0.1".to_owned()];
        let made: Vec<(String, Vec<String>)> =
            names.iter().map(|name| ((*name).to_owned(), of_desk.clone())).collect();
        crate::keys::make_keys(folder.path(), &made).unwrap();
        let at = format!("127.0.0.1:{}", port());
        // Opens a link for the host `who` with the certificate of `keys`.
        let open = |who: &str, keys: &str| {
            let address = Address {
                deployment: "a".to_owned(),
                host: who.to_owned(),
                hosts: names.map(str::to_owned).to_vec(),
                address: at.clone(),
                listens: who == "desk",
                keys: Some(KeyFiles::find(folder.path(), keys).unwrap()),
            };
            Link::open(&address).unwrap()
        };
        let topics = Topics::of("a");
        let desk = open("desk", "desk");
        let (heard, arrived) = crossbeam::channel::unbounded();
        let on_data = move |key: &str, _: &[u8]| heard.send(key.to_owned()).unwrap();
        desk.subscribe(&topics.data("*"), on_data).unwrap();
        desk.answer(&topics.status(), || b"well".to_vec()).unwrap();
        let rack = open("rack", "rack");
        let (told, orders) = crossbeam::channel::unbounded();
        for host in ["shelf", "rack"] {
            let told = told.clone();
            let on = move |key: &str, _: &[u8]| told.send(key.to_owned()).unwrap();
            rack.subscribe(&topics.down(host), on).unwrap();
        }
        // The first messages of a host arrive after a short delay. Messages sent in another host's name never arrive.
        let limit = Duration::from_secs(20);
        let began = std::time::Instant::now();
        while arrived.is_empty() || orders.is_empty() {
            assert!(began.elapsed() < limit, "heard by the other side");
            for host in ["shelf", "rack"] {
                rack.send(&topics.data(host), vec![1], true);
                desk.send(&topics.down(host), vec![1], true);
            }
            std::thread::sleep(Duration::from_millis(50));
        }
        assert_eq!(rack.ask(&topics.status(), limit), Some(b"well".to_vec()));
        rack.close();
        desk.close();
        let said: Vec<String> = arrived.try_iter().collect();
        assert!(
            said.iter().all(|topic| *topic == topics.data("rack")),
            "{said:?}"
        );
        let heard: Vec<String> = orders.try_iter().collect();
        assert!(
            heard.iter().all(|topic| *topic == topics.down("rack")),
            "{heard:?}"
        );
    }
}
