//! Tests of recordings as files: they are written, truncated, damaged, and read.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::cell::RefCell;
use std::io::{self, Cursor, Write};
use std::rc::Rc;

use messages::topic;
use proptest::prelude::*;
use recording::{
    About, Buffer, Count, Entry, Kind, ReadError, Recording, WriteError, Writer, check, encode,
    read, scan,
};

/// One message of the tests: its topic, its time of sending, and its array.
type Sent = (usize, u64, Vec<u8>);

fn topics() -> Vec<String> {
    vec![
        topic::frame(0),
        topic::sightings(0),
        topic::health("pose-0"),
    ]
}

fn about() -> About {
    About {
        version: "1.2.3".to_owned(),
        session: 77,
        settings: "{}".to_owned(),
        ..About::default()
    }
}

fn kind(topic: usize) -> Kind {
    [Kind::Frame, Kind::Sightings, Kind::Health][topic]
}

/// Returns the bytes of a message; its frame number is its time.
fn data((topic, time, elements): &Sent) -> Vec<u8> {
    let mut data = Vec::new();
    let head = [time.to_le_bytes(); 2].concat();
    encode(kind(*topic), &head, elements, &mut data);
    data
}

/// Returns the bytes of a recording with these messages.
fn written(sent: &[Sent], flush_every: usize) -> Vec<u8> {
    let mut file = Vec::new();
    let mut writer = Writer::begin(&mut file, &about(), &topics()).unwrap();
    for (nth, it) in sent.iter().enumerate() {
        let entry = Entry {
            log_time: it.1 + 1,
            publish_time: it.1,
            ..Entry::default()
        };
        writer.write(it.0, &entry, &data(it)).unwrap();
        if nth % flush_every == 0 {
            writer.flush(&[nth as u64 / 3, 0, 0]).unwrap();
        }
    }
    writer.finish(&[9, 0, 1]).unwrap();
    file
}

/// Compares the messages of a file, in the order of the file, with the messages that were sent. Returns the number of messages found.
fn held(recording: &Recording, file: &[u8], sent: &[Sent]) -> usize {
    let mut found = Vec::new();
    for (nth, name) in topics().iter().enumerate() {
        let entries = recording.tracks.get(name).map(|track| &track.entries[..]);
        found.extend(entries.unwrap_or_default().iter().map(|entry| (nth, *entry)));
    }
    found.sort_by_key(|entry| entry.1.offset);
    let mut buffer = Buffer::default();
    for ((topic, entry), it) in found.iter().zip(sent) {
        let message = read(&mut Cursor::new(file), kind(*topic), entry, &mut buffer).unwrap();
        assert_eq!(message.head[..8], it.1.to_le_bytes());
        let expected: &[u8] = if *topic == 0 { &it.2 } else { &[] };
        assert_eq!((*topic, message.elements), (it.0, expected));
        assert_eq!((entry.publish_time, entry.log_time), (it.1, it.1 + 1));
    }
    found.len()
}

fn some() -> Vec<Sent> {
    (0..12)
        .map(|nth| (nth % 3, 10 * nth as u64, vec![nth as u8; 5 + nth]))
        .collect()
}

#[test]
fn a_recording_survives_a_round_trip_with_its_counts() {
    let (sent, file) = (some(), written(&some(), 4));
    let recording = scan(&mut Cursor::new(&file)).unwrap();
    assert_eq!(recording.about, Ok(about()));
    assert!(recording.extent.is_complete);
    assert_eq!(recording.extent.whole_bytes, file.len() as u64);
    assert_eq!(held(&recording, &file, &sent), sent.len());
    let count = |topic: usize| recording.counts[&topics()[topic]];
    let expected = [(4, 9), (4, 0), (4, 1)];
    let expected = expected.map(|(recorded, lost)| Count { recorded, lost });
    assert_eq!([0, 1, 2].map(count), expected);
    assert_eq!(recording.n_lost(), 10);
    assert_eq!(
        recording.span().map(|span| span[0]),
        Some(10),
        "the first does not say when"
    );
}

#[test]
fn other_programs_can_read_it_with_index_and_checksums() {
    let file = written(&some(), 4);
    let summary = mcap::Summary::read(&file).unwrap().unwrap();
    assert_eq!(summary.stats.unwrap().message_count, 12);
    assert!(!summary.chunk_indexes.is_empty());
    let options = mcap::read::Options::ValidateChunkCrcs;
    let messages = mcap::MessageStream::new_with_options(&file, options.into()).unwrap();
    let messages: Vec<_> = messages.map(Result::unwrap).collect();
    assert_eq!(messages.len(), 12);
    let first = &messages[0].channel;
    assert_eq!(
        (first.topic.as_str(), first.message_encoding.as_str()),
        ("frame/v1/0", "cdr")
    );
    let schema = first.schema.as_ref().unwrap();
    assert_eq!(
        (schema.name.as_str(), schema.encoding.as_str()),
        ("parallax/msg/Frame", "ros2msg")
    );
}

