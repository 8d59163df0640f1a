//! Compares the files and settings of two hosts in a deployment.

use formats::checksum::fnv1a;
use serde::{Deserialize, Serialize};

/// Hashes of the files and settings that must be the same on all hosts, by name. The hashes detect mistakes; protection against attacks is
/// the task of the keys.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Fingerprint(Vec<(String, String)>);

/// A file or setting that differs between two hosts.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
#[error("{what} differs: {here} on this host, {there} on the other host")]
pub struct Difference {
    /// Name of the file or setting, such as `rig` or `model`.
    pub what: String,
    /// Hash on the host that makes the comparison.
    pub here: String,
    /// Hash on the other host.
    pub there: String,
}

impl Fingerprint {
    /// Adds the hash of a file or text.
    pub fn add(&mut self, what: &str, bytes: &[u8]) {
        let hash = format!("{:016x}", fnv1a(bytes));
        self.0.push((what.to_owned(), hash));
    }

    /// Adds a short text without hashing it, such as a version.
    pub fn add_text(&mut self, what: &str, text: &str) {
        self.0.push((what.to_owned(), text.to_owned()));
    }

    /// Returns the entries that differ, in the order of this fingerprint. Entries that only the other fingerprint has come last.
    pub fn differences(&self, other: &Self) -> Vec<Difference> {
        let find = |all: &Self, what: &str| {
            let found = all.0.iter().find(|entry| entry.0 == what);
            found.map_or_else(|| "nothing".to_owned(), |entry| entry.1.clone())
        };
        let only_there = other.0.iter().filter(|entry| !self.0.iter().any(|own| own.0 == entry.0));
        let all = self.0.iter().chain(only_there);
        let compared = all.map(|(what, _)| Difference {
            what: what.clone(),
            here: find(self, what),
            there: find(other, what),
        });
        compared.filter(|compared| compared.here != compared.there).collect()
    }

    /// Returns the number of entries.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Returns true if there are no entries.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_error_for_different_files_names_both_hashes() {
        let [mut here, mut there] = [Fingerprint::default(), Fingerprint::default()];
        for it in [&mut here, &mut there] {
            it.add("model", b"model");
        }
        assert!(here.differences(&there).is_empty());
        here.add("rig", b"a");
        there.add("rig", b"b");
        there.add_text("network", "shipped");
        let got: Vec<String> = here.differences(&there).iter().map(ToString::to_string).collect();
        assert_eq!(
            got,
            [
                "rig differs: af63dc4c8601ec8c on this host, af63df4c8601f1a5 on the other host",
                "network differs: nothing on this host, shipped on the other host"
            ]
        );
    }
}
