//! Tests that the network can be trained, and that a training run can be saved, resumed and written.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use training::networks::pose::{
    N_KEYPOINTS, Person, PoseTask, Settings, Shape, Source, Target, Vary, peak, plain, varied,
};
use training::networks::{Backend, Plan, Precision, TrainError, Trainer};

const SIDE: usize = 256;

/// Ten people made of coloured dots: every joint has its own colour.
fn people(n: usize, seed: u64) -> Vec<Person> {
    let mut rng = fastrand::Rng::with_seed(seed);
    (0..n).map(|nth| person(nth, &mut rng)).collect()
}

fn person(nth: usize, rng: &mut fastrand::Rng) -> Person {
    let standing: [[f32; 2]; N_KEYPOINTS] = [
        [-9.0, 40.0],
        [-9.0, 20.0],
        [-8.0, 0.0],
        [8.0, 0.0],
        [9.0, 20.0],
        [9.0, 40.0],
        [-22.0, 2.0],
        [-20.0, -14.0],
        [-14.0, -30.0],
        [14.0, -30.0],
        [20.0, -14.0],
        [22.0, 2.0],
        [0.0, -33.0],
        [0.0, -45.0],
        [0.0, -39.0],
        [14.0, 46.0],
        [-14.0, 46.0],
        [5.0, 47.0],
        [-5.0, 47.0],
    ];
    let places = standing.map(|at| at.map(|side| 128.0 + 1.6 * side + 8.0 * (rng.f32() - 0.5)));
    let mut rgb = vec![110u8; 3 * SIDE * SIDE];
    for (joint, [x, y]) in places.iter().enumerate() {
        let colour =
            [37 * joint % 256, 91 * joint % 256, 255 - 13 * joint].map(|value| value as u8);
        for row in -5i32..=5 {
            for column in -5i32..=5 {
                let at = (*y as i32 + row) as usize * SIDE + (*x as i32 + column) as usize;
                rgb[3 * at..3 * at + 3].copy_from_slice(&colour);
            }
        }
    }
    Person {
        source: Source::Scene,
        name: format!("person {nth}"),
        rgb,
        targets: places.map(|at| Target {
            at,
            or: None,
            weight: 1.0,
            is_marked: true,
        }),
        front: [0.0, 0.0, 1.0],
    }
}

/// A network that is small enough for a test.
fn small() -> Settings {
    let shape = Shape {
        width: 64,
        height: 64,
        stem: 8,
        channels: [16, 16, 16, 16],
        blocks: [1, 1, 1, 1],
        hidden: 8,
    };
    Settings {
        shape,
        batch: 8,
        steps: 60,
        small: 0.0,
        error_steps: 4,
        rate: 1e-2,
        averaged: 0.05,
        ..Settings::default()
    }
}

/// A training run from the start, or from a checkpoint.
fn trainer<'a>(
    settings: &'a Settings,
    people: [&'a [Person]; 2],
    checkpoint: Option<&[u8]>,
) -> Trainer<PoseTask<'a>> {
    let task = PoseTask::new(settings, people, None).unwrap();
    Trainer::new(task, Backend::BuiltIn, checkpoint).unwrap()
}

/// A pass of some steps without evaluation.
const fn steps(steps: usize) -> Plan {
    Plan {
        steps,
        is_judged: false,
    }
}

#[test]
fn training_reduces_the_cost_and_an_interrupted_training_ends_bit_for_bit_the_same() {
    let (learnt, kept) = (people(10, 1), people(3, 2));
    let settings = small();
    let new = |checkpoint: Option<&[u8]>| trainer(&settings, [&learnt, &kept], checkpoint);
    let mut whole = new(None);
    for _ in 0..4 {
        assert!(whole.run(steps(16), &mut |_| true));
    }
    assert_eq!(whole.step(), 64);
    let passes = whole.passes();
    assert!(
        passes[2].cost.maps < 0.7 * passes[0].cost.maps,
        "{passes:?}"
    );
    let score = whole.judge(&kept);
    assert!(score.front > 0.99, "everybody faces the camera: {score:?}");

    let mut begun = new(None);
    assert!(begun.run(steps(16), &mut |_| true));
    assert!(begun.run(steps(16), &mut |_| true));
    let mut calls = 0;
    let stopped = begun.run(steps(16), &mut |_| {
        calls += 1;
        calls < 5
    });
    assert!(!stopped, "it was stopped in the middle");
    let mut resumed = new(Some(&begun.checkpoint().unwrap()));
    assert!(resumed.run(steps(16), &mut |_| true));
    assert!(resumed.run(steps(16), &mut |_| true));
    assert_eq!(whole.trained(), resumed.trained());
    let [whole, resumed] = [whole, resumed].map(|trainer| trainer.checkpoint().unwrap());
    assert!(whole == resumed, "everything that they know is the same");
}

