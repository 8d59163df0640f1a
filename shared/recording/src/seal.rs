//! Metadata with a checksum.

use std::collections::BTreeMap;

use crate::mcap::Body;

/// The key of the checksum in the map.
pub(crate) const KEY: &str = "checksum";

fn checksum(name: &str, map: &BTreeMap<String, String>) -> String {
    let body = Body::default().bytes(name.as_bytes()).map(map);
    format!("{:08x}", crc32fast::hash(body.fields()))
}

/// A map with its checksum.
pub(crate) fn seal(name: &str, mut map: BTreeMap<String, String>) -> BTreeMap<String, String> {
    let checksum = checksum(name, &map);
    map.insert(KEY.to_owned(), checksum);
    map
}

/// The map without its checksum; none if it is damaged.
pub(crate) fn unseal(
    name: &str,
    mut map: BTreeMap<String, String>,
) -> Option<BTreeMap<String, String>> {
    let expected = map.remove(KEY)?;
    (expected == checksum(name, &map)).then_some(map)
}
