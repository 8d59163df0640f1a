//! Tests of the file of prepared people, and of the card of a trained network.

use training::networks::About;
use training::networks::pose::{N_JOINTS, N_KEYPOINTS, Source, Target};

use super::*;

fn person(name: &str) -> Person {
    Person {
        source: Source::Photograph,
        name: name.to_owned(),
        rgb: vec![7; 3 * SIDE * SIDE],
        targets: [Target::UNKNOWN; N_KEYPOINTS],
        front: [0.0, 0.0, 1.0],
    }
}

#[test]
fn people_survive_a_round_trip_through_a_file_and_a_truncated_file_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("people.bin");
    let people = Prepared {
        learnt: vec![person("a"), person("b")],
        kept: vec![person("c")],
    };
    write(&file, &people).unwrap();
    let back = read(&file).unwrap();
    let names = |of: &[Person]| of.iter().map(|person| person.name.clone()).collect::<Vec<_>>();
    assert_eq!(names(&back.learnt), ["a", "b"]);
    assert_eq!(names(&back.kept), ["c"]);
    assert_eq!(back.kept[0].rgb, people.kept[0].rgb);
    let bytes = std::fs::read(&file).unwrap();
    for n in [0, 5, 9, 100, bytes.len() - 1] {
        std::fs::write(&file, &bytes[..n]).unwrap();
        assert!(read::<Person>(&file).is_err(), "{n} bytes");
    }
}

#[test]
fn the_written_card_is_valid_and_describes_the_input_of_the_network() {
    let shape = training::networks::pose::Shape::default();
    let text = training::networks::pose::card(&shape, &About::default());
    let card = keypoints::Card::parse(&text).unwrap();
    assert_eq!(
        [card.input.width, card.input.height],
        [shape.width, shape.height]
    );
    assert_eq!(card.keypoints.sides, keypoints::Sides::Seen);
    assert_eq!(card.names().len(), N_KEYPOINTS);
    assert_eq!(card.also.front.as_deref(), Some("front"));
}

#[test]
fn an_untrained_network_fits_its_card_and_outputs_front_and_errors() {
    let shape = training::networks::pose::Shape {
        channels: [8, 8, 8, 8],
        blocks: [1, 1, 1, 1],
        ..training::networks::pose::Shape::default()
    };
    let card = training::networks::pose::card(&shape, &About::default());
    let parameters = training::networks::pose::initial(&shape, 3);
    let bytes = training::networks::pose::file(&shape, &parameters, &[]);
    let session = inference::Session::parse(bytes).unwrap();
    let card = keypoints::Card::parse(&card).unwrap();
    let network = PoseNetwork::new(session, card).unwrap();
    let rgb = vec![90u8; 3 * 100 * 100];
    let picture = kernels::Rgb8View::new(100, 100, &rgb).unwrap();
    let mut workspace = posenetwork::Workspace::default();
    let sight = network.look(picture, [20.0, 10.0, 80.0, 90.0], &mut workspace);
    let sight = sight.unwrap().unwrap();
    assert!(sight.front().is_some());
    // Each error is a tenth of the window's height, which is the height of the box with a margin.
    let errors: Vec<f64> = sight.errors().unwrap().collect();
    assert_eq!(errors.len(), N_KEYPOINTS);
    assert!(
        errors.iter().all(|error| (error - 10.0).abs() < 0.1),
        "{errors:?}"
    );
    let mut maps = posenetwork::JointMaps::default();
    maps.read(&sight, &posenetwork::MapSettings::default()).unwrap();
    let expected = maps.expected_px(0).unwrap();
    assert!((expected - 8.0).abs() < 0.1, "along one axis: {expected}");
    let (_, of_nose) = maps.keypoint(N_JOINTS).unwrap();
    assert!((of_nose - 8.0).abs() < 0.1, "as the network tells it");
}