#[test]
fn a_file_truncated_at_any_byte_contains_the_messages_of_its_complete_chunks() {
    let (sent, file) = (some(), written(&some(), 4));
    let mut most = 0;
    let whole = scan(&mut Cursor::new(&file)).unwrap();
    let chunks = whole.tracks.values().flat_map(|track| &track.entries);
    let chunks: Vec<u64> = chunks.map(|entry| entry.chunk).collect();
    // A chunk has one frame of known topics, or two messages without a frame.
    let n_of = |chunk: u64| chunks.iter().filter(|other| **other == chunk).count();
    assert!(chunks.iter().all(|chunk| n_of(*chunk) <= 2));
    for n in 0..=file.len() {
        let part = &file[..n];
        let recording = match scan(&mut Cursor::new(part)) {
            Ok(recording) => recording,
            Err(error) => {
                assert!(n < 8, "{n} bytes: {error}");
                continue;
            }
        };
        let extent = &recording.extent;
        assert_eq!(extent.is_complete, n == file.len());
        assert_eq!(
            (&extent.damage[..], extent.n_malformed),
            (&[][..], 0),
            "{n}"
        );
        assert_eq!(extent.file_bytes, n as u64);
        assert!(extent.whole_bytes <= n as u64);
        let n_held = held(&recording, part, &sent);
        let after = |entry: u64| entry < n as u64;
        let n_begun = chunks.iter().filter(|chunk| after(**chunk)).count();
        assert!(
            (most..=most + 2).contains(&n_held) && n_held + 2 >= n_begun,
            "{n} bytes: {most}, then {n_held}"
        );
        most = n_held;
        assert!(most == 0 || recording.about == Ok(about()));
    }
    assert_eq!(most, sent.len());
}

#[test]
fn other_files_are_refused() {
    for other in [&b""[..], b"\x89MCAP", b"\x89PNG\r\n\x1a\n and more"] {
        let refused = scan(&mut Cursor::new(other));
        assert!(matches!(refused, Err(ReadError::NotMcap)));
    }
}

#[test]
fn an_unknown_topic_cannot_be_written() {
    let refused = Writer::begin(Vec::new(), &about(), &["frame/v9/0".to_owned()]);
    assert!(matches!(refused, Err(WriteError::Topic(it)) if it == "frame/v9/0"));
}

/// A disk with limited space.
#[derive(Clone)]
struct Disk {
    file: Rc<RefCell<Vec<u8>>>,
    room: usize,
}

impl Write for Disk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let mut file = self.file.borrow_mut();
        let n = bytes.len().min(self.room - file.len());
        file.extend_from_slice(&bytes[..n]);
        if n == 0 && !bytes.is_empty() {
            return Err(io::ErrorKind::StorageFull.into());
        }
        Ok(n)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[test]
fn a_full_disk_is_an_error_with_the_size_and_the_file_stays_readable() {
    let disk = Disk {
        file: Rc::default(),
        room: 40_000,
    };
    let mut writer = Writer::begin(disk.clone(), &about(), &topics()).unwrap();
    let sent: Vec<Sent> = (0..90).map(|nth| (0, nth, vec![nth as u8; 1000])).collect();
    let failed = sent.iter().try_for_each(|message| {
        let entry = Entry {
            log_time: message.1 + 1,
            publish_time: message.1,
            ..Entry::default()
        };
        writer.write(0, &entry, &data(message))?;
        writer.flush(&[0; 3])
    });
    let error = failed.unwrap_err();
    assert!(error.to_string().contains("40000 bytes"), "{error}");
    assert!(
        matches!(&error, WriteError::Write { source, .. } if source.kind() == io::ErrorKind::StorageFull)
    );
    let again = writer.write(0, &Entry::default(), &data(&sent[0]));
    assert!(again.is_err(), "no more can be written");
    drop(writer);
    let file = disk.file.borrow().clone();
    assert_eq!(file.len(), 40_000);
    let recording = scan(&mut Cursor::new(&file)).unwrap();
    assert!(!recording.extent.is_complete);
    assert!(held(&recording, &file, &sent) > 20);
}