/// `LibTorch` sums in a different order, so that the results of some steps are close but not equal.
#[cfg(feature = "libtorch")]
#[test]
fn both_backends_learn_the_same() {
    let (learnt, kept) = (people(10, 1), people(3, 2));
    let settings = Settings {
        steps: 6,
        ..small()
    };
    let [built_in, torch] = [Backend::BuiltIn, Backend::LibTorch].map(|backend| {
        let task = PoseTask::new(&settings, [&learnt, &kept], None).unwrap();
        let mut trainer = Trainer::new(task, backend, None).unwrap();
        // Six steps train everything, four train only the expected error.
        for _ in 0..10 {
            assert!(trainer.run(steps(1), &mut |_| true));
        }
        let seen = plain(&kept[0], &settings.shape).unwrap();
        (trainer.passes().to_vec(), trainer.find_in(1, &seen.picture))
    });
    for (a, b) in built_in.0.iter().zip(&torch.0) {
        let costs = [
            [a.cost.maps, b.cost.maps],
            [a.cost.front, b.cost.front],
            [a.cost.error, b.cost.error],
        ];
        for [a, b] in costs {
            assert!((a - b).abs() < 1e-3 * (1.0 + a.abs()), "{a} and {b}");
        }
    }
    let pairs = [
        (&built_in.1.maps, &torch.1.maps),
        (&built_in.1.fronts, &torch.1.fronts),
        (&built_in.1.errors, &torch.1.errors),
    ];
    for (a, b) in pairs {
        assert_eq!(a.len(), b.len());
        for (a, b) in a.iter().zip(b) {
            assert!((a - b).abs() < 5e-3 * (1.0 + a.abs()), "{a} and {b}");
        }
    }
}

#[test]
fn training_maps_have_their_maxima_at_the_joints() {
    let person = &people(1, 3)[0];
    let shape = small().shape;
    let sample = plain(person, &shape).unwrap();
    let [columns, rows] = shape.cells();
    for (joint, place) in sample.places.iter().enumerate() {
        let map = &sample.maps[joint * columns * rows..][..columns * rows];
        let [x, y] = peak(map, columns);
        assert!(
            (x - place[0]).abs() < 0.51 && (y - place[1]).abs() < 0.51,
            "{joint}"
        );
    }
}

#[test]
fn the_written_file_gives_the_results_of_the_trained_network() {
    let people = people(6, 4);
    let settings = small();
    let mut trainer = trainer(&settings, [&people[..5], &people[5..]], None);
    assert!(trainer.run(steps(30), &mut |_| true));
    let sample = plain(&people[0], &settings.shape).unwrap();
    let found = trainer.find_in(1, &sample.picture);
    let outputs = found_by(trainer.onnx(&[]), &settings.shape, &sample.picture);
    let expected = [
        found.maps,
        found.fronts,
        found.errors.iter().map(|logarithm| logarithm.exp()).collect(),
    ];
    // Weights are stored in half precision.
    let names = ["maps", "direction", "errors"];
    for ((name, got), expected) in names.iter().zip(&outputs).zip(&expected) {
        assert_eq!(got.len(), expected.len(), "{name}");
        let scale = expected.iter().fold(0.0f32, |most, value| most.max(value.abs()));
        let off = got.iter().zip(expected).map(|(a, b)| (a - b).abs());
        let worst = off.fold(0.0f32, f32::max);
        assert!(worst < 0.01 * scale, "{name}: {worst} of {scale}");
    }
}

#[test]
fn a_changed_checkpoint_and_one_of_another_training_are_refused() {
    let people = people(4, 5);
    let settings = small();
    let shown = [&people[..3], &people[3..]];
    let new = |settings: &Settings, bytes: Option<&[u8]>| {
        let task = PoseTask::new(settings, shown, None).unwrap();
        Trainer::new(task, Backend::BuiltIn, bytes).map(|trainer| trainer.step())
    };
    let whole = trainer(&settings, shown, None);
    let bytes = whole.checkpoint().unwrap();
    assert_eq!(new(&settings, Some(&bytes)).unwrap(), 0);
    let mut changed = bytes.clone();
    let middle = changed.len() / 2;
    changed[middle] ^= 1;
    new(&settings, Some(&changed)).unwrap_err();
    new(&settings, Some(&bytes[..middle])).unwrap_err();
    let other = Settings {
        seed: 2,
        ..settings.clone()
    };
    let refused = new(&other, Some(&bytes)).unwrap_err().to_string();
    assert!(refused.contains("other people or settings"), "{refused}");
    let from = training::networks::pose::begun(&settings.shape, 1, &whole.onnx(&[])).unwrap();
    let task = PoseTask::new(&settings, shown, Some(from)).unwrap();
    let begun = Trainer::new(task, Backend::BuiltIn, Some(&bytes));
    let refused = begun.unwrap_err().to_string();
    assert!(refused.contains("from another network"), "{refused}");
}

