//! Tests of cards that are accepted and of cards that are rejected.

use proptest::prelude::*;

use super::*;

const TEXT: &str = r#"
format = "parallax-keypoint-network"
version = 1
name = "a network"
[input]
width = 96
height = 128
[output]
codec = "heat-map"
[keypoints]
set = "coco-17"
"#;

pub(crate) fn card() -> Card {
    Card::parse(TEXT).unwrap()
}

#[test]
fn omitted_card_entries_get_the_defaults() {
    let card = card();
    assert_eq!(card.input.layout, Layout::Planes);
    assert_eq!((card.input.scale, card.input.std), (1.0, [1.0; 3]));
    assert_eq!(card.crop, Crop::default());
    assert_eq!(card.names().len(), 17);
    assert_eq!(card.keypoints.sides, Sides::Anatomical);
    let Codec::HeatMap { udp, refine, .. } = card.output else {
        panic!("another codec");
    };
    assert_eq!((udp, refine), (false, Refine::Quarter));
}

#[test]
fn every_codec_is_read() {
    let simcc = TEXT.replace(
        "codec = \"heat-map\"",
        "codec = \"simcc\"\nx = \"simcc_x\"\ny = \"simcc_y\"\nbins_per_pixel = 2",
    );
    assert!(matches!(
        Card::parse(&simcc).unwrap().output,
        Codec::Simcc { bins_per_pixel, nats, .. } if bins_per_pixel == 2.0 && nats == 10.0
    ));
    let list = TEXT.replace(
        "codec = \"heat-map\"",
        "codec = \"keypoints\"\nfields = [\"y\", \"x\", \"score\"]\nunit = \"share\"",
    );
    assert!(matches!(
        Card::parse(&list).unwrap().output,
        Codec::Keypoints { ref fields, unit: ListUnit::Share, .. } if fields.len() == 3
    ));
}

/// Replaced text, replacement, and expected message.
const CASES: [[&str; 3]; 18] = [
    [
        "codec = \"heat-map\"",
        "codec = \"heat-map\"\nudp = true\ncentred = true",
        "`output.centred` is true, expected false, because with `udp`",
    ],
    ["version = 1", "version = 2", "version 2, expected"],
    [
        "width = 96",
        "width = 4",
        "`input.width` is 4, expected 8 to 2048",
    ],
    ["height = 128", "height = 1e9", "height"],
    [
        "height = 128",
        "height = 128\nscale = 0",
        "`input.scale` is 0",
    ],
    [
        "height = 128",
        "height = 128\nstd = [1, 0, 1]",
        "`input.std`",
    ],
    [
        "height = 128",
        "height = 128\nmean = [nan, 0, 1]",
        "`input.mean`",
    ],
    [
        "height = 128",
        "height = 128\ncolor = \"rgb\"",
        "unknown field `color`",
    ],
    [
        "[output]",
        "[crop]\nmargin = 9\n[output]",
        "`crop.margin` is 9",
    ],
    [
        "codec = \"heat-map\"",
        "codec = \"heatmap\"",
        "unknown variant `heatmap`",
    ],
    [
        "codec = \"heat-map\"",
        "codec = \"heat-map\"\nstride = 4",
        "unknown field `stride`",
    ],
    [
        "codec = \"heat-map\"",
        "codec = \"keypoints\"\nfields = [\"x\", \"score\"]",
        "`output.fields`",
    ],
    [
        "codec = \"heat-map\"",
        "codec = \"simcc\"\nx = \"a\"\ny = \"b\"\nbins_per_pixel = 0",
        "`output.bins_per_pixel` is 0",
    ],
    [
        "set = \"coco-17\"",
        "set = \"coco\"",
        "expected one of coco-17, halpe-26",
    ],
    ["set = \"coco-17\"", "", "`keypoints` is neither"],
    [
        "set = \"coco-17\"",
        "set = \"coco-17\"\nnames = [\"a\"]",
        "`keypoints` is both",
    ],
    [
        "set = \"coco-17\"",
        "names = [\"nose\", \"nose\"]",
        "`keypoints.names` is nose",
    ],
    ["set = \"coco-17\"", "names = []", "`keypoints.names` is 0"],
];

#[test]
fn wrong_values_are_named_with_the_accepted_ones() {
    for [from, to, expected] in CASES {
        assert!(TEXT.contains(from), "{from}");
        let said = Card::parse(&TEXT.replace(from, to))
            .map_or_else(|value| value.to_string(), |_| String::new());
        assert!(said.contains(expected), "{to}: {said}");
    }
}

proptest! {
    #[test]
    fn any_text_is_parsed_as_a_card_or_refused(text in ".{0,200}", at in 0..200_usize) {
        let _either = Card::parse(&text);
        let mut changed = TEXT.to_owned();
        let at = changed.floor_char_boundary(at.min(changed.len()));
        changed.insert_str(at, &text);
        let _either = Card::parse(&changed);
    }
}