fn any_sent() -> impl Strategy<Value = Vec<Sent>> {
    let elements = prop::collection::vec(any::<u8>(), 0..40);
    prop::collection::vec((0_usize..3, 0_u64..1000, elements), 0..20)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn a_prefix_of_the_file_contains_a_prefix_of_the_messages(sent in any_sent(), flush_every in 1_usize..8, share in 0.0..1.0) {
        let file = written(&sent, flush_every);
        let part = &file[..(file.len() as f64 * share) as usize];
        if let Ok(recording) = scan(&mut Cursor::new(part)) {
            prop_assert!(held(&recording, part, &sent) <= sent.len());
            prop_assert_eq!(recording.extent.n_malformed, 0);
        }
    }

    #[test]
    fn damage_is_reported_and_only_undamaged_messages_are_read(
        sent in any_sent(), flush_every in 1_usize..8,
        at in any::<prop::sample::Index>(), to: [u8; 8], n in 1_usize..9,
    ) {
        let whole = written(&sent, flush_every);
        let mut file = whole.clone();
        let at = at.index(file.len());
        let end = (at + n).min(file.len());
        file[at..end].copy_from_slice(&to[..end - at]);
        check_damaged(&whole, &file)?;
    }

    #[test]
    fn removed_and_inserted_bytes_are_reported(
        sent in any_sent(), flush_every in 1_usize..8,
        [begin, end, other] in any::<[prop::sample::Index; 3]>(),
    ) {
        let whole = written(&sent, flush_every);
        let [begin, end, other] = [begin, end, other].map(|place| place.index(whole.len()));
        let mut file = whole.clone();
        file.splice(begin.min(end)..begin.max(end), whole[other..].iter().copied().take(9));
        check_damaged(&whole, &file)?;
    }
}

/// Topic, entry and bytes of a message.
type Given = (String, Vec<Entry>, Vec<u8>);

/// Returns everything that can be read from a recording: its metadata, and the readable messages of every topic.
fn given(file: &[u8]) -> Option<(Recording, Vec<Given>, usize)> {
    let recording = scan(&mut Cursor::new(file)).ok()?;
    let damaged = check(&mut Cursor::new(file), &recording, |_| true).unwrap();
    let mut all = Vec::new();
    for (topic, track) in &recording.tracks {
        for entry in &track.entries {
            let mut buffer = Buffer::default();
            let message = read(&mut Cursor::new(file), track.kind, entry, &mut buffer);
            if let Ok(message) = message {
                let when = Entry {
                    offset: 0,
                    chunk: 0,
                    ..*entry
                };
                let bytes = [message.head, message.elements].concat();
                all.push((topic.clone(), vec![when], bytes));
            }
        }
    }
    Some((recording, all, damaged.len()))
}

/// Checks that a changed file either gives the same messages or reports damage, and never gives a message that was not written.
fn check_damaged(whole: &[u8], changed: &[u8]) -> Result<(), TestCaseError> {
    let (before, mut all, _) = given(whole).unwrap();
    let Some((after, some, n_damaged)) = given(changed) else {
        return Ok(());
    };
    let extent = &after.extent;
    let is_reported = n_damaged > 0
        || !extent.is_complete
        || !extent.damage.is_empty()
        || after.n_missing() > 0
        || after.about != before.about;
    let n_all = all.len();
    prop_assert!(
        is_reported || some.len() == n_all,
        "{} of {n_all}",
        some.len()
    );
    if let Ok(about) = &after.about {
        prop_assert_eq!(Ok(about), before.about.as_ref());
    }
    for it in some {
        let place = all.iter().position(|other| it == *other);
        prop_assert!(place.is_some(), "{it:?} was not written");
        all.remove(place.unwrap_or_default());
    }
    Ok(())
}

#[test]
fn frame_numbers_are_read_even_if_topic_names_are_only_at_the_end() {
    let sent = [(1, 0, vec![]), (1, 0, vec![]), (0, 0, vec![])];
    let whole = written(&sent, 1);
    let mut file = whole.clone();
    let first = scan(&mut Cursor::new(&whole)).unwrap().tracks[&topics()[1]].entries[0];
    file.drain(9..first.chunk as usize);
    let recording = scan(&mut Cursor::new(&file)).unwrap();
    let topics = topics();
    let frames = |nth: usize| {
        let entries = recording.tracks[&topics[nth]].entries.iter();
        entries.map(|entry| entry.frame).collect::<Vec<_>>()
    };
    assert_eq!(frames(0), [Some(0)]);
    assert_eq!(frames(1), [Some(0); 2]);
    check_damaged(&whole, &file).unwrap();
}