#[test]
fn a_window_beside_the_person_has_no_heat_in_any_map() {
    let (people, shape) = (people(2, 3), small().shape);
    for (empty, is_empty) in [(0.0, false), (1.0, true)] {
        let vary = Vary {
            empty,
            ..Vary::default()
        };
        let mut rng = fastrand::Rng::with_seed(5);
        let sample = varied(&people[0], &people[1], (&shape, &vary), &mut rng).unwrap();
        let n_hot = sample.maps.iter().filter(|heat| **heat > 0.5).count();
        assert_eq!((n_hot == 0, sample.front == [0.0; 2]), (is_empty, is_empty));
        assert_eq!(sample.weights, [1.0; N_KEYPOINTS]);
    }
}

#[test]
fn training_continues_from_a_written_network() {
    let people = people(6, 4);
    let settings = small();
    let shown = [&people[..5], &people[5..]];
    let mut whole = trainer(&settings, shown, None);
    assert!(whole.run(steps(60), &mut |_| true));
    let file = whole.onnx(&[]);
    let from = training::networks::pose::begun(&settings.shape, 7, &file).unwrap();
    let task = PoseTask::new(&settings, shown, Some(from)).unwrap();
    let mut begun = Trainer::new(task, Backend::BuiltIn, None).unwrap();
    let sample = plain(&people[0], &settings.shape).unwrap();
    let [before, after] = [&whole, &begun].map(|trainer| trainer.find_in(1, &sample.picture).maps);
    let scale = before.iter().fold(0.0f32, |most, value| most.max(value.abs()));
    for (a, b) in before.iter().zip(&after) {
        assert!((a - b).abs() < 0.01 * scale, "{a} and {b} of {scale}");
    }
    let mut anew = trainer(&settings, shown, None);
    let costs = [&mut begun, &mut anew].map(|trainer| {
        assert!(trainer.run(steps(4), &mut |_| true));
        trainer.passes()[0].cost.maps
    });
    assert!(costs[0] < 0.8 * costs[1], "it has begun anew: {costs:?}");
}

#[test]
fn a_file_of_another_network_is_refused_with_the_missing_layers() {
    let settings = small();
    let parameters = training::networks::pose::initial(&settings.shape, 1);
    let file = training::networks::pose::file(&settings.shape, &parameters, &[]);
    let refused = |shape: &Shape, file: &[u8]| {
        let refused = training::networks::pose::begun(shape, 1, file).unwrap_err();
        refused.to_string()
    };
    training::networks::pose::begun(&settings.shape, 1, &file).unwrap();
    let wider = Shape {
        stem: 16,
        ..settings.shape.clone()
    };
    let said = refused(&wider, &file);
    assert!(
        said.contains("stem1.weight") && said.contains("[8, 3, 3, 3]"),
        "{said}"
    );
    let deeper = Shape {
        blocks: [1, 1, 1, 2],
        ..settings.shape.clone()
    };
    let said = refused(&deeper, &file);
    assert!(said.contains("level3.1.narrow.weight"), "{said}");
    for n in [0, 1, 100, file.len() / 2] {
        refused(&settings.shape, &file[..n]);
    }
    refused(&settings.shape, b"no network");
    // The middle of the file contains weights; with all bits set, a weight is NaN.
    let mut broken = file.clone();
    let middle = broken.len() / 2;
    broken[middle..middle + 64].fill(0xff);
    let said = refused(&settings.shape, &broken);
    assert!(said.contains("finite numbers of half"), "{said}");
}

#[test]
fn precisions_of_another_backend_are_refused() {
    let people = people(2, 5);
    let settings = Settings {
        precision: Precision::Bf16,
        ..small()
    };
    let task = PoseTask::new(&settings, [&people[..1], &people[1..]], None).unwrap();
    let refused = Trainer::new(task, Backend::BuiltIn, None);
    assert!(matches!(refused, Err(TrainError::Precision)));
}

/// Maps, direction and errors that the network of a file gives for a picture.
fn found_by(file: Vec<u8>, shape: &Shape, picture: &[f32]) -> Vec<Vec<f32>> {
    use training::networks::pose::{ERROR, FRONT, MAPS, PICTURE};

    let session = inference::Session::parse(file).unwrap();
    let input = inference::Input {
        name: PICTURE,
        shape: &[1, 3, shape.height, shape.width],
        values: inference::Values::F32(picture),
    };
    let names = [MAPS, FRONT, ERROR];
    let mut outputs = vec![Vec::new(); names.len()];
    session
        .run(&[input], &names, &mut |output| {
            outputs[output.index] = output.values.unwrap().to_vec();
        })
        .unwrap();
    outputs
}
