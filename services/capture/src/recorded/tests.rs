//! Tests of recorded pictures of live cameras, used as footage.

use std::io::Write as _;

use footage::Size;
use messages::{MAX_NAME, PictureHeader, Stamp, Status, Timing, topic};
use recording::{About, Entry, Without, Writer, encode};

use super::*;

const SIZE: Size = Size {
    width: 4,
    height: 2,
};
const START: u64 = 7_000_000_000;

/// Writes a recording with raw pictures of the camera `left`, each of one brightness.
///
/// * `pictures`: for each picture, its number, its time in milliseconds after the first frame, and its brightness.
fn recording(pictures: &[(u64, u64, u8)]) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("run.mcap");
    let about = About {
        version: "1".to_owned(),
        session: 1,
        began_unix_nanos: 0,
        settings: "{}".to_owned(),
        without: Without::default(),
    };
    let topics = [topic::picture(3), topic::skeletons()];
    let mut bytes = Vec::new();
    let mut writer = Writer::begin(&mut bytes, &about, &topics).unwrap();
    let mut name = [0; MAX_NAME];
    name[..4].copy_from_slice(b"left");
    for &(number, ms, grey) in pictures {
        let at = START + ms * 1_000_000;
        let header = PictureHeader {
            stamp: Stamp {
                session: 1,
                frame: number,
                captured_at_nanos: at,
                ..Stamp::default()
            },
            timing: Timing {
                received_at_nanos: at,
                sent_at_nanos: at + 5,
            },
            width: 4,
            height: 2,
            status: Status::OK,
            format: *b"GREY",
            grid_start_nanos: START,
            grid_rate_hz: 10.0,
            name,
            ..PictureHeader::default()
        };
        let entry = Entry {
            log_time: at + 9,
            publish_time: at + 5,
            ..Entry::default()
        };
        let mut data = Vec::new();
        encode(
            Kind::Picture,
            bytemuck::bytes_of(&header),
            &[grey; 8],
            &mut data,
        );
        writer.write(0, &entry, &data).unwrap();
    }
    writer.finish(&[0, 0]).unwrap();
    File::create(&file).unwrap().write_all(&bytes).unwrap();
    (folder, file)
}

fn spec(file: &Path) -> SourceSpec {
    SourceSpec::new(Recorded::address(file, "left"))
}

fn read(spec: &SourceSpec) -> Vec<(u64, u8)> {
    let recorded = Recorded::parse(&spec.path).unwrap();
    let mut feed = RecordedFeed::open(&recorded, spec).unwrap();
    assert_eq!(feed.info.size, SIZE);
    let mut all = Vec::new();
    while let Some(frame) = feed.next_frame().unwrap() {
        all.push((frame.index, frame.rgb[0]));
    }
    all
}

#[test]
fn every_instant_gets_the_nearest_picture_and_other_pictures_are_left_out() {
    let pictures = [
        (0, 2, 10),
        (1, 98, 11),
        (2, 205, 12),
        // There is no picture near 300 ms, and there are two near 400 ms.
        (3, 399, 13),
        (4, 430, 14),
        (5, 501, 15),
    ];
    let (_folder, file) = recording(&pictures);
    let all = spec(&file);
    let expected = [(0, 10), (1, 11), (2, 12), (4, 13), (5, 15)];
    assert_eq!(read(&all), expected);
    let every_second = SourceSpec {
        step: 2,
        ..all.clone()
    };
    assert_eq!(read(&every_second), [(0, 10), (2, 12), (4, 13)]);
    let from_two = SourceSpec {
        start: 2,
        count: Some(3),
        ..all.clone()
    };
    assert_eq!(read(&from_two), [(2, 12), (4, 13)]);
    let slower = SourceSpec {
        frame_rate_hz: Some(5.0),
        ..all
    };
    assert_eq!(read(&slower), [(0, 10), (1, 12), (2, 13)]);
}

#[test]
fn a_damaged_picture_is_left_out() {
    let (_folder, file) = recording(&[(0, 0, 10), (1, 100, 77), (2, 200, 12)]);
    let mut bytes = std::fs::read(&file).unwrap();
    let at = bytes.windows(8).position(|window| window == [77; 8]).unwrap();
    bytes[at] = 78;
    std::fs::write(&file, bytes).unwrap();
    assert_eq!(read(&spec(&file)), [(0, 10), (2, 12)]);
}

#[test]
fn errors_of_recorded_sources_name_the_problem() {
    let (_folder, file) = recording(&[(0, 0, 10)]);
    let refused = |source: &str| {
        let spec = SourceSpec::new(source);
        let refused = crate::Feed::look(&spec).unwrap_err();
        failure::wording::in_one_line(&refused)
    };
    let text = refused(&Recorded::address(&file, "right"));
    assert!(
        text.contains("\"right\"") && text.contains("pictures of left"),
        "{text}"
    );
    assert!(refused(&file.display().to_string()).contains("run.mcap#NAME"));
    assert!(refused("nowhere.mcap#left").contains("cannot open the recording"));
    std::fs::write(&file, b"no recording").unwrap();
    assert!(refused(&Recorded::address(&file, "left")).contains("not an MCAP file"));
}
