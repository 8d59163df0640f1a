//! Tests that the network that finds people can be trained, and that its file gives the same results as the trained network.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use proptest::prelude::*;
use training::networks::finder::{
    Around, BOXES, CHANNELS, FinderSample, FinderTask, PICTURE, Picture, STRIDE, Settings, Shape,
    Vary, card, plain, varied,
};
use training::networks::{About, Backend, Plan, Task as _, Trainer};

/// Pictures of bright upright boxes on noise; every fourth picture shows no people.
fn pictures(n: usize, seed: u64) -> Vec<Picture> {
    let mut rng = fastrand::Rng::with_seed(seed);
    (0..n).map(|nth| picture(nth, &mut rng)).collect()
}

fn picture(nth: usize, rng: &mut fastrand::Rng) -> Picture {
    let size = [96, 72];
    let noise = (0..3 * size[0] * size[1]).map(|_| rng.u8(90..130));
    let mut rgb: Vec<u8> = noise.collect();
    let mut people = Vec::new();
    if nth % 4 != 3 {
        let [width, height] = [rng.usize(14..20), rng.usize(36..50)];
        let [left, top] = [
            rng.usize(0..size[0] - width),
            rng.usize(0..size[1] - height),
        ];
        for row in top..top + height {
            let from = 3 * (row * size[0] + left);
            rgb[from..from + 3 * width].fill(if row < top + height / 2 { 250 } else { 10 });
        }
        let outline = [left, top, left + width, top + height].map(|side| side as f32 - 0.5);
        people.push(Around {
            outline,
            counts: true,
        });
    }
    Picture {
        name: format!("picture {nth}"),
        size,
        rgb,
        people,
    }
}

/// A network that is small enough for a test.
fn small() -> Settings {
    Settings {
        shape: Shape {
            side: 96,
            stem: 8,
            channels: [16, 16, 16, 16],
            blocks: [1, 1, 1, 1],
        },
        batch: 8,
        steps: 120,
        small: 0.0,
        rate: 1e-2,
        averaged: 0.05,
        vary: Vary {
            least_height: 0.4,
            coarse: 0.0,
            ..Vary::default()
        },
        ..Settings::default()
    }
}

const fn steps(steps: usize) -> Plan {
    Plan {
        steps,
        is_judged: false,
    }
}

fn trainer<'a>(
    settings: &'a Settings,
    pictures: [&'a [Picture]; 2],
    checkpoint: Option<&[u8]>,
) -> Trainer<FinderTask<'a>> {
    let task = FinderTask::new(settings, pictures, None).unwrap();
    Trainer::new(task, Backend::BuiltIn, checkpoint).unwrap()
}

#[test]
fn a_trained_detector_finds_people_and_nothing_in_empty_pictures() {
    let (learnt, kept) = (pictures(24, 1), pictures(16, 2));
    let settings = small();
    let mut trainer = trainer(&settings, [&learnt, &kept], None);
    assert!(trainer.run(steps(20), &mut |_| true));
    assert!(trainer.run(steps(80), &mut |_| true));
    assert!(trainer.run(
        Plan {
            steps: 20,
            is_judged: true
        },
        &mut |_| true
    ));
    let [first, .., last] = trainer.passes() else {
        panic!("three passes");
    };
    assert!(
        last.cost.heat < 0.5 * first.cost.heat,
        "{first:?}, {last:?}"
    );
    let score = last.score.unwrap();
    assert!(score.recall > 0.7 && score.quiet > 0.7, "{score:?}");
}

#[test]
fn an_interrupted_training_ends_bit_for_bit_the_same() {
    let pictures = pictures(8, 3);
    let settings = small();
    let shown = [&pictures[..6], &pictures[6..]];
    let mut whole = trainer(&settings, shown, None);
    assert!(whole.run(steps(4), &mut |_| true));
    let kept = whole.checkpoint().unwrap();
    assert!(whole.run(steps(4), &mut |_| true));
    let mut resumed = trainer(&settings, shown, Some(&kept));
    assert!(resumed.run(steps(4), &mut |_| true));
    assert_eq!(whole.trained(), resumed.trained());
}

