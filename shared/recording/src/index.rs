//! The contents of a recording and their positions.

use std::collections::BTreeMap;

use crate::{About, AboutError, Count, Kind};

/// Position and times of a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Entry {
    /// Time at which the message was received, in nanoseconds, `CLOCK_MONOTONIC` of the recording machine.
    pub log_time: u64,
    /// Time at which the message was sent, by the same clock.
    pub publish_time: u64,
    /// Offset of the message's data, in bytes from the start of the file.
    pub offset: u64,
    /// Length of the data, in bytes.
    pub len: u64,
    /// Frame of the message. `None` for heartbeats, and for messages whose topic was not known when they were scanned.
    pub frame: Option<u64>,
    /// Offset of the message's chunk, in bytes from the start of the file.
    pub chunk: u64,
}

/// Messages of one topic.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Track {
    /// Type of the messages.
    pub kind: Kind,
    /// Messages of the topic, in the order of the file.
    pub entries: Vec<Entry>,
}

/// Part of a file that could be read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Extent {
    /// Size of the file, in bytes.
    pub file_bytes: u64,
    /// Offset of the end of the last complete record, in bytes.
    pub whole_bytes: u64,
    /// True if the file is complete.
    pub is_complete: bool,
    /// Damaged positions, at most the first thousand.
    pub damage: Vec<Damage>,
    /// Number of malformed messages, which were skipped.
    pub n_malformed: u64,
    /// Number of messages, by topic, that were written but not found. They are noticed as gaps in the message numbers.
    pub missing: BTreeMap<String, u64>,
}

/// A damaged position in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Damage {
    /// Offset of the damage, in bytes from the start of the file.
    pub offset: u64,
    /// Description of the damage.
    pub what: &'static str,
}

/// The contents of a recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Recording {
    /// Metadata of the recording.
    pub about: Result<About, AboutError>,
    /// Topics by name, except the topics that this program does not know.
    pub tracks: BTreeMap<String, Track>,
    /// Numbers of recorded and of lost messages, for every topic for which the file contains counts.
    pub counts: BTreeMap<String, Count>,
    /// Part of the file that could be read.
    pub extent: Extent,
}

impl Recording {
    /// Returns the number of all messages that can be read.
    pub fn n_messages(&self) -> u64 {
        let tracks = self.tracks.values();
        tracks.map(|track| track.entries.len() as u64).sum()
    }

    /// Returns the number of messages that were sent but not recorded, over all topics for which the file contains counts.
    pub fn n_lost(&self) -> u64 {
        let lost = self.counts.values().map(|value| value.lost);
        lost.fold(0, u64::saturating_add)
    }

    /// Returns the number of messages of all topics that were written but not found.
    pub fn n_missing(&self) -> u64 {
        self.extent.missing.values().sum()
    }

    /// Returns the times at which the first and the last message with a time were sent. Heartbeats and pictures of cameras are left out.
    pub fn span(&self) -> Option<[u64; 2]> {
        let is_stamped = |track: &&Track| !matches!(track.kind, Kind::Health | Kind::Picture);
        let stamped = self.tracks.values().filter(is_stamped);
        let times = stamped.flat_map(|track| &track.entries).map(|entry| entry.publish_time);
        let times = times.filter(|time| *time > 0);
        times.fold(None, |span, it| {
            let [first, last] = span.unwrap_or([it; 2]);
            Some([first.min(it), last.max(it)])
        })
    }
}

/// Returns the messages of several topics in the order in which they were sent, each with the number of its topic. Messages that were sent
/// at the same time are sorted by the time of reception, and after that by their order in the file.
pub fn in_order(tracks: &[&Track]) -> Vec<(usize, Entry)> {
    let numbered = tracks.iter().enumerate();
    let mut all: Vec<(usize, Entry)> = numbered
        .flat_map(|(track, it)| it.entries.iter().map(move |entry| (track, *entry)))
        .collect();
    all.sort_by_key(|(_, it)| (it.publish_time, it.log_time, it.offset));
    all
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn track(times: &[u64], offset: u64) -> Track {
        let entries = times.iter().zip(offset..);
        Track {
            kind: Kind::Sightings,
            entries: entries
                .map(|(&publish_time, offset)| Entry {
                    log_time: 0,
                    publish_time,
                    offset,
                    len: 1,
                    ..Entry::default()
                })
                .collect(),
        }
    }

    #[test]
    fn messages_are_ordered_by_the_time_of_sending() {
        let (poses, evidence) = (track(&[20, 40], 0), track(&[10, 30], 100));
        let order = in_order(&[&poses, &evidence]);
        let times: Vec<_> = order.iter().map(|order| (order.0, order.1.publish_time)).collect();
        assert_eq!(times, [(1, 10), (0, 20), (1, 30), (0, 40)]);
    }

    proptest! {
        #[test]
        fn all_messages_are_kept_and_equal_times_keep_their_order(
            first in prop::collection::vec(0_u64..4, 0..20),
            second in prop::collection::vec(0_u64..4, 0..20),
        ) {
            let order = in_order(&[&track(&first, 0), &track(&second, 1000)]);
            prop_assert_eq!(order.len(), first.len() + second.len());
            for pair in order.windows(2) {
                let key = |entry: &(usize, Entry)| (entry.1.publish_time, entry.1.offset);
                prop_assert!(key(&pair[0]) < key(&pair[1]));
            }
        }
    }
}
