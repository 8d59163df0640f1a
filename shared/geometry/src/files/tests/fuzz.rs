//! Tests that no input makes a reader panic: arbitrary text, and valid files with a few changed bytes.

use super::*;

/// Reads a text with every reader.
fn read_with_all(text: &str) {
    let options = ReadOptions {
        size: Some([640, 480]),
        ..ReadOptions::default()
    };
    for name in ["a.toml", "a.json", "a.yml", "a.cal", "a.ini", "a.txt", ""] {
        std::hint::black_box(detect(Path::new(name), text));
    }
    let rigs = [
        own::parse(text, &options),
        pose2sim::parse(text, &options),
        qualisys::parse(text, &options),
        opencv::parse(&[("a", text), ("b", text)], &options),
        humaneva::parse("a", text, &options),
        umpm::parse("a", text, &options),
        panoptic::parse(text, &options),
    ];
    for rig in rigs.into_iter().flatten() {
        std::hint::black_box(check(&rig));
        own::parse(&own::write(&rig), &options).expect("a rig can be written and read back");
    }
}

fn valid_files() -> Vec<String> {
    let rig = ring_rig(2, BARREL);
    let camera = &rig.cameras()[0];
    vec![
        own::write(&rig),
        pose2sim::write(&rig).expect("writable"),
        opencv::write(&rig).expect("writable"),
        humaneva::write(camera).expect("writable"),
        umpm::write(camera).expect("writable"),
        PANOPTIC.to_owned(),
        "<c><camera serial=\"1\"><fov_video left=\"0\" top=\"0\" right=\"9\" bottom=\"9\"/><transform x=\"0\" y=\"0\" z=\"0\" \
         r11=\"1\" r12=\"0\" r13=\"0\" r21=\"0\" r22=\"1\" r23=\"0\" r31=\"0\" r32=\"0\" r33=\"1\"/><intrinsic focalLengthU=\"64\" \
         focalLengthV=\"64\" centerPointU=\"320\" centerPointV=\"320\" radialDistortion1=\"0\" radialDistortion2=\"0\" \
         radialDistortion3=\"0\" tangentalDistortion1=\"0\" tangentalDistortion2=\"0\"/></camera></c>"
            .to_owned(),
    ]
}

#[test]
fn the_valid_files_are_read() {
    let options = ReadOptions::default();
    let files = valid_files();
    assert_eq!(
        own::parse(&files[0], &options).expect("own").cameras().len(),
        2
    );
    assert_eq!(
        qualisys::parse(&files[6], &options).expect("qualisys").cameras().len(),
        1
    );
}

proptest! {
    #[test]
    fn arbitrary_text_is_read_without_panic(text in "\\PC*|[\\x00-\\x7f]{0,200}|([-0-9.e]{1,6}[ \n]){0,30}") {
        read_with_all(&text);
    }

    #[test]
    fn mutated_files_are_read_without_panic(
        file in 0_usize..7,
        edits in prop::collection::vec((any::<prop::sample::Index>(), "[-0-9.eEnaif\\[\\]\"=,\n<>/: ]{0,3}", 0_usize..4), 1..5),
    ) {
        let mut text: Vec<char> = valid_files()[file].chars().collect();
        for (at, put, drop) in edits {
            let start = at.index(text.len().max(1)).min(text.len());
            let end = (start + drop).min(text.len());
            text.splice(start..end, put.chars());
        }
        read_with_all(&text.into_iter().collect::<String>());
    }
}

#[test]
fn deep_nesting_is_read_without_panic() {
    for open in ["[", "{", "a: [", "<a>", "a.", "a = [", "- ", "{a: "] {
        read_with_all(&open.repeat(100_000));
    }
}
