//! Collects the contents of a recording during a scan, by channel number.

use std::collections::BTreeMap;

use crate::chunk::MessageHead;
use crate::{About, AboutError, Count, Damage, Entry, Extent, Kind, Recording, Track};
use crate::{about, count, message};

/// Maximum number of damaged positions that are kept.
const MOST_DAMAGE: usize = 1000;

#[derive(Debug)]
pub(crate) struct Contents {
    about: Result<About, AboutError>,
    counts: BTreeMap<String, Count>,
    pub(crate) extent: Extent,
    /// Names of the topics; `None` for a topic that this program does not know.
    pub(crate) channels: BTreeMap<u16, Option<String>>,
    messages: BTreeMap<u16, Vec<Entry>>,
    /// Numbers of expected and of found messages of a channel.
    numbers: BTreeMap<u16, [u64; 2]>,
}

impl Contents {
    pub(crate) fn new(file_bytes: u64) -> Self {
        Self {
            about: Err(AboutError::Missing("settings")),
            counts: BTreeMap::new(),
            extent: Extent {
                file_bytes,
                whole_bytes: 0,
                is_complete: false,
                damage: Vec::new(),
                n_malformed: 0,
                missing: BTreeMap::new(),
            },
            channels: BTreeMap::new(),
            messages: BTreeMap::new(),
            numbers: BTreeMap::new(),
        }
    }

    pub(crate) fn damaged(&mut self, offset: u64, what: &'static str) {
        if self.extent.damage.len() < MOST_DAMAGE {
            self.extent.damage.push(Damage { offset, what });
        }
    }

    /// Adds a message to the contents.
    pub(crate) fn message(&mut self, message: &MessageHead) {
        let [due, n] = self.numbers.entry(message.channel).or_default();
        *due = (*due).max(message.nth.saturating_add(1));
        *n += 1;
        let entries = self.messages.entry(message.channel).or_default();
        entries.push(message.entry);
    }

    pub(crate) fn metadata(&mut self, name: &str, map: BTreeMap<String, String>) {
        match name {
            about::NAME if self.about.is_err() => self.about = About::from_map(&map),
            about::TOPICS => {
                let named = map.into_iter();
                let named =
                    named.filter_map(|(channel, name)| Some((channel.parse().ok()?, Some(name))));
                self.channels.extend(named);
            }
            count::NAME => {
                let counts = map.into_iter();
                let counts = counts.filter_map(|(topic, it)| Some((topic, it.parse().ok()?)));
                self.counts = counts.collect();
            }
            _ => {}
        }
    }

    /// Assigns the messages to their topics.
    pub(crate) fn finish(mut self) -> Recording {
        let mut tracks = BTreeMap::new();
        for (channel, name) in &self.channels {
            let name = name.as_ref();
            let Some((name, kind)) = name.and_then(|name| Some((name, Kind::of_topic(name)?)))
            else {
                continue;
            };
            let mut entries = self.messages.remove(channel).unwrap_or_default();
            let n = entries.len();
            entries.retain(|entry| message::check_length(kind, entry.len).is_ok());
            self.extent.n_malformed += (n - entries.len()) as u64;
            if kind.status_at().is_none() {
                for entry in &mut entries {
                    entry.frame = None;
                }
            }
            let track = tracks.entry(name.clone()).or_insert(Track {
                kind,
                entries: Vec::new(),
            });
            track.entries.extend(entries);
            let [due, n_found] = self.numbers.remove(channel).unwrap_or_default();
            let recorded = self.counts.get(name).map_or(0, |count| count.recorded);
            let missing = due.max(recorded).saturating_sub(n_found);
            if missing > 0 {
                *self.extent.missing.entry(name.clone()).or_default() += missing;
            }
        }
        for channel in self.messages.keys() {
            if !self.channels.contains_key(channel) {
                let n = self.messages[channel].len() as u64;
                let name = format!("channel {channel} (its name is not known)");
                self.extent.missing.insert(name, n);
            }
        }
        Recording {
            about: self.about,
            tracks,
            counts: self.counts,
            extent: self.extent,
        }
    }
}
