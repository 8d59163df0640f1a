//! Tests of topics that are meant for other programs: those programs read them, and this crate ignores them.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::io::Cursor;

use messages::topic;
use recording::{About, Entry, Foreign, Kind, Writer, encode, scan};

fn foreign(topic: &str, schema_name: &'static str) -> Foreign {
    Foreign {
        topic: topic.to_owned(),
        schema_name,
        schema: "{\"type\":\"object\"}",
    }
}

/// Returns a recording of three messages of known topics, each followed by two messages for other programs.
fn written() -> Vec<u8> {
    let mut file = Vec::new();
    let about = About::default();
    let topics = [topic::health("a")];
    let others = [
        foreign("/one", "strange.A"),
        foreign("/two", "strange.B"),
        foreign("/three", "strange.A"),
    ];
    let mut writer = Writer::begin_with(&mut file, &about, &topics, &others).unwrap();
    for time in 1..=3 {
        let mut data = Vec::new();
        encode(Kind::Health, &[time; 104], &[], &mut data);
        let entry = Entry {
            log_time: u64::from(time),
            publish_time: u64::from(time),
            ..Entry::default()
        };
        writer.write(0, &entry, &data).unwrap();
        for nth in [1, 3] {
            let json = format!("{{\"n\":{nth}}}");
            writer.write(nth, &entry, json.as_bytes()).unwrap();
        }
        writer.flush(&[0]).unwrap();
    }
    writer.finish(&[0]).unwrap();
    file
}

#[test]
fn messages_of_other_programs_have_schemas() {
    let file = written();
    let summary = mcap::Summary::read(&file).unwrap().unwrap();
    assert_eq!(summary.stats.unwrap().message_count, 9);
    let schemas: Vec<_> = summary.schemas.values().map(|value| value.name.clone()).collect();
    assert_eq!(schemas.len(), 3, "{schemas:?}");
    let messages = mcap::MessageStream::new(&file).unwrap();
    let messages = messages.map(Result::unwrap);
    let strange = messages.filter(|message| message.channel.message_encoding == "json");
    let found: Vec<_> = strange
        .map(|strange| {
            let schema = strange.channel.schema.clone().unwrap();
            assert_eq!(schema.encoding, "jsonschema");
            let text = String::from_utf8(strange.data.to_vec()).unwrap();
            (strange.channel.topic.clone(), schema.name.clone(), text)
        })
        .collect();
    let expected = |topic: &str, nth: u32| {
        let text = format!("{{\"n\":{nth}}}");
        (topic.to_owned(), "strange.A".to_owned(), text)
    };
    let both = [expected("/one", 1), expected("/three", 3)];
    assert_eq!(found, [both.clone(), both.clone(), both].concat());
}

#[test]
fn messages_for_other_programs_do_not_count_as_topics_of_the_run() {
    let file = written();
    let recording = scan(&mut Cursor::new(&file)).unwrap();
    assert_eq!(recording.tracks.len(), 1);
    assert_eq!(recording.tracks[&topic::health("a")].entries.len(), 3);
    assert!(recording.extent.is_complete && recording.extent.damage.is_empty());
    assert_eq!((recording.n_missing(), recording.n_lost()), (0, 0));
}

#[test]
fn a_file_truncated_among_them_contains_the_messages_before_that() {
    let file = written();
    let mut most = 0;
    for n in 8..=file.len() {
        let recording = scan(&mut Cursor::new(&file[..n])).unwrap();
        assert!(recording.extent.damage.is_empty(), "{n}");
        assert_eq!(recording.extent.n_malformed, 0, "{n}");
        let track = recording.tracks.get(&topic::health("a"));
        let found = track.map_or(0, |track| track.entries.len());
        assert!(found >= most, "{n}");
        most = found;
    }
    assert_eq!(most, 3);
}
