//! What a recording holds, and where.

use std::collections::BTreeMap;

use crate::{About, AboutError, Count, Kind};

/// Where a message lies, and when it came.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Entry {
    /// When it was taken in, nanoseconds, `CLOCK_MONOTONIC` of the recording machine.
    pub log_time: u64,
    /// When it was sent, by the same clock.
    pub publish_time: u64,
    /// Where its data begins, bytes from the beginning of the file.
    pub offset: u64,
    /// How long it is, bytes.
    pub len: u64,
    /// The frame that it is about; none for signs of life, and where the recording does not say it.
    pub frame: Option<u64>,
    /// Of its data, by which it is checked when it is read; none if the recording has none for every message.
    pub checksum: Option<u32>,
}

/// One topic.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Track {
    /// What travels there.
    pub kind: Kind,
    /// Its messages, as they stand in the file.
    pub entries: Vec<Entry>,
}

/// How much of a file could be read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Extent {
    /// Bytes of the file.
    pub file_bytes: u64,
    /// Where the last whole record ends.
    pub whole_bytes: u64,
    /// Whether the file ends as a recording should.
    pub is_complete: bool,
    /// Places where it is not what was written; the first thousand.
    pub damage: Vec<Damage>,
    /// Messages that are none of their topic's, and were passed over.
    pub n_malformed: u64,
    /// Messages that were written and are not found, by topic: of each the numbers run on.
    pub missing: BTreeMap<String, u64>,
    /// What its checksums are of.
    pub checks: Checked,
}

/// A place where a file is not what was written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Damage {
    /// Where, bytes from the beginning.
    pub offset: u64,
    /// What is wrong.
    pub what: &'static str,
}

/// What the checksums of a recording are of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Checked {
    /// Every message has its own, and so has all that is said about the run.
    #[default]
    Messages,
    /// Only chunks have, of a megabyte or more: a recording of format 1.
    Chunks,
}

/// What a file holds.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Recording {
    /// What it says about itself.
    pub about: Result<About, AboutError>,
    /// Its topics by name; those that this program does not know are left out.
    pub tracks: BTreeMap<String, Track>,
    /// What was kept of every topic and what was lost, as far as the file says.
    pub counts: BTreeMap<String, Count>,
    /// How much of it could be read.
    pub extent: Extent,
}

impl Recording {
    /// All messages that can be read.
    pub fn n_messages(&self) -> u64 {
        let tracks = self.tracks.values();
        tracks.map(|it| it.entries.len() as u64).sum()
    }

    /// Messages of all topics that were sent but not kept, as far as the file says.
    pub fn n_lost(&self) -> u64 {
        let lost = self.counts.values().map(|it| it.lost);
        lost.fold(0, u64::saturating_add)
    }

    /// Messages of all topics that were written and are not found.
    pub fn n_missing(&self) -> u64 {
        self.extent.missing.values().sum()
    }

    /// When the first and the last message were sent, of those that say so; signs of life do not count.
    pub fn span(&self) -> Option<[u64; 2]> {
        let stamped = self.tracks.values().filter(|it| it.kind != Kind::Health);
        let times = stamped.flat_map(|it| &it.entries).map(|it| it.publish_time);
        let times = times.filter(|it| *it > 0);
        times.fold(None, |span, it| {
            let [first, last] = span.unwrap_or([it; 2]);
            Some([first.min(it), last.max(it)])
        })
    }
}

/// The messages of several topics in the order in which they were sent, each with the number of its
/// topic. What was sent at one time stands as it was taken in, what has the same times as in the file.
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
            kind: Kind::ViewPose,
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
    fn what_was_sent_first_comes_first_whoever_was_heard_first() {
        let (poses, evidence) = (track(&[20, 40], 0), track(&[10, 30], 100));
        let order = in_order(&[&poses, &evidence]);
        let times: Vec<_> = order.iter().map(|it| (it.0, it.1.publish_time)).collect();
        assert_eq!(times, [(1, 10), (0, 20), (1, 30), (0, 40)]);
    }

    proptest! {
        #[test]
        fn nothing_is_lost_and_what_was_sent_at_one_time_stays_in_order(
            first in prop::collection::vec(0_u64..4, 0..20),
            second in prop::collection::vec(0_u64..4, 0..20),
        ) {
            let order = in_order(&[&track(&first, 0), &track(&second, 1000)]);
            prop_assert_eq!(order.len(), first.len() + second.len());
            for pair in order.windows(2) {
                let key = |it: &(usize, Entry)| (it.1.publish_time, it.1.offset);
                prop_assert!(key(&pair[0]) < key(&pair[1]));
            }
        }
    }
}
