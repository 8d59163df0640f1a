//! Adds a checksum to metadata, because MCAP has checksums only for chunks.

use std::collections::BTreeMap;

/// Key of the checksum in the map.
const KEY: &str = "checksum";

fn checksum(name: &str, map: &BTreeMap<String, String>) -> String {
    let mut hasher = crc32fast::Hasher::new();
    let entries = map.iter().flat_map(|(key, value)| [key, value]);
    for text in std::iter::once(name).chain(entries.map(String::as_str)) {
        hasher.update(&(text.len() as u64).to_le_bytes());
        hasher.update(text.as_bytes());
    }
    format!("{:08x}", hasher.finalize())
}

/// Returns the map with its checksum.
pub(crate) fn seal(name: &str, mut map: BTreeMap<String, String>) -> BTreeMap<String, String> {
    let checksum = checksum(name, &map);
    map.insert(KEY.to_owned(), checksum);
    map
}

/// Returns the map without its checksum; `None` if it is damaged.
pub(crate) fn unseal(
    name: &str,
    mut map: BTreeMap<String, String>,
) -> Option<BTreeMap<String, String>> {
    let expected = map.remove(KEY)?;
    (expected == checksum(name, &map)).then_some(map)
}