#[test]
fn one_changed_byte_loses_only_its_chunk_whose_messages_are_named() {
    let sent: Vec<Sent> = (0..9).map(|nth| (0, nth, vec![nth as u8; 100])).collect();
    let mut file = written(&sent, 100);
    let recording = scan(&mut Cursor::new(&file)).unwrap();
    let entry = recording.tracks["frame/v1/0"].entries[4];
    file[entry.offset as usize + 150] ^= 1;
    let recording = scan(&mut Cursor::new(&file)).unwrap();
    let damaged = check(&mut Cursor::new(&file), &recording, |_| true).unwrap();
    assert_eq!(damaged.len(), 1, "every frame has a chunk");
    let it = &damaged[0];
    assert_eq!((it.topic.as_str(), it.offset), ("frame/v1/0", entry.offset));
    assert_eq!((it.frame, it.chunk), (Some(4), entry.chunk));
    let mut buffer = Buffer::default();
    let refused = read(&mut Cursor::new(&file), Kind::Frame, &entry, &mut buffer);
    assert!(matches!(refused, Err(ReadError::Checksum { offset }) if offset == entry.chunk));
    let other = check(&mut Cursor::new(&file), &recording, |topic| {
        topic != "frame/v1/0"
    });
    assert!(other.unwrap().is_empty());
}

/// Returns four numbers: messages that a scan finds, messages that it misses, positions that it reports as damaged, and unreadable
/// messages.
fn judged(file: &[u8]) -> [u64; 4] {
    let recording = scan(&mut Cursor::new(file)).unwrap();
    let damaged = check(&mut Cursor::new(file), &recording, |_| true).unwrap();
    let n_damage = recording.extent.damage.len() as u64;
    [
        recording.n_messages(),
        recording.n_missing(),
        n_damage,
        damaged.len() as u64,
    ]
}

#[test]
fn damage_between_two_chunks_loses_no_later_chunk() {
    let sent: Vec<Sent> = (0..30).map(|nth| (0, nth, vec![nth as u8; 100])).collect();
    let whole = written(&sent, 1);
    assert_eq!(judged(&whole), [30, 0, 0, 0]);
    let recording = scan(&mut Cursor::new(&whole)).unwrap();
    let entries = recording.tracks["frame/v1/0"].entries.iter();
    let chunks: Vec<usize> = entries.map(|entry| entry.chunk as usize).collect();
    // Change the length of a chunk's record, or one of the two lengths in it.
    for at in [1, 25, 41] {
        let mut file = whole.clone();
        file[chunks[12] + at..chunks[12] + at + 8].fill(0xff);
        assert_eq!(judged(&file), [29, 1, 1, 0], "{at}");
    }
    // Change the checksum of the chunk.
    let mut file = whole.clone();
    file[chunks[12] + 33] ^= 1;
    assert_eq!(judged(&file), [30, 0, 0, 1]);
    // Change the length of the chunk's message.
    let mut file = whole.clone();
    file[chunks[12] + 50] ^= 1;
    assert_eq!(judged(&file), [29, 1, 1, 0]);
    // Change complete chunks, with the bytes between them.
    let mut file = whole;
    file[chunks[12]..chunks[14]].fill(0);
    let [held, missing, damage, _] = judged(&file);
    assert!(held >= 28 && held + missing == 30 && damage > 0);
}

#[test]
fn a_chunk_that_claims_a_terabyte_allocates_nothing_and_only_its_messages_are_lost() {
    let sent: Vec<Sent> = (0..6).map(|nth| (0, nth, vec![nth as u8; 100])).collect();
    let mut file = written(&sent, 1);
    let recording = scan(&mut Cursor::new(&file)).unwrap();
    let at = recording.tracks["frame/v1/0"].entries[2].chunk as usize;
    let terabyte = 1_u64 << 40;
    for (place, bytes) in [(1, terabyte + 40), (25, terabyte), (41, terabyte)] {
        file[at + place..at + place + 8].copy_from_slice(&bytes.to_le_bytes());
    }
    assert_eq!(judged(&file), [5, 1, 1, 0]);
}

#[test]
fn a_damaged_end_is_reported_and_loses_no_message() {
    let (sent, whole) = (some(), written(&some(), 4));
    let end = whole.len();
    // Damage the closing magic, the checksum of the index, the index, and the record that ends the messages.
    let data_end = (0..end)
        .rev()
        .find(|&at| whole[at..].starts_with(&[0x0f, 4, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]));
    for at in [end - 1, end - 10, end - 60, data_end.unwrap()] {
        let mut file = whole.clone();
        file[at] ^= 0x55;
        let recording = scan(&mut Cursor::new(&file)).unwrap();
        let extent = &recording.extent;
        assert!(!extent.is_complete || extent.damage.len() == 1, "{at}");
        assert_eq!(held(&recording, &file, &sent), sent.len(), "{at}");
        assert_eq!(recording.n_missing(), 0, "{at}");
    }
}