#[test]
fn the_written_file_gives_the_results_of_the_trained_network() {
    let pictures = pictures(8, 4);
    let settings = small();
    let mut trainer = trainer(&settings, [&pictures[..6], &pictures[6..]], None);
    assert!(trainer.run(steps(30), &mut |_| true));
    let sample = plain(&pictures[0], &settings.shape);
    let expected = trainer.find_in(1, &sample.picture);
    let session = inference::Session::parse(trainer.onnx(&[])).unwrap();
    let side = settings.shape.side;
    let input = inference::Input {
        name: PICTURE,
        shape: &[1, 3, side, side],
        values: inference::Values::F32(&sample.picture),
    };
    let mut found = Vec::new();
    let take = &mut |output: inference::Output<'_>| {
        let cells = side / STRIDE;
        assert_eq!(output.shape, [1, CHANNELS, cells, cells]);
        found = output.values.unwrap().to_vec();
    };
    session.run(&[input], &[BOXES], take).unwrap();
    // Weights are stored in half precision.
    let scale = expected.iter().fold(0.0_f32, |most, value| most.max(value.abs()));
    let off = found.iter().zip(&expected).map(|(a, b)| (a - b).abs());
    let worst = off.fold(0.0, f32::max);
    assert_eq!(found.len(), expected.len());
    assert!(worst < 0.01 * scale, "{worst} of {scale}");
}

#[test]
fn the_included_detector_is_small_and_its_card_is_valid() {
    let shape = Shape::default();
    let parameters = training::networks::finder::initial(&shape, 1);
    let n: usize = parameters.iter().map(|list| list.values.len()).sum();
    assert!((200_000..600_000).contains(&n), "{n}");
    let card = keypoints::DetectorCard::parse(&card(&shape, &About::default())).unwrap();
    assert_eq!([card.input.width, card.input.height], [256, 256]);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// For any variation, the card's codec decodes the true output to the boxes in the sample.
    #[test]
    fn training_targets_decode_to_the_annotated_boxes(seed in any::<u64>()) {
        let settings = small();
        let pictures = pictures(4, seed);
        let mut rng = fastrand::Rng::with_seed(seed);
        let sample = varied(&pictures[0], &pictures, (&settings.shape, &settings.vary), &mut rng);
        prop_assert!(sample.picture.iter().all(|value| value.is_finite()));
        let n = settings.shape.cells().pow(2);
        let mut card = keypoints::DetectorCard::parse(&card(&settings.shape, &About::default())).unwrap();
        card.most_overlap = 1.0;
        let cells = settings.shape.cells();
        let decoded = |sample: &FinderSample| {
            // A box that is narrower than a cell may have no sides in the cell of its middle.
            let is_boxed = |(heat, left): (&f32, &f32)| *heat == 1.0 && *left > 0.0;
            let is_boxed = sample.heat.iter().zip(&sample.sides).map(is_boxed);
            let log_odds = is_boxed.map(|is_boxed| if is_boxed { 5.0 } else { -5.0 });
            let logarithms = sample.sides.iter().map(|side| side.max(1e-3).ln());
            let values: Vec<f32> = log_odds.chain(logarithms).collect();
            card.boxes(&values, &[1, 5, cells, cells]).unwrap()
        };
        // The whole picture has one person, and the size of the sample.
        let whole = decoded(&plain(&pictures[0], &settings.shape));
        prop_assert_eq!(whole.len(), 1);
        for (got, expected) in whole[0].outline.iter().zip(pictures[0].people[0].outline) {
            prop_assert!((got - f64::from(expected)).abs() < 1e-3, "{whole:?}");
        }
        let found = decoded(&sample);
        for found in &found {
            let [left, top, right, bottom] = found.outline;
            let [width, height] = [right - left, bottom - top];
            // Everybody in the pictures is at least 14 wide and at most 50 high; at least 0.3 of the area is visible.
            prop_assert!(width > 0.3 * 14.0 / 50.0 * height && height >= 13.0, "{found:?}");
            prop_assert!(left > -1.0 && top > -1.0 && right < 96.0 && bottom < 96.0, "{found:?}");
        }
        let middles = sample.heat.iter().take(n).filter(|heat| **heat == 1.0).count();
        prop_assert!(found.len() <= middles);
    }
}

#[test]
fn a_task_without_pictures_is_refused() {
    let settings = small();
    let refused = FinderTask::new(&settings, [&[], &[]], None).unwrap_err();
    assert!(refused.to_string().contains("0 pictures"), "{refused}");
    assert_eq!(FinderTask::LEARNED_FROM, "pictures");
}
